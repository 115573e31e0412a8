//! The stream of results in its formats.

use std::io::Write;

use leak_table::Fault;
use prognoser::{FaultCall, Prognosis};
use quantity::Dimension;

use super::Ends;
use crate::cli::StreamFormat;
use crate::output::{manner, paint, push_number, told_in};
use answers::figures::life::{bounds_words, probability};
use answers::prognosis::document;

/// Decimals of cycles, probabilities and areas, which the prognosis itself is
/// rounded to.
const CYCLE_DECIMALS: usize = 4;
const PROBABILITY_DECIMALS: usize = 9;
const AREA_DECIMALS: usize = 9;
const SEVERITY_DECIMALS: usize = 6;

/// Formats rows; what stands between them is the [`Writer`]'s.
#[derive(Debug, Clone, Copy)]
pub struct RowFormat {
    /// The format.
    pub format: StreamFormat,
    /// Whether text has every row.
    pub rows_as_text: bool,
}

impl RowFormat {
    /// Whether rows are written one by one.
    pub fn tells_rows(self) -> bool {
        self.format != StreamFormat::Text || self.rows_as_text
    }

    /// Appends a row, without what separates it from others.
    pub fn row(self, out: &mut Vec<u8>, one: &Prognosis) -> anyhow::Result<()> {
        match self.format {
            StreamFormat::Text if self.rows_as_text => text(out, one)?,
            StreamFormat::Text => {}
            StreamFormat::Csv => csv(out, one),
            StreamFormat::Json | StreamFormat::Jsonl => serde_json::to_writer(out, &document(one))?,
        }
        Ok(())
    }
}

/// Writes formatted rows one by one.
pub struct Writer {
    format: RowFormat,
    out: Box<dyn Write>,
    lines: u64,
}

impl Writer {
    /// A writer, which begins with what stands above the rows.
    pub fn new(format: RowFormat, mut out: Box<dyn Write>) -> anyhow::Result<Self> {
        match format.format {
            StreamFormat::Text if format.rows_as_text => writeln!(
                out,
                "{:<12} {:>7}  {:<11} {:>11} {:>10} {:>10}  {:>19}  status",
                "valve",
                "cycle",
                "fault",
                "probability",
                format!("leak ({})", told_in(Dimension::Area).name()),
                "RUL",
                "5 to 95 %"
            )?,
            StreamFormat::Csv => {
                let others: Vec<String> =
                    others().map(|fault| format!("p_{}", fault.name().replace('-', "_"))).collect();
                writeln!(
                    out,
                    "valve,cycle,fault,p_none,p_atmosphere,p_supply,leak_area_mm2,leak_rate_mm2_per_cycle,\
                     eol_cycle,rul_cycles,rul_p05,rul_p50,rul_p95,status,{},severity,replace_by_cycle,eol_time,\
                     replace_by,fault_group,caveat",
                    others.join(",")
                )?;
            }
            StreamFormat::Json => write!(out, "[")?,
            StreamFormat::Jsonl | StreamFormat::Text => {}
        }
        Ok(Self { format, out, lines: 0 })
    }

    /// A writer that goes on below rows that an earlier one wrote.
    pub fn below(format: RowFormat, out: Box<dyn Write>, rows: u64) -> Self {
        Self { format, out, lines: rows }
    }

    /// Rows so far.
    pub fn rows(&self) -> u64 {
        self.lines
    }

    /// Whether the end of the stream tells how valves stand.
    pub fn tells_ends(&self) -> bool {
        self.format.format == StreamFormat::Text
    }

    /// Hands on what was written.
    pub fn flush(&mut self) -> anyhow::Result<()> {
        Ok(self.out.flush()?)
    }

    /// Writes a formatted row.
    pub fn write(&mut self, row: &[u8]) -> anyhow::Result<()> {
        match self.format.format {
            StreamFormat::Json => {
                self.out.write_all(if self.lines == 0 { b"\n  " } else { b",\n  " })?;
                self.out.write_all(row)?;
            }
            StreamFormat::Text if !self.format.rows_as_text => {}
            _ => {
                self.out.write_all(row)?;
                self.out.write_all(b"\n")?;
            }
        }
        self.lines += 1;
        Ok(())
    }

    /// Ends the stream.
    pub fn finish(mut self, ends: &Ends) -> anyhow::Result<()> {
        match self.format.format {
            StreamFormat::Json => writeln!(self.out, "\n]")?,
            StreamFormat::Text if ends.len() == 0 => writeln!(self.out, "0 valves")?,
            StreamFormat::Text => {
                if self.format.rows_as_text {
                    writeln!(self.out)?;
                }
                let valves = if ends.len() == 1 { "1 valve".to_owned() } else { format!("{} valves", ends.len()) };
                let coloured = manner().coloured;
                let counts = ends.counts().into_iter().map(|cell| paint(&cell.text, cell.tone.filter(|_| coloured)));
                writeln!(self.out, "{valves}: {}\n", counts.collect::<Vec<_>>().join(", "))?;
                self.out.write_all(ends.table().render().as_bytes())?;
            }
            StreamFormat::Jsonl | StreamFormat::Csv => {}
        }
        self.out.flush()?;
        Ok(())
    }
}

fn text(out: &mut Vec<u8>, one: &Prognosis) -> anyhow::Result<()> {
    let number =
        |value: Option<f64>, digits: usize| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"));
    let bounds = match (one.rul_p05, one.rul_p95) {
        (Some(low), Some(high)) => bounds_words([low, high]),
        _ => "-".to_owned(),
    };
    write!(
        out,
        "{:<12} {:>7}  {:<11} {:>11} {:>10} {:>10}  {:>19}  {}",
        one.valve,
        one.cycle,
        one.fault.name(),
        number(probability(one), 3),
        one.leak_area_mm2.map_or_else(|| "-".to_owned(), |area| told_in(Dimension::Area).number(1e-6 * area, 4)),
        number(one.rul_cycles, 1),
        bounds,
        one.status.name()
    )?;
    Ok(())
}

/// The faults of the catalogue beside the leaks, whose columns came later.
fn others() -> impl Iterator<Item = FaultCall> {
    FaultCall::catalogue().filter(|fault| fault.fault().is_none())
}

fn csv(out: &mut Vec<u8>, one: &Prognosis) {
    field(out, &one.valve);
    out.push(b',');
    // Writing to memory cannot fail.
    let _ = write!(out, "{}", one.cycle);
    out.push(b',');
    out.extend_from_slice(one.fault.name().as_bytes());
    let number = |out: &mut Vec<u8>, value: Option<f64>, decimals: usize| {
        out.push(b',');
        if let Some(value) = value {
            push_number(out, value, decimals);
        }
    };
    let share = |fault: FaultCall| one.fault_probability.as_ref().map(|all| all.of(fault));
    for fault in [FaultCall::None, Fault::Atmosphere.into(), Fault::Supply.into()] {
        number(out, share(fault), PROBABILITY_DECIMALS);
    }
    for area in [one.leak_area_mm2, one.leak_rate_mm2_per_cycle] {
        number(out, area, AREA_DECIMALS);
    }
    for cycles in [one.eol_cycle, one.rul_cycles, one.rul_p05, one.rul_p50, one.rul_p95] {
        number(out, cycles, CYCLE_DECIMALS);
    }
    out.push(b',');
    out.extend_from_slice(one.status.name().as_bytes());
    for fault in others() {
        number(out, share(fault), PROBABILITY_DECIMALS);
    }
    number(out, one.severity, SEVERITY_DECIMALS);
    out.push(b',');
    if let Some(by) = one.replace_by_cycle {
        let _ = write!(out, "{by}");
    }
    for date in [&one.eol_time, &one.replace_by] {
        out.push(b',');
        out.extend_from_slice(date.as_deref().unwrap_or_default().as_bytes());
    }
    out.push(b',');
    let group: Vec<&str> = one.fault_group.iter().map(|fault| fault.name()).collect();
    out.extend_from_slice(group.join(" ").as_bytes());
    out.push(b',');
    field(out, one.caveat.as_deref().unwrap_or_default());
}

/// A field of CSV, quoted where it has to be (RFC 4180).
fn field(out: &mut Vec<u8>, text: &str) {
    if text.contains([',', '"', '\n', '\r']) {
        out.push(b'"');
        out.extend_from_slice(text.replace('"', "\"\"").as_bytes());
        out.push(b'"');
    } else {
        out.extend_from_slice(text.as_bytes());
    }
}
