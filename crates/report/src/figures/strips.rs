//! Residual strips: a row a stroke, time along it, colour for the error. What
//! repeats from stroke to stroke is seen as stripes.

use chart::theme::diverging;
use chart::{Axis, Cell, Figure, Layer, Panel, Swatch};

/// One stroke.
#[derive(Debug, Clone, Default)]
pub struct StripRow {
    /// Its conditions.
    pub name: String,
    /// Instants since the command, s.
    pub time_s: Vec<f64>,
    /// Measured minus simulated, mm.
    pub residual_mm: Vec<f64>,
}

/// Strips before and after a change of the model, on one colour scale.
#[derive(Debug, Clone, Default)]
pub struct StripsFigure {
    /// Headline.
    pub title: String,
    /// What changed.
    pub subtitle: String,
    /// Name and rows of each stage, such as before and after.
    pub stages: Vec<(String, Vec<StripRow>)>,
}

/// Columns of a strip; more would not be seen.
const COLUMNS: usize = 240;
/// Steps of colour on each side of zero.
const LEVELS: f64 = 12.0;

impl StripsFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let limit = self.colour_limit_mm();
        let mut figure = Figure::new(&self.title, &self.subtitle);
        for (index, (name, rows)) in self.stages.iter().enumerate() {
            let last = index + 1 == self.stages.len();
            figure.panels.push(panel(name, rows, limit, index == 0, last));
        }
        figure
    }

    /// Error shown in full colour: what 98 % of the errors stay below, rounded up.
    fn colour_limit_mm(&self) -> f64 {
        let mut sizes: Vec<f64> = self
            .stages
            .iter()
            .flat_map(|(_, rows)| rows.iter().flat_map(|row| row.residual_mm.iter()))
            .map(|residual| residual.abs())
            .filter(|size| size.is_finite())
            .collect();
        sizes.sort_by(f64::total_cmp);
        let high = sizes.get(sizes.len() * 98 / 100).copied().unwrap_or(1.0).max(1e-6);
        let decade = 10_f64.powf(high.log10().floor());
        [1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0]
            .into_iter()
            .map(|factor| factor * decade)
            .find(|limit| *limit >= high)
            .unwrap_or(high)
    }
}

fn panel(name: &str, rows: &[StripRow], limit_mm: f64, key: bool, last: bool) -> Panel {
    let end = rows.iter().filter_map(|row| row.time_s.last()).copied().fold(0.0, f64::max);
    let x =
        Axis::linear(if last { "time since the command (s)" } else { "" }).over(0.0, if end > 0.0 { end } else { 1.0 });
    let x = if last { x } else { x.bare() };
    let names = rows.iter().map(|row| row.name.clone()).collect();
    // A multiple of a power of ten is off by a rounding error.
    let limit = (1e6 * limit_mm).round() / 1e6;
    let cells = rows.iter().enumerate().flat_map(|(index, row)| strip(row, index as f64, end, limit_mm)).collect();
    let height = 17.0 * rows.len().max(1) as f64;
    let panel = Panel::new(x, Axis::names("", names), height).titled(name).with(Layer::Cells(cells));
    if !key {
        return panel;
    }
    let scale = Swatch::Scale {
        colours: (-5..=5).map(|step| diverging(f64::from(step) / 5.0)).collect(),
        low: format!("\u{2212}{limit} mm"),
        high: format!("+{limit} mm"),
    };
    panel.keyed(scale, "measured \u{2212} simulated")
}

/// Cells of one row; neighbours of equal colour are one cell.
fn strip(row: &StripRow, at: f64, end: f64, limit_mm: f64) -> Vec<Cell> {
    let mut sums = vec![(0.0, 0_u32); COLUMNS];
    for (time, residual) in row.time_s.iter().zip(&row.residual_mm) {
        if residual.is_finite() && *time >= 0.0 && end > 0.0 {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative")]
            let column = ((time / end * COLUMNS as f64) as usize).min(COLUMNS - 1);
            sums[column].0 += residual;
            sums[column].1 += 1;
        }
    }
    let mut cells: Vec<Cell> = Vec::new();
    for (column, (sum, count)) in sums.into_iter().enumerate() {
        if count == 0 {
            continue;
        }
        let share = (sum / f64::from(count) / limit_mm).clamp(-1.0, 1.0);
        let colour = diverging((share * LEVELS).round() / LEVELS);
        let edge = |index: usize| index as f64 * end / COLUMNS as f64;
        match cells.last_mut() {
            Some(cell) if cell.colour == colour && cell.x[1] == edge(column) => {
                cell.x[1] = edge(column + 1);
            }
            _ => cells.push(Cell {
                x: [edge(column), edge(column + 1)],
                y: [at - 0.46, at + 0.46],
                colour,
                text: String::new(),
            }),
        }
    }
    cells
}
