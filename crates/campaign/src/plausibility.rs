//! Whether a trace can be what it claims to be.

use crate::error::{DataError, DataProblem};
use crate::noise::{estimate_noise, estimate_resolution, quantile, range};
use crate::trace::{CommandFrom, ReadTrace};
use crate::types::{Trace, ValveFacts};
use crate::warning::{Doubt, Warning};

/// Millimetres in an inch.
const INCH_MM: f64 = 25.4;
/// Motion below this share of the stroke is none.
const NO_MOTION: f64 = 0.02;
/// Motion below this share of the stroke may be the sensor's noise alone.
const ONLY_NOISE: f64 = 0.1;
/// Motion below this share of the stroke is worth a word.
const SHORT_MOTION: f64 = 0.9;
/// Motion above this many strokes cannot be: stops give way by a few hundredths, soft ones of a strong
/// actuator by some tenths, and no unit is that close to another.
const TOO_LONG: f64 = 1.6;
/// How far a stop may throw the valve back, in strokes.
const BOUNCE: f64 = 0.2;
/// How far outside the stops a position may lie, in strokes.
const OUTSIDE: f64 = 0.12;

/// A motion whose highest reading is below this share of the stroke never came near the open stop.
const NEVER_OPEN: f64 = 0.3;
/// A motion that is this much off a whole conversion of units may still be one: partial strokes are shorter, stops give way.
const NEAR_CONVERSION: std::ops::Range<f64> = 0.75..1.3;
/// White noise spans at most so many rms differences of neighbouring rows.
const NOISE_SPAN: f64 = 6.5;
/// A channel that lacks more than this share of its readings is told.
const MANY_GAPS: f64 = 0.2;

/// Checks a trace against the valve; warnings go to `warnings`.
pub(crate) fn check(
    read: &ReadTrace,
    file: &str,
    (valve, command_from): (&ValveFacts, Option<&CommandFrom>),
    warnings: &mut Vec<Warning>,
) -> Result<(), DataError> {
    let trace = &read.trace;
    let error = |line, problem| Err(DataError::new(file, line, problem));
    let first_line = read.lines.first().copied().unwrap_or(read.header_line);
    let mut warn = |line, doubt| warnings.push(Warning { file: file.to_owned(), line, doubt });
    for (line, doubt) in &read.doubts {
        warn(*line, doubt.clone());
    }
    let Some((lowest_m, highest_m)) = range(&trace.position_m) else {
        let problem = DataProblem::NoReadings { column: read.position_column.clone(), channel: "position".into() };
        return error(first_line, problem);
    };
    check_pressures(read, file, valve, &mut warn)?;
    check_gaps(trace, first_line, &mut warn);
    check_times(trace, first_line, &mut warn);
    let constant = trace.command_close.iter().all(|close| *close == trace.command_close[0]);
    if constant {
        let close = trace.command_close[0];
        if !moves_one_way(trace, close, valve.stroke_m) {
            let never_changes = DataProblem::CommandNeverChanges { value: u8::from(close) };
            let never_crossed = command_from.map(|from| from.never_crossed(read.signal_range));
            return error(first_line, never_crossed.unwrap_or(never_changes));
        }
        warn(first_line, if close { Doubt::OnlyClosing } else { Doubt::OnlyOpening });
    }
    let (span_mm, stroke_mm) = ((highest_m - lowest_m) * 1e3, valve.stroke_m * 1e3);
    let only_noise = span_mm < ONLY_NOISE * stroke_mm && is_noise(&trace.position_m, highest_m - lowest_m);
    if !only_noise && let Some(hint) = scale_hint(span_mm, highest_m * 1e3, stroke_mm) {
        return error(read.header_line, DataProblem::WrongScale { span_mm, stroke_mm, hint });
    }
    if only_noise || span_mm < NO_MOTION * stroke_mm {
        warn(first_line, Doubt::NoMotion { span_mm, stroke_mm });
        return Ok(());
    }
    if mirrored(trace) {
        let problem = DataProblem::Mirrored { column: read.position_column.clone(), stroke_mm };
        return error(read.header_line, problem);
    }
    if span_mm < SHORT_MOTION * stroke_mm {
        warn(first_line, Doubt::ShortMotion { span_mm, stroke_mm });
    }
    let (lowest_mm, highest_mm) = (lowest_m * 1e3, highest_m * 1e3);
    if lowest_mm < -OUTSIDE * stroke_mm || highest_mm > (1.0 + OUTSIDE) * stroke_mm {
        warn(first_line, Doubt::Offset { lowest_mm, highest_mm, stroke_mm });
    }
    check_clipping(read, (lowest_m, highest_m), valve.stroke_m, &mut warn);
    Ok(())
}

/// What is likely wrong where the motion's size cannot be right.
fn scale_hint(span_mm: f64, highest_mm: f64, stroke_mm: f64) -> Option<String> {
    let ratio = span_mm / stroke_mm;
    // A short motion that begins at the open stop is a partial stroke; one that never gets near it is in another unit.
    let possible = ratio > 1.0 || highest_mm < NEVER_OPEN * stroke_mm;
    let near = |factor: f64| possible && NEAR_CONVERSION.contains(&(ratio / factor));
    let unit = |found: &str| format!("the column looks like {found}: give its unit in [columns]");
    if near(1.0 / INCH_MM) {
        Some(unit("inches called mm (a factor of 25.4)"))
    } else if near(INCH_MM) {
        Some(unit("millimetres called inches (a factor of 25.4)"))
    } else if near(1e3) {
        Some(unit("micrometres called mm, or millimetres called metres (a factor of 1000)"))
    } else if near(1e-3) && span_mm > 0.0 {
        Some(unit("metres called mm (a factor of 1000)"))
    } else if near(0.1) {
        Some(unit("centimetres called mm (a factor of 10)"))
    } else if ratio > TOO_LONG {
        Some("check the unit and the scale in [columns], and the stroke in the valve file".into())
    } else {
        None
    }
}

/// Whether readings that span so much jump about from row to row instead of moving: white noise
/// spans some four to six times the rms difference of neighbours, a recorded stroke far more.
fn is_noise(position_m: &[f64], span_m: f64) -> bool {
    let differences = position_m.windows(2).map(|pair| pair[1] - pair[0]).filter(|difference| difference.is_finite());
    let (sum, count) = differences.fold((0.0, 0usize), |(sum, count), value| (sum + value * value, count + 1));
    span_m < NOISE_SPAN * (sum / count.max(1) as f64).sqrt()
}

/// Whether a trace is one stroke in the direction that its command says, wherever it begins, and not back.
fn moves_one_way(trace: &Trace, close: bool, stroke_m: f64) -> bool {
    let sign = if close { -1.0 } else { 1.0 };
    let mut finite = trace.position_m.iter().filter(|position| position.is_finite()).map(|position| sign * position);
    let Some(first) = finite.next() else { return false };
    let (mut farthest, mut back) = (first, 0f64);
    for position in finite {
        farthest = farthest.max(position);
        back = back.max(farthest - position);
    }
    farthest - first > ONLY_NOISE * stroke_m && back < BOUNCE * stroke_m
}

/// Whether the position grows while the valve is told to close and falls while it is told to open.
fn mirrored(trace: &Trace) -> bool {
    let (mut closing, mut opening) = (0.0, 0.0);
    let mut last: Option<f64> = None;
    for (&position, &close) in trace.position_m.iter().zip(&trace.command_close) {
        if position.is_nan() {
            continue;
        }
        if let Some(last) = last {
            *(if close { &mut closing } else { &mut opening }) += position - last;
        }
        last = Some(position);
    }
    let moved = range(&trace.position_m).map_or(0.0, |(lowest, highest)| highest - lowest);
    // The total way under each command; a stroke that is under way when the command changes has its share in both.
    closing > 0.5 * moved && opening <= 0.0 || closing >= 0.0 && opening < -0.5 * moved
}

fn check_pressures(
    read: &ReadTrace,
    file: &str,
    valve: &ValveFacts,
    warn: &mut impl FnMut(usize, Doubt),
) -> Result<(), DataError> {
    for (channel, values) in pressures(&read.trace) {
        let Some(values) = values else { continue };
        let Some((lowest, _)) = range(values) else {
            let problem = DataProblem::NoReadings { column: channel.into(), channel: channel.into() };
            return Err(DataError::new(file, read.header_line, problem));
        };
        if lowest < 0.5 * valve.ambient_pressure_pa {
            let (lowest_kpa, ambient_kpa) = (lowest / 1e3, valve.ambient_pressure_pa / 1e3);
            warn(read.header_line, Doubt::LooksGauge { channel: channel.into(), lowest_kpa, ambient_kpa });
        }
    }
    Ok(())
}

/// What of the stated supply pressure (gauge) a recorded one may lie above it: gauges are off by less.
const ABOVE_SUPPLY: f64 = 0.1;
/// A pressure is above for a good part of the record where this quantile of its readings is.
const GOOD_PART: f64 = 0.8;
/// Of a pressure in a wrong unit the rare readings at the top are so many times too high, gauge.
const MANY_TIMES: f64 = 3.0;
const TOP: f64 = 0.98;

/// Doubts about pressures that lie above the supply that the run states.
pub(crate) fn above_supply(read: &ReadTrace, file: &str, valve: &ValveFacts, supply_pa: f64) -> Vec<Warning> {
    let ambient_pa = valve.ambient_pressure_pa;
    let limit_pa = |share: f64| ambient_pa + share * (supply_pa - ambient_pa);
    let doubt = |((channel, values), column): ((&'static str, Option<&Vec<f64>>), &Option<String>)| {
        let known: Vec<f64> = values?.iter().copied().filter(|pressure| pressure.is_finite()).collect();
        let (usual_pa, top_pa) = (quantile(&known, GOOD_PART), quantile(&known, TOP));
        let is_above = usual_pa > limit_pa(1.0 + ABOVE_SUPPLY) || top_pa > limit_pa(MANY_TIMES);
        let doubt = Doubt::AboveSupply {
            channel,
            column: column.clone()?,
            found_kpa: top_pa / 1e3,
            supply_kpa: supply_pa / 1e3,
        };
        is_above.then(|| Warning { file: file.to_owned(), line: read.header_line, doubt })
    };
    pressures(&read.trace).into_iter().zip(&read.pressure_columns).filter_map(doubt).collect()
}

fn pressures(trace: &Trace) -> [(&'static str, Option<&Vec<f64>>); 3] {
    [
        ("chamber pressure", trace.chamber_pressure_pa.as_ref()),
        ("pipe pressure", trace.pipe_pressure_pa.as_ref()),
        ("supply pressure", trace.supply_pressure_pa.as_ref()),
    ]
}

fn check_gaps(trace: &Trace, line: usize, warn: &mut impl FnMut(usize, Doubt)) {
    let position = [("position", Some(&trace.position_m))];
    for (channel, values) in position.into_iter().chain(pressures(trace)) {
        let Some(values) = values else { continue };
        let missing = values.iter().filter(|value| value.is_nan()).count();
        let share = missing as f64 / values.len() as f64;
        if share > MANY_GAPS {
            warn(line, Doubt::ManyGaps { channel: channel.into(), share });
        }
    }
}

/// Rows are usually at most this far apart, s: a stroke of a second then has two.
const SLOW_ROWS_S: f64 = 0.5;
/// A gap is at least so long, s, and so many of the usual steps of the rows.
const GAP_S: f64 = 0.1;
const GAP_STEPS: f64 = 12.0;
/// Where some steps are long as a rule, a gap is so many of those.
const GAP_LONG_STEPS: f64 = 3.0;

/// Warns of stretches without a position, and of rows too far apart.
fn check_times(trace: &Trace, line: usize, warn: &mut impl FnMut(usize, Doubt)) {
    let rows = trace.time_s.iter().zip(&trace.position_m);
    let seen: Vec<f64> = rows.filter(|(_, position)| position.is_finite()).map(|(time_s, _)| *time_s).collect();
    let steps: Vec<f64> = seen.windows(2).map(|pair| pair[1] - pair[0]).collect();
    // Recorders that save changes only have long steps at rest: then the long ones are usual.
    let (usual_s, long_s) = (quantile(&steps, 0.5), quantile(&steps, 0.95));
    if usual_s >= SLOW_ROWS_S {
        warn(line, Doubt::SlowRows { step_s: usual_s });
    }
    let least_s = GAP_S.max(GAP_STEPS * usual_s).max(GAP_LONG_STEPS * long_s);
    let gaps: Vec<(f64, f64)> =
        steps.iter().zip(&seen).filter(|(step, _)| **step >= least_s).map(|(step, at)| (*step, *at)).collect();
    if let Some(&(longest_s, at_s)) = gaps.iter().max_by(|one, other| one.0.total_cmp(&other.0)) {
        warn(line, Doubt::TimeGap { count: gaps.len(), least_s, longest_s, at_s });
    }
}

/// Warns where many samples are exactly one extreme value: either the other end is noisy, so that
/// the sensor is not merely a quiet one, or the value lies clearly inside the stops.
fn check_clipping(
    read: &ReadTrace,
    (lowest_m, highest_m): (f64, f64),
    stroke_m: f64,
    warn: &mut impl FnMut(usize, Doubt),
) {
    const FEWEST: usize = 20;
    // Noise rounded to steps of twice its size or more is mostly that of rounding.
    const COARSE: f64 = 1.5;
    const SHARE: f64 = 0.3;
    // Readings this close to an extreme, in spans, are at that end; a share of the stroke inside a stop is clearly inside.
    const END: f64 = 0.1;
    const INSIDE: f64 = 0.02;
    // Coarse steps hold a resting valve on one code.
    let step_m = estimate_resolution(&read.trace.position_m).unwrap_or(0.0);
    if step_m > COARSE * estimate_noise(&read.trace.position_m).unwrap_or(0.0) {
        return;
    }
    let band = END * (highest_m - lowest_m);
    let share_at = |extreme: f64| {
        let near = read.trace.position_m.iter().filter(|position| (**position - extreme).abs() <= band).count();
        let at = read.trace.position_m.iter().filter(|position| **position == extreme).count();
        if at < FEWEST { 0.0 } else { at as f64 / near as f64 }
    };
    let (low, high) = (share_at(lowest_m), share_at(highest_m));
    let ends = [
        (lowest_m, low, high, lowest_m > INSIDE * stroke_m),
        (highest_m, high, low, highest_m < (1.0 - INSIDE) * stroke_m),
    ];
    for (extreme_m, share, other_share, inside) in ends {
        if share > SHARE && (other_share < 0.5 * SHARE || inside) {
            let first = read.trace.position_m.iter().position(|position| *position == extreme_m).unwrap_or(0);
            warn(read.lines[first], Doubt::Clipped { value_mm: extreme_m * 1e3, share });
        }
    }
}
