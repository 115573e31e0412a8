//! Axes: which values are shown, where ticks stand and what they say.

/// What an axis shows.
#[derive(Debug, Clone, PartialEq)]
pub enum AxisKind {
    /// Numbers at equal distances.
    Linear,
    /// Numbers at equal ratios; values must be positive.
    Logarithmic,
    /// Names; the n-th name stands at n, the first at the top of a vertical axis.
    Names(Vec<String>),
}

/// One axis of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Quantity and unit, such as `time (s)`.
    pub label: String,
    /// What it shows.
    pub kind: AxisKind,
    /// Range to show; without it, the range of the data.
    pub range: Option<[f64; 2]>,
    /// Values that must be in view beside the data.
    pub include: Vec<f64>,
    /// False hides the labels of the ticks, for panels that share an axis.
    pub labelled: bool,
}

impl Axis {
    /// An axis of numbers that shows all data.
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), kind: AxisKind::Linear, range: None, include: Vec::new(), labelled: true }
    }

    /// An axis of ratios that shows all data.
    pub fn logarithmic(label: impl Into<String>) -> Self {
        Self { kind: AxisKind::Logarithmic, ..Self::linear(label) }
    }

    /// An axis of names.
    pub fn names(label: impl Into<String>, names: Vec<String>) -> Self {
        Self { kind: AxisKind::Names(names), ..Self::linear(label) }
    }

    /// The same axis over a fixed range.
    #[must_use]
    pub fn over(mut self, low: f64, high: f64) -> Self {
        self.range = Some([low, high]);
        self
    }

    /// The same axis with a value in view.
    #[must_use]
    pub fn showing(mut self, value: f64) -> Self {
        self.include.push(value);
        self
    }

    /// The same axis without tick labels and title.
    #[must_use]
    pub fn bare(mut self) -> Self {
        self.labelled = false;
        self
    }
}

/// An axis with its range settled and its place on the page.
#[derive(Debug, Clone)]
pub(super) struct Scale {
    low: f64,
    high: f64,
    logarithmic: bool,
    /// Page coordinate of `low` and of `high`.
    pub ends: [f64; 2],
}

impl Scale {
    /// Page coordinate of a value.
    pub fn at(&self, value: f64) -> f64 {
        let share = if self.logarithmic {
            (value.max(f64::MIN_POSITIVE).ln() - self.low.ln()) / (self.high.ln() - self.low.ln())
        } else {
            (value - self.low) / (self.high - self.low)
        };
        // Far outside the panel the exact place does not matter, and renderers
        // dislike huge numbers.
        self.ends[0] + (self.ends[1] - self.ends[0]) * share.clamp(-20.0, 20.0)
    }

    /// True for a value inside the range.
    pub fn contains(&self, value: f64) -> bool {
        let slack = 1e-9 * (self.high - self.low).abs();
        (self.low - slack..=self.high + slack).contains(&value)
    }
}

/// The range that an axis shows: its own, or that of the data with a margin.
pub(super) fn settle_range(axis: &Axis, data: impl Iterator<Item = f64>, margin: f64) -> [f64; 2] {
    if let AxisKind::Names(names) = &axis.kind {
        return [-0.5, names.len() as f64 - 0.5];
    }
    if let Some(range) = axis.range {
        return range;
    }
    let logarithmic = axis.kind == AxisKind::Logarithmic;
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for value in data.chain(axis.include.iter().copied()) {
        if value.is_finite() && (!logarithmic || value > 0.0) {
            low = low.min(value);
            high = high.max(value);
        }
    }
    if low > high {
        return if logarithmic { [0.1, 1.0] } else { [0.0, 1.0] };
    }
    if logarithmic {
        let grow = (high / low).powf(margin).max(1.02);
        return [low / grow, high * grow];
    }
    if high - low <= 1e-12 * high.abs().max(low.abs()) {
        let half = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
        return [low - half, high + half];
    }
    let grow = margin * (high - low);
    // A quantity that starts at zero keeps zero as its edge.
    let floor = if low >= 0.0 && axis.include.contains(&0.0) { low.min(0.0) } else { low - grow };
    [floor, high + grow]
}

/// Places an axis of a settled range on the page.
pub(super) fn scale(axis: &Axis, range: [f64; 2], ends: [f64; 2]) -> Scale {
    Scale { low: range[0], high: range[1], logarithmic: axis.kind == AxisKind::Logarithmic, ends }
}

/// Ticks: value and text, at most about `most` of them.
pub(super) fn ticks(axis: &Axis, range: [f64; 2], most: usize) -> Vec<(f64, String)> {
    match &axis.kind {
        AxisKind::Names(names) => names.iter().enumerate().map(|(index, name)| (index as f64, name.clone())).collect(),
        AxisKind::Linear => {
            // One tick says nothing of the scale; a finer step is tried then.
            let ticks = linear_ticks(range, most);
            if ticks.len() < 2 { linear_ticks(range, 2 * most) } else { ticks }
        }
        AxisKind::Logarithmic => logarithmic_ticks(range, most),
    }
}

fn linear_ticks(range: [f64; 2], most: usize) -> Vec<(f64, String)> {
    let span = range[1] - range[0];
    if !(span.is_finite() && span > 0.0) {
        return Vec::new();
    }
    let coarse = span / most.max(1) as f64;
    let decade = 10_f64.powi(floor_log10(coarse));
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * decade)
        .find(|step| *step >= coarse * 0.999)
        .unwrap_or(10.0 * decade);
    let decimals = (-floor_log10(step * 1.001)).max(0).unsigned_abs() as usize;
    let first = (range[0] / step - 1e-6).ceil();
    let count = ((range[1] / step + 1e-6).floor() - first).max(-1.0) + 1.0;
    // The count is at most `most` and a few: the step was chosen for that.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small count")]
    let count = count as usize;
    (0..count)
        .map(|index| {
            let value = (first + index as f64) * step;
            (value, tick_text(value, decimals))
        })
        .collect()
}

fn logarithmic_ticks(range: [f64; 2], most: usize) -> Vec<(f64, String)> {
    let (first, last) = (floor_log10(range[0]), floor_log10(range[1]));
    let factors: &[f64] =
        if ((last - first + 1) * 3).unsigned_abs() as usize <= most + 1 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let mut ticks = Vec::new();
    for exponent in first..=last {
        for factor in factors {
            let value = factor * 10_f64.powi(exponent);
            if value >= range[0] * 0.999_999 && value <= range[1] * 1.000_001 {
                let decimals = (-exponent).max(0).unsigned_abs() as usize;
                ticks.push((value, tick_text(value, decimals)));
            }
        }
    }
    ticks
}

fn floor_log10(value: f64) -> i32 {
    #[expect(clippy::cast_possible_truncation, reason = "an exponent of an f64")]
    let exponent = value.log10().floor() as i32;
    exponent
}

/// A number with a real minus sign.
fn tick_text(value: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    let is_zero = text.chars().all(|letter| letter == '0' || letter == '.');
    if value < 0.0 && !is_zero { format!("\u{2212}{text}") } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(range: [f64; 2], most: usize) -> Vec<String> {
        linear_ticks(range, most).into_iter().map(|tick| tick.1).collect()
    }

    #[test]
    fn ticks_are_round_numbers_inside_the_range() {
        assert_eq!(texts([0.0, 12.0], 6), ["0", "2", "4", "6", "8", "10", "12"]);
        assert_eq!(texts([-0.1, 0.12], 4), ["\u{2212}0.1", "0.0", "0.1"]);
        assert_eq!(texts([100.0, 620.0], 4), ["200", "400", "600"]);
        assert!(texts([1.0, 1.0], 4).is_empty());
    }

    #[test]
    fn decades_get_a_tick_each() {
        let ticks = logarithmic_ticks([0.8, 120.0], 4);
        assert_eq!(ticks.iter().map(|tick| tick.1.as_str()).collect::<Vec<_>>(), ["1", "10", "100"]);
    }

    #[test]
    fn range_covers_data_and_required_values() {
        let axis = Axis::linear("x").showing(0.0);
        assert_eq!(settle_range(&axis, [2.0, 4.0, f64::NAN].into_iter(), 0.05), [0.0, 4.2]);
        let empty = settle_range(&Axis::linear("x"), std::iter::empty(), 0.05);
        assert_eq!(empty, [0.0, 1.0]);
    }

    #[test]
    fn scale_is_linear_between_its_ends() {
        let axis = Axis::linear("x");
        let scale = scale(&axis, [0.0, 10.0], [100.0, 300.0]);
        assert_eq!(scale.at(2.5), 150.0);
        assert!(scale.contains(10.0) && !scale.contains(10.1));
    }
}
