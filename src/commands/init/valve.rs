//! `valve init`: a commented valve file from a datasheet's numbers.

use std::fmt::Write;

use quantity::{Dimension, format_number};
use valve_file::ValveFile;
use valve_model::{Conditions, Schedule};

use super::collector::Collector;
use super::dialogue;
use super::facts::plain;
use super::sheet::Draft;
use crate::cli::InitValveArgs;
use crate::failure::{Answer, Hinted};
use crate::output::{self, Outputs};
use answers::strokes::Cycles;

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
    let mut collector = Collector::new(args, false);
    let mut draft = collector.draft()?;
    dialogue::all_right(&collector.wrong)?;
    if dialogue::is_possible() {
        // Asked only once all options are known to be right.
        collector = Collector::new(args, true);
        draft = collector.draft()?;
    }
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
    let (mut times, mut schedule, mut limits) = settled(&probe, &draft);
    if collector.asks_all() && draft.limits_s.contains(&None) {
        draft.limits_s = asked_limits(draft.limits_s, limits, times)?;
        (times, schedule, limits) = settled(&probe, &draft);
    }
    collector.assume_limits(draft.limits_s, limits);
    let file = ValveFile::parse(&draft.text(schedule, limits), &name)?;
    out.write_whole(file.text().as_bytes())?;
    for doubt in file.doubts() {
        output::note(&format!("warning: {doubt}"));
    }
    output::print_text(&summary(&draft, &collector.assumed, times, &name))?;
    Ok(Answer::Fine)
}

/// Closing and opening time in the shortest cycle that is long enough, s.
fn times_s(file: &ValveFile) -> [Option<f64>; 2] {
    let conditions = Conditions::nominal(file.valve().parameters());
    let mut close_s = 4.0;
    loop {
        let schedule = Schedule { close_at_s: 0.0, open_at_s: close_s, end_s: 3.0 * close_s };
        let cycles = Cycles::simulate(file.valve(), conditions, &schedule, 1, 1e-3);
        let times = cycles.times_s[0].map(moved);
        if times.iter().all(Option::is_some) || 6.0 * close_s > LONGEST_CYCLE_S {
            return times;
        }
        close_s *= 2.0;
    }
}

/// The time of a stroke; none where the valve was there already because it had never left.
fn moved(time_s: Option<f64>) -> Option<f64> {
    time_s.filter(|time_s| *time_s > 0.0)
}

/// Stroke times with the cycle and the limits that fit them. How long the valve opens depends on how full it is by then,
/// so the times are those of the very cycle that the file gets.
fn settled(file: &ValveFile, given: &Draft) -> ([Option<f64>; 2], Schedule, [f64; 2]) {
    let conditions = Conditions::nominal(file.valve().parameters());
    let mut times = times_s(file);
    let (mut schedule, mut limits) = cycle(times, given);
    for _ in 0..MOST_CYCLES_TRIED {
        let last = Cycles::simulate(file.valve(), conditions, &schedule, REPEATS, 1e-3)
            .times_s
            .last()
            .map(|times| times.map(moved));
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
fn cycle(times: [Option<f64>; 2], given: &Draft) -> (Schedule, [f64; 2]) {
    let limit = |index: usize, fallback: f64| {
        given.limits_s[index].unwrap_or_else(|| times[index].map_or(fallback, |time| up(LIMIT_OVER_TIME * time)))
    };
    // No time beyond a cycle that was given can be seen.
    let within = |index: usize, limit_s: f64, room_s: f64| {
        let is_assumed = given.limits_s[index].is_none() && times[index].is_none_or(|time| time < room_s);
        if is_assumed { limit_s.min((room_s * 1e9).round() * 1e-9) } else { limit_s }
    };
    let mut limits = [limit(0, 3.0), limit(1, 6.0)];
    limits[0] = given.cycle_s[0].map_or(limits[0], |room_s| within(0, limits[0], room_s));
    let open_at_s = given.cycle_s[0].unwrap_or_else(|| up(1.3 * limits[0]));
    limits[1] = given.cycle_s[1].map_or(limits[1], |end_s| within(1, limits[1], end_s - open_at_s));
    let end_s = given.cycle_s[1].unwrap_or_else(|| open_at_s + up(1.3 * limits[1]));
    (Schedule { close_at_s: 0.0, open_at_s, end_s }, limits)
}

/// The next number with one digit, or one and a half.
fn up(number: f64) -> f64 {
    let decade = 10f64.powf(number.log10().floor());
    (2.0 * number / decade).ceil() * 0.5 * decade
}

fn summary(draft: &Draft, assumed: &[String], times: [Option<f64>; 2], file: &str) -> String {
    let mut text = format!("{file} written.\n");
    let typical: Vec<&str> =
        draft.entries.iter().filter(|entry| entry.comment.starts_with("typical")).map(|entry| entry.key).collect();
    // Writing to a string cannot fail.
    if !typical.is_empty() {
        let _ = writeln!(text, "Typical values with wide tolerances: {}.", typical.join(", "));
    }
    if !assumed.is_empty() {
        let _ = writeln!(text, "Assumed: {}.", assumed.join(", "));
    }
    let known = draft.entries.iter().filter_map(|entry| {
        let own = entry.key.split_once('.').map_or(entry.key, |(_, own)| own);
        Some(format!("{own} {} %", format_number(100.0 * entry.tolerance?)))
    });
    let known = known.collect::<Vec<_>>().join(", ");
    let _ = writeln!(
        text,
        "Known to one standard deviation of: {known} (limits such as +-2 % are taken for 1.7 of them; what is known as one goes in \
         with --tolerance)."
    );
    let _ = match times {
        [Some(closes_s), Some(opens_s)] => {
            writeln!(text, "The model closes in {closes_s:.3} s and opens in {opens_s:.3} s; does your valve?")
        }
        [closes, opens] => {
            let strokes = [closes.is_none().then_some("close"), opens.is_none().then_some("open")];
            let strokes = strokes.into_iter().flatten().collect::<Vec<_>>().join(" or ");
            writeln!(
                text,
                "warning: by these values the valve does not {strokes}. Is one of them wrong, or its unit: bore, supply, spring, \
                 mass, orifices?"
            )
        }
    };
    text.push_str(&output::next_step("look at its strokes", &["simulate", file, "--plot", "cycle.svg"]));
    let recordings = ["init", "campaign", "traces/*.csv", "--valve", file];
    text.push_str(&output::next_step("describe recorded strokes, by their names for traces/*.csv", &recordings));
    text
}

/// The limits that are asked for at a terminal, s; an empty answer leaves the one that is shown.
fn asked_limits(
    given: [Option<f64>; 2],
    usual: [f64; 2],
    times_s: [Option<f64>; 2],
) -> anyhow::Result<[Option<f64>; 2]> {
    let mut limits_s = given;
    for (index, stroke) in ["closing", "opening"].into_iter().enumerate() {
        if given[index].is_none() {
            let why = match times_s[index] {
                Some(_) => format!("{LIMIT_OVER_TIME} times the model's own"),
                None => "the model does not get there".to_owned(),
            };
            let question = format!(
                "Longest acceptable {stroke} time. Maintenance manual: maximum stroke time, Stellzeit. E.g. 3 s. \
                 Empty for {} s ({why})",
                format_number(usual[index])
            );
            let answer = dialogue::ask(&question, true, |text| plain(text, Dimension::Time))?;
            limits_s[index] = answer.map(|(_, (si, _))| si);
        }
    }
    Ok(limits_s)
}
