//! What an answer is held against: what has to be named, what may be, and the sizes.

use std::collections::BTreeMap;

use blind_benchmark::truth::{Category, Channels, Truth};
use serde_json::{Map, Value};

/// What kind of thing a campaign hides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Nothing.
    Nothing,
    /// Nothing that has to be named, but something that may be: effects too faint to be told for sure, or laws of
    /// the valve that look like one.
    Faint,
    /// One effect.
    One,
    /// Two effects.
    Two,
    /// A law outside the catalogue.
    Outside,
}

impl Kind {
    /// All of them, in the order of the table.
    pub const ALL: [Self; 5] = [Self::Nothing, Self::Faint, Self::One, Self::Two, Self::Outside];

    /// The word for it in the table.
    pub fn word(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Faint => "faint",
            Self::One => "one effect",
            Self::Two => "two effects",
            Self::Outside => "outside",
        }
    }
}

/// What an answer should be.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// Name of the campaign.
    pub name: String,
    /// Kind of thing hidden.
    pub kind: Kind,
    /// Effects that have to be named.
    pub needed: Vec<String>,
    /// Effects of which at least one has to be named.
    pub one_of: Vec<String>,
    /// Effects that may be named, and `outside` where that may be said.
    pub allowed: Vec<String>,
    /// True sizes, by effect and parameter; the first of an effect is its main one.
    pub sizes: BTreeMap<String, Vec<(String, f64)>>,
    /// Whether stroke times are all that was taken: they hardly tell one effect from another, so that a group will do.
    pub times_only: bool,
}

/// The main parameter of effects, for truths that list parameters by name alone.
const MAIN: [(&str, &str); 17] = [
    ("dry-friction", "coulomb_force"),
    ("seal-friction", "friction_per_pressure"),
    ("progressive-spring", "hardening"),
    ("closing-cushion", "damping"),
    ("opening-cushion", "damping"),
    ("seat-adhesion", "force"),
    ("process-force", "force"),
    ("gas-heating", "wall_conductance"),
    ("supply-droop", "resistance"),
    ("vent-restriction", "area_factor"),
    ("back-pressure", "pressure"),
    ("orifice-law", "critical_ratio"),
    ("leak-to-atmosphere", "area"),
    ("leak-from-supply", "area"),
    ("solenoid-lag", "energise_delay"),
    ("sensor-lag", "time_constant"),
    ("clock-offset", "offset"),
];

/// Short names of sizes, by which some truths tell them: effect and parameter.
const SHORT: [(&str, &str, &str); 4] = [
    ("Fc", "dry-friction", "coulomb_force"),
    ("Fs", "dry-friction", "static_force"),
    ("vs", "dry-friction", "stribeck_velocity"),
    ("hA", "gas-heating", "wall_conductance"),
];

/// The main parameter of an effect.
pub fn main_parameter(effect: &str) -> Option<&'static str> {
    MAIN.iter().find(|(id, _)| *id == effect).map(|(_, parameter)| *parameter)
}

fn words(value: &Value) -> Vec<String> {
    value.as_array().into_iter().flatten().filter_map(Value::as_str).map(str::to_owned).collect()
}

impl Wanted {
    /// From an entry of a `truth.json`.
    pub fn from_json(name: &str, truth: &Value) -> Self {
        if let Some(effects) = truth["effects"].as_object() {
            return Self::of_tidy_json(name, truth, effects);
        }
        let (needed, one_of, allowed) = (words(&truth["needed"]), words(&truth["one_of"]), words(&truth["allowed"]));
        let has_outside = truth["outside"].as_object().is_some_and(|odd| !odd.is_empty());
        let hides = truth["sizes"].as_object().is_some_and(|sizes| !sizes.is_empty());
        let kind = match (needed.len(), has_outside) {
            (_, true) if truth["outside_is_plain"] == true => Kind::Outside,
            (_, true) => Kind::Faint,
            (0, _) if !one_of.is_empty() => Kind::Two,
            (0, _) if hides || !allowed.is_empty() => Kind::Faint,
            (0, _) => Kind::Nothing,
            (1, _) => Kind::One,
            _ => Kind::Two,
        };
        let mut sizes: BTreeMap<String, Vec<(String, f64)>> = BTreeMap::new();
        for (key, value) in truth["sizes"].as_object().into_iter().flatten() {
            match (value, SHORT.iter().find(|(short, ..)| short == key)) {
                (Value::Object(parameters), _) => {
                    let list = sizes.entry(key.clone()).or_default();
                    list.extend(parameters.iter().filter_map(|(p, v)| Some((p.clone(), v.as_f64()?))));
                }
                (value, Some((_, effect, parameter))) => {
                    let list = sizes.entry((*effect).to_owned()).or_default();
                    list.extend(value.as_f64().map(|v| ((*parameter).to_owned(), v)));
                }
                _ => {}
            }
        }
        Self { name: name.to_owned(), kind, needed, one_of, allowed, sizes, times_only: false }
    }

    /// From the `truth.json` of a tidy campaign, which lists what it hides.
    fn of_tidy_json(name: &str, truth: &Value, effects: &Map<String, Value>) -> Self {
        let has_outside =
            truth["outside"].as_object().is_some_and(|odd| !odd.is_empty()) || effects.contains_key("outside");
        let hidden = || effects.iter().filter(|(effect, _)| *effect != "outside");
        let values = |parameters: &Value| {
            let all = parameters.as_object().into_iter().flatten();
            all.filter_map(|(parameter, value)| Some((parameter.clone(), value["si"].as_f64()?))).collect()
        };
        Self {
            name: name.to_owned(),
            kind: match (effects.len(), has_outside) {
                (_, true) => Kind::Outside,
                (0, _) => Kind::Nothing,
                (1, _) => Kind::One,
                _ => Kind::Two,
            },
            needed: hidden().map(|(effect, _)| effect.clone()).collect(),
            one_of: Vec::new(),
            allowed: if has_outside { vec!["outside".to_owned()] } else { Vec::new() },
            sizes: hidden().map(|(effect, parameters)| (effect.clone(), values(parameters))).collect(),
            times_only: truth["channels"] == "timings",
        }
    }

    /// Of a tidy campaign.
    pub fn of_tidy(name: &str, truth: &Truth) -> Self {
        let ids = || truth.effects.iter().map(|effect| effect.id.to_owned());
        let sizes = truth.effects.iter().map(|effect| {
            let all = effect.parameters.iter().map(|p| (p.name.to_owned(), p.value)).collect();
            (effect.id.to_owned(), all)
        });
        Self {
            name: name.to_owned(),
            kind: match truth.category {
                Category::Nothing => Kind::Nothing,
                Category::One => Kind::One,
                Category::Two => Kind::Two,
                Category::Outside => Kind::Outside,
            },
            needed: ids().collect(),
            one_of: Vec::new(),
            allowed: if truth.outside.is_empty() { Vec::new() } else { vec!["outside".to_owned()] },
            sizes: sizes.collect(),
            times_only: truth.channels == Channels::Timings,
        }
    }

    /// Whether an effect may be named.
    pub fn may_be(&self, id: &str) -> bool {
        [&self.needed, &self.one_of, &self.allowed].iter().any(|list| list.iter().any(|other| other == id))
    }

    /// True value of an effect's main parameter.
    pub fn main_size(&self, effect: &str) -> Option<f64> {
        let main = main_parameter(effect)?;
        self.sizes.get(effect)?.iter().find(|(name, _)| name == main).map(|(_, value)| *value)
    }
}

/// The value of an effect's main parameter from which its size is counted.
pub fn neutral(effect: &str) -> f64 {
    if effect == "vent-restriction" { 1.0 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn truths_in_short_and_in_full_are_read() {
        let short = json!({ "kind": "x", "needed": ["dry-friction"], "allowed": ["outside"], "sizes": { "Fc": 35.0 } });
        let wanted = Wanted::from_json("r", &short);
        assert_eq!((wanted.kind, wanted.main_size("dry-friction")), (Kind::One, Some(35.0)));
        assert!(wanted.may_be("outside") && !wanted.may_be("clock-offset"));
        let full =
            json!({ "needed": [], "allowed": ["sensor-lag"], "sizes": { "sensor-lag": { "time_constant": 0.01 } } });
        let wanted = Wanted::from_json("l", &full);
        assert_eq!((wanted.kind, wanted.main_size("sensor-lag")), (Kind::Faint, Some(0.01)));
        let tidy = json!({
            "category": "one", "outside": {}, "effects": { "clock-offset": { "offset": { "si": 0.05, "text": "5e-2 s" } } }
        });
        let wanted = Wanted::from_json("c", &tidy);
        assert_eq!((wanted.kind, wanted.main_size("clock-offset")), (Kind::One, Some(0.05)));
        let odd = json!({ "category": "outside", "outside": { "detent": {} }, "effects": {} });
        assert_eq!(Wanted::from_json("o", &odd).kind, Kind::Outside);
        let scored = json!({
            "effects": { "dry-friction": { "coulomb_force": "10 N" }, "outside": "friction raised near 15 mm" },
            "channels": "position"
        });
        let wanted = Wanted::from_json("s", &scored);
        assert_eq!((wanted.kind, &wanted.needed[..]), (Kind::Outside, &["dry-friction".to_owned()][..]));
        let times = json!({ "effects": { "dry-friction": { "coulomb_force": "60 N" } }, "channels": "timings" });
        assert!(Wanted::from_json("t", &times).times_only && !wanted.times_only);
        let nothing = json!({ "needed": [], "allowed": [], "sizes": {} });
        assert_eq!(Wanted::from_json("n", &nothing).kind, Kind::Nothing);
    }
}
