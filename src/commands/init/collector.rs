//! The numbers of a valve file: from options, answers and what is typical.

use std::f64::consts::PI;

use quantity::{Dimension, Quantity, Unit, format_number, format_si, pressure_pa};

use super::dialogue;
use super::facts::{FACTS, Fact, bench_set_pa, plain, preload};
use super::sheet::{Draft, Entry, quoted};
use super::typical::Size;
use crate::cli::InitValveArgs;

/// What is taken where nobody says anything else.
const AIR: (&str, f64) = ("air", 287.05);
const USUAL_NAME: &str = "my valve";
const USUAL_TEMPERATURE: &str = "20 degC";
const USUAL_AMBIENT: &str = "101.325 kPa";
const USUAL_AMBIENT_PA: f64 = 101_325.0;

const USUAL_COEFFICIENT: &str = "0.86";
/// How well the stiffness of stops is known: as stated, and as typical.
const KNOWN_STOPS: f64 = 0.1;
// Rubber or metal: a factor of three either way.
const UNKNOWN_STOPS: f64 = 1.0;

/// A piston area and a bore agree where their areas do to this share: a rod through the chamber takes more away.
const SAME_AREA: f64 = 0.01;

/// Gets each number from its option, the terminal, or what is typical.
pub struct Collector<'a> {
    args: &'a InitValveArgs,
    /// Whether there is somebody who is to be asked.
    asks: bool,
    /// What nobody has said.
    pub missing: Vec<String>,
    /// What is wrong with the options.
    pub wrong: Vec<String>,
    /// What was taken without being said.
    pub assumed: Vec<String>,
}

impl<'a> Collector<'a> {
    /// Nothing collected yet; `asks`: questions may be asked.
    pub fn new(args: &'a InitValveArgs, asks: bool) -> Self {
        Self { args, asks, missing: Vec::new(), wrong: Vec::new(), assumed: Vec::new() }
    }

    /// Collects all but the limits that nobody has given. What is wrong or missing stands in the collector.
    pub fn draft(&mut self) -> anyhow::Result<Draft> {
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
            entry("pneumatics.supply_pressure", supply, "at the valve"),
            entry("pneumatics.ambient_pressure", ambient, "of the atmosphere, absolute"),
            entry("pneumatics.temperature", temperature, "of gas and walls"),
        ];
        entries.push(self.stops(size));
        let coefficient = self.flow_coefficient();
        entries.push(Entry {
            key: "pneumatics.flow_coefficient",
            text: coefficient,
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
                None => self.fact(fact, size, stiffness(&entries))?,
            });
        }
        if let Some(words) = &args.orientation {
            let known = ["upright", "inverted", "horizontal"];
            if !known.contains(&words.as_str()) {
                self.wrong.push(format!("--orientation: \"{words}\" is not known; expected {}", known.join(", ")));
            }
            entries.push(entry(
                "actuator.orientation",
                words.clone(),
                "upright: the weight closes the valve; inverted: it opens it",
            ));
        } else if stiffness(&entries) == 0.0 {
            self.assumed.push("that its weight opens it, there being no spring".to_owned());
            let comment = "without a spring its weight has to open it; upright it would stay closed";
            entries.push(entry("actuator.orientation", "inverted".to_owned(), comment));
        }
        for text in &args.tolerance {
            let stated = tolerance(text, &entries);
            if let Some((index, share)) = self.named("--tolerance", stated) {
                entries[index].tolerance = Some(share);
            }
        }
        let gas = self.gas()?;
        let limits_s =
            [("--close-within", &args.close_within), ("--open-within", &args.open_within)].map(|(option, text)| {
                let (si, _) = self.named(option, plain(text.as_ref()?, Dimension::Time))?;
                Some(si)
            });
        let cycle_s = [("--open-at", &args.open_at), ("--cycle-end", &args.cycle_end)].map(|(option, text)| {
            let (si, _) = self.named(option, plain(text.as_ref()?, Dimension::Time))?;
            Some(si)
        });
        if let [Some(open_s), Some(end_s)] = cycle_s
            && end_s <= open_s
        {
            self.wrong.push("--cycle-end: the cycle ends before the valve is told to open".to_owned());
        }
        self.assume_usual(&entries);
        let name = args.name.clone().unwrap_or_else(|| USUAL_NAME.to_owned());
        Ok(Draft { name, gas, entries, limits_s, cycle_s })
    }

    /// Notes what is taken where nothing else was said, but for the gas.
    fn assume_usual(&mut self, entries: &[Entry]) {
        let args = self.args;
        if args.orientation.is_none() && stiffness(entries) > 0.0 {
            self.assumed.push("upright".to_owned());
        }
        if args.flow_coefficient.is_none() {
            self.assumed.push(format!("a discharge coefficient of {USUAL_COEFFICIENT}"));
        }
        if args.temperature.is_none() {
            self.assumed.push(USUAL_TEMPERATURE.to_owned());
        }
        if args.ambient.is_none() {
            self.assumed.push(format!("an atmosphere of {USUAL_AMBIENT}"));
        }
        if args.name.is_none() {
            self.assumed.push(format!("name {USUAL_NAME}"));
        }
    }

    /// Whether what has a usual value is asked for.
    pub fn asks_all(&self) -> bool {
        self.asks && !self.args.typical
    }

    /// The end stops, which hardly any datasheet tells.
    fn stops(&mut self, size: Size) -> Entry {
        let (text, comment, tolerance) = match &self.args.contact_stiffness {
            Some(text) => {
                self.named("--contact-stiffness", plain(text, Dimension::Stiffness));
                (text.clone(), "of the end stops", KNOWN_STOPS)
            }
            None => (written_stiffness(size), "typical; how stiff the stops are", UNKNOWN_STOPS),
        };
        let comment = comment.to_owned();
        Entry { key: "stops.contact_stiffness", text: quoted(&text), comment, tolerance: Some(tolerance) }
    }

    /// The discharge coefficient: its option, else a usual one.
    fn flow_coefficient(&mut self) -> String {
        let Some(text) = &self.args.flow_coefficient else {
            return USUAL_COEFFICIENT.to_owned();
        };
        let number = text.parse::<f64>().ok().filter(|number| *number > 0.0 && *number <= 1.0);
        let read = number.ok_or_else(|| format!("\"{text}\" is no number above 0 and at most 1, such as 0.86"));
        self.named("--flow-coefficient", read).map_or_else(|| USUAL_COEFFICIENT.to_owned(), |_| text.clone())
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
    pub fn assume_limits(&mut self, given: [Option<f64>; 2], taken: [f64; 2]) {
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
            let bore = self.args.bore.as_ref().and_then(|bore| self.named("--bore", plain(bore, Dimension::Length)));
            if let Some((bore_m, _)) = bore
                && (of_bore(bore_m) / area_m2 - 1.0).abs() > SAME_AREA
            {
                self.wrong.push(format!(
                    "--bore: its area of {} is not the --piston-area of {text}; give the one that the pressure acts on",
                    shown(of_bore(bore_m))
                ));
            }
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

    fn fact(&mut self, fact: &Fact, size: Size, stiffness_n_per_m: f64) -> anyhow::Result<Entry> {
        let read = |text: &str| match fact.key {
            "spring.preload_compression" => preload(text, stiffness_n_per_m),
            _ => (fact.read)(text),
        };
        let entry = |text: &str, si: f64, as_it_is: bool, stated: Option<f64>| {
            let tolerance = stated.or(fact.tolerance[0]).filter(|_| si > 0.0);
            if as_it_is {
                Entry { key: fact.key, text: quoted(text), comment: fact.what.to_owned(), tolerance }
            } else {
                written(fact, si, format!("{}, from {text}", fact.what), tolerance)
            }
        };
        if let Some(text) = self.given(fact.key) {
            let option = format!("--{}", fact.option_name());
            let (text, limits) = with_limits(&text);
            let (si, as_it_is) = self.named(&option, read(text)).unwrap_or((0.0, false));
            return Ok(entry(text, si, as_it_is, limits));
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
            let answer = dialogue::ask(&question, true, |text| read(with_limits(text).0))?;
            return Ok(answer.map_or_else(
                || usual(fact.tolerance[1]),
                |(text, (si, as_it_is))| {
                    let (text, limits) = with_limits(&text);
                    entry(text, si, as_it_is, limits)
                },
            ));
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

/// A value without the limits that a datasheet gives beside it ("24.8 cm3 +-10 %", in brackets or not), and one standard deviation
/// of a value that lies anywhere within them (JCGM 100:2008, 4.3.7).
fn with_limits(text: &str) -> (&str, Option<f64>) {
    let limits = || {
        let (value, limits) = ["+-", "+/-", "±"].into_iter().find_map(|mark| text.split_once(mark))?;
        let (value, limits) = match limits.trim().strip_suffix(')') {
            Some(limits) => (value.trim_end().strip_suffix('(')?, limits),
            None => (value, limits),
        };
        let percent = limits.trim().strip_suffix('%')?.trim_end().parse::<f64>().ok()?;
        (percent > 0.0 && percent <= 100.0).then(|| (value.trim(), 0.01 * percent / 3_f64.sqrt()))
    };
    limits().map_or((text, None), |(value, sigma)| (value, Some((1e4 * sigma).round() / 1e4)))
}

/// Which entry a tolerance is of, and the tolerance: `spring.stiffness=0.02`, `port_orifice_area 20 %`.
fn tolerance(text: &str, entries: &[Entry]) -> Result<(usize, f64), String> {
    let known = || {
        let may = entries.iter().filter(|entry| entry.tolerance.is_some()).map(|entry| entry.key);
        may.collect::<Vec<_>>().join(", ")
    };
    let without_percent = text.trim_end().trim_end_matches('%').trim_end();
    let parted = text.split_once('=').or_else(|| {
        let (name, _) = without_percent.rsplit_once(' ')?;
        Some((name, &text[name.len()..]))
    });
    let (name, share) = parted.ok_or_else(|| format!("\"{text}\" is no VALUE=SHARE"))?;
    let name = name.trim().trim_matches('"').trim_start_matches("--").replace(['-', ' '], "_");
    let is_meant = |entry: &&(usize, &Entry)| {
        let own = entry.1.key.split_once('.').map_or(entry.1.key, |(_, own)| own);
        let fact = FACTS.iter().find(|fact| fact.key == entry.1.key);
        let option = fact.map_or(own.to_owned(), |fact| fact.option_name().replace('-', "_"));
        entry.1.key == name || own == name || option == name
    };
    let found: Vec<(usize, &Entry)> = entries.iter().enumerate().collect();
    let Some((index, entry)) = found.iter().find(is_meant) else {
        return Err(format!("there is no \"{name}\"; expected one of {}", known()));
    };
    if entry.tolerance.is_none() {
        return Err(format!("{} cannot be calibrated; expected one of {}", entry.key, known()));
    }
    let share = share.trim();
    let (number, unit) = share.strip_suffix('%').map_or((share, 1.0), |percent| (percent.trim_end(), 0.01));
    let number = number.parse::<f64>().map(|number| number * unit).ok();
    let number = number.filter(|number| *number > 0.0 && *number <= 1.0);
    number.map(|share| (*index, share)).ok_or_else(|| format!("\"{share}\" is no share above 0 and at most 1"))
}

/// The stiffness of the spring among what is known by now, N/m; 0 where there is none.
fn stiffness(entries: &[Entry]) -> f64 {
    let entry = entries.iter().find(|entry| entry.key == "spring.stiffness");
    let stiffness = entry.and_then(|entry| Quantity::parse(entry.text.trim_matches('"'), Dimension::Stiffness).ok());
    stiffness.map_or(0.0, |stiffness| stiffness.si())
}

/// The typical stiffness of the stops, with its unit.
fn written_stiffness(size: Size) -> String {
    format!("{} MN/m", (10.0 * size.contact_n_per_m() / 1e6).round() / 10.0)
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
        "air" | "luft" | "druckluft" | "compressed air" => Ok(AIR),
        "nitrogen" | "n2" | "n₂" | "stickstoff" | "azote" | "gn2" => Ok(("nitrogen", 296.8)),
        _ => Err(format!("\"{text}\" is not known; expected air or nitrogen (N2); edit the file for another")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_of_a_datasheet_are_no_standard_deviation() {
        assert_eq!(with_limits("24.77 cm3 +-10 %"), ("24.77 cm3", Some(0.0577)));
        assert_eq!(with_limits("8.5 N/mm ±2%"), ("8.5 N/mm", Some(0.0115)));
        assert_eq!(with_limits("8.5 N/mm (+-2 %)"), ("8.5 N/mm", Some(0.0115)));
        for text in ["24.77 cm3", "6 mm x 1.4 m", "5 mm +-0.1 mm"] {
            assert_eq!(with_limits(text), (text, None));
        }
    }

    #[test]
    fn a_tolerance_goes_by_key_name_and_option() {
        let entry = |key, tolerance| Entry { key, text: "1".into(), comment: String::new(), tolerance };
        let entries = [entry("spring.stiffness", Some(0.1)), entry("pneumatics.port_orifice_area", Some(0.1))];
        for text in ["port 20 %", "--port=0.2", "pneumatics.port_orifice_area=20%", "port orifice area 20 %"] {
            assert_eq!(tolerance(text, &entries), Ok((1, 0.2)), "{text}");
        }
        assert_eq!(tolerance("spring-stiffness 2 %", &entries), Ok((0, 0.02)));
        assert!(tolerance("bore 2 %", &entries).unwrap_err().contains("there is no \"bore\""));
    }

    #[test]
    fn gases_go_by_name_and_formula() {
        for (text, name) in [("N2", "nitrogen"), ("Nitrogen", "nitrogen"), ("air", "air"), (" Air ", "air")] {
            assert_eq!(gas(text).unwrap().0, name);
        }
        assert!(gas("argon").unwrap_err().contains("expected air or nitrogen (N2)"));
    }
}
