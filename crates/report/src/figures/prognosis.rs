//! What a timing log tells: severity, remaining useful life and fault over cycles.

use super::Quantity;
use chart::theme::{BLUE, GREEN, GREY, INK, ORANGE, PURPLE, SKY, VERMILLION};
use chart::{Axis, Figure, Layer, LineDirection, Marker, Panel, Swatch};

/// The estimate after one cycle.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PrognosisPoint {
    /// Cycle of the log.
    pub cycle: f64,
    /// Severities that the closing and the opening time of this cycle alone would give, in the unit of
    /// [`PrognosisFigure::quantity`].
    pub readings: [Option<f64>; 2],
    /// Estimated severity.
    pub severity: Option<f64>,
    /// 5 and 95 % bounds of the severity.
    pub severity_bounds: Option<[f64; 2]>,
    /// Estimated remaining useful life, cycles.
    pub rul_cycles: Option<f64>,
    /// 5 and 95 % bounds of the remaining useful life, cycles.
    pub rul_bounds_cycles: Option<[f64; 2]>,
    /// Probability of each of `PrognosisFigure::faults`; empty where it is not known.
    pub fault_probability: Vec<f64>,
}

/// The history of one valve.
#[derive(Debug, Clone, Default)]
pub struct PrognosisFigure {
    /// Headline.
    pub title: String,
    /// Method, noise, verdict.
    pub subtitle: String,
    /// The estimates in order.
    pub points: Vec<PrognosisPoint>,
    /// What the severity counts.
    pub quantity: Quantity,
    /// What its estimate is called in the legend: "estimated leak".
    pub estimated: String,
    /// Severity at which life ends.
    pub severity_at_limit: Option<f64>,
    /// The hypotheses, "none" first.
    pub faults: Vec<String>,
    /// End of life if known afterwards, cycle.
    pub true_eol_cycle: Option<f64>,
    /// Width of the alpha cone, a fraction.
    pub alpha: f64,
}

/// Where marks of what goes on above stand, a share of the axis below its end.
const EDGE: f64 = 0.025;
/// Estimates up to so many times the later ones are shown where they are.
const NEAR: f64 = 2.0;

impl PrognosisFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let mut figure = Figure::new(&self.title, &self.subtitle);
        let known = |pick: fn(&PrognosisPoint) -> bool| self.points.iter().any(pick);
        if known(|point| point.severity.is_some()) {
            figure.panels.push(self.severity());
        }
        if known(|point| point.rul_cycles.is_some()) {
            figure.panels.push(self.rul());
        }
        if known(|point| !point.fault_probability.is_empty()) {
            figure.panels.push(self.faults());
        }
        if let Some(last) = figure.panels.last_mut() {
            last.x.labelled = true;
            "cycle".clone_into(&mut last.x.label);
        }
        figure
    }

    fn cycles(&self) -> Axis {
        let first = self.points.first().map_or(0.0, |point| point.cycle);
        let last = self.points.last().map_or(1.0, |point| point.cycle);
        let end = self.true_eol_cycle.unwrap_or(last).max(last);
        Axis::linear("").over(first - 0.3, if end > first { end + 0.3 } else { first + 1.0 }).bare()
    }

    fn severity(&self) -> Panel {
        let value = |point: &PrognosisPoint| [point.cycle, point.severity.unwrap_or(f64::NAN)];
        let edges = |point: &PrognosisPoint| {
            let [low, high] = point.severity_bounds.unwrap_or([f64::NAN; 2]);
            [point.cycle, low, high]
        };
        let points: Vec<[f64; 2]> = self.points.iter().map(value).collect();
        let top = points.iter().map(|point| point[1]).fold(0.0, f64::max);
        let top = 1.25 * top.max(self.severity_at_limit.unwrap_or(0.0));
        let low = points.iter().map(|point| point[1]).fold(0.0, f64::min);
        let range = [low - 0.03 * top, if top > 0.0 { top } else { 1.0 }];
        let mut panel = Panel::new(self.cycles(), Axis::linear(self.quantity.label()).over(range[0], range[1]), 180.0);
        if self.points.iter().any(|point| point.severity_bounds.is_some()) {
            panel = panel
                .with(Layer::band(self.points.iter().map(edges).collect(), BLUE))
                .keyed(Swatch::Band(BLUE), "5 to 95 %");
        }
        // Told apart without colour too.
        for (index, (name, colour, marker, swatch)) in [
            ("from the closing time", ORANGE, Marker::Ring, Swatch::Ring(ORANGE)),
            ("from the opening time", PURPLE, Marker::Triangle, Swatch::Triangle(PURPLE)),
        ]
        .into_iter()
        .enumerate()
        {
            let readings: Vec<[f64; 2]> =
                self.points.iter().filter_map(|point| Some([point.cycle, point.readings[index]?])).collect();
            if !readings.is_empty() {
                panel = panel.with(Layer::Points { points: readings, colour, radius: 3.2, marker }).keyed(swatch, name);
            }
        }
        if let Some(limit) = self.severity_at_limit {
            panel = panel.with(Layer::Level {
                at: limit,
                direction: LineDirection::Horizontal,
                colour: VERMILLION,
                dashed: true,
                text: format!("end of life at {}", self.quantity.text(limit, 3)),
            });
        }
        panel
            .with(Layer::line(points.clone(), BLUE))
            .with(Layer::Points { points, colour: BLUE, radius: 2.6, marker: Marker::Dot })
            .keyed(Swatch::Dot(BLUE), &self.estimated)
    }

    fn rul(&self) -> Panel {
        let points: Vec<[f64; 2]> =
            self.points.iter().map(|point| [point.cycle, point.rul_cycles.unwrap_or(f64::NAN)]).collect();
        let range = self.rul_range(&points);
        let y = Axis::linear("remaining life (cycles)").over(range[0], range[1]);
        let mut panel = Panel::new(self.cycles(), y, 200.0);
        if let Some(eol) = self.true_eol_cycle {
            let first = self.points.first().map_or(0.0, |point| point.cycle);
            let truth = vec![[first, eol - first], [eol, 0.0]];
            let cone =
                truth.iter().map(|[cycle, rul]| [*cycle, rul * (1.0 - self.alpha), rul * (1.0 + self.alpha)]).collect();
            panel = panel
                .with(Layer::Band { points: cone, colour: GREEN, opacity: 0.25 })
                .with(Layer::Line { points: truth, colour: GREEN, width: 1.6, dashed: true })
                .keyed(Swatch::Dashed(GREEN), "true")
                .keyed(Swatch::Band(GREEN), format!("within {:.0} %", 100.0 * self.alpha));
        }
        if self.points.iter().any(|point| point.rul_bounds_cycles.is_some()) {
            let edges = |point: &PrognosisPoint| {
                let [low, high] = point.rul_bounds_cycles.unwrap_or([f64::NAN; 2]);
                [point.cycle, low, high]
            };
            panel = panel
                .with(Layer::band(self.points.iter().map(edges).collect(), BLUE))
                .keyed(Swatch::Band(BLUE), "5 to 95 %");
        }
        panel = panel
            .with(Layer::line(points.clone(), BLUE))
            .with(Layer::dots(points, BLUE))
            .keyed(Swatch::Dot(BLUE), "estimated remaining life");
        let highest = |point: &PrognosisPoint| {
            let values = [point.rul_cycles, point.rul_bounds_cycles.map(|[_, high]| high)];
            values.into_iter().flatten().filter(|value| value.is_finite()).fold(0.0, f64::max)
        };
        let above: Vec<&PrognosisPoint> = self.points.iter().filter(|point| highest(point) > range[1]).collect();
        if above.is_empty() {
            return panel;
        }
        let most = above.iter().map(|point| highest(point)).fold(0.0, f64::max);
        let edge = range[1] - EDGE * (range[1] - range[0]);
        let marks = above.iter().map(|point| [point.cycle, edge]).collect();
        panel
            .with(Layer::Points { points: marks, colour: INK, radius: 3.4, marker: Marker::Up })
            .keyed(Swatch::Up(INK), format!("goes on above, to {most:.0} at most"))
    }

    /// The first estimates may lie anywhere; the axis is made for the later ones, and shows the first if they are near.
    fn rul_range(&self, points: &[[f64; 2]]) -> [f64; 2] {
        let first = self.points.first().map_or(0.0, |point| point.cycle);
        let mut known: Vec<f64> = points.iter().map(|point| point[1]).filter(|rul| rul.is_finite()).collect();
        known.sort_by(f64::total_cmp);
        let typical = known.get(known.len() * 9 / 10).copied().unwrap_or(1.0);
        let top = self.true_eol_cycle.map_or(typical, |eol| 1.2 * (eol - first));
        let most = known.last().copied().unwrap_or(1.0);
        let top = if most <= NEAR * top { top.max(0.9 * most) } else { top };
        [-0.03 * top.max(1.0), 1.2 * top.max(1.0)]
    }

    fn faults(&self) -> Panel {
        let y = Axis::linear("probability").over(-0.03, 1.03);
        let mut panel = Panel::new(self.cycles(), y, 90.0);
        let colours = [GREY, BLUE, ORANGE, GREEN, VERMILLION, PURPLE, SKY, INK];
        for (index, (name, colour)) in self.faults.iter().zip(colours.into_iter().cycle()).enumerate() {
            let points = self
                .points
                .iter()
                .map(|point| [point.cycle, point.fault_probability.get(index).copied().unwrap_or(f64::NAN)])
                .collect();
            panel = panel.with(Layer::line(points, colour)).keyed(Swatch::Line(colour), name);
        }
        panel
    }
}
