//! Polynomial interpolation through a few nodes: the weight of each node at some place.
//!
//! Through the extrema of a Chebyshev polynomial this is as good as any polynomial of the degree but for
//! a small factor, and converges faster than any power where the function is smooth (Trefethen,
//! Approximation Theory and Approximation Practice, 2013, chapters 2 to 8).

/// The most nodes of one condition.
pub(crate) const MOST_NODES: usize = 17;

/// Nodes on a line.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Nodes {
    at: Vec<f64>,
    middle: f64,
    half_width: f64,
    /// Nodes scaled to -1..1.
    scaled: Vec<f64>,
    /// One over the product of the distances to all other nodes, scaled.
    inverse_distances: Vec<f64>,
}

/// The weights of the nodes at one place, and their derivatives.
pub(crate) struct Weights {
    pub value: [f64; MOST_NODES],
    pub derivative: [f64; MOST_NODES],
}

impl Nodes {
    /// From places that rise strictly, 1 to [`MOST_NODES`] of them; nothing otherwise.
    pub(crate) fn new(at: Vec<f64>) -> Option<Self> {
        let rises = at.is_sorted_by(|a, b| a < b) && at.iter().all(|x| x.is_finite());
        if at.is_empty() || at.len() > MOST_NODES || !rises {
            return None;
        }
        let (first, last) = (at[0], at[at.len() - 1]);
        let middle = f64::midpoint(first, last);
        let half_width = if last > first { 0.5 * (last - first) } else { 1.0 };
        let scaled: Vec<f64> = at.iter().map(|x| (x - middle) / half_width).collect();
        let inverse_distances = (0..at.len())
            .map(|j| {
                let others = scaled.iter().enumerate().filter(|(k, _)| *k != j);
                1.0 / others.map(|(_, other)| scaled[j] - other).product::<f64>()
            })
            .collect();
        Some(Self { at, middle, half_width, scaled, inverse_distances })
    }

    pub(crate) fn at(&self) -> &[f64] {
        &self.at
    }

    pub(crate) fn len(&self) -> usize {
        self.at.len()
    }

    pub(crate) fn range(&self) -> (f64, f64) {
        (self.at[0], self.at[self.at.len() - 1])
    }

    /// Products of the distances to the nodes before and after each one give all weights at once.
    #[inline]
    pub(crate) fn weights(&self, x: f64) -> Weights {
        let z = (x - self.middle) / self.half_width;
        let n = self.at.len();
        let mut weights = Weights { value: [0.0; MOST_NODES], derivative: [0.0; MOST_NODES] };
        let (mut product, mut slope) = (1.0, 0.0);
        for j in 0..n {
            weights.value[j] = product;
            weights.derivative[j] = slope;
            let distance = z - self.scaled[j];
            slope = slope * distance + product;
            product *= distance;
        }
        let (mut product, mut slope) = (1.0, 0.0);
        for j in (0..n).rev() {
            let (before, before_slope) = (weights.value[j], weights.derivative[j]);
            let scale = self.inverse_distances[j];
            weights.value[j] = scale * before * product;
            weights.derivative[j] = scale * (before_slope * product + before * slope) / self.half_width;
            let distance = z - self.scaled[j];
            slope = slope * distance + product;
            product *= distance;
        }
        weights
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chebyshev(from: f64, to: f64, n: usize) -> Vec<f64> {
        let angle = |j: usize| std::f64::consts::PI * j as f64 / (n - 1) as f64;
        (0..n).map(|j| f64::midpoint(from, to) - 0.5 * (to - from) * angle(j).cos()).collect()
    }

    #[test]
    fn follows_a_smooth_function_and_its_slope() {
        let nodes = Nodes::new(chebyshev(2.0, 5.0, 13)).expect("rises");
        for i in 0..=300 {
            let x = 2.0 + 0.01 * f64::from(i);
            let weights = nodes.weights(x);
            let sum = |weights: &[f64]| nodes.at().iter().zip(weights).map(|(at, w)| w / at).sum::<f64>();
            assert!((sum(&weights.value) - 1.0 / x).abs() < 1e-8, "{x}");
            assert!((sum(&weights.derivative) + 1.0 / (x * x)).abs() < 1e-6, "{x}");
        }
    }

    #[test]
    fn one_node_is_a_constant_and_a_node_is_met_exactly() {
        let one = Nodes::new(vec![3.0]).expect("one");
        assert_eq!((one.weights(3.0).value[0], one.weights(3.0).derivative[0]), (1.0, 0.0));
        let nodes = Nodes::new(vec![1.0, 2.0, 4.0]).expect("rises");
        let weights = nodes.weights(2.0);
        assert_eq!(weights.value[..3], [0.0, 1.0, 0.0]);
        assert!(Nodes::new(vec![1.0, 1.0]).is_none() && Nodes::new(Vec::new()).is_none());
    }
}
