//! The stream of results in its formats.

use std::io::Write;

use prognoser::Prognosis;

use super::Ends;
use super::history::probability;
use crate::cli::StreamFormat;

/// Valves up to which the text ends with a sentence for each.
const SENTENCES: usize = 20;

/// Writes results one by one.
#[derive(Debug)]
pub struct Writer<W> {
    format: StreamFormat,
    out: W,
    /// Each line goes out at once.
    live: bool,
    lines: u64,
}

impl<W: Write> Writer<W> {
    /// A writer; with `live`, nothing waits in a buffer.
    pub fn new(format: StreamFormat, mut out: W, live: bool) -> anyhow::Result<Self> {
        match format {
            StreamFormat::Text => writeln!(
                out,
                "{:<12} {:>7}  {:<10} {:>11} {:>10} {:>10}  {:>19}  status",
                "valve", "cycle", "fault", "probability", "leak (mm²)", "RUL", "5 to 95 %"
            )?,
            StreamFormat::Csv => writeln!(
                out,
                "valve,cycle,fault,p_none,p_atmosphere,p_supply,leak_area_mm2,leak_rate_mm2_per_cycle,\
                 eol_cycle,rul_cycles,rul_p05,rul_p50,rul_p95,status"
            )?,
            StreamFormat::Json => write!(out, "[")?,
            StreamFormat::Jsonl => {}
        }
        if live {
            out.flush()?;
        }
        Ok(Self { format, out, live, lines: 0 })
    }

    /// Writes one result.
    pub fn write(&mut self, prognosis: &Prognosis) -> anyhow::Result<()> {
        match self.format {
            StreamFormat::Text => self.write_text(prognosis)?,
            StreamFormat::Csv => self.write_csv(prognosis)?,
            StreamFormat::Json => {
                self.out.write_all(if self.lines == 0 { b"\n  " } else { b",\n  " })?;
                serde_json::to_writer(&mut self.out, prognosis)?;
            }
            StreamFormat::Jsonl => {
                serde_json::to_writer(&mut self.out, prognosis)?;
                self.out.write_all(b"\n")?;
            }
        }
        self.lines += 1;
        if self.live {
            self.out.flush()?;
        }
        Ok(())
    }

    /// Ends the stream.
    pub fn finish(mut self, ends: &Ends) -> anyhow::Result<()> {
        match self.format {
            StreamFormat::Json => writeln!(self.out, "\n]")?,
            StreamFormat::Text if ends.len() <= SENTENCES => {
                writeln!(self.out)?;
                for end in ends.iter() {
                    writeln!(self.out, "{}", end.sentence())?;
                }
            }
            _ => {}
        }
        self.out.flush()?;
        Ok(())
    }

    fn write_text(&mut self, one: &Prognosis) -> anyhow::Result<()> {
        let number = |value: Option<f64>, digits: usize| {
            value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
        };
        let bounds = match (one.rul_p05, one.rul_p95) {
            (Some(low), Some(high)) => format!("{low:.1} to {high:.1}"),
            _ => "-".to_owned(),
        };
        writeln!(
            self.out,
            "{:<12} {:>7}  {:<10} {:>11} {:>10} {:>10}  {:>19}  {}",
            one.valve,
            one.cycle,
            one.fault.name(),
            number(probability(one), 3),
            number(one.leak_area_mm2, 4),
            number(one.rul_cycles, 1),
            bounds,
            one.status.name()
        )?;
        Ok(())
    }

    fn write_csv(&mut self, one: &Prognosis) -> anyhow::Result<()> {
        write_field(&mut self.out, &one.valve)?;
        write!(self.out, ",{},{}", one.cycle, one.fault.name())?;
        let share = |pick: fn(&prognoser::bayes::FaultProbability) -> f64| one.fault_probability.as_ref().map(pick);
        let values = [
            share(|all| all.none),
            share(|all| all.atmosphere),
            share(|all| all.supply),
            one.leak_area_mm2,
            one.leak_rate_mm2_per_cycle,
            one.eol_cycle,
            one.rul_cycles,
            one.rul_p05,
            one.rul_p50,
            one.rul_p95,
        ];
        for value in values {
            match value {
                Some(value) => write!(self.out, ",{value:?}")?,
                None => write!(self.out, ",")?,
            }
        }
        writeln!(self.out, ",{}", one.status.name())?;
        Ok(())
    }
}

/// A field of CSV, quoted where it has to be (RFC 4180).
fn write_field(out: &mut impl Write, text: &str) -> anyhow::Result<()> {
    if text.contains([',', '"', '\n', '\r']) {
        write!(out, "\"{}\"", text.replace('"', "\"\""))?;
    } else {
        write!(out, "{text}")?;
    }
    Ok(())
}
