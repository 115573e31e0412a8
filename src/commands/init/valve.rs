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

/// Collects the numbers, simulates once to find a cycle that fits, writes the file.
pub fn run(args: &InitValveArgs) -> anyhow::Result<Answer> {
    let out = Outputs::new(args.force).file(&args.out)?;
    let mut collector = Collector { args, missing: Vec::new() };
    let draft = collector.draft()?;
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
    let (times, schedule, limits) = settled(&probe, &draft.limits_s);
    let file = ValveFile::parse(&draft.text(schedule, limits), &name)?;
    out.write_whole(file.text().as_bytes())?;
    for doubt in file.doubts() {
        output::note(&format!("warning: {doubt}"));
    }
    output::print_text(&summary(&draft, times, &name))?;
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

fn summary(draft: &Draft, times: [Option<f64>; 2], file: &str) -> String {
    let mut text = format!("{file} written.\n");
    let typical: Vec<&str> =
        draft.entries.iter().filter(|entry| entry.comment.starts_with("typical")).map(|entry| entry.key).collect();
    // Writing to a string cannot fail.
    if !typical.is_empty() {
        let _ = writeln!(text, "Typical values with wide tolerances: {}.", typical.join(", "));
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
        let name: String = self.name.chars().filter(|character| !character.is_control()).collect();
        let _ = writeln!(text, "name = \"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""));
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

/// Gets each number from its option, the terminal, or what is typical.
struct Collector<'a> {
    args: &'a InitValveArgs,
    missing: Vec<String>,
}

impl Collector<'_> {
    fn draft(&mut self) -> anyhow::Result<Draft> {
        let args = self.args;
        let ambient = args.ambient.clone().unwrap_or_else(|| "101.325 kPa".to_owned());
        let ambient_pa =
            named("--ambient", quantity::absolute_pressure_pa(&ambient).map_err(|error| error.to_string()))?;
        let temperature = args.temperature.clone().unwrap_or_else(|| "20 degC".to_owned());
        named("--temperature", plain(&temperature, Dimension::Temperature))?;
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
            text: format!("\"{text}\""),
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
        let gas = match args.gas.as_deref() {
            None | Some("air") => ("air", 287.05),
            Some("nitrogen") => ("nitrogen", 296.8),
            Some(other) => {
                return Err(Hinted::error(
                    format!("--gas: \"{other}\" is not known"),
                    "air or nitrogen; edit the file for another",
                ));
            }
        };
        let limit = |option: &str, text: Option<&String>| {
            text.map(|text| named(option, plain(text, Dimension::Time)).map(|(si, _)| si)).transpose()
        };
        let limits_s =
            [limit("--close-within", args.close_within.as_ref())?, limit("--open-within", args.open_within.as_ref())?];
        Ok(Draft { name: args.name.clone().unwrap_or_else(|| "my valve".to_owned()), gas, entries, limits_s })
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
            return Ok((text.clone(), named(option, read(text))?));
        }
        if dialogue::is_possible()
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
            let (area_m2, _) = named("--piston-area", plain(text, Dimension::Area))?;
            return Ok((text.clone(), area_m2, "effective area of piston or diaphragm".to_owned()));
        }
        let question = "Bore of the cylinder. Datasheet: bore, piston diameter, Kolbendurchmesser, alésage. E.g. 63 mm";
        let (bore, bore_m) = self.needed("--bore", self.args.bore.as_ref(), question, |text| {
            plain(text, Dimension::Length).map(|(si, _)| si)
        })?;
        Ok((shown(of_bore(bore_m)), of_bore(bore_m), format!("from a bore of {bore}")))
    }

    /// Stiffness in N/m and compression in m from a bench set, where one is given.
    fn bench_set(&self, size: Size) -> anyhow::Result<Option<(f64, f64)>> {
        let args = self.args;
        let by_itself = args.spring_stiffness.is_some() || args.spring_preload.is_some() || args.typical;
        let range_pa = match &args.bench_set {
            Some(text) => Some(named("--bench-set", bench_set_pa(text))?),
            None if !by_itself && dialogue::is_possible() => {
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
                    text: format!("\"{text}\""),
                    comment: fact.what.to_owned(),
                    tolerance: fact.tolerance[0].filter(|_| si > 0.0),
                }
            } else {
                written(fact, si, format!("{}, from {text}", fact.what), fact.tolerance[0])
            }
        };
        if let Some(text) = self.given(fact.key) {
            let (si, as_it_is) = named(fact.option, (fact.read)(&text))?;
            return Ok(entry(&text, si, as_it_is));
        }
        let typical = (fact.typical)(size);
        let usual = |tolerance| written(fact, typical, format!("typical; {}", fact.what), tolerance);
        if self.args.typical {
            return Ok(usual(fact.tolerance[1]));
        }
        if dialogue::is_possible() {
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

/// An error that names its option.
fn named<T>(option: &str, result: Result<T, String>) -> anyhow::Result<T> {
    result.map_err(|reason| anyhow::anyhow!("{option}: {reason}"))
}
