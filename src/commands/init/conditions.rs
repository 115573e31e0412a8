//! Under what conditions each recording was made: from options, from what it shows, else asked.

use std::path::Path;

use campaign::guess::{DraftRun, SupplyGuess};
use quantity::{Dimension, Quantity, pressure_pa};

use super::dialogue;
use crate::cli::InitCampaignArgs;
use crate::failure::Hinted;

/// A leak that was opened on purpose: its key in the campaign file, and its area.
type Leak = (&'static str, String);

/// What an option says, of one file or of all.
struct Given {
    file: Option<String>,
    value: String,
}

impl Given {
    /// Reads `FILE=VALUE` or a value of all.
    fn new(text: &str) -> Self {
        match text.split_once('=') {
            Some((file, value)) => Self { file: Some(file.trim().to_owned()), value: value.trim().to_owned() },
            None => Self { file: None, value: text.trim().to_owned() },
        }
    }

    fn is_of(&self, file: &str) -> bool {
        self.file.as_ref().is_some_and(|name| file == name || Path::new(file).ends_with(name))
    }
}

/// The conditions that options state; each of them can be read.
pub struct Stated {
    ambient_pa: f64,
    supply: Vec<Given>,
    temperature: Vec<Given>,
    leak: Vec<Given>,
}

impl Stated {
    /// Reads the options; all that is wrong with them is told at once.
    pub fn read(args: &InitCampaignArgs, ambient_pa: f64) -> anyhow::Result<Self> {
        let mut wrong = Vec::new();
        let files: Vec<String> = args.files.iter().map(|path| path.display().to_string()).collect();
        let mut read = |option: &str, texts: &[String], check: &dyn Fn(&str) -> Result<(), String>| {
            let mut all = Vec::new();
            for text in texts {
                let given = Given::new(text);
                let named = given.file.as_deref().filter(|_| !files.iter().any(|file| given.is_of(file)));
                if let Some(name) = named {
                    let meant = quantity::suggest::did_you_mean(name, files.iter().map(String::as_str));
                    wrong.push(format!("{option} {text}: there is no recording \"{name}\"{meant}"));
                } else if let Err(reason) = check(&given.value) {
                    wrong.push(format!("{option}: {reason}"));
                }
                all.push(given);
            }
            all
        };
        let stated = Self {
            ambient_pa,
            supply: read("--supply", &args.supply, &|text| supply(text, ambient_pa)),
            temperature: read("--temperature", &args.temperature, &temperature),
            leak: read("--leak", &args.leak, &|text| leak(text).map(|_| ())),
        };
        dialogue::all_right(&wrong)?;
        Ok(stated)
    }

    /// What is known of a recording that is called `shown_as` in the campaign file.
    pub fn run(&self, file: &str, shown: Option<&SupplyGuess>, shown_as: String) -> DraftRun {
        let of = |given: &[Given]| {
            let own = given.iter().find(|given| given.is_of(file));
            own.or_else(|| given.iter().find(|given| given.file.is_none())).map(|given| given.value.clone())
        };
        let (supply_pressure, supply_from) = match (of(&self.supply), shown) {
            (Some(text), _) => (text, "as you said".to_owned()),
            (None, Some(supply)) => (supply.text.clone(), format!("from {}", supply.from)),
            (None, None) => (String::new(), String::new()),
        };
        let leak = of(&self.leak).and_then(|text| leak(&text).ok());
        DraftRun { file: shown_as, supply_pressure, supply_from, temperature: of(&self.temperature), leak }
    }

    /// Asks for what is not known: the supply pressure of each recording, the temperature of all at once, the leaks that were
    /// opened. Without a terminal the first is refused, the second left to the valve file, and of the third there are none.
    pub fn ask(&self, runs: &mut [DraftRun]) -> anyhow::Result<()> {
        if !dialogue::is_possible() {
            let missing: Vec<&str> =
                runs.iter().filter(|run| run.supply_pressure.is_empty()).map(|run| run.file.as_str()).collect();
            if missing.is_empty() {
                return Ok(());
            }
            return Err(Hinted::error(
                format!("the supply pressure is not known of {}", missing.join(", ")),
                "say it with --supply \"75 psig\" (all recordings), --supply \"run-01.csv=75 psig\" (one), or in the files' names",
            ));
        }
        for run in runs.iter_mut().filter(|run| run.supply_pressure.is_empty()) {
            let question = format!("Supply pressure of {}, such as 75 psig or 5.2 barg", run.file);
            if let Some((text, ())) = dialogue::ask(&question, false, |text| supply(text, self.ambient_pa))? {
                (run.supply_pressure, run.supply_from) = (text, "as you said".to_owned());
            }
        }
        if self.temperature.is_empty() {
            let question = "Temperature of the recordings, such as 20 degC; empty for that of the valve file";
            let answer = dialogue::ask(question, true, temperature)?.map(|(text, ())| text);
            for run in runs.iter_mut() {
                run.temperature.clone_from(&answer);
            }
        }
        if self.leak.is_empty() {
            let example = runs.first().map_or("run-01.csv", |run| crate::output::short_name(&run.file));
            let question = format!(
                "Leaks that were opened on purpose, such as {example}=atmosphere:0.15mm2, with commas between them; empty if \
                 there were none"
            );
            let opened =
                dialogue::ask(&question, true, |text| opened(text, runs))?.map_or_else(Vec::new, |(_, opened)| opened);
            for (index, leak) in opened {
                runs[index].leak = Some(leak);
            }
        }
        Ok(())
    }
}

fn supply(text: &str, ambient_pa: f64) -> Result<(), String> {
    match pressure_pa(text, ambient_pa) {
        Ok(pascal) if pascal > ambient_pa => Ok(()),
        Ok(_) => Err(format!("\"{text}\" is not above the atmosphere")),
        Err(error) => Err(error.to_string()),
    }
}

fn temperature(text: &str) -> Result<(), String> {
    Quantity::parse(text, Dimension::Temperature).map(|_| ()).map_err(|error| error.to_string())
}

/// Reads a leak that was opened on purpose.
fn leak(text: &str) -> Result<Leak, String> {
    let expected = "a leak is such as atmosphere:0.15mm2 (from the chamber) or supply:0.05mm2 (into it)";
    let (place, area) = text.split_once(':').ok_or_else(|| format!("\"{text}\" has no place; {expected}"))?;
    let key = match place.trim() {
        "atmosphere" => "leak_to_atmosphere",
        "supply" => "leak_from_supply",
        other => return Err(format!("\"{other}\" is no place; {expected}")),
    };
    let area = area.trim();
    let quantity = Quantity::parse(area, Dimension::Area).map_err(|error| format!("{error}; {expected}"))?;
    if quantity.si() >= 0.0 && quantity.si().is_finite() {
        Ok((key, area.to_owned()))
    } else {
        Err(format!("\"{area}\" is not 0 or more; {expected}"))
    }
}

/// Which recording was made with which leak.
fn opened(text: &str, runs: &[DraftRun]) -> Result<Vec<(usize, Leak)>, String> {
    let one = |text: &str| {
        let given = Given::new(text);
        let leak = leak(&given.value)?;
        let is_meant = |run: &&DraftRun| given.file.is_none() || given.is_of(&run.file);
        let meant: Vec<usize> =
            runs.iter().enumerate().filter(|(_, run)| is_meant(run)).map(|(index, _)| index).collect();
        let files = || runs.iter().map(|run| run.file.as_str()).collect::<Vec<_>>();
        match (&given.file, &meant[..]) {
            (Some(name), []) => {
                let meant = quantity::suggest::did_you_mean(name, files());
                Err(format!("there is no recording \"{name}\"{meant}; there are {}", files().join(", ")))
            }
            _ => Ok(meant.into_iter().map(|index| (index, leak.clone())).collect::<Vec<_>>()),
        }
    };
    let all: Result<Vec<_>, String> = text.split(',').map(|text| one(text.trim())).collect();
    Ok(all?.concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_about_leaks_name_their_recordings() {
        let run = |file: &str| DraftRun {
            file: file.to_owned(),
            supply_pressure: "75 psig".to_owned(),
            supply_from: "as you said".to_owned(),
            temperature: None,
            leak: None,
        };
        let runs = [run("traces/run-01.csv"), run("traces/run-02.csv")];
        let leak = |index, area: &str| (index, ("leak_to_atmosphere", area.to_owned()));
        assert_eq!(opened("run-02.csv=atmosphere:0.15mm2", &runs).unwrap(), [leak(1, "0.15mm2")]);
        assert_eq!(
            opened("run-01.csv=atmosphere:0.1mm2, run-02.csv=atmosphere:0.2mm2", &runs).unwrap(),
            [leak(0, "0.1mm2"), leak(1, "0.2mm2")]
        );
        assert_eq!(opened("atmosphere:0.1 mm2", &runs).unwrap(), [leak(0, "0.1 mm2"), leak(1, "0.1 mm2")]);
        assert!(opened("run-03.csv=atmosphere:0.1mm2", &runs).unwrap_err().contains("there is no recording"));
        assert!(opened("none", &runs).unwrap_err().contains("such as atmosphere:0.15mm2"));
    }

    #[test]
    fn leaks_have_a_place_and_an_area() {
        assert_eq!(leak("atmosphere:0.15mm2").unwrap(), ("leak_to_atmosphere", "0.15mm2".to_owned()));
        assert_eq!(leak("supply: 0.05 mm2").unwrap(), ("leak_from_supply", "0.05 mm2".to_owned()));
        for wrong in ["0.15 mm2", "pipe:0.15 mm2", "supply:0.15 mm", "supply:-1 mm2", "atmosphere:"] {
            assert!(leak(wrong).unwrap_err().contains("such as atmosphere:0.15mm2"), "{wrong}");
        }
    }
}
