//! What a command of 1 means, and which way the position counts.
//!
//! The signals alone cannot tell a command turned round from a position turned round. Pressure can: it rises where
//! the valve is told to close, since pressure closes it. So can a name ("close", "auf").

use std::fmt::Write;

use super::columns::RISEN;
use super::{ColumnGuess, Hints, Recording, Understanding, Unknown};
use crate::levels::plateaus;
use crate::words;

/// A sensor whose zero is this near to the closed stop, in strokes, is taken to be right: stops give way by as much.
const ZERO_IS_RIGHT: f64 = 0.08;
/// Motion below this share of the stroke reaches no stop at one end at least.
const SHORT: f64 = 0.85;
/// Motion beyond the stroke by more than this is told to be the stops'.
const GIVE_SHOWS: f64 = 1.01;

/// Settles both; an [`Unknown::Direction`] where nothing tells.
pub(super) fn settle(recordings: &[&Recording], hints: &Hints, found: &mut Understanding) {
    let column = |channel: &str| found.columns.iter().find(|column| column.channel == channel).cloned();
    let Some(position) = column("position") else { return };
    let pressure = column("chamber_pressure").or_else(|| column("pipe_pressure"));
    let (mut moved, mut filled) = (0.0, 0.0);
    for recording in recordings {
        let high = commanded_high(recording, found);
        moved += way(&recording.columns[position.index], &high);
        filled += pressure.as_ref().map_or(0.0, |pressure| way(&recording.columns[pressure.index], &high));
    }
    // Where the pressure itself tells the command, above is close.
    let from_pressure = found.threshold.as_ref().is_some_and(|threshold| threshold.is_pressure);
    let by_words = column("command").filter(|command| recordings[0].words[command.index] == Some(true));
    let named = column("command").and_then(|command| words::says_closes(&command.name));
    let grows_when_high = moved > 0.0;
    let (one_closes, why) = if let Some(given) = hints.one_closes {
        (given, hints.closes_because.clone().unwrap_or_else(|| "as you said".to_owned()))
    } else if by_words.is_some() {
        (true, "its words say so".to_owned())
    } else if from_pressure {
        (true, "pressure closes the valve".to_owned())
    } else if let (Some(pressure), true) = (&pressure, filled != 0.0) {
        (
            filled > 0.0,
            format!("the pressure of \"{}\" {} with it", pressure.name, if filled > 0.0 { "rises" } else { "falls" }),
        )
    } else if let Some(closes) = named {
        (closes, "by the column's name".to_owned())
    } else if let Some(grows_to_open) = hints.grows_to_open {
        (grows_to_open != grows_when_high, "from the direction of the position, as you said".to_owned())
    } else {
        found.unknown.push(Unknown::Direction);
        return;
    };
    found.said.push(format!("command: 1 means {} ({why})", if one_closes { "close" } else { "open" }));
    turn_command(one_closes, found);
    let grows_to_open = hints.grows_to_open.unwrap_or(grows_when_high != one_closes);
    turn_position(recordings, hints, grows_to_open, found);
}

/// Whether each row is commanded high.
fn commanded_high(recording: &Recording, found: &Understanding) -> Vec<bool> {
    let of = |channel: &str| found.columns.iter().find(|column| column.channel == channel);
    match &found.threshold {
        Some(threshold) if threshold.is_pressure => {
            let Some(pipe) = of("pipe_pressure") else { return Vec::new() };
            let (low, high) = plateaus(&recording.columns[pipe.index]);
            let [rises, falls] = [RISEN, 1.0 - RISEN].map(|share| low + share * (high - low));
            // On its way down from where it was filled it is vented.
            let mut was_filled = false;
            let of_row = |value: &f64| {
                was_filled = *value > falls || was_filled && *value > rises;
                *value > falls || *value > rises && !was_filled
            };
            recording.columns[pipe.index].iter().map(of_row).collect()
        }
        Some(threshold) => {
            let Some(command) = of("command") else { return Vec::new() };
            recording.columns[command.index].iter().map(|value| *value > threshold.threshold).collect()
        }
        None => {
            let Some(command) = of("command") else { return Vec::new() };
            recording.columns[command.index].iter().map(|value| *value > 0.5).collect()
        }
    }
}

/// The way that a signal makes while the command is high, less the one while it is low, in its own numbers.
fn way(values: &[f64], high: &[bool]) -> f64 {
    let (mut sum, mut last) = (0.0, f64::NAN);
    for (value, high) in values.iter().zip(high) {
        if value.is_finite() {
            if last.is_finite() {
                sum += if *high { value - last } else { last - value };
            }
            last = *value;
        }
    }
    sum
}

fn turn_command(one_closes: bool, found: &mut Understanding) {
    if one_closes {
        return;
    }
    if let Some(threshold) = &mut found.threshold {
        threshold.above_closes = false;
    } else if let Some(command) = found.columns.iter_mut().find(|column| column.channel == "command") {
        (command.scale, command.offset) = (-1.0, 1.0);
    }
}

/// Turns the position so that it counts from the closed stop, and puts its zero there.
fn turn_position(recordings: &[&Recording], hints: &Hints, grows_to_open: bool, found: &mut Understanding) {
    let Some(position) = found.columns.iter_mut().find(|column| column.channel == "position") else { return };
    let ends = recordings.iter().map(|recording| plateaus(&recording.columns[position.index]));
    let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |all, one| (all.0.min(one.0), all.1.max(one.1)));
    let si = |number: f64, position: &ColumnGuess| number * position.scale * position.factor;
    let span_m = si(high - low, position).abs();
    if !grows_to_open {
        position.scale = -position.scale;
    }
    // The closed stop: the lowest position, or the highest reading where it is turned round. Stops give way: as a model says, else
    // by the same at both ends as far as anybody knows.
    let closed_m = si(if grows_to_open { low } else { high }, position);
    let even_m = || hints.stroke_m.map_or(0.0, |stroke_m| 0.5 * (span_m - stroke_m).max(0.0));
    // A model whose stops were guessed knows nothing of that: it has to tell how far the valve moves better than stops that do not
    // give way at all.
    let tells_span = |[closed_m, open_m]: &[f64; 2]| {
        hints.stroke_m.is_none_or(|stroke_m| (open_m - closed_m - span_m).abs() < (stroke_m - span_m).abs())
    };
    let rests_m = hints.rests_m.filter(tells_span);
    let give_m = rests_m.map_or_else(even_m, |[closed_m, _]| -closed_m);
    let short = hints.stroke_m.is_some_and(|stroke_m| span_m < SHORT * stroke_m);
    let off_m = if rests_m.is_some() { closed_m + give_m } else { closed_m };
    let far = off_m.abs() > ZERO_IS_RIGHT * hints.stroke_m.unwrap_or(span_m);
    let is_percent =
        hints.stroke_m.is_some_and(|stroke_m| (si(100.0, position).abs() - stroke_m).abs() < 1e-6 * stroke_m);
    if !grows_to_open && (short || is_percent) {
        // The valve never reached a stop, or its range is known: the zero of a turned sensor is the stroke.
        position.offset = hints.stroke_m.unwrap_or(span_m);
    } else if far && !short || position.offset != 0.0 {
        position.offset = -(closed_m + give_m);
    }
    let mut words =
        if grows_to_open { "counts towards open".to_owned() } else { "counts towards closed, turned round".to_owned() };
    // Writing to a string cannot fail.
    if position.offset != 0.0 {
        words.push_str(", zero put at the closed stop");
    } else if closed_m.abs() > 0.01 * span_m {
        let _ = write!(words, ", its closed end at {:.3} mm left where it is", closed_m * 1e3);
    }
    let _ = write!(words, " (it moves over {:.3} mm", span_m * 1e3);
    if let Some(stroke_m) = hints.stroke_m.filter(|stroke_m| span_m > GIVE_SHOWS * stroke_m) {
        let _ = write!(words, ": the stroke of {:.3} mm and what the stops or the linkage give way by", stroke_m * 1e3);
    }
    words.push(')');
    found.said.push(format!("position: {words}"));
}
