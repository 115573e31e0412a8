//! Accuracy over noise: what a study of many simulated lives found.

use chart::theme::SERIES;
use chart::{Axis, Figure, Layer, LineDirection, Marker, Panel, Swatch};

/// A value with its spread at one noise level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StudyPoint {
    /// Noise variance of a stroke time, s2.
    pub noise_variance_s2: f64,
    /// Median over the lives.
    pub median: f64,
    /// 10 and 90 % of the lives.
    pub bounds: Option<[f64; 2]>,
}

/// One method.
#[derive(Debug, Clone)]
pub struct StudySeries {
    /// Its name.
    pub name: String,
    /// Its results by noise.
    pub points: Vec<StudyPoint>,
}

/// Relative accuracy of several methods for each fault, side by side.
#[derive(Debug, Clone)]
pub struct StudyFigure {
    /// Headline.
    pub title: String,
    /// Conditions of the study.
    pub subtitle: String,
    /// Fault and its series.
    pub faults: Vec<(String, Vec<StudySeries>)>,
}

impl StudyFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let mut figure = Figure::new(&self.title, &self.subtitle);
        figure.columns = self.faults.len().max(1);
        for (fault, series) in &self.faults {
            figure.panels.push(Self::panel(fault, series));
        }
        figure
    }

    fn panel(fault: &str, series: &[StudySeries]) -> Panel {
        let mut levels: Vec<f64> =
            series.iter().flat_map(|one| one.points.iter().map(|point| point.noise_variance_s2)).collect();
        levels.sort_by(f64::total_cmp);
        levels.dedup();
        let names = levels.iter().map(|level| variance_name(*level)).collect();
        let x = Axis::names("noise variance (s²)", names);
        let y = Axis::linear("relative accuracy").over(0.0, 1.04);
        let mut panel = Panel::new(x, y, 240.0).titled(fault);
        for (index, one) in series.iter().enumerate() {
            let colour = SERIES[index % SERIES.len()];
            // Shifted aside, so that the spreads of several methods stand beside each other.
            let shift = 0.14 * (index as f64 - (series.len() as f64 - 1.0) / 2.0);
            let place = |variance: f64| levels.iter().position(|level| *level == variance).unwrap_or(0) as f64 + shift;
            let medians: Vec<[f64; 2]> =
                one.points.iter().map(|point| [place(point.noise_variance_s2), point.median]).collect();
            let spans = one
                .points
                .iter()
                .filter_map(|point| {
                    let [low, high] = point.bounds?;
                    Some([place(point.noise_variance_s2), low, high])
                })
                .collect();
            panel = panel
                .with(Layer::Whiskers { spans, colour, direction: LineDirection::Vertical })
                .with(Layer::Line { points: medians.clone(), colour, width: 1.4, dashed: false })
                .with(Layer::Points { points: medians, colour, radius: 4.0, marker: Marker::Dot })
                .keyed(Swatch::Dot(colour), &one.name);
        }
        panel
    }
}

fn variance_name(variance: f64) -> String {
    if variance == 0.0 {
        return "0".to_owned();
    }
    let text = format!("{variance:e}");
    match text.split_once('e') {
        Some((mantissa, exponent)) => {
            let power: String = exponent.chars().map(superscript).collect();
            if mantissa == "1" { format!("10{power}") } else { format!("{mantissa}·10{power}") }
        }
        None => text,
    }
}

/// A digit or a minus sign, raised.
fn superscript(letter: char) -> char {
    match letter {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        digit => digit.to_digit(10).and_then(|value| char::from_u32(0x2070 + value)).unwrap_or(digit),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variances_read_as_powers_of_ten() {
        assert_eq!(variance_name(0.0), "0");
        assert_eq!(variance_name(1e-4), "10\u{207b}\u{2074}");
        assert_eq!(variance_name(2.5e-3), "2.5·10\u{207b}\u{b3}");
    }
}
