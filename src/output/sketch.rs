//! A small plot in letters: two curves over one axis.

use std::fmt::Write;

const COLUMNS: usize = 68;
const ROWS: usize = 11;

/// Draws two curves over the same range: `.` the first, `o` the second, `8` both.
/// The vertical axis carries the largest and the smallest value, the horizontal one
/// its ends, with the units given.
pub fn sketch(first: &[[f64; 2]], second: &[[f64; 2]], units: [&str; 2]) -> String {
    let all = || first.iter().chain(second);
    let range = |axis: usize| {
        let values = all().map(|point| point[axis]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
    };
    let (x, y) = (range(0), range(1));
    if !(x[1] > x[0] && y[1] > y[0]) {
        return String::new();
    }
    let mut cells = vec![[0_u8; COLUMNS]; ROWS];
    for (bit, curve) in [(1, first), (2, second)] {
        for point in curve {
            let column = place(point[0], x, COLUMNS);
            let row = ROWS - 1 - place(point[1], y, ROWS);
            cells[row][column] |= bit;
        }
    }
    let labels = [format!("{:.1} {}", y[1], units[1]), format!("{:.1} {}", y[0], units[1])];
    let width = labels.iter().map(String::len).max().unwrap_or(0);
    let mut out = String::new();
    for (index, row) in cells.iter().enumerate() {
        let label = match index {
            0 => labels[0].as_str(),
            last if last + 1 == ROWS => labels[1].as_str(),
            _ => "",
        };
        let line: String = row.iter().map(|cell| [' ', '.', 'o', '8'][usize::from(*cell)]).collect();
        out.push_str(format!("{label:>width$} |{line}").trim_end());
        out.push('\n');
    }
    let (start, end) = (format!("{:.1}", x[0]), format!("{:.1} {}", x[1], units[0]));
    let gap = COLUMNS.saturating_sub(start.len() + end.len());
    let rule = "-".repeat(COLUMNS);
    // Writing to a string cannot fail.
    let _ = writeln!(out, "{:width$} +{rule}\n{:width$}  {start}{:gap$}{end}", "", "", "");
    out
}

/// The cell in which a value of a range stands.
fn place(value: f64, [low, high]: [f64; 2], cells: usize) -> usize {
    let share = (value - low) / (high - low);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "inside the range")]
    let cell = (share * cells as f64) as usize;
    cell.min(cells - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_that_part_are_told_apart() {
        let line = |slope: f64| (0..=100).map(|i| [f64::from(i), slope * f64::from(i)]).collect::<Vec<_>>();
        let plot = sketch(&line(1.0), &line(0.5), ["s", "mm"]);
        let rows: Vec<&str> = plot.lines().collect();
        assert_eq!(rows.len(), ROWS + 2);
        assert!(rows[0].starts_with("100.0 mm |") && rows[0].ends_with('.'), "{plot}");
        assert!(rows[ROWS - 1].contains('8') && rows[ROWS - 6].contains('o'), "{plot}");
        assert!(rows[ROWS + 1].ends_with("100.0 s"), "{plot}");
    }

    #[test]
    fn nothing_to_draw_is_nothing() {
        assert_eq!(sketch(&[], &[], ["s", "mm"]), "");
    }
}
