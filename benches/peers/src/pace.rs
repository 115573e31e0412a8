//! How long things take beside each other: by turns in one run, so that what else the machine does meets all of them.

use std::time::{Duration, Instant};

/// Turns of each contender; the median of them counts.
const TURNS: usize = 15;
/// A turn repeats its call for about this long.
const TURN: Duration = Duration::from_millis(12);

/// What is timed.
pub type Call<'a> = Box<dyn FnMut() + 'a>;

/// How long a contender takes.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// A call, s: the median of the turns.
    pub call_s: f64,
    /// How many times as long as a call of the first contender: the median of the ratios within a turn.
    pub to_first: f64,
}

/// Lets contenders call by turns.
pub fn by_turns(contenders: &mut [Call<'_>]) -> Vec<Pace> {
    let repeats: Vec<u32> = contenders.iter_mut().map(|call| repeats(call)).collect();
    let mut turns: Vec<Vec<f64>> = vec![Vec::new(); contenders.len()];
    for _ in 0..TURNS {
        for ((call, &repeats), times) in contenders.iter_mut().zip(&repeats).zip(&mut turns) {
            times.push(timed(call, repeats) / f64::from(repeats));
        }
    }
    let ratios = |times: &[f64]| times.iter().zip(&turns[0]).map(|(time, first)| time / first).collect();
    turns.iter().map(|times| Pace { call_s: median(times.clone()), to_first: median(ratios(times)) }).collect()
}

/// How often a contender has to be called to fill a turn.
fn repeats(call: &mut Call<'_>) -> u32 {
    let mut repeats = 1;
    while timed(call, repeats) < 0.5 * TURN.as_secs_f64() {
        repeats *= 2;
    }
    repeats
}

fn timed(call: &mut Call<'_>, repeats: u32) -> f64 {
    let start = Instant::now();
    (0..repeats).for_each(|_| call());
    start.elapsed().as_secs_f64()
}

/// The middle of a list that is not empty.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
