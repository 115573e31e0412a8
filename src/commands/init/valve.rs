//! `valve init`: a commented valve file from a datasheet's numbers.

use std::f64::consts::PI;
use std::fmt::Write;

use quantity::{Dimension, Unit, format_number, format_si, pressure_pa};
use valve_file::ValveFile;
use valve_model::{Conditions, Schedule};

use super::dialogue;
use super::facts::{FACTS, Fact, bench_set_pa, plain};
use super::typical::Size;
use crate::cli::InitValveArgs;
use crate::failure::{Answer, Hinted};
use crate::output::{self, Outputs};
use answers::strokes::Cycles;

/// A value as it is to stand in the file.
struct Entry {
    key: &'static str,
    text: String,
    comment: String,
    tolerance: Option<f64>,
}

/// Stroke times are looked for in cycles up to this long, s.
const LONGEST_CYCLE_S: f64 = 1000.0;
/// Most cycles that are tried before the stroke times are taken as they are.
const MOST_CYCLES_TRIED: usize = 6;
/// Cycles after which a valve nearly repeats itself.
const REPEATS: u32 = 3;
/// A limit is typically so many times the healthy stroke time.
const LIMIT_OVER_TIME: f64 = 3.0;
/// What is taken where nobody says anything else.
const AIR: (&str, f64) = ("air", 287.05);
const USUAL_NAME: &str = "my valve";
const USUAL_TEMPERATURE: &str = "20 degC";
const USUAL_AMBIENT: &str = "101.325 kPa";
const USUAL_AMBIENT_PA: f64 = 101_325.0;

/// Collects the numbers, simulates once to find a cycle that fits, writes the file.
pub fn run(args: &InitValveArgs) -> anyhow::Result<Answer> {
    let out = Outputs::new(args.force).file(&args.out)?;
    let mut collector = Collector::new(args, false);
    let mut draft = collector.draft()?;
    dialogue::all_right(&collector.wrong)?;
    if dialogue::is_possible() {
        // Asked only once all options are known to be right.
        collector = Collector::new(args, true);
        draft = collector.draft()?;
    }
    if !collector.missing.is_empty() {
        return Err(Hinted::error(
            format!("not known yet: {}", collector.missing.join("; ")),
            "give the options, or run it at a terminal to be asked; --typical takes typical values with wide \
             tolerances for all but stroke, bore and supply",
        ));
    }
    let name = args.out.display().to_string();
    let probe =
        ValveFile::parse(&draft.text(Schedule { close_at_s: 0.0, open_at_s: 4.0, end_s: 12.0 }, [3.0, 6.0]), &name)?;
    let (mut times, mut schedule, mut limits) = settled(&probe, &draft.limits_s);
    if collector.asks_all() && draft.limits_s.contains(&None) {
        draft.limits_s = asked_limits(draft.limits_s, limits, times)?;
        (times, schedule, limits) = settled(&probe, &draft.limits_s);
    }
    collector.assume_limits(draft.limits_s, limits);
    let file = ValveFile::parse(&draft.text(schedule, limits), &name)?;
    out.write_whole(file.text().as_bytes())?;
    for doubt in file.doubts() {
        output::note(&format!("warning: {doubt}"));
    }
    output::print_text(&summary(&draft, &collector.assumed, times, &name))?;
    Ok(Answer::Fine)
}

/// Closing and opening time in the shortest cycle that is long enough, s.
fn times_s(file: &ValveFile) -> [Option<f64>; 2] {
    let conditions = Conditions::nominal(file.valve().parameters());
    let mut close_s = 4.0;
    loop {
        let schedule = Schedule { close_at_s: 0.0, open_at_s: close_s, end_s: 3.0 * close_s };
        let cycles = Cycles::simulate(file.valve(), conditions, &schedule, 1, 1e-3);
        let times = cycles.times_s[0];
        if times.iter().all(Option::is_some) || 6.0 * close_s > LONGEST_CYCLE_S {
            return times;
        }
        close_s *= 2.0;
    }
}

/// Stroke times with the cycle and the limits that fit them. How long the valve opens depends on how full it is by then,
/// so the times are those of the very cycle that the file gets.
fn settled(file: &ValveFile, given: &[Option<f64>; 2]) -> ([Option<f64>; 2], Schedule, [f64; 2]) {
    let conditions = Conditions::nominal(file.valve().parameters());
    let mut times = times_s(file);
    let (mut schedule, mut limits) = cycle(times, given);
    for _ in 0..MOST_CYCLES_TRIED {
        let last = Cycles::simulate(file.valve(), conditions, &schedule, REPEATS, 1e-3).times_s.last().copied();
        let Some(own) = last.filter(|own| own.iter().all(Option::is_some)) else { break };
        times = own;
        let (next, next_limits) = cycle(times, given);
        limits = next_limits;
        if next == schedule {
            break;
        }
        schedule = next;
    }
    (times, schedule, limits)
}

/// A cycle with room for both strokes, and limits within it.
fn cycle(times: [Option<f64>; 2], given: &[Option<f64>; 2]) -> (Schedule, [f64; 2]) {
    let limit = |index: usize, fallback: f64| {
        given[index].unwrap_or_else(|| times[index].map_or(fallback, |time| up(LIMIT_OVER_TIME * time)))
    };
    let limits = [limit(0, 3.0), limit(1, 6.0)];
    let open_at_s = up(1.3 * limits[0]);
    (Schedule { close_at_s: 0.0, open_at_s, end_s: open_at_s + up(1.3 * limits[1]) }, limits)
}

/// The typical stiffness of the stops, with its unit.
fn written_stiffness(size: Size) -> String {
    format!("{} MN/m", (10.0 * size.contact_n_per_m() / 1e6).round() / 10.0)
}

/// The next number with one digit, or one and a half.
fn up(number: f64) -> f64 {
    let decade = 10f64.powf(number.log10().floor());
    (2.0 * number / decade).ceil() * 0.5 * decade
}

fn summary(draft: &Draft, assumed: &[String], times: [Option<f64>; 2], file: &str) -> String {
    let mut text = format!("{file} written.\n");
    let typical: Vec<&str> =
        draft.entries.iter().filter(|entry| entry.comment.starts_with("typical")).map(|entry| entry.key).collect();
    // Writing to a string cannot fail.
    if !typical.is_empty() {
        let _ = writeln!(text, "Typical values with wide tolerances: {}.", typical.join(", "));
    }
    if !assumed.is_empty() {
        let _ = writeln!(text, "Assumed: {}.", assumed.join(", "));
    }
    let words = |time: Option<f64>| time.map_or("does not get there".to_owned(), |time| format!("{time:.3} s"));
    let _ =
        writeln!(text, "The model closes in {} and opens in {}; does your valve?", words(times[0]), words(times[1]));
    text.push_str(&output::next_step("look at its strokes", &["simulate", file, "--plot", "cycle.svg"]));
    let recordings = ["init", "campaign", "traces/*.csv", "--valve", file];
    text.push_str(&output::next_step("describe recorded strokes, by their names for traces/*.csv", &recordings));
    text
}

/// All that goes into the file.
struct Draft {
    name: String,
    gas: (&'static str, f64),
    entries: Vec<Entry>,
    limits_s: [Option<f64>; 2],
}

impl Draft {
    fn text(&self, schedule: Schedule, limits: [f64; 2]) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ =
            writeln!(text, "# A valve that pressure closes and a spring, or its weight, opens. Written by valve init.");
        let _ = writeln!(
            text,
            "# Quantities are a number and a unit; pressures are psig, psia, barg, bara, kPa, MPa or Pa."
        );
        let _ = writeln!(text, "name = {}", quoted(&self.name));
        for section in ["actuator", "spring", "stops", "gas", "pneumatics"] {
            let _ = writeln!(text, "\n[{section}]");
            if section == "gas" {
                let (name, constant) = self.gas;
                let _ = writeln!(text, "ratio_of_specific_heats = 1.4                # {name}");
                let _ = writeln!(text, "specific_gas_constant = \"{} J/(kg K)\"", format_number(constant));
                let _ = writeln!(text, "compressibility = 1.0");
            }
            for entry in &self.entries {
                if let Some((table, key)) = entry.key.split_once('.')
                    && table == section
                {
                    let line = format!("{key} = {}", entry.text);
                    let _ = writeln!(text, "{line:<44} # {}", entry.comment);
                }
            }
        }
        let seconds = |number: f64| format!("\"{} s\"", format_number(number));
        let _ =
            writeln!(text, "\n# The cycle in which stroke times are taken, and for which tables are built.\n[cycle]");
        let _ = writeln!(text, "close_at = {}", seconds(schedule.close_at_s));
        let _ = writeln!(text, "open_at = {}", seconds(schedule.open_at_s));
        let _ = writeln!(text, "end = {}", seconds(schedule.end_s));
        let _ = writeln!(
            text,
            "\n# A stroke that takes longer has failed. Maintenance manual: maximum stroke time, Stellzeit.\n[limits]"
        );
        let _ = writeln!(text, "close_within = {}", seconds(limits[0]));
        let _ = writeln!(text, "open_within = {}", seconds(limits[1]));
        let _ = writeln!(
            text,
            "\n# How well the values above are known, one standard deviation as a fraction: these may be calibrated."
        );
        let _ = writeln!(text, "[tolerance]");
        for entry in &self.entries {
            if let Some(tolerance) = entry.tolerance {
                let _ = writeln!(text, "\"{}\" = {tolerance:.2}", entry.key);
            }
        }
        text
    }
}

/// A text as a TOML string, on one line.
fn quoted(text: &str) -> String {
    let text: String = text.chars().filter(|character| !character.is_control()).collect();
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// Gets each number from its option, the terminal, or what is typical.
struct Collector<'a> {
    args: &'a InitValveArgs,
    /// Whether there is somebody who is to be asked.
    asks: bool,
    /// What nobody has said.
    missing: Vec<String>,
    /// What is wrong with the options.
    wrong: Vec<String>,
    /// What was taken without being said.
    assumed: Vec<String>,
}

impl<'a> Collector<'a> {
    fn new(args: &'a InitValveArgs, asks: bool) -> Self {
        Self { args, asks, missing: Vec::new(), wrong: Vec::new(), assumed: Vec::new() }
    }

    fn draft(&mut self) -> anyhow::Result<Draft> {
        let args = self.args;
        let ambient = args.ambient.clone().unwrap_or_else(|| USUAL_AMBIENT.to_owned());
        let ambient_pa = quantity::absolute_pressure_pa(&ambient).map_err(|error| error.to_string());
        let ambient_pa = self.named("--ambient", ambient_pa).unwrap_or(USUAL_AMBIENT_PA);
        let temperature = args.temperature.clone().unwrap_or_else(|| USUAL_TEMPERATURE.to_owned());
        self.named("--temperature", plain(&temperature, Dimension::Temperature));
        let (stroke, stroke_m) = self.needed(
            "--stroke",
            args.stroke.as_ref(),
            "Stroke: travel between the stops. Nameplate or datasheet: stroke, travel, lift, Hub, course. E.g. 25.4 mm",
            |text| plain(text, Dimension::Length).map(|(si, _)| si),
        )?;
        let (area, area_m2, area_comment) = self.area()?;
        let (supply, supply_pa) = self.needed(
            "--supply",
            args.supply.as_ref(),
            "Supply pressure at the valve. Filter regulator's gauge, or datasheet: operating pressure. E.g. 75 psig or 5.2 barg",
            |text| match pressure_pa(text, ambient_pa) {
                Ok(pascal) if pascal > ambient_pa => Ok(pascal),
                Ok(_) => Err(format!("\"{text}\" is not above the atmosphere of {ambient}")),
                Err(error) => Err(error.to_string()),
            },
        )?;
        let size = Size { stroke_m, area_m2, supply_gauge_pa: supply_pa - ambient_pa };
        let entry = |key, text: String, comment: &str| Entry {
            key,
            text: quoted(&text),
            comment: comment.to_owned(),
            tolerance: None,
        };
        let mut entries = vec![
            entry("actuator.stroke", stroke, "travel between the stops"),
            entry("actuator.piston_area", area, &area_comment),
            entry("stops.contact_stiffness", written_stiffness(size), "typical of metal stops"),
            entry("pneumatics.supply_pressure", supply, "at the valve"),
            entry("pneumatics.ambient_pressure", ambient, "of the atmosphere, absolute"),
            entry("pneumatics.temperature", temperature, "of gas and walls"),
        ];
        entries.push(Entry {
            key: "pneumatics.flow_coefficient",
            text: "0.86".to_owned(),
            comment: "discharge coefficient, multiplies every orifice area".to_owned(),
            tolerance: None,
        });
        let spring = self.bench_set(size)?;
        for fact in &FACTS {
            let from_bench = spring.as_ref().filter(|_| fact.key.starts_with("spring."));
            entries.push(match from_bench {
                Some((stiffness, preload_m)) => {
                    let si = if fact.key == "spring.stiffness" { *stiffness } else { *preload_m };
                    written(fact, si, "from the bench set".to_owned(), fact.tolerance[0])
                }
                None => self.fact(fact, size)?,
            });
        }
        let gas = self.gas()?;
        let limits_s =
            [("--close-within", &args.close_within), ("--open-within", &args.open_within)].map(|(option, text)| {
                let (si, _) = self.named(option, plain(text.as_ref()?, Dimension::Time))?;
                Some(si)
            });
        if args.temperature.is_none() {
            self.assumed.push(USUAL_TEMPERATURE.to_owned());
        }
        if args.ambient.is_none() {
            self.assumed.push(format!("an atmosphere of {USUAL_AMBIENT}"));
        }
        if args.name.is_none() {
            self.assumed.push(format!("name {USUAL_NAME}"));
        }
        let name = args.name.clone().unwrap_or_else(|| USUAL_NAME.to_owned());
        Ok(Draft { name, gas, entries, limits_s })
    }

    /// Whether what has a usual value is asked for.
    fn asks_all(&self) -> bool {
        self.asks && !self.args.typical
    }

    /// The gas: its option, the answer at a terminal, else air.
    fn gas(&mut self) -> anyhow::Result<(&'static str, f64)> {
        if let Some(text) = &self.args.gas {
            return Ok(self.named("--gas", gas(text)).unwrap_or(AIR));
        }
        if self.asks_all() {
            let question = "Gas: air or nitrogen (N2). Empty for air";
            if let Some((_, gas)) = dialogue::ask(question, true, gas)? {
                return Ok(gas);
            }
        }
        self.assumed.push(AIR.0.to_owned());
        Ok(AIR)
    }

    /// Notes limits that nobody has said, after the gas.
    fn assume_limits(&mut self, given: [Option<f64>; 2], taken: [f64; 2]) {
        let at = self.assumed.iter().position(|assumed| assumed != AIR.0).unwrap_or(self.assumed.len());
        let words = ["closes", "opens"].into_iter().enumerate().filter(|(index, _)| given[*index].is_none());
        let words: Vec<String> =
            words.map(|(index, verb)| format!("{verb} within {} s", format_number(taken[index]))).collect();
        self.assumed.splice(at..at, words);
    }

    /// What an option says; what is wrong with it is told with all the rest.
    fn named<T>(&mut self, option: &str, read: Result<T, String>) -> Option<T> {
        read.map_err(|reason| self.wrong.push(format!("{option}: {reason}"))).ok()
    }

    /// A number without which nothing can be said.
    fn needed(
        &mut self,
        option: &str,
        given: Option<&String>,
        question: &str,
        read: impl Fn(&str) -> Result<f64, String>,
    ) -> anyhow::Result<(String, f64)> {
        if let Some(text) = given {
            return Ok((text.clone(), self.named(option, read(text)).unwrap_or(1.0)));
        }
        if self.asks
            && let Some(answer) = dialogue::ask(question, false, read)?
        {
            return Ok(answer);
        }
        let (what, _) = question.split_once(". ").unwrap_or((question, ""));
        self.missing.push(format!("{option} ({})", what.to_lowercase()));
        Ok((String::new(), 1.0))
    }

    fn area(&mut self) -> anyhow::Result<(String, f64, String)> {
        let of_bore = |bore_m: f64| 0.25 * PI * bore_m * bore_m;
        let shown = |area_m2: f64| rounded(area_m2, "cm2");
        if let Some(text) = &self.args.piston_area {
            let (area_m2, _) = self.named("--piston-area", plain(text, Dimension::Area)).unwrap_or((1.0, false));
            return Ok((text.clone(), area_m2, "effective area of piston or diaphragm".to_owned()));
        }
        let question = "Bore of the cylinder. Datasheet: bore, piston diameter, Kolbendurchmesser, alésage. E.g. 63 mm";
        let (bore, bore_m) = self.needed("--bore", self.args.bore.as_ref(), question, |text| {
            plain(text, Dimension::Length).map(|(si, _)| si)
        })?;
        Ok((shown(of_bore(bore_m)), of_bore(bore_m), format!("from a bore of {bore}")))
    }

    /// Stiffness in N/m and compression in m from a bench set, where one is given.
    fn bench_set(&mut self, size: Size) -> anyhow::Result<Option<(f64, f64)>> {
        let args = self.args;
        let by_itself = args.spring_stiffness.is_some() || args.spring_preload.is_some() || args.typical;
        let range_pa = match &args.bench_set {
            // A wrong one must not be asked for a second time by its parts.
            Some(text) => Some(self.named("--bench-set", bench_set_pa(text)).unwrap_or((0.0, 1.0))),
            None if !by_itself && self.asks => {
                let question = "Bench set: pressures at which the stroke begins and ends. Nameplate: bench set, spring range, \
                                Federbereich. E.g. 0.8..2.4 barg. Empty if there is none";
                dialogue::ask(question, true, bench_set_pa)?.map(|(_, range_pa)| range_pa)
            }
            None => None,
        };
        let Some((begin_pa, end_pa)) = range_pa else { return Ok(None) };
        let stiffness = (end_pa - begin_pa) * size.area_m2 / size.stroke_m;
        Ok(Some((stiffness, begin_pa * size.area_m2 / stiffness)))
    }

    fn fact(&mut self, fact: &Fact, size: Size) -> anyhow::Result<Entry> {
        let entry = |text: &str, si: f64, as_it_is: bool| {
            if as_it_is {
                Entry {
                    key: fact.key,
                    text: quoted(text),
                    comment: fact.what.to_owned(),
                    tolerance: fact.tolerance[0].filter(|_| si > 0.0),
                }
            } else {
                written(fact, si, format!("{}, from {text}", fact.what), fact.tolerance[0])
            }
        };
        if let Some(text) = self.given(fact.key) {
            let option = fact.option.split(' ').next().unwrap_or(fact.option);
            let (si, as_it_is) = self.named(option, (fact.read)(&text)).unwrap_or((0.0, false));
            return Ok(entry(&text, si, as_it_is));
        }
        let typical = (fact.typical)(size);
        let usual = |tolerance| written(fact, typical, format!("typical; {}", fact.what), tolerance);
        if self.args.typical {
            return Ok(usual(fact.tolerance[1]));
        }
        if self.asks {
            let question = format!(
                "{}: {}.\n  Where: {}. E.g. {}. Empty if you do not know (then {}, and not sure)",
                fact.option,
                fact.what,
                fact.stands,
                fact.example,
                rounded(typical, fact.unit)
            );
            let answer = dialogue::ask(&question, true, fact.read)?;
            return Ok(
                answer.map_or_else(|| usual(fact.tolerance[1]), |(text, (si, as_it_is))| entry(&text, si, as_it_is))
            );
        }
        self.missing.push(format!("{} ({})", fact.option, fact.what));
        Ok(usual(None))
    }

    fn given(&self, key: &str) -> Option<String> {
        let args = self.args;
        match key {
            "actuator.moving_mass" => args.moving_mass.clone(),
            "spring.stiffness" => args.spring_stiffness.clone(),
            "spring.preload_compression" => args.spring_preload.clone(),
            "actuator.dead_volume" => args.dead_volume.clone(),
            "actuator.viscous_friction" => args.viscous_friction.clone(),
            "pneumatics.solenoid_orifice_area" => args.solenoid.clone(),
            "pneumatics.port_orifice_area" => args.port.clone(),
            "pneumatics.pipe_volume" => args.pipe.clone(),
            _ => None,
        }
    }
}

/// The limits that are asked for at a terminal, s; an empty answer leaves the one that is shown.
fn asked_limits(
    given: [Option<f64>; 2],
    usual: [f64; 2],
    times_s: [Option<f64>; 2],
) -> anyhow::Result<[Option<f64>; 2]> {
    let mut limits_s = given;
    for (index, stroke) in ["closing", "opening"].into_iter().enumerate() {
        if given[index].is_none() {
            let why = match times_s[index] {
                Some(_) => format!("{LIMIT_OVER_TIME} times the model's own"),
                None => "the model does not get there".to_owned(),
            };
            let question = format!(
                "Longest acceptable {stroke} time. Maintenance manual: maximum stroke time, Stellzeit. E.g. 3 s. \
                 Empty for {} s ({why})",
                format_number(usual[index])
            );
            let answer = dialogue::ask(&question, true, |text| plain(text, Dimension::Time))?;
            limits_s[index] = answer.map(|(_, (si, _))| si);
        }
    }
    Ok(limits_s)
}

/// A value in the fact's own unit.
fn written(fact: &Fact, si: f64, comment: String, tolerance: Option<f64>) -> Entry {
    let tolerance = tolerance.filter(|_| si > 0.0);
    Entry { key: fact.key, text: format!("\"{}\"", rounded(si, fact.unit)), comment, tolerance }
}

/// Four significant digits in a unit.
fn rounded(si: f64, unit: &str) -> String {
    let Ok(unit) = Unit::parse(unit) else { return format_number(si) };
    let number: f64 = format!("{:.3e}", unit.from_si(si)).parse().unwrap_or(si);
    format_si(unit.to_si(number), &unit)
}

/// A gas by one of its names, with its specific gas constant, J/(kg K).
fn gas(text: &str) -> Result<(&'static str, f64), String> {
    match text.trim().to_lowercase().as_str() {
        "air" => Ok(AIR),
        "nitrogen" | "n2" | "n₂" => Ok(("nitrogen", 296.8)),
        _ => Err(format!("\"{text}\" is not known; expected air or nitrogen (N2); edit the file for another")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gases_go_by_name_and_formula() {
        for (text, name) in [("N2", "nitrogen"), ("Nitrogen", "nitrogen"), ("air", "air"), (" Air ", "air")] {
            assert_eq!(gas(text).unwrap().0, name);
        }
        assert!(gas("argon").unwrap_err().contains("expected air or nitrogen (N2)"));
    }

    #[test]
    fn an_inch_sign_does_not_end_a_text() {
        assert_eq!(quoted("0.083\""), "\"0.083\\\"\"");
        assert_eq!(quoted("a\\b\n"), "\"a\\\\b\"");
    }
}
