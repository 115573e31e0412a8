//! Times that stay as they are but for the last digits, and times that rise or fall but for a little.

/// Times that go one way or stay, nearest to the given ones in the mean square (pool adjacent violators;
/// Barlow et al., Statistical Inference under Order Restrictions, 1972), and how many: from where on times would have to be
/// changed by more than the tolerance they are left as they are.
pub(crate) fn levelled(times_s: &[f64], falls: bool, tolerance_s: f64) -> (Vec<f64>, usize) {
    as_far_as_possible(times_s, |times_s| {
        let levels: Vec<f64> = pooled(times_s, falls, |before, last| before > last)
            .into_iter()
            .flat_map(|(level, many)| std::iter::repeat_n(level, many))
            .collect();
        let near = levels.iter().zip(times_s).all(|(level, time_s)| (level - time_s).abs() <= tolerance_s);
        near.then_some(levels)
    })
}

/// Changes the first times, as many as can be, and leaves the rest as they are; and how many could be.
fn as_far_as_possible(times_s: &[f64], change: impl Fn(&[f64]) -> Option<Vec<f64>>) -> (Vec<f64>, usize) {
    let changed = (2..=times_s.len()).rev().find_map(|many| Some((change(&times_s[..many])?, many)));
    let (changed, many) = changed.unwrap_or((Vec::new(), 0));
    ([&changed, &times_s[many..]].concat(), many)
}

/// Times that are the same move on by this, s.
const LEAST_S: f64 = 1e-6;

/// A time that turns within this share of the severity tells the severity to that share, however far it turns.
pub(crate) const NARROW: f64 = 0.005;

/// Times of rising severities that truly rise, or truly fall, as near to the given ones, and by how much the worst of them was
/// changed of those that a turn spreads over severities, s. From where on one would have to be changed by more than this share
/// of itself over severities that lie apart, or where nothing rises or falls, they are left as they are.
pub(crate) fn evened(severities: &[f64], times_s: &[f64], most: f64) -> (Vec<f64>, f64) {
    let all = |times_s: &[f64]| evened_all(severities, times_s, most);
    let (even, _) = as_far_as_possible(times_s, all);
    let changes = even.iter().zip(times_s).map(|(even, time_s)| ((even - time_s).abs(), most * time_s.abs()));
    let worst_s = changes.filter(|(change_s, most_s)| change_s <= most_s).map(|(change_s, _)| change_s);
    let worst_s = worst_s.fold(0.0, f64::max);
    (even, worst_s)
}

fn evened_all(severities: &[f64], times_s: &[f64], most: f64) -> Option<Vec<f64>> {
    let pools = pooled(times_s, falls(times_s), |before, last| before >= last);
    let mut even: Vec<f64> = Vec::with_capacity(times_s.len());
    for (index, (level, many)) in pools.iter().enumerate() {
        let before = index.checked_sub(1).map(|before| level - pools[before].0);
        let after = pools.get(index + 1).map(|after| after.0 - level);
        let free = before.into_iter().chain(after).min_by(|a, b| a.abs().total_cmp(&b.abs()))?;
        let of_pool = &times_s[even.len()..even.len() + many];
        let (first, last) = (severities[even.len()], severities[even.len() + many - 1]);
        let is_narrow = last - first <= NARROW * last;
        let range = |(low, high): (f64, f64), time_s: &f64| (low.min(*time_s), high.max(*time_s));
        let (low, high) = of_pool.iter().fold((f64::INFINITY, f64::NEG_INFINITY), range);
        // The times of a pool move on by as much as they turned, and through half of what is free about it at most.
        let moves = free.signum() * (high - low).max(LEAST_S).min(0.5 * free.abs());
        let last = (many - 1).max(1) as f64;
        even.extend((0..*many).map(|place| {
            let along = if *many == 1 { 0.0 } else { place as f64 / last - 0.5 };
            level + along * moves
        }));
        let mut changes = even[even.len() - many..].iter().zip(of_pool);
        if !is_narrow && changes.any(|(even, time_s)| (even - time_s).abs() > most * time_s.abs()) {
            return None;
        }
    }
    Some(even)
}

/// Whether the last time is less than the first.
pub(crate) fn falls(times_s: &[f64]) -> bool {
    times_s[times_s.len() - 1] < times_s[0]
}

/// Levels that go one way, each with how many of the times it stands for.
fn pooled(times_s: &[f64], falls: bool, turns: impl Fn(f64, f64) -> bool) -> Vec<(f64, usize)> {
    let sign = if falls { -1.0 } else { 1.0 };
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for time_s in times_s {
        pools.push((sign * time_s, 1));
        while let [.., (before, many), (last, few)] = pools[..]
            && turns(before, last)
        {
            pools.truncate(pools.len() - 2);
            pools.push(((before * many as f64 + last * few as f64) / (many + few) as f64, many + few));
        }
    }
    pools.into_iter().map(|(level, many)| (sign * level, many)).collect()
}

#[cfg(test)]
mod tests {
    use super::{evened, falls};

    fn levelled(times_s: &[f64], tolerance_s: f64) -> (Vec<f64>, usize) {
        super::levelled(times_s, falls(times_s), tolerance_s)
    }

    #[test]
    fn a_little_turning_is_evened_out_and_more_is_not() {
        for sign in [1.0, -1.0] {
            let times: Vec<f64> = [1.7, 1.8, 1.799, 1.7985, 1.9, 2.0].map(|time| 2.0 + sign * (time - 1.85)).into();
            let apart: Vec<f64> = (0..7).map(f64::from).collect();
            let (even, most_s) = evened(&apart, &times, 0.005);
            assert!(even.windows(2).all(|pair| sign * (pair[1] - pair[0]) > 1e-4), "{even:?}");
            assert!(most_s > 1e-3 && most_s < 2e-3 && even[0] == times[0] && even[5] == times[5], "{most_s}");
            assert_eq!(evened(&apart, &times, 1e-4), (times.clone(), 0.0));
            // Close together they tell the severity all the same.
            let (even, most_s) = evened(&[0.0, 1.0, 1.001, 1.002, 2.0, 3.0], &times, 1e-4);
            assert!(even.windows(2).all(|pair| sign * (pair[1] - pair[0]) > 1e-4) && most_s < 2e-4, "{even:?}");
            // A turn that is too large hides no small one before it.
            let (even, _) = evened(&apart, &[&times[..], &[times[0]]].concat(), 0.005);
            assert!(
                even[..6].windows(2).all(|pair| sign * (pair[1] - pair[0]) > 1e-4) && even[6] == times[0],
                "{even:?}"
            );
        }
        let straight = [1.0, 1.1, 1.3];
        assert_eq!(evened(&[0.0, 1.0, 2.0], &straight, 0.0), (straight.to_vec(), 0.0));
        assert_eq!(evened(&[0.0, 1.0, 2.0], &[1.0, 1.0, 1.0], 0.1), (vec![1.0; 3], 0.0));
    }

    #[test]
    fn small_steps_back_are_pooled_and_large_ones_are_not() {
        let (pooled, _) = levelled(&[1.0, 1.0 + 2e-6, 1.0, 2.0], 1e-5);
        assert!(
            pooled.iter().zip([1.0, 1.0 + 1e-6, 1.0 + 1e-6, 2.0]).all(|(a, b)| (a - b).abs() < 1e-12),
            "{pooled:?}"
        );
        assert_eq!(levelled(&[2.0, 1.0, 1.0, 1.0 + 2e-6, 0.5], 1e-5).0[0], 2.0);
        assert!(levelled(&[2.0, 1.0, 1.0 + 2e-6, 0.5], 1e-5).0.is_sorted_by(|a, b| a >= b));
        // All of what goes the other way by less than the tolerance is one level.
        let (level, many) = super::levelled(&[1.0, 1.0 + 2e-6, 1.0 + 3e-6], true, 1e-5);
        assert!(level.windows(2).all(|pair| pair[0] == pair[1]) && many == 3, "{level:?}");
        let turning = [1.0, 2.0, 1.5, 3.0];
        assert_eq!(levelled(&turning, 1e-5), (turning.to_vec(), 2));
        let (late, many) = levelled(&[1.0, 1.0 + 2e-6, 1.0, 2.0, 1.0], 1e-5);
        assert!(late[..4].is_sorted() && late[4] == 1.0 && many == 4, "{late:?}");
    }
}
