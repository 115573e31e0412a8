//! `valve effects`: the catalogue, and one effect explained.

mod document;

use std::fmt::Write;

use quantity::format_number;
use report::figures::EffectFigure;
use valve_file::ValveFile;
use valve_model::effects::DefaultValue;
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{Conditions, Effect, EffectKind, Valve};

use self::document::{Catalogue, document};
use crate::cli::{EffectsArgs, Format};
use crate::failure::{Answer, Hinted};
use crate::output::{self, Align, Outputs, PlotFile, TextTable};
use answers::samples::reference_valve;
use answers::strokes::{Cycles, instants};

/// Lists the catalogue or explains one effect.
pub fn run(args: &EffectsArgs) -> anyhow::Result<Answer> {
    let Some(id) = &args.id else { return list(args.format) };
    let ids = || EffectKind::ALL.iter().map(|kind| kind.id());
    let Some(kind) = EffectKind::from_id(id) else {
        let near = quantity::suggest::did_you_mean(id, ids());
        return Err(Hinted::error(
            format!("the catalogue has no effect {id:?}{near}"),
            "`valve effects` lists them all",
        ));
    };
    let plot = PlotFile::create(&mut Outputs::new(args.force).reads(&args.valve), args.plot.as_deref())?;
    let file = match &args.valve {
        Some(path) => ValveFile::read(path)?,
        None => reference_valve(),
    };
    let shown = Shown::new(kind, &file)?;
    match args.format {
        Format::Text => output::print_text(&explain(kind, &file, &shown))?,
        Format::Json => output::print_json(&document(kind, &shown))?,
    }
    if let Some(plot) = plot {
        plot.write(&shown.figure(kind, &file).figure())?;
    }
    Ok(Answer::Fine)
}

fn list(format: Format) -> anyhow::Result<Answer> {
    if format == Format::Json {
        output::print_json(&Catalogue::whole())?;
        return Ok(Answer::Fine);
    }
    let mut table = TextTable::new(&[("id", Align::Left), ("acts on", Align::Left), ("what it is", Align::Left)]);
    for kind in EffectKind::ALL {
        let info = kind.info();
        table.row(vec![info.id.to_owned(), info.acts_on.part().to_owned(), info.summary.to_owned()]);
    }
    let text = format!(
        "{}\n`valve effects ID` explains one. A formula of your own is the effect `custom` of the valve file.\n",
        table.render()
    );
    output::print_text(&text)?;
    Ok(Answer::Fine)
}

/// A cycle of a valve without and with an effect of typical size.
struct Shown {
    effect: Effect,
    valves: [Valve; 2],
    without: Cycles,
    with: Cycles,
}

impl Shown {
    fn new(kind: EffectKind, file: &ValveFile) -> anyhow::Result<Self> {
        let parameters = file.valve().parameters();
        // The first parameter is the size; the others are left at their defaults
        // where they have one.
        let given: Vec<Option<f64>> = kind
            .parameters()
            .iter()
            .enumerate()
            .map(|(index, parameter)| {
                let needed = index == 0 || parameter.default == DefaultValue::Required;
                needed.then(|| (parameter.range)(parameters).typical)
            })
            .collect();
        let effect = Effect::new(kind, &given)?;
        let others = file.valve().effects().iter().copied().filter(|other| other.kind() != kind);
        let build = |effects: Vec<Effect>| {
            Valve::new(parameters.clone(), file.valve().switches(), effects, file.valve().custom().to_vec())
        };
        let without = build(others.clone().collect())?;
        let with = build(others.chain([effect]).collect())?;
        let cycle = |valve: &Valve| {
            Cycles::simulate(valve, Conditions::nominal(parameters), &file.schedule(), 1, DEFAULT_STEP_S)
        };
        Ok(Self { effect, without: cycle(&without), with: cycle(&with), valves: [without, with] })
    }

    fn sizes(&self) -> String {
        let values = self.effect.values().iter().zip(self.effect.kind().parameters()).enumerate();
        let texts: Vec<String> = values
            .filter(|(index, _)| self.effect.is_told(*index))
            .map(|(_, (value, parameter))| {
                format!("{} = {} {}", parameter.name, format_number(rounded(*value)), parameter.si_unit)
                    .trim_end()
                    .to_owned()
            })
            .collect();
        texts.join(", ")
    }

    /// Time, s, and recorded position, mm, without and with the effect, until the
    /// slower of both is open again: the rest shows nothing.
    fn paths(&self, file: &ValveFile) -> [Vec<[f64; 2]>; 2] {
        let opened_s = [&self.without, &self.with].map(|cycles| cycles.times_s[0][1].unwrap_or(f64::INFINITY));
        let schedule = file.schedule();
        let end_s = (schedule.open_at_s + 1.4 * opened_s[0].max(opened_s[1])).min(schedule.end_s);
        let times = instants(end_s, DEFAULT_STEP_S);
        let path = |valve: &Valve, cycles: &Cycles| {
            let position = cycles.record(valve, &times).position_m;
            times.iter().zip(position).map(|(time, x)| [*time, 1e3 * x]).collect()
        };
        [path(&self.valves[0], &self.without), path(&self.valves[1], &self.with)]
    }

    fn figure(&self, kind: EffectKind, file: &ValveFile) -> EffectFigure {
        let [without, with] = self.paths(file);
        let title = format!("{}: {}", kind.id(), kind.info().summary);
        EffectFigure { title, subtitle: self.sizes(), without, with }
    }
}

/// Three significant digits, for sizes that are only typical.
fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

fn explain(kind: EffectKind, file: &ValveFile, shown: &Shown) -> String {
    let info = kind.info();
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(out, "{}: {}\n", info.id, info.summary);
    let mut facts = TextTable::new(&[("", Align::Left), ("", Align::Left)]);
    for (label, text) in [
        ("law", info.equation),
        ("acts on", info.acts_on.part()),
        ("what it does", info.symptom),
        ("typical sizes", info.typical_sizes),
        ("looks like", &info.confused_with.join(", ")),
        ("source", info.source),
    ] {
        facts.row(vec![label.to_owned(), text.to_owned()]);
    }
    out.push_str(&facts.render());
    let mut table = TextTable::new(&[
        ("parameter", Align::Left),
        ("SI unit", Align::Left),
        ("if left out", Align::Left),
        ("meaning", Align::Left),
    ]);
    for parameter in kind.parameters() {
        let default = match parameter.default {
            DefaultValue::Required => "must be given".to_owned(),
            DefaultValue::Value(value) => format_number(value),
            DefaultValue::SameAs(other) => format!("as {}", kind.parameters()[other].name),
        };
        table.row(vec![parameter.name.to_owned(), parameter.si_unit.to_owned(), default, parameter.meaning.to_owned()]);
    }
    let _ = write!(out, "\n{}", table.render());
    let _ = writeln!(out, "\nOn {:?} with {}:", file.name(), shown.sizes());
    for (index, name) in ["closing", "opening"].into_iter().enumerate() {
        let text = |cycles: &Cycles| {
            cycles.times_s[0][index].map_or_else(|| "not reached".to_owned(), |time| format!("{time:.4} s"))
        };
        let _ = writeln!(out, "  {name}: {} without, {} with it", text(&shown.without), text(&shown.with));
    }
    if info.acts_on.is_measurement() {
        let _ = writeln!(out, "  The valve moves as before; only what is recorded of it changes.");
    }
    let [without, with] = shown.paths(file);
    let plot = output::sketch(&without, &with, ["s", "mm"]);
    let _ = writeln!(out, "\nPosition over time; . without, o with it, 8 both:\n\n{plot}");
    let first = &kind.parameters()[0];
    let value = format_number(rounded(shown.effect.values()[0]));
    let quantity = format!("{value} {}", first.si_unit);
    let _ = writeln!(
        out,
        "In a valve file:\n  [[effect]]\n  kind = \"{}\"\n  {} = \"{}\"",
        info.id,
        first.name,
        quantity.trim()
    );
    out
}
