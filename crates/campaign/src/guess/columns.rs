//! Which column is which, and in which unit.

use column_source::{listed, without_unit};
use quantity::{Dimension, Reference, Unit};

use super::{ColumnGuess, Hints, Recording, ThresholdGuess, Understanding, Unknown};
use crate::levels::{increases, plateaus, two_levels};
use crate::noise::quantile;
use crate::words::{self, CHANNELS};

/// A vented pipe keeps less than this share of the highest pressure above the atmosphere.
const MOST_LEFT: f64 = 0.5;
/// A motion in mm over at least this share of the stroke is one that somebody would record.
const PART_AT_LEAST: f64 = 0.5;
/// What transmitters give at the ends of their range: mA, V, percent.
const SIGNALS: [(f64, f64); 8] =
    [(4.0, 20.0), (0.0, 20.0), (0.0, 10.0), (2.0, 10.0), (1.0, 5.0), (0.0, 5.0), (0.0, 100.0), (0.0, 1.0)];
/// How near an end is to that of a signal, in ranges of the signal.
const NEAR_SIGNAL: f64 = 0.03;
/// How far outside the stops a position in mm or in percent may lie, in strokes.
const PART_OUTSIDE: f64 = 0.12;
/// What each channel measures; a temperature is recognised so that it is taken for nothing else.
fn dimension(channel: &str) -> Dimension {
    match channel {
        "time" => Dimension::Time,
        "position" => Dimension::Length,
        "command" => Dimension::Pure,
        "temperature" => Dimension::Temperature,
        _ => Dimension::Pressure,
    }
}

/// Gives columns to channels.
pub(super) fn assign(recordings: &[&Recording], hints: &Hints, found: &mut Understanding) {
    let first = recordings[0];
    let mut free: Vec<usize> = (0..first.names.len()).filter(|index| is_used(first, *index)).collect();
    for (channel, name) in &hints.columns {
        let Some(words) = CHANNELS.iter().find(|words| words.channel == channel) else { continue };
        if let Some(index) = first.columns_named(name).first().copied() {
            free.retain(|other| *other != index);
            take(recordings, hints, index, words.channel, "as you said", found);
        }
    }
    for channel in &hints.left_out {
        found.said.push(format!("{channel}: left out, as you said"));
    }
    for words in &CHANNELS {
        let taken = found.columns.iter().any(|column| column.channel == words.channel);
        if taken || hints.left_out.iter().any(|channel| channel == words.channel) {
            continue;
        }
        let fits = |index: &usize| (*index, fit(recordings, *index, words));
        let scores: Vec<(usize, u32)> = free.iter().map(fits).filter(|(_, score)| *score > 0).collect();
        let best = scores.iter().map(|(_, score)| *score).max().unwrap_or(0);
        let mut winners = scores.iter().filter(|(_, score)| *score == best).map(|(index, _)| *index);
        let (winner, second) = (winners.next(), winners.next());
        match (winner, second) {
            (Some(index), None) => {
                free.retain(|other| *other != index);
                if words.channel != "temperature" {
                    take(recordings, hints, index, words.channel, "by its name, unit and shape", found);
                }
            }
            (Some(index), Some(_)) if words.channel == "time" => {
                free.retain(|other| *other != index);
                take(recordings, hints, index, words.channel, "the first that increases", found);
            }
            (Some(index), Some(second)) => {
                let (one, other) = (&first.names[index], &first.names[second]);
                found.said.push(format!("{}: \"{one}\" and \"{other}\" both may be it", words.channel));
            }
            (None, _) => {}
        }
    }
    let has = |found: &Understanding, channel: &str| found.columns.iter().any(|column| column.channel == channel);
    if !has(found, "command") {
        command_from_pressure(recordings, hints.ambient_pressure_pa, found);
    }
    for (channel, unknown) in [("time", Unknown::Time), ("position", Unknown::Position)] {
        if !has(found, channel) {
            found.unknown.push(unknown);
        }
    }
    if !has(found, "command") && found.threshold.is_none() {
        found.unknown.push(Unknown::Command);
    }
    if !free.is_empty() {
        let left = listed(free.iter().map(|index| first.names[*index].as_str()));
        let pressure = free.iter().find(|index| {
            recordings[0].unit(**index).is_some_and(|unit| unit.measures(Dimension::Pressure))
                && is_used(first, **index)
        });
        let hint = pressure.map_or_else(String::new, |index| {
            let name = without_unit(&first.bare[*index]);
            format!(
                "; where a pressure is taken is not known: --column chamber_pressure=\"{name}\", or pipe_pressure or \
                 supply_pressure, reads it"
            )
        });
        found.said.push(format!("not read: {left}{hint}"));
    }
}

/// Whether a column holds numbers that say something.
fn is_used(recording: &Recording, index: usize) -> bool {
    recording.columns[index].iter().filter(|value| value.is_finite()).count() * 2 > recording.columns[index].len()
}

/// How well a column fits a channel, 0 for not at all.
fn fit(recordings: &[&Recording], index: usize, words: &words::Words) -> u32 {
    let first = recordings[0];
    let (name, values) = (&first.bare[index], &first.columns[index]);
    let kind = dimension(words.channel);
    let unit = first.unit(index);
    let fitting = unit.as_ref().map(|unit| unit.measures(kind) && !unit.text().is_empty());
    let by_name = words::fit(name, words);
    match words.channel {
        "time" => {
            let usable = fitting != Some(false) || first.timestamps[index];
            if usable && increases(values) { 1 + 2 * by_name + u32::from(fitting == Some(true)) } else { 0 }
        }
        "command" => {
            let levels = two_levels(values);
            // Volts and unitless signals are as good as bits.
            let usable =
                unit.as_ref().is_none_or(|unit| unit.dimension() == Some(Dimension::Pure)) && fitting != Some(true);
            let bits = levels == Some((0.0, 1.0));
            if levels.is_none() || !usable || words::is_switch(name) || by_name == 0 && !bits {
                0
            } else {
                1 + 2 * by_name + u32::from(bits)
            }
        }
        "position" => {
            let moves = two_levels(values) != Some((0.0, 1.0)) && !increases(values);
            if fitting == Some(false) && unit.as_ref().is_some_and(|unit| unit.dimension() != Some(Dimension::Pure)) {
                0
            } else if moves && (by_name > 0 || fitting == Some(true)) {
                2 * by_name + 3 * u32::from(fitting == Some(true))
            } else {
                0
            }
        }
        _ => {
            // A pressure that nobody names could be any of the three: the word decides.
            if by_name == 0 || fitting == Some(false) { 0 } else { 2 * by_name + u32::from(fitting == Some(true)) }
        }
    }
}

/// Whether the reader takes the column's unit from its heading by itself.
fn reader_knows(recording: &Recording, index: usize, unit: &Unit, kind: Dimension) -> bool {
    unit.measures(kind) && unit.reference() != Reference::Ambiguous && recording.unit(index).is_some()
}

fn take(
    recordings: &[&Recording],
    hints: &Hints,
    index: usize,
    channel: &'static str,
    why: &str,
    found: &mut Understanding,
) {
    let first = recordings[0];
    let name = first.names[index].clone();
    let written = first.unit(index).filter(|unit| unit.measures(dimension(channel)) && !unit.text().is_empty());
    let mut column = ColumnGuess {
        channel,
        index,
        name: name.clone(),
        call: name.clone(),
        unit: None,
        scale: 1.0,
        offset: 0.0,
        factor: 1.0,
    };
    let said = match channel {
        "time" if first.timestamps[index] => "timestamps".to_owned(),
        "command" if first.words[index].is_some() => "of words that stand for 0 and 1".to_owned(),
        "command" => {
            let (low, high) = two_levels(&first.columns[index]).unwrap_or((0.0, 1.0));
            format!("which holds {low} and {high}")
        }
        _ => match written {
            _ if let Some(unit) = stated(hints, channel) => {
                column.factor = unit.difference_to_si(1.0);
                column.unit = Some(unit.text().to_owned());
                format!("in {}, as you said", unit.text())
            }
            Some(unit) if reader_knows(first, index, &unit, dimension(channel)) => {
                column.factor = unit.difference_to_si(1.0);
                column.offset = 0.0;
                let added = format!("; {} kPa of ambient pressure are added", hints.ambient_pressure_pa / 1e3);
                let gauge = unit.reference() == Reference::Gauge;
                format!("in {}, as it says{}", unit.text(), if gauge { added.as_str() } else { "" })
            }
            written => match guessed_unit(recordings, hints, index, channel, written.as_ref()) {
                Some((unit, reason)) => {
                    column.factor = unit.difference_to_si(1.0);
                    let words = format!("in {}: {reason}", unit.text());
                    column.unit = Some(unit.text().to_owned());
                    words
                }
                None if channel == "position" => {
                    let scaled = if may_be_mm(first, hints, index) {
                        Err(
                            "in a unit that it does not say: in mm it would move over a part of the stroke alone, in any \
                             other its ends may be the stops",
                        )
                    } else {
                        scaled_to_stroke(recordings, hints, index, &mut column).ok_or("in a unit that it does not say")
                    };
                    scaled.unwrap_or_else(|why| {
                        found.unknown.push(Unknown::PositionUnit);
                        why.to_owned()
                    })
                }
                None => {
                    // The reader would take it for kPa.
                    found
                        .unknown
                        .extend((dimension(channel) == Dimension::Pressure).then_some(Unknown::PressureUnit(channel)));
                    match &written {
                        Some(unit) if unit.reference() == Reference::Ambiguous => {
                            format!("in {}, which does not say from where it counts", unit.text())
                        }
                        _ => "in a unit that it does not say".to_owned(),
                    }
                }
            },
        },
    };
    found.said.push(format!("{channel}: column \"{name}\" ({why}), {said}"));
    if channel == "command" {
        command_levels(&first.columns[index], &column, found);
    }
    found.columns.push(column);
}

/// A command of two other levels than 0 and 1 goes by a threshold.
fn command_levels(values: &[f64], column: &ColumnGuess, found: &mut Understanding) {
    let Some((low, high)) = two_levels(values) else { return };
    if (low, high) != (0.0, 1.0) {
        found.threshold = Some(ThresholdGuess {
            channel: column.name.clone(),
            threshold: rounded(0.5 * (low + high)),
            hysteresis: rounded(0.2 * (high - low)),
            release: None,
            is_pressure: false,
            above_closes: true,
        });
    }
}

/// Three significant digits: a threshold needs no more.
fn rounded(number: f64) -> f64 {
    format!("{number:.2e}").parse().unwrap_or(number)
}

/// The unit that the numbers themselves suggest, with the reason.
fn guessed_unit(
    recordings: &[&Recording],
    hints: &Hints,
    index: usize,
    channel: &str,
    written: Option<&Unit>,
) -> Option<(Unit, String)> {
    let values = &recordings[0].columns[index];
    let unit = |text: &str| Unit::parse(text).ok();
    match dimension(channel) {
        Dimension::Time => {
            let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let step = quantile(&steps, 0.5);
            let (text, reason) =
                if step >= 0.5 { ("ms", "rows would be too far apart for s") } else { ("s", "the usual unit") };
            Some((unit(text)?, format!("{reason} (a step of {})", rounded(step))))
        }
        Dimension::Length => {
            let stroke_m = hints.stroke_m?;
            let (low, high) = plateaus(values);
            let near = |text: &&str| {
                let ratio = (high - low) * unit(text).map_or(0.0, |unit| unit.to_si(1.0)) / stroke_m;
                (0.85..1.12).contains(&ratio)
            };
            let text = ["mm", "in", "cm", "m", "um"].into_iter().find(near)?;
            Some((unit(text)?, format!("it spans {:.4} then, the stroke being {:.4} mm", high - low, stroke_m * 1e3)))
        }
        Dimension::Pressure => pressure_unit(recordings, hints, index, channel, written),
        _ => None,
    }
}

/// Gauge or absolute, and in which unit: a vented chamber or pipe is at the atmosphere.
fn pressure_unit(
    recordings: &[&Recording],
    hints: &Hints,
    index: usize,
    channel: &str,
    written: Option<&Unit>,
) -> Option<(Unit, String)> {
    // The supply is never vented; its neighbours tell nothing about its zero.
    if channel == "supply_pressure" {
        return None;
    }
    let lows = recordings.iter().filter_map(|recording| recording.columns.get(index)).map(|values| plateaus(values).0);
    let low = lows.fold(f64::INFINITY, f64::min);
    let candidates: &[&str] = match written.map(|unit| unit.text().to_ascii_lowercase()).as_deref() {
        Some("bar") => &["barg", "bara"],
        Some("psi") => &["psig", "psia"],
        Some("kpa") => &["kPa", "kPag"],
        Some("mpa") => &["MPa", "MPag"],
        _ => &["bara", "psia", "kPa"],
    };
    let high = recordings[0].columns[index].iter().copied().filter(|value| value.is_finite()).fold(0.0, f64::max);
    candidates.iter().find_map(|text| {
        let unit = Unit::parse(text).ok()?;
        let gauge = unit.reference() == Reference::Gauge;
        let vented = if gauge { unit.to_si(low) } else { unit.to_si(low) - hints.ambient_pressure_pa };
        // Near the atmosphere on the scale of what it reaches.
        let reached = if gauge { unit.to_si(high) } else { unit.to_si(high) - hints.ambient_pressure_pa };
        (reached > 0.0 && vented.abs() < 0.08 * reached && vented.abs() < 0.3 * hints.ambient_pressure_pa)
            .then(|| (unit, format!("it falls to {low:.4}, which is the atmosphere then")))
    })
}

/// The unit that the user stated, where it needs no guess.
fn stated<'a>(hints: &'a Hints, channel: &str) -> Option<&'a Unit> {
    hints.unit_of(channel).filter(|unit| {
        unit.measures(dimension(channel)) && !unit.text().is_empty() && unit.reference() != Reference::Ambiguous
    })
}

/// Whether a position without any unit may be mm of a motion that leaves out a part of the stroke. Taken for the stops,
/// its ends would stretch it.
fn may_be_mm(first: &Recording, hints: &Hints, index: usize) -> bool {
    let silent = first.unit(index).is_none() && hints.unit_of("position").is_none();
    let (low, high) = plateaus(&first.columns[index]);
    let is_signal = SIGNALS.iter().any(|(start, end)| {
        let near = NEAR_SIGNAL * (end - start);
        (low - start).abs() < near && (high - end).abs() < near
    });
    hints.stroke_m.is_some_and(|stroke_m| {
        let stroke_mm = stroke_m * 1e3;
        // Within the stops, give or take what a zero may be off by.
        let within = low > -PART_OUTSIDE * stroke_mm && high < (1.0 + PART_OUTSIDE) * stroke_mm;
        silent && !is_signal && within && high - low > PART_AT_LEAST * stroke_mm
    })
}

/// A position in volts, percent or counts: its plateaus are the stops.
fn scaled_to_stroke(
    recordings: &[&Recording],
    hints: &Hints,
    index: usize,
    column: &mut ColumnGuess,
) -> Option<String> {
    let stroke_m = hints.stroke_m?;
    let (low, high) = plateaus(&recordings[0].columns[index]);
    if high <= low {
        return None;
    }
    column.unit = Some("mm".to_owned());
    column.factor = 1e-3;
    let outside = 100.0 * PART_OUTSIDE;
    if recordings[0].in_percent[index] && low > -outside && high < 100.0 + outside && high - low > 100.0 * PART_AT_LEAST
    {
        column.scale = 1e3 * stroke_m / 100.0;
        return Some(format!("in percent, as it says: of the stroke of {:.4} mm", stroke_m * 1e3));
    }
    column.scale = 1e3 * stroke_m / (high - low);
    column.offset = -low * column.scale * 1e-3;
    Some(format!("its plateaus at {low:.4} and {high:.4} taken for the stops, {:.4} mm apart", stroke_m * 1e3))
}

/// A pressure that has come so far of its way is on it.
pub(super) const RISEN: f64 = 0.2;

/// A pipe pressure tells the command where no column does, if the pipe is vented in between.
fn command_from_pressure(recordings: &[&Recording], ambient_pressure_pa: f64, found: &mut Understanding) {
    let Some(pipe) = found.columns.iter().find(|column| column.channel == "pipe_pressure") else { return };
    let given = pipe.unit.clone().and_then(|text| Unit::parse(&text).ok());
    for recording in recordings {
        let Some(unit) = given.clone().or_else(|| recording.unit(pipe.index)) else { return };
        let (low, high) = plateaus(&recording.columns[pipe.index]);
        let zero_pa = if unit.reference() == Reference::Gauge { ambient_pressure_pa } else { 0.0 };
        let gauge_pa = |number: f64| unit.to_si(number) + zero_pa - ambient_pressure_pa;
        if gauge_pa(low) > MOST_LEFT * gauge_pa(high) {
            found.said.push(format!(
                "command: no column holds it, and the pipe pressure does not tell it: in {} it lies between {low:.3} and \
                 {high:.3} {}, where a pipe that is vented would fall to the atmosphere",
                recording.file,
                unit.text()
            ));
            return;
        }
    }
    // Near the ends, so that edges are near the commands: pipes fill and empty from the start. Supplies differ, so that the
    // levels are of each recording.
    found.threshold = Some(ThresholdGuess {
        channel: "pipe_pressure".to_owned(),
        threshold: RISEN,
        hysteresis: 0.5 * RISEN,
        release: Some(1.0 - RISEN),
        is_pressure: true,
        above_closes: true,
    });
    found.said.push(
        "command: no column holds it; told by the pipe pressure at a fifth of its rise and of its fall in each recording"
            .to_owned(),
    );
    found.said.push(
        "pipe pressure: drives the model as it was measured, in place of a solenoid whose command nobody wrote down"
            .to_owned(),
    );
}
