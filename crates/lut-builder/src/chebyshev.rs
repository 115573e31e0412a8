//! Places over a range as the extrema of Chebyshev polynomials lie: a polynomial through them does not swing.

/// The extrema of a Chebyshev polynomial over a range, its ends among them; the middle for one node.
pub(crate) fn extrema((from, to): (f64, f64), count: usize) -> Vec<f64> {
    at_angles(from, to, count, |j| j)
}

/// The places half-way between them, in angle.
pub(crate) fn between(range: (f64, f64), count: usize) -> Vec<f64> {
    let (from, to) = range;
    let mut places = at_angles(from, to, count, |j| j + 0.5);
    places.truncate(count - 1);
    places
}

fn at_angles(from: f64, to: f64, count: usize, place: impl Fn(f64) -> f64) -> Vec<f64> {
    if count == 1 {
        return vec![from];
    }
    let cosine = |j: usize| (std::f64::consts::PI * place(j as f64) / (count - 1) as f64).cos();
    let mut at: Vec<f64> = (0..count).map(|j| f64::midpoint(from, to) - 0.5 * (to - from) * cosine(j)).collect();
    // Rounding must not move the ends.
    if place(0.0) == 0.0 {
        at[0] = from;
        at[count - 1] = to;
    }
    at
}
