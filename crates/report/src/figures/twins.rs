//! Which effects these data can tell apart: a map of the expected misfit if one
//! is true and the other is fitted.

use chart::theme::sequential;
use chart::{Axis, Cell, Figure, Layer, Panel, Swatch};

/// Expected gaps between candidates.
#[derive(Debug, Clone, Default)]
pub struct TwinsFigure {
    /// Headline.
    pub title: String,
    /// What it says in a sentence.
    pub subtitle: String,
    /// The candidates.
    pub names: Vec<String>,
    /// Row: the truth; column: what is fitted; expected drop of chi squared
    /// that would be missing. The diagonal is not looked at.
    pub gaps: Vec<Vec<f64>>,
    /// Below this gap two candidates cannot be told apart.
    pub threshold: f64,
}

impl TwinsFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let mut cells = Vec::new();
        for (row, gaps) in self.gaps.iter().enumerate() {
            for (column, gap) in gaps.iter().enumerate() {
                if row == column {
                    continue;
                }
                // From the threshold to a thousand times it, in ratios.
                let share = ((gap / self.threshold).max(1e-3).log10() + 1.0) / 4.0;
                let place = |index: usize| [index as f64 - 0.48, index as f64 + 0.48];
                cells.push(Cell { x: place(column), y: place(row), colour: sequential(share), text: gap_text(*gap) });
            }
        }
        // Long names do not fit below their columns; these carry numbers instead.
        let rows = self.names.iter().enumerate().map(|(index, name)| format!("{name}  {}", index + 1));
        let columns = (1..=self.names.len()).map(|number| number.to_string()).collect();
        let size = 34.0 * self.names.len().max(2) as f64;
        let scale = Swatch::Scale {
            colours: (0..=8).map(|step| sequential(f64::from(step) / 8.0)).collect(),
            low: "twins".to_owned(),
            high: "told apart".to_owned(),
        };
        let panel = Panel::new(Axis::names("fitted", columns), Axis::names("true", rows.collect()), size.min(520.0))
            .with(Layer::Cells(cells))
            .keyed(scale, format!("expected \u{394}\u{3c7}²; below {:.0}: twins", self.threshold));
        Figure::new(&self.title, &self.subtitle).with(panel)
    }
}

fn gap_text(gap: f64) -> String {
    if gap >= 9_999.5 { format!("{:.0}k", gap / 1000.0) } else { format!("{gap:.0}") }
}
