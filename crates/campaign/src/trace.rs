//! From a CSV text to a trace and its command edges.

use checked_toml::{QuantityKind, Section, TomlFileError};
use column_source::{Clock, ColumnSource, Comments, NoticeKind, RecordProblem, Switch, find_table, without_unit};
use quantity::Dimension;

use crate::columns::{self, CHANNELS, Column, Mapping};
use crate::error::{DataError, DataProblem};
use crate::levels::plateaus;
use crate::noise::quantile;
use crate::outliers;
use crate::time_column;
use crate::types::{CommandEdge, Outlier, Trace, ValveFacts};
use crate::warning::Doubt;

/// Outliers that a warning names one by one.
const MOST_NAMED: usize = 4;

/// `command_from`: a channel that tells the command by a threshold.
#[derive(Debug, Clone)]
pub(crate) struct CommandFrom {
    channel: String,
    /// Whether the levels are shares of the way from where a recording's signal lies lowest to where it lies highest. Otherwise
    /// they are SI for a known channel, and in the column's own numbers for any other.
    in_shares: bool,
    threshold: f64,
    hysteresis: f64,
    /// A level above the threshold: what has been above it and falls below it is on its way down.
    release: Option<f64>,
    above_closes: bool,
}

/// A signal that moves by fewer steps of a typical row than this shows its noise only, no plateaus.
const LEAST_STEPS: f64 = 20.0;

impl CommandFrom {
    /// With levels in the signal's own numbers. A signal that hardly moves is never above.
    fn of(&self, signals: &[f64]) -> Self {
        if !self.in_shares {
            return self.clone();
        }
        let known: Vec<f64> = signals.iter().copied().filter(|signal| signal.is_finite()).collect();
        let (low, high) = plateaus(&known);
        let steps: Vec<f64> = known.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
        let moves = high - low > LEAST_STEPS * quantile(&steps, 0.5);
        let level = |share: f64| if moves { low + share * (high - low) } else { f64::INFINITY };
        Self {
            in_shares: false,
            threshold: level(self.threshold),
            hysteresis: self.hysteresis * (high - low),
            release: self.release.map(level),
            ..self.clone()
        }
    }

    /// What is said of a recording in which the channel never crosses the threshold.
    pub(crate) fn never_crossed(&self, (lowest, highest): (f64, f64)) -> DataProblem {
        let is_pressure = CHANNELS.iter().any(|(name, kind)| *name == self.channel && *kind == Dimension::Pressure);
        let (scale, unit) = if is_pressure { (1e-3, " kPa") } else { (1.0, "") };
        if self.in_shares {
            return DataProblem::HardlyMoves {
                channel: self.channel.clone(),
                range: [lowest * scale, highest * scale],
                unit,
            };
        }
        DataProblem::NeverCrossed {
            channel: self.channel.clone(),
            range: [lowest * scale, highest * scale],
            threshold: self.threshold * scale,
            hysteresis: self.hysteresis * scale,
            unit,
        }
    }
}

/// How traces are to be read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TraceFormat<'a> {
    pub mappings: &'a [Mapping],
    pub command_from: Option<&'a CommandFrom>,
    pub valve: &'a ValveFacts,
}

/// A trace with what is needed to judge it.
#[derive(Debug)]
pub(crate) struct ReadTrace {
    pub trace: Trace,
    /// The line of each row.
    pub lines: Vec<usize>,
    pub header_line: usize,
    pub position_column: String,
    /// Of chamber, pipe and supply pressure, where they are.
    pub pressure_columns: [Option<String>; 3],
    /// Lowest and highest reading of what tells the command.
    pub signal_range: (f64, f64),
    /// Why the file would be refused, did it not have another time column than the one that `[columns]` names.
    pub without_named_time: Option<DataError>,
    /// What looks wrong, with its line.
    pub doubts: Vec<(usize, Doubt)>,
}

/// Reads `command_from`.
pub(crate) fn read_command_from(root: &Section<'_>, valve: &ValveFacts) -> Result<Option<CommandFrom>, TomlFileError> {
    let Some(section) = root.section("command_from")? else { return Ok(None) };
    section.allow_only(&["channel", "threshold", "hysteresis", "release", "above"])?;
    let channel = section
        .text("channel", "the name of a channel or a column")?
        .ok_or_else(|| section.missing("channel", "the name of a channel or a column"))?;
    let dimension = CHANNELS.iter().find(|(name, _)| *name == channel).map(|(_, dimension)| *dimension);
    let (level, width) = match dimension {
        Some(Dimension::Pressure) => (
            QuantityKind::Pressure { ambient_pressure_pa: valve.ambient_pressure_pa },
            QuantityKind::PressureDifference,
        ),
        Some(dimension) => (QuantityKind::Si(dimension.si_unit()), QuantityKind::Si(dimension.si_unit())),
        None => (QuantityKind::Si(""), QuantityKind::Si("")),
    };
    let in_shares = matches!(section.text("threshold", "a level"), Ok(Some(text)) if text.trim_end().ends_with('%'));
    let quantity = |key: &str, kind: QuantityKind| {
        if in_shares && section.has(key) { share(&section, key).map(Some) } else { section.quantity(key, kind) }
    };
    let threshold = quantity("threshold", level)?
        .ok_or_else(|| section.missing("threshold", "the level that parts open from close"))?;
    let expected = "\"close\" or \"open\": what is commanded above the threshold";
    let above_closes = match section.text("above", expected)? {
        None | Some("close") => true,
        Some("open") => false,
        Some(other) => return Err(section.wrong("above", format!("\"{other}\""), expected)),
    };
    let hysteresis = quantity("hysteresis", width)?.unwrap_or(0.0);
    if !(threshold.is_finite() && hysteresis.is_finite() && hysteresis >= 0.0) {
        return Err(section.wrong("hysteresis", hysteresis.to_string(), "a finite level, and a width of 0 or more"));
    }
    let release = quantity("release", level)?;
    if let Some(release) = release.filter(|release| !release.is_finite() || *release <= threshold + hysteresis) {
        return Err(section.wrong(
            "release",
            release.to_string(),
            "a level above the threshold by more than the hysteresis",
        ));
    }
    Ok(Some(CommandFrom { channel: channel.to_owned(), in_shares, threshold, hysteresis, release, above_closes }))
}

/// A text such as "20 %", between 0 and 1.
fn share(section: &Section<'_>, key: &str) -> Result<f64, TomlFileError> {
    let expected = "a share such as \"20 %\", from 0 up to 100 %, as the threshold is one";
    let text = section.text(key, expected)?.unwrap_or_default();
    let percent = text.trim().strip_suffix('%').and_then(|number| number.trim().parse::<f64>().ok());
    let percent = percent.filter(|percent| (0.0..100.0).contains(percent));
    percent.map(|percent| percent / 100.0).ok_or_else(|| section.wrong(key, format!("\"{text}\""), expected))
}

/// The columns of one file.
struct Columns {
    time: Column,
    command: Column,
    position: Column,
    pressures: [Option<Column>; 3],
}

fn find_columns(source: &dyn ColumnSource, format: &TraceFormat<'_>) -> Result<(Columns, Vec<Doubt>), DataError> {
    let find = |channel: &'static str| {
        let dimension = CHANNELS.iter().find(|(name, _)| *name == channel).map_or(Dimension::Pure, |(_, found)| *found);
        let mapping = format.mappings.iter().find(|mapping| mapping.channel == channel);
        let ambient_pa = format.valve.ambient_pressure_pa;
        columns::find(source, (channel, dimension), mapping, ambient_pa)
    };
    let hint = "or its name in [columns]";
    let time = find("time")?.ok_or_else(|| columns::missing(source, "time_s", &format!("time_s, time_ms, {hint}")))?;
    let position = find("position")?
        .ok_or_else(|| columns::missing(source, "position_mm", &format!("position_mm, position_in, {hint}")))?;
    let command = match format.command_from {
        None => find("command")?.ok_or_else(|| {
            let hint =
                "command (0 open, 1 close), its name in [columns], or command_from with a channel and a threshold";
            columns::missing(source, "command", hint)
        })?,
        Some(from) => {
            let known = CHANNELS.iter().find(|(name, _)| *name == from.channel);
            let found = if let Some((channel, _)) = known {
                find(channel)?
            } else {
                let mapping = Mapping::raw(&from.channel);
                columns::find(source, ("command", Dimension::Pure), Some(&mapping), 0.0)?
            };
            found.ok_or_else(|| columns::missing(source, &from.channel, "the channel of command_from"))?
        }
    };
    let pressures = [find("chamber_pressure")?, find("pipe_pressure")?, find("supply_pressure")?];
    let mut read = vec![time.index, position.index, command.index];
    read.extend(pressures.iter().flatten().map(|column| column.index));
    let known = ["chamber_pressure_kpa", "pipe_pressure_kpa", "supply_pressure_kpa"];
    let left_out = |channel: &str| format.mappings.iter().any(|mapping| mapping.left_out && mapping.channel == channel);
    let known = known.into_iter().filter(|name| !left_out(without_unit(name))).collect::<Vec<_>>();
    let doubts = columns::look_alikes(source, &read, &known);
    Ok((Columns { time, command, position, pressures }, doubts))
}

/// Reads a trace.
pub(crate) fn read(bytes: &[u8], file: &str, format: &TraceFormat<'_>) -> Result<ReadTrace, DataError> {
    let mut source = column_source::open(bytes, file, Comments::WhereNoNames)?;
    let rows = bytes.len() / 12;
    let Some((column, refusal)) = time_column::in_place(bytes, file, format.mappings)? else {
        return read_source(source.as_mut(), rows, format);
    };
    let (time, others): (Vec<_>, Vec<_>) =
        format.mappings.iter().cloned().partition(|mapping| mapping.channel == "time");
    let mut own = Mapping::raw(&column);
    "time".clone_into(&mut own.channel);
    let mappings: Vec<Mapping> = others.into_iter().chain([own]).collect();
    let mut read = read_source(source.as_mut(), rows, &TraceFormat { mappings: &mappings, ..*format })?;
    if let Some(named) = time.first().and_then(Mapping::named) {
        read.doubts.insert(0, (read.header_line, Doubt::OtherTime { column, named: named.to_owned() }));
        read.without_named_time = Some(refusal);
    }
    Ok(read)
}

/// The time of the row at hand, s: a number in the column's unit, or a timestamp.
fn time_s(source: &dyn ColumnSource, column: Column, clock: &mut Clock, line: usize) -> Result<f64, DataError> {
    let stamp = |clock: &mut Clock| clock.seconds(&source.field(column.index), line);
    if clock.notice().is_some()
        && let Some(time_s) = stamp(clock)
    {
        return Ok(time_s);
    }
    match source.number(column.index) {
        Ok(number) => Ok(column.to_si(number)),
        Err(error) => stamp(clock).ok_or_else(|| match error.problem {
            RecordProblem::NotANumber { column, found } => {
                DataError::new(&error.file, error.line, DataProblem::NotATime { column, found })
            }
            _ => error.into(),
        }),
    }
}

/// What tells the command, as a number: one, or a word such as ON.
fn signal(source: &dyn ColumnSource, column: usize) -> Result<f64, DataError> {
    let word = || Switch::parse(&source.field(column)).map(Switch::number);
    source.number(column).or_else(|error| word().ok_or_else(|| error.into()))
}

/// Reads a trace of any format; `rows` is about how many it has.
pub(crate) fn read_source(
    source: &mut dyn ColumnSource,
    rows: usize,
    format: &TraceFormat<'_>,
) -> Result<ReadTrace, DataError> {
    let (columns, doubts) = find_table(
        source,
        |source| find_columns(source, format),
        |source| columns::count(source, &CHANNELS, format.mappings),
    )?;
    let header_line = source.header_line();
    let mut doubts: Vec<(usize, Doubt)> = doubts.into_iter().map(|doubt| (header_line, doubt)).collect();
    let mut trace = Trace {
        time_s: Vec::with_capacity(rows),
        command_close: Vec::with_capacity(rows),
        position_m: Vec::with_capacity(rows),
        ..Trace::default()
    };
    let mut pressures = columns.pressures.map(|column| column.map(|_| Vec::with_capacity(rows)));
    let mut lines = Vec::with_capacity(rows);
    let mut without_time = 0;
    let (mut signals, mut clock) = (Vec::with_capacity(rows), Clock::default());
    while let Some(line) = source.next_row()? {
        let time_s = time_s(source, columns.time, &mut clock, line)?;
        if time_s.is_nan() {
            without_time += 1;
            continue;
        }
        trace.time_s.push(time_s);
        signals.push(columns.command.to_si(signal(source, columns.command.index)?));
        trace.position_m.push(columns.position.to_si(source.number(columns.position.index)?));
        for (column, values) in columns.pressures.iter().zip(&mut pressures) {
            if let (Some(column), Some(values)) = (column, values) {
                values.push(column.to_si(source.number(column.index)?));
            }
        }
        lines.push(line);
    }
    if trace.time_s.len() < 2 {
        let problem = DataProblem::TooFewRows { rows: trace.time_s.len(), expected: 2 };
        return Err(DataError::new(source.file(), header_line, problem));
    }
    if newest_first(&trace.time_s) {
        for values in
            [&mut trace.time_s, &mut signals, &mut trace.position_m].into_iter().chain(pressures.iter_mut().flatten())
        {
            values.reverse();
        }
        lines.reverse();
        doubts.push((header_line, Doubt::Read(NoticeKind::NewestFirst)));
    }
    if let Some(row) = (1..lines.len()).find(|row| trace.time_s[*row] <= trace.time_s[row - 1]) {
        let (found_s, before_s) = (trace.time_s[row], trace.time_s[row - 1]);
        return Err(DataError::new(source.file(), lines[row], DataProblem::TimeNotIncreasing { found_s, before_s }));
    }
    let first_s = trace.time_s[0];
    for time_s in &mut trace.time_s {
        *time_s -= first_s;
    }
    let (mut without_command, mut command) = (0, false);
    let command_from = format.command_from.map(|from| from.of(&signals));
    let mut level = command_from.as_ref().map_or(Level::Low, |from| Level::before(&signals, from));
    let mut signal_range = (f64::INFINITY, f64::NEG_INFINITY);
    for (&signal, &line) in signals.iter().zip(&lines) {
        if signal.is_nan() {
            without_command += 1;
        } else {
            command = match &command_from {
                Some(from) => {
                    level = level.next(signal, trace.command_close.is_empty(), from);
                    (level == Level::High || level == Level::Rising) == from.above_closes
                }
                None if signal == 1.0 => true,
                None if signal == 0.0 => false,
                None => return Err(DataError::new(source.file(), line, DataProblem::CommandValue { found: signal })),
            };
            signal_range = (signal_range.0.min(signal), signal_range.1.max(signal));
        }
        trace.command_close.push(command);
    }
    if without_time > 0 {
        doubts.push((header_line, Doubt::RowsWithoutTime { rows: without_time }));
    }
    if without_command > 0 {
        doubts.push((header_line, Doubt::RowsWithoutCommand { rows: without_command }));
    }
    let notices = source.notices().iter().chain(clock.notice());
    doubts.extend(notices.map(|notice| (notice.line, Doubt::Read(notice.kind.clone()))));
    let [chamber, pipe, supply] = pressures;
    (trace.chamber_pressure_pa, trace.pipe_pressure_pa, trace.supply_pressure_pa) = (chamber, pipe, supply);
    doubts.extend(take_outliers(&mut trace, &lines));
    let pressure_columns = columns.pressures.map(|column| Some(source.headings()[column?.index].name.clone()));
    let position_column = source.headings()[columns.position.index].name.clone();
    Ok(ReadTrace {
        trace,
        lines,
        header_line,
        position_column,
        pressure_columns,
        signal_range,
        without_named_time: None,
        doubts,
    })
}

/// Whether rows run from the newest to the oldest, as some historians export them.
pub(crate) fn newest_first(time_s: &[f64]) -> bool {
    time_s.len() > 2 && time_s.windows(2).all(|pair| pair[1] < pair[0])
}

/// Takes readings that no motion can have made out of every channel.
fn take_outliers(trace: &mut Trace, lines: &[usize]) -> Vec<(usize, Doubt)> {
    let edges_s: Vec<f64> = edges(trace).iter().map(|edge| edge.time_s).collect();
    let Trace { time_s, position_m, chamber_pressure_pa, pipe_pressure_pa, supply_pressure_pa, outliers, .. } = trace;
    let channels = [
        ("position", "mm", 1e-3, Some(position_m)),
        ("chamber pressure", "kPa", 1e3, chamber_pressure_pa.as_mut()),
        ("pipe pressure", "kPa", 1e3, pipe_pressure_pa.as_mut()),
        ("supply pressure", "kPa", 1e3, supply_pressure_pa.as_mut()),
    ];
    let mut doubts = Vec::new();
    for (channel, unit, scale, values) in channels {
        let Some(values) = values else { continue };
        for rows in outliers::stuck(time_s, values) {
            let first = rows.start;
            let value = format!("{:.4} {unit}", values[first] / scale);
            let doubt = Doubt::Stuck { channel, value, rows: rows.len(), from_s: time_s[first] };
            doubts.push((lines[first], doubt));
            for row in rows {
                outliers.push(Outlier { channel, row, line: lines[row], time_s: time_s[row], value: values[row] });
                values[row] = f64::NAN;
            }
        }
        let found = outliers::find(time_s, values, &edges_s);
        if found.too_many > 0 {
            doubts.push((lines[0], Doubt::Jumpy { channel, count: found.too_many, of: values.len() }));
        }
        let Some(&first) = found.rows.first() else { continue };
        let mut named: Vec<String> = Vec::new();
        for &row in found.rows.iter().take(MOST_NAMED) {
            let (time, value) = (time_s[row], values[row] / scale);
            named.push(format!("{value:.4} {unit} at {time:.4} s (line {})", lines[row]));
        }
        if found.rows.len() > MOST_NAMED {
            named.push(format!("and {} more", found.rows.len() - MOST_NAMED));
        }
        let (count, named) = (found.rows.len(), named.join(", "));
        doubts.push((lines[first], Doubt::Outliers { channel, count, named }));
        for row in found.rows {
            outliers.push(Outlier { channel, row, line: lines[row], time_s: time_s[row], value: values[row] });
            values[row] = f64::NAN;
        }
    }
    doubts
}

/// Where a signal that tells the command stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Level {
    /// Below the threshold.
    Low,
    /// Above the threshold, and on its way up.
    Rising,
    /// Where it is released from, if it falls.
    High,
    /// Still above the threshold, and on its way down.
    Released,
}

/// A signal that falls all the way has lost this share of it halfway, less what noise and gas that chokes take away from a half.
const FALLING: f64 = 0.4;

impl Level {
    /// Where a record begins. One that begins while a signal is already on its way down shows no plateau before it falls below the
    /// threshold: halfway there it has lost half of what it loses, or more.
    fn before(signals: &[f64], from: &CommandFrom) -> Self {
        let Some(release) = from.release else { return Self::Low };
        let known: Vec<f64> = signals.iter().copied().filter(|signal| signal.is_finite()).collect();
        let Some(end) = known.iter().position(|signal| *signal < from.threshold || *signal > release) else {
            return Self::Low;
        };
        let lost = |row: usize| known[0] - known[row];
        if known[end] < from.threshold && lost(end / 2) >= FALLING * lost(end) { Self::Released } else { Self::Low }
    }

    /// Where a reading leads. Within half the hysteresis of a level it stays as it is.
    fn next(self, signal: f64, first: bool, from: &CommandFrom) -> Self {
        let half = if first { 0.0 } else { 0.5 * from.hysteresis };
        let is_above = |level: f64| signal > level + half;
        let is_below = |level: f64| signal < level - half;
        if from.release.map_or(is_above(from.threshold), is_above) {
            return Self::High;
        }
        match self {
            _ if first && !is_above(from.threshold) || is_below(from.threshold) => Self::Low,
            Self::Low if is_above(from.threshold) => Self::Rising,
            Self::High if from.release.is_some_and(is_below) => Self::Released,
            as_it_is => as_it_is,
        }
    }
}

/// The command edges of a trace: each at the first row with the new value, the first one at 0 s
/// where the first row says close.
pub(crate) fn edges(trace: &Trace) -> Vec<CommandEdge> {
    let mut edges = Vec::new();
    let mut before = false;
    for (&time_s, &close) in trace.time_s.iter().zip(&trace.command_close) {
        if close != before {
            edges.push(CommandEdge { time_s, close });
            before = close;
        }
    }
    edges
}
