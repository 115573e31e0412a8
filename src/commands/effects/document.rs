//! Effects as programs get them.

use serde::Serialize;
use valve_model::EffectKind;

use super::Shown;
use answers::SCHEMA;
use answers::strokes::Cycles;

#[derive(Serialize)]
struct Description {
    id: &'static str,
    summary: &'static str,
    acts_on: &'static str,
    equation: &'static str,
    symptom: &'static str,
    typical_sizes: &'static str,
    confused_with: &'static [&'static str],
    source: &'static str,
    parameters: Vec<ParameterOut>,
}

#[derive(Serialize)]
struct ParameterOut {
    name: &'static str,
    si_unit: &'static str,
    meaning: &'static str,
}

fn description(kind: EffectKind) -> Description {
    let info = kind.info();
    let parameters = kind
        .parameters()
        .iter()
        .map(|parameter| ParameterOut { name: parameter.name, si_unit: parameter.si_unit, meaning: parameter.meaning })
        .collect();
    Description {
        id: info.id,
        summary: info.summary,
        acts_on: info.acts_on.part(),
        equation: info.equation,
        symptom: info.symptom,
        typical_sizes: info.typical_sizes,
        confused_with: info.confused_with,
        source: info.source,
        parameters,
    }
}

/// One effect.
#[derive(Serialize)]
pub struct Document<'a> {
    schema: u32,
    #[serde(flatten)]
    description: Description,
    example: Example<'a>,
}

#[derive(Serialize)]
struct Example<'a> {
    values_si: &'a [f64],
    without: Times,
    with: Times,
}

#[derive(Serialize)]
struct Times {
    close_time_s: Option<f64>,
    open_time_s: Option<f64>,
}

/// One effect with its example.
pub fn document(kind: EffectKind, shown: &Shown) -> Document<'_> {
    let times = |cycles: &Cycles| {
        let [close_time_s, open_time_s] = cycles.times_s[0];
        Times { close_time_s, open_time_s }
    };
    let example =
        Example { values_si: shown.effect.values(), without: times(&shown.without), with: times(&shown.with) };
    Document { schema: SCHEMA, description: description(kind), example }
}

/// All effects.
#[derive(Serialize)]
pub struct Catalogue {
    schema: u32,
    effects: Vec<Description>,
}

impl Catalogue {
    /// Every effect of the catalogue.
    pub fn whole() -> Self {
        Self { schema: SCHEMA, effects: EffectKind::ALL.iter().map(|kind| description(*kind)).collect() }
    }
}
