//! Reads `campaign.toml` and the files that it names.

use std::path::{Path, PathBuf};

use checked_toml::{Document, Problem, QuantityKind, Refusals, Section, TomlFileError};
use column_source::NoticeKind;

use crate::columns::{self, CHANNELS, Mapping, TIMING_CHANNELS};
use crate::conditions::{self, CONDITION_KEYS};
use crate::error::{CampaignError, DataError, DataProblem};
use crate::trace::{self, CommandFrom, TraceFormat};
use crate::types::{Campaign, CommandEdge, Inputs, PlannedRun, Run, Sensors, Trace, ValveFacts};
use crate::warning::{Doubt, Warning};
use crate::{plausibility, stated_noise, timing_doubts, timings, uncertainty};

/// Gives the bytes of a file that the campaign names.
type Load<'a> = &'a dyn Fn(&str) -> std::io::Result<Vec<u8>>;

impl Campaign {
    /// Reads a campaign file and the CSV files that it names, relative to its folder.
    pub fn read(path: &Path, valve: &ValveFacts) -> Result<Self, CampaignError> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let parse = |text: &str| {
            Self::parse(text, &path.display().to_string(), valve, &|file| std::fs::read(folder.join(file)))
        };
        let read = checked_toml::read_text(path).map_err(CampaignError::from).and_then(|text| parse(&text));
        read.map_err(|error| recording_instead(path, &error).unwrap_or(error))
    }

    /// Reads a campaign's text; `load` gives the bytes of each file that it names. `file_name` is
    /// what messages call the campaign; CSV files are called by their path beside it.
    pub fn parse(
        text: &str,
        file_name: &str,
        valve: &ValveFacts,
        load: &dyn Fn(&str) -> std::io::Result<Vec<u8>>,
    ) -> Result<Self, CampaignError> {
        let document = Document::parse(text, file_name)?;
        let root = document.root();
        let known = ["name", "sensors", "uncertainty", "columns", "inputs", "command_from", "run", "timings"];
        let of_valves = ["actuator", "pneumatics", "spring"];
        let expected = "a campaign file, which is named after the valve file";
        root.not_of_another_kind(&known[1..], &of_valves, "a valve file", expected)?;
        let mut refusals = Refusals::default();
        refusals.keep(root.allow_only(&known));
        let name = root.text("name", "a text");
        let name = name.and_then(|name| name.ok_or_else(|| root.missing("name", "the campaign's name, a text")));
        let mut reader = Reader {
            folder: Path::new(file_name).parent().unwrap_or(Path::new("")).to_owned(),
            file_name,
            valve,
            load,
            mappings: refusals.keep(columns::read_mappings(&root, &CHANNELS)).unwrap_or_default(),
            command_from: refusals.keep(trace::read_command_from(&root, valve)).flatten(),
            inputs: refusals.keep(read_inputs(&root)).unwrap_or_default(),
            left_out: None,
            time_named: None,
        };
        let mut campaign = Self {
            name: refusals.keep(name).unwrap_or_default().to_owned(),
            sensors: refusals.keep(read_sensors(&root)).unwrap_or_default(),
            uncertainty: refusals.keep(uncertainty::read(&root)).unwrap_or_default(),
            inputs: reader.inputs,
            runs: Vec::new(),
            planned: Vec::new(),
            timings: Vec::new(),
            timings_file: None,
            warnings: Vec::new(),
        };
        let mut files: Vec<(PathBuf, usize)> = Vec::new();
        let mut read: Result<(), CampaignError> = Ok(());
        for section in refusals.keep(root.sections("run")).unwrap_or_default() {
            read = told(reader.run(&section, &mut files, &mut campaign), &mut refusals);
            if read.is_err() {
                break;
            }
        }
        if let (true, Some(section)) = (read.is_ok(), refusals.keep(root.section("timings")).flatten()) {
            read = told(reader.timings(&section, &mut campaign), &mut refusals);
        }
        // What a recording lacks may come of what was refused here.
        refusals.none()?;
        read?;
        // A name for the time that no recording has is mistyped.
        if let Some(Err(error)) = reader.time_named {
            return Err(error.into());
        }
        if let (true, Some(error)) = (campaign.runs.is_empty(), reader.left_out) {
            return Err(error.into());
        }
        if campaign.runs.is_empty() && campaign.planned.is_empty() && campaign.timings.is_empty() {
            return Err(root.missing("run", "at least one [[run]] with a file, or [timings] with a file").into());
        }
        if let Some(section) = root.section("sensors")? {
            let doubted = stated_noise::doubted(&mut campaign, file_name, &|key| section.line_of(key));
            campaign.warnings.extend(doubted);
        }
        Ok(campaign)
    }
}

/// The refusal of a recording where the campaign that names it should be; `None` of any other file.
fn recording_instead(path: &Path, error: &CampaignError) -> Option<CampaignError> {
    let CampaignError::Text(error) = error else { return None };
    if !matches!(
        *error.problem,
        Problem::NotText | Problem::Syntax { .. } | Problem::Columns { .. } | Problem::LongLine { .. }
    ) {
        return None;
    }
    let format = column_source::recognised(&std::fs::read(path).ok()?)?;
    Some(CampaignError::Recording { file: path.display().to_string(), format })
}

/// What a recording was refused for; refusals of the campaign's own text are gathered.
fn told(read: Result<(), CampaignError>, refusals: &mut Refusals) -> Result<(), CampaignError> {
    match read {
        Err(CampaignError::Text(error)) => {
            refusals.add(error);
            Ok(())
        }
        read => read,
    }
}

struct Reader<'a> {
    folder: PathBuf,
    file_name: &'a str,
    valve: &'a ValveFacts,
    load: Load<'a>,
    mappings: Vec<Mapping>,
    command_from: Option<CommandFrom>,
    inputs: Inputs,
    /// Why the first run that was left out was.
    left_out: Option<DataError>,
    /// Whether a recording has the time column that `[columns]` names, or the refusal of the first without; `None` before any.
    time_named: Option<Result<(), DataError>>,
}

impl Reader<'_> {
    /// The bytes of a file named in `section`, and what messages call it.
    fn load(&self, section: &Section<'_>, file: &str) -> Result<(Vec<u8>, String), DataError> {
        let shown = self.folder.join(file).display().to_string();
        match (self.load)(file) {
            Ok(bytes) => Ok((bytes, shown)),
            Err(error) => {
                let named_in_line = section.line_of("file");
                Err(DataError::new(&shown, 1, DataProblem::Unreadable { reason: error.to_string(), named_in_line }))
            }
        }
    }

    fn run(
        &mut self,
        section: &Section<'_>,
        files: &mut Vec<(PathBuf, usize)>,
        campaign: &mut Campaign,
    ) -> Result<(), CampaignError> {
        let mut known = vec!["file", "commands", "name", "end"];
        known.extend(CONDITION_KEYS);
        section.allow_only(&known)?;
        let (conditions, doubts) = conditions::read(section, self.valve)?;
        let said = |doubt| Warning { file: self.file_name.to_owned(), line: section.line(), doubt };
        campaign.warnings.extend(doubts.into_iter().map(said));
        let assumed = Doubt::TemperatureAssumed { assumed_k: self.valve.temperature_k };
        // Once is enough.
        if !section.has("temperature") && campaign.warnings.iter().all(|warning| warning.doubt != assumed) {
            campaign.warnings.push(said(assumed));
        }
        let file = section.text("file", "the path of a CSV file")?;
        let Some(file) = file else {
            let number = campaign.planned.len() + 1;
            campaign.planned.push(planned(section, conditions, number)?);
            return Ok(());
        };
        for key in ["commands", "end"] {
            if section.has(key) {
                let expected = "either a file (a recorded run) or commands (a planned one)";
                return Err(section.wrong(key, "given beside a file", expected).into());
            }
        }
        let path: PathBuf = Path::new(file).components().filter(|part| part.as_os_str() != ".").collect();
        if let Some((_, line)) = files.iter().find(|(other, _)| *other == path) {
            let found = format!("\"{file}\", which the run in line {line} has already");
            return Err(section.wrong("file", found, "a file of its own for each run").into());
        }
        files.push((path, section.line()));
        let (bytes, shown) = self.load(section, file)?;
        let format =
            TraceFormat { mappings: &self.mappings, command_from: self.command_from.as_ref(), valve: self.valve };
        let read = trace::read(&bytes, &shown, &format)?;
        match (&read.without_named_time, &self.time_named) {
            (None, _) => self.time_named = Some(Ok(())),
            (Some(error), None) => self.time_named = Some(Err(error.clone())),
            (Some(_), Some(_)) => {}
        }
        let mut warnings = Vec::new();
        if let Err(error) = plausibility::check(&read, &shown, (self.valve, self.command_from.as_ref()), &mut warnings)
        {
            if !matches!(*error.problem, DataProblem::NeverCrossed { .. }) {
                return Err(error.into());
            }
            // Other runs may cross it; whether any does is known in the end.
            let doubt = Doubt::LeftOut { reason: error.problem.to_string() };
            campaign.warnings.push(Warning { file: shown, line: error.line, doubt });
            self.left_out.get_or_insert(error);
            return Ok(());
        }
        warnings.extend(plausibility::above_supply(&read, &shown, self.valve, conditions.supply_pressure_pa));
        // Files of one recorder are written alike: that is said once.
        let told = |warning: &Warning| {
            let Doubt::Read(kind) = &warning.doubt else { return false };
            let alike = |other: &Warning| match &other.doubt {
                Doubt::Read(other) => std::mem::discriminant(other) == std::mem::discriminant(kind),
                _ => false,
            };
            *kind != NoticeKind::CutRow && campaign.warnings.iter().any(alike)
        };
        warnings.retain(|warning| !told(warning));
        campaign.warnings.append(&mut warnings);
        let trace = read.trace;
        for (wanted, present, column) in [
            (self.inputs.pipe_pressure, trace.pipe_pressure_pa.is_some(), "pipe_pressure_kpa"),
            (self.inputs.chamber_pressure, trace.chamber_pressure_pa.is_some(), "chamber_pressure_kpa"),
        ] {
            if wanted && !present {
                let problem = DataProblem::MissingColumn {
                    column: format!("\"{column}\""),
                    expected: "it in every run, since [inputs] lets it drive the model".into(),
                    found: "none for this channel".into(),
                };
                return Err(DataError::new(&shown, read.header_line, problem).into());
            }
        }
        let commands = trace::edges(&trace);
        if let Some(same) = campaign.runs.iter().find(|run| same_recording(&run.trace, &trace)) {
            let doubt = Doubt::SameRecording { other: same.file.clone() };
            campaign.warnings.push(Warning { file: shown.clone(), line: read.header_line, doubt });
        }
        let commands_inferred = self.command_from.is_some();
        campaign.runs.push(Run { file: file.to_owned(), conditions, trace, commands, commands_inferred });
        Ok(())
    }

    fn timings(&self, section: &Section<'_>, campaign: &mut Campaign) -> Result<(), CampaignError> {
        section.allow_only(&["file", "columns"])?;
        let mappings = columns::read_mappings(section, &TIMING_CHANNELS)?;
        let expected = "the path of a CSV file";
        let file = section.text("file", expected)?.ok_or_else(|| section.missing("file", expected))?;
        let (bytes, shown) = self.load(section, file)?;
        campaign.timings = timings::read(&bytes, &shown, &mappings, self.valve, &mut campaign.warnings)?;
        campaign.warnings.extend(timing_doubts::leave_out(&mut campaign.timings, &shown));
        campaign.timings_file = Some(shown);
        Ok(())
    }
}

/// Whether the shorter of two traces is the beginning of the other one, to the last digit.
fn same_recording(one: &Trace, other: &Trace) -> bool {
    let alike = |one: &[f64], other: &[f64]| one.iter().zip(other).all(|(one, other)| one.to_bits() == other.to_bits());
    alike(&one.position_m, &other.position_m) && alike(&one.time_s, &other.time_s)
}

fn read_sensors(root: &Section<'_>) -> Result<Sensors, TomlFileError> {
    let Some(section) = root.section("sensors")? else { return Ok(Sensors::default()) };
    section.allow_only(&["position_noise", "pressure_noise", "timing_noise"])?;
    let noise = |key: &str, kind: QuantityKind| match section.quantity(key, kind)? {
        Some(sigma) if !(sigma > 0.0 && sigma.is_finite()) => {
            Err(section.wrong(key, sigma.to_string(), "one standard deviation of the noise, more than 0"))
        }
        sigma => Ok(sigma),
    };
    Ok(Sensors {
        position_noise_m: noise("position_noise", QuantityKind::Si("m"))?,
        pressure_noise_pa: noise("pressure_noise", QuantityKind::PressureDifference)?,
        timing_noise_s: noise("timing_noise", QuantityKind::Si("s"))?,
    })
}

fn read_inputs(root: &Section<'_>) -> Result<Inputs, TomlFileError> {
    let Some(section) = root.section("inputs")? else { return Ok(Inputs::default()) };
    section.allow_only(&["pipe_pressure", "chamber_pressure"])?;
    let expected = "\"measured\" (drives the model) or \"simulated\"";
    let measured = |key: &str| match section.text(key, expected)? {
        None | Some("simulated") => Ok(false),
        Some("measured") => Ok(true),
        Some(other) => Err(section.wrong(key, format!("\"{other}\""), expected)),
    };
    Ok(Inputs { pipe_pressure: measured("pipe_pressure")?, chamber_pressure: measured("chamber_pressure")? })
}

fn planned(
    section: &Section<'_>,
    conditions: crate::RunConditions,
    number: usize,
) -> Result<PlannedRun, TomlFileError> {
    let meaning = "the path of a CSV file, or commands = [ { at = \"0 s\", close = true }, ... ] for a planned run";
    if !section.has("commands") {
        return Err(section.missing("file", meaning));
    }
    let mut commands: Vec<CommandEdge> = Vec::new();
    for edge in section.sections("commands")? {
        edge.allow_only(&["at", "close"])?;
        let time_s = edge
            .quantity("at", QuantityKind::Si("s"))?
            .ok_or_else(|| edge.missing("at", "the time of the command, such as \"0.6 s\""))?;
        let close = edge
            .boolean("close", "true or false")?
            .ok_or_else(|| edge.missing("close", "true where the valve is told to close, else false"))?;
        let after = commands.last().map_or(0.0, |last| last.time_s);
        let increases = commands.last().is_none_or(|last| time_s > last.time_s);
        if !(time_s.is_finite() && time_s >= 0.0 && increases) {
            return Err(edge.wrong("at", format!("{time_s} s"), format!("a time after {after} s")));
        }
        commands.push(CommandEdge { time_s, close });
    }
    let Some(last) = commands.last() else {
        return Err(section.wrong("commands", "an empty list", "at least one command"));
    };
    let end_s = section.quantity("end", QuantityKind::Si("s"))?;
    if end_s.is_some_and(|end_s| end_s <= last.time_s || !end_s.is_finite()) {
        return Err(section.wrong("end", "before the last command", "a time after the last command"));
    }
    let name = section.text("name", "a text")?.map_or_else(|| format!("planned run {number}"), str::to_owned);
    Ok(PlannedRun { name, conditions, commands, end_s })
}
