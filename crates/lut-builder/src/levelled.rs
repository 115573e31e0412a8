//! Times that stay as they are but for the last digits.

/// Times that go one way or stay, nearest to the given ones in the mean square (pool adjacent violators;
/// Barlow et al., Statistical Inference under Order Restrictions, 1972). Times that would have to be changed by more
/// than the tolerance are left as they are.
pub(crate) fn levelled(times_s: &[f64], tolerance_s: f64) -> Vec<f64> {
    let sign = if times_s[times_s.len() - 1] < times_s[0] { -1.0 } else { 1.0 };
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for time_s in times_s {
        pools.push((sign * time_s, 1));
        while let [.., (before, many), (last, few)] = pools[..]
            && before > last
        {
            pools.truncate(pools.len() - 2);
            pools.push(((before * many as f64 + last * few as f64) / (many + few) as f64, many + few));
        }
    }
    let levels: Vec<f64> =
        pools.into_iter().flat_map(|(level, many)| std::iter::repeat_n(sign * level, many)).collect();
    let near = levels.iter().zip(times_s).all(|(level, time_s)| (level - time_s).abs() <= tolerance_s);
    if near { levels } else { times_s.to_vec() }
}

#[cfg(test)]
mod tests {
    use super::levelled;

    #[test]
    fn small_steps_back_are_pooled_and_large_ones_are_not() {
        let pooled = levelled(&[1.0, 1.0 + 2e-6, 1.0, 2.0], 1e-5);
        assert!(
            pooled.iter().zip([1.0, 1.0 + 1e-6, 1.0 + 1e-6, 2.0]).all(|(a, b)| (a - b).abs() < 1e-12),
            "{pooled:?}"
        );
        assert_eq!(levelled(&[2.0, 1.0, 1.0, 1.0 + 2e-6, 0.5], 1e-5)[0], 2.0);
        assert!(levelled(&[2.0, 1.0, 1.0 + 2e-6, 0.5], 1e-5).is_sorted_by(|a, b| a >= b));
        let turning = [1.0, 2.0, 1.5, 3.0];
        assert_eq!(levelled(&turning, 1e-5), turning);
    }
}
