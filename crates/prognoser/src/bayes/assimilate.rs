//! A hypothesis meets a reading.

#![expect(clippy::needless_range_loop, reason = "rows and columns of matrices")]

use super::hypothesis::{Cause, Hypothesis, SIZE};
use super::law::Law;
use super::noise::{Densities, Innovations, NoiseState};
use super::plant::Plant;
use super::special::{normal_tail, quick_ln};
use super::wide::{Wide, widely};

/// Squared innovation, in expected variances, from which on something else than
/// noise is considered.
const LARGE_INNOVATION: f64 = 12.0;
/// Share of the readings that stray farther than noise does, and their variance in
/// that of the noise: few hands and clocks are Gaussian.
const STRAYS: f64 = 0.02;
const STRAY_VARIANCE: f64 = 12.0;
/// Shape of the noise's posterior up to which its size is not known.
const UNKNOWN_UP_TO: f64 = 30.0;
/// Moves of the severity up to which the tables are straight enough.
const STRAIGHT: f64 = 0.004;
/// The same of a hypothesis that is too unlikely to matter.
const IDLY_STRAIGHT: f64 = 0.05;
/// The same where the law of growth bends, share of the coordinate itself.
const BENT_STRAIGHT: f64 = 0.1;
/// Largest move of a severity from one linearisation to the next: no further than the tables can be trusted to be
/// anything like straight.
const LARGEST_PASS: f64 = 0.3;
/// Probability of being a proper reading from which on a time teaches anything.
pub(crate) const PROPER_FROM: f64 = 0.5;
/// Probability of a stroke that does not arrive below which it counts as far off as an outlier.
const HARDLY_LATE: f64 = 1e-3;
/// Most linearisations of one reading.
const MOST_PASSES: usize = 4;

/// Standard deviation of a coordinate, share of its mean, from which on an exponential law bends too much within it for
/// one straight line: a leak that is not seen yet would tell nothing of the paces at which it would be.
const VAGUE: f64 = 0.3;
/// Standard deviation of a coordinate below which it does not matter, share of the limit.
const SURE: f64 = 0.01;
/// Logarithm of the weight from which on a vague coordinate is looked at node by node: with -5, -7 and -9 lives come out the
/// same, and a fleet that is mostly healthy takes a tenth longer with -7.
const LN_BY_NODES: f64 = -6.0;
/// Nodes over a vague coordinate, and the standard deviations that they reach to either side.
const NODES: usize = 7;
const REACH: f64 = 3.5;
/// Hypotheses that are weighed side by side.
const SIDE: usize = 4;
/// Logarithm of the square root of 2 pi.
const LN_SQRT_TAU: f64 = 0.918_938_533_204_672_7;

/// What one cycle says, as the hypotheses meet it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Observation {
    /// Times in s, closing and opening; none where there is none.
    pub time_s: [Option<f64>; 2],
    /// Strokes that did not arrive.
    pub stalled: [bool; 2],
    /// Share of outliers.
    pub outlier_share: f64,
    /// What a reading counts for the noise variance.
    pub weight: f64,
    /// Shape of the inverse gamma posterior of the noise variance.
    pub shape: f64,
    /// Logarithm of the weight below which a hypothesis is hardly looked at.
    pub ln_idle: f64,
}

/// How a hypothesis met it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Update {
    /// Logarithm of the probability of the reading.
    pub ln: f64,
    /// Probability that each time was a proper reading.
    pub inlier: [f64; 2],
    /// Innovation of each time in s.
    pub residual_s: [Option<f64>; 2],
    /// Whether noise hardly explains it.
    pub is_outlying: bool,
}

/// The time of a stroke under a hypothesis at some state. It moves with two numbers of
/// the hypothesis at most: which, and by how much.
#[derive(Clone, Copy, Debug, Default)]
struct Expected {
    time_s: f64,
    moves_with: [usize; 2],
    by: [f64; 2],
}

impl Expected {
    /// Of both strokes.
    #[inline]
    fn of(hypothesis: &Hypothesis, plant: &Plant, at: &[f64; SIZE]) -> [Self; 2] {
        match hypothesis.cause {
            Cause::None => {
                let of = |stroke: usize| {
                    let healthy_s = plant.healthy_s(stroke);
                    let time_s = healthy_s * (1.0 + at[2 + stroke]);
                    Self { time_s, moves_with: [0, 2 + stroke], by: [0.0, healthy_s] }
                };
                [of(0), of(1)]
            }
            Cause::Wear(wear) => {
                let (severity, grows) = hypothesis.law.severity(at[0]);
                let times = plant.times_and_slopes(wear, severity);
                let of = |stroke: usize| {
                    let (time, by_severity) = times[stroke];
                    let factor = 1.0 + at[2 + stroke];
                    let by = [by_severity * grows * factor, time];
                    Self { time_s: time * factor, moves_with: [0, 2 + stroke], by }
                };
                [of(0), of(1)]
            }
            Cause::Both => {
                let times = plant.both_leaks([at[0], at[1]]);
                let of = |stroke: usize| {
                    let ((time_s, [by_first, by_second]), factor) = (times[stroke], 1.0 + hypothesis.unit[stroke]);
                    let by = [by_first * factor, by_second * factor];
                    Self { time_s: time_s * factor, moves_with: [0, 1], by }
                };
                [of(0), of(1)]
            }
            Cause::Other => {
                let of = |stroke: usize| {
                    let time_s = plant.healthy_s(stroke) + at[stroke];
                    Self { time_s, moves_with: [stroke, 2], by: [1.0, 0.0] }
                };
                [of(0), of(1)]
            }
        }
    }
}

/// What a hypothesis is linearised about, and how often it was.
#[derive(Clone, Copy, Debug)]
struct Course {
    at: [f64; SIZE],
    /// Its numbers that are severities.
    levels: usize,
    passes: usize,
    expected: [Expected; 2],
    probability: f64,
    distance: f64,
    update: Update,
}

/// What a stroke tells a hypothesis.
#[derive(Clone, Copy, Debug, Default)]
struct Look {
    /// Covariance of each number with the time, and the variance of the time, in that of the noise.
    by_cov: [f64; SIZE],
    model_spread: f64,
    spread: f64,
    predicted_s: f64,
    innovation_s: f64,
    /// Densities of the time, if it is a proper reading and if it strays.
    density: f64,
    stray: f64,
    /// What was known of the noise before it.
    noise: NoiseState,
}

/// Memory of [`assimilate_all`].
#[derive(Default)]
pub(crate) struct Meeting {
    /// The hypotheses before the reading.
    pub before: Vec<Hypothesis>,
    /// How each met it.
    pub updates: Vec<Update>,
    together: Together,
    /// Those that are linearised once more.
    open: Vec<usize>,
    /// Those that are looked at node by node.
    vague: Vec<usize>,
    /// Their nodes, one hypothesis after the other, and the places of those.
    nodes: Vec<Hypothesis>,
    places: Vec<usize>,
}

/// Hypotheses that are linearised together: what each is linearised about, and what a stroke tells it.
#[derive(Default)]
struct Together {
    courses: Vec<Course>,
    looks: Vec<Look>,
}

/// Updates a hypothesis by a reading. It is linearised where it is expected, and
/// again where it leads, if that is elsewhere; node by node if no line does.
pub(crate) fn assimilate(
    hypothesis: &mut Hypothesis,
    before: &Hypothesis,
    plant: &Plant,
    observed: &Observation,
) -> Update {
    if is_vague(before, observed) {
        return by_nodes(hypothesis, before, plant, observed);
    }
    let mut course = Course::new(before);
    loop {
        course.pass(hypothesis, plant, observed);
        if !course.goes_on(hypothesis, before, observed) {
            return course.update;
        }
    }
}

/// Whether the coordinate of an exponential law is so little known that no straight line does.
fn is_vague(before: &Hypothesis, observed: &Observation) -> bool {
    let sd = (VAGUE * before.mean[0].max(0.0)).max(SURE);
    matches!(before.law, Law::Exponential | Law::SteepExponential)
        && matches!(before.cause, Cause::Wear(_))
        && before.ln_weight > LN_BY_NODES
        && before.cov[0][0] * before.scale > observed.shape * sd * sd
}

/// Updates a hypothesis by a reading met at each of some nodes over its coordinate, and takes what comes out together for
/// a Gaussian again.
fn by_nodes(hypothesis: &mut Hypothesis, before: &Hypothesis, plant: &Plant, observed: &Observation) -> Update {
    let mut updates = [Update::default(); NODES];
    let mut nodes = nodes_of(before, observed);
    for (node, update) in nodes.iter_mut().zip(&mut updates) {
        let mut course = Course::new(node);
        course.pass(node, plant, observed);
        *update = course.update;
    }
    from_nodes(hypothesis, before, &nodes, updates.into_iter(), observed)
}

/// A hypothesis at each of some nodes over its coordinate.
fn nodes_of(before: &Hypothesis, observed: &Observation) -> [Hypothesis; NODES] {
    let sd = (before.cov[0][0] * before.scale / observed.shape).sqrt();
    let step = 2.0 * REACH / (NODES - 1) as f64;
    let ln_step = quick_ln(step) - LN_SQRT_TAU;
    // But for the means all are the same.
    let mut at = before.given(0, before.mean[0]);
    // Known exactly, which rounding must not make a little less.
    for i in 0..SIZE {
        (at.cov[0][i], at.cov[i][0]) = (0.0, 0.0);
    }
    std::array::from_fn(|node| {
        let z = node as f64 * step - REACH;
        let mut at = at;
        at.mean = before.means_given(0, before.mean[0] + z * sd);
        at.ln_weight += ln_step - 0.5 * z * z;
        at
    })
}

/// What has become of a hypothesis whose nodes have met the reading.
fn from_nodes(
    hypothesis: &mut Hypothesis,
    before: &Hypothesis,
    nodes: &[Hypothesis],
    updates: impl Iterator<Item = Update>,
    observed: &Observation,
) -> Update {
    let mut best: Option<(f64, Update)> = None;
    for (at, update) in nodes.iter().zip(updates) {
        if best.is_none_or(|(ln_weight, _)| ln_weight < at.ln_weight) {
            best = Some((at.ln_weight, update));
        }
    }
    *hypothesis = Hypothesis::merged(nodes, observed.shape);
    let mut update = best.map(|(_, update)| update).unwrap_or_default();
    update.ln = hypothesis.ln_weight - before.ln_weight;
    for stroke in 0..2 {
        // Nodes may differ in whether it was a proper reading.
        if update.residual_s[stroke].is_none() || update.inlier[stroke] < PROPER_FROM {
            hypothesis.noise.left_s[stroke] = f64::NAN;
        }
    }
    update
}

/// The same of all hypotheses, which `meeting` has as they were before. Each step is taken by all of them before the
/// next one: a step waits for the one before, and a processor works on several hypotheses while it does.
pub(crate) fn assimilate_all(
    hypotheses: &mut [Hypothesis],
    Meeting { before, updates, together, open, vague, nodes, places }: &mut Meeting,
    plant: &Plant,
    observed: &Observation,
) {
    open.clear();
    vague.clear();
    for (i, hypothesis) in before.iter().enumerate() {
        if is_vague(hypothesis, observed) { &mut *vague } else { &mut *open }.push(i);
    }
    updates.clear();
    updates.resize(before.len(), Update::default());
    if !vague.is_empty() {
        nodes.clear();
        for &i in vague.iter() {
            nodes.extend(nodes_of(&before[i], observed));
        }
        places.clear();
        places.extend(0..nodes.len());
        together.begin(nodes);
        together.pass(nodes, places, plant, observed);
        for ((&i, nodes), courses) in vague.iter().zip(nodes.chunks(NODES)).zip(together.courses.chunks(NODES)) {
            let met = courses.iter().map(|course| course.update);
            updates[i] = from_nodes(&mut hypotheses[i], &before[i], nodes, met, observed);
        }
    }
    together.begin(before);
    while !open.is_empty() {
        together.pass(hypotheses, open, plant, observed);
        open.retain(|&i| {
            let course = &mut together.courses[i];
            updates[i] = course.update;
            course.goes_on(&mut hypotheses[i], &before[i], observed)
        });
    }
}

impl Together {
    /// Begins with some hypotheses.
    fn begin(&mut self, before: &[Hypothesis]) {
        self.courses.clear();
        self.courses.extend(before.iter().map(Course::new));
        self.looks.resize(before.len(), Look::default());
    }

    /// A linearised update of some of them.
    fn pass(&mut self, hypotheses: &mut [Hypothesis], open: &[usize], plant: &Plant, observed: &Observation) {
        let Self { courses, looks } = self;
        for &i in open {
            courses[i].expect(&hypotheses[i], plant);
        }
        for stroke in 0..2 {
            if observed.tells(stroke) {
                for &i in open {
                    looks[i].at(&hypotheses[i], &courses[i], plant, observed, stroke);
                }
                widely(Weighing { looks, hypotheses, open, observed, stroke });
            }
            let improper = observed.improper(plant, stroke);
            for &i in open {
                courses[i].learn((&looks[i], improper), &mut hypotheses[i], plant, observed, stroke);
            }
        }
        for &i in open {
            courses[i].finish(&mut hypotheses[i]);
        }
    }
}

/// Readings of a stroke that are no proper ones.
#[derive(Clone, Copy, Debug)]
struct Improper {
    /// Share of those that stray farther than noise does.
    strays: f64,
    /// Density of outliers, 1/s: anywhere within the window.
    outliers: f64,
}

impl Observation {
    /// Whether anything is known of a stroke.
    fn tells(&self, stroke: usize) -> bool {
        self.time_s[stroke].is_some() || self.stalled[stroke]
    }

    /// What of a stroke is no proper reading. None strays before the noise is known, which would be taken for them.
    fn improper(&self, plant: &Plant, stroke: usize) -> Improper {
        Improper {
            strays: STRAYS * (1.0 - UNKNOWN_UP_TO / self.shape).max(0.0),
            outliers: self.outlier_share / plant.window_s(stroke),
        }
    }
}

impl Course {
    fn new(before: &Hypothesis) -> Self {
        let levels = match before.cause {
            Cause::None | Cause::Other => 0,
            Cause::Wear(_) => 1,
            Cause::Both => 2,
        };
        Self {
            at: before.mean,
            levels,
            passes: 0,
            expected: [Expected::default(); 2],
            probability: 1.0,
            distance: 0.0,
            update: Update::default(),
        }
    }

    /// A linearised update.
    fn pass(&mut self, hypothesis: &mut Hypothesis, plant: &Plant, observed: &Observation) {
        let mut look = Look::default();
        self.expect(hypothesis, plant);
        for stroke in 0..2 {
            if observed.tells(stroke) {
                look.at(hypothesis, self, plant, observed, stroke);
                look.weigh(hypothesis, observed, stroke);
            }
            self.learn((&look, observed.improper(plant, stroke)), hypothesis, plant, observed, stroke);
        }
        self.finish(hypothesis);
    }

    /// Begins a linearised update.
    #[inline]
    fn expect(&mut self, hypothesis: &Hypothesis, plant: &Plant) {
        self.expected = Expected::of(hypothesis, plant, &self.at);
        self.passes += 1;
        (self.probability, self.distance) = (1.0, 0.0);
        self.update = Update { inlier: [1.0; 2], ..Update::default() };
    }

    /// Ends it.
    #[inline]
    fn finish(&mut self, out: &mut Hypothesis) {
        self.update.ln = quick_ln(self.probability);
        self.update.is_outlying = self.distance > LARGE_INNOVATION;
        out.ln_weight += self.update.ln;
    }

    /// Whether it led so far away that it is done again about there, from what was before.
    #[inline]
    fn goes_on(&mut self, hypothesis: &mut Hypothesis, before: &Hypothesis, observed: &Observation) -> bool {
        if self.levels == 0 || self.passes == MOST_PASSES {
            return false;
        }
        let curved = hypothesis.law != Law::Linear;
        let straight = if before.ln_weight < observed.ln_idle { IDLY_STRAIGHT } else { STRAIGHT };
        let at = &mut self.at;
        let moved = (0..self.levels).map(|i| (hypothesis.mean[i] - at[i]).abs()).fold(0.0, f64::max);
        if moved < straight && !(curved && moved > BENT_STRAIGHT * at[0].abs()) {
            return false;
        }
        for i in 0..self.levels {
            at[i] += (hypothesis.mean[i] - at[i]).clamp(-LARGEST_PASS, LARGEST_PASS);
        }
        if self.levels == 1 {
            (at[2], at[3]) = (hypothesis.mean[2], hypothesis.mean[3]);
        }
        *hypothesis = *before;
        true
    }

    /// Takes in what a stroke tells.
    #[inline]
    fn learn(
        &mut self,
        (look, improper): (&Look, Improper),
        out: &mut Hypothesis,
        plant: &Plant,
        observed: &Observation,
        stroke: usize,
    ) {
        if !observed.tells(stroke) {
            out.noise.left_s[stroke] = f64::NAN;
            return;
        }
        let shape = observed.shape;
        let window_s = plant.window_s(stroke);
        let Look { by_cov, model_spread, spread, predicted_s, innovation_s, density, stray, .. } = *look;
        let (innovation, inlier) = if observed.time_s[stroke].is_some() {
            let Improper { strays, outliers } = improper;
            let density = density * (1.0 - observed.outlier_share) * (1.0 - strays);
            let total = density + strays * stray + outliers;
            self.probability *= total;
            let inlier = density / total;
            self.update.residual_s[stroke] = Some(innovation_s);
            self.distance += innovation_s * innovation_s * shape / ((1.0 + model_spread) * out.scale);
            if inlier < PROPER_FROM {
                out.noise = look.noise;
                out.noise.left_s[stroke] = f64::NAN;
            } else {
                out.noise.left_s[stroke] = innovation_s * out.inflation / spread;
            }
            (innovation_s, inlier)
        } else {
            // Not there within the window: anything beyond is as likely.
            out.noise.left_s[stroke] = f64::NAN;
            let sd = (spread * out.scale / shape).sqrt();
            let late = normal_tail((window_s - predicted_s) / sd) * (1.0 - observed.outlier_share);
            let total = late + observed.outlier_share;
            self.probability *= total;
            self.distance += if late < HARDLY_LATE { LARGE_INNOVATION } else { 0.0 };
            // Where it is expected beyond the window, nothing is learnt.
            (window_s - predicted_s, late / total)
        };
        self.update.inlier[stroke] = inlier;
        if observed.time_s[stroke].is_none() && predicted_s >= window_s {
            return;
        }
        if inlier < PROPER_FROM {
            return;
        }
        // A doubtful reading counts as noisier, in proportion.
        let doubted = spread + out.inflation * (1.0 / inlier - 1.0);
        let share = 1.0 / doubted;
        for i in 0..SIZE {
            let gain = by_cov[i] * share;
            out.mean[i] += gain * innovation;
            for j in 0..SIZE {
                out.cov[i][j] -= gain * by_cov[j];
            }
        }
        out.scale += 0.5 * observed.weight * innovation * innovation * out.inflation * share;
    }
}

impl Look {
    /// What is expected of a stroke beside what was measured.
    #[inline]
    fn at(&mut self, out: &Hypothesis, course: &Course, plant: &Plant, observed: &Observation, stroke: usize) {
        let Expected { time_s, moves_with: [a, b], by: [by_a, by_b] } = course.expected[stroke];
        let at = &course.at;
        self.predicted_s = time_s + by_a * (out.mean[a] - at[a]) + by_b * (out.mean[b] - at[b]);
        let (row_a, row_b) = (&out.cov[a], &out.cov[b]);
        for i in 0..SIZE {
            self.by_cov[i] = by_a * row_a[i] + by_b * row_b[i];
        }
        self.model_spread = (by_a * self.by_cov[a] + by_b * self.by_cov[b]).max(0.0);
        self.spread = out.inflation + self.model_spread;
        self.innovation_s = observed.time_s[stroke].unwrap_or(plant.window_s(stroke)) - self.predicted_s;
    }

    /// How likely the measured time is.
    #[inline(always)]
    fn weigh(&mut self, out: &mut Hypothesis, observed: &Observation, stroke: usize) {
        if observed.time_s[stroke].is_none() {
            return;
        }
        let mut alone = Innovations::<1>::new();
        self.set_in(&mut alone, 0, out, stroke);
        self.take_from(&alone.densities(observed.shape, STRAY_VARIANCE), 0, out, stroke);
    }

    /// Puts the innovation among others.
    #[inline(always)]
    fn set_in<const N: usize>(&self, all: &mut Innovations<N>, place: usize, out: &Hypothesis, stroke: usize) {
        all.set(place, self.innovation_s, self.model_spread, out.scale, out.noise.left_s[stroke]);
    }

    /// Takes what came out for it.
    #[inline(always)]
    fn take_from<const N: usize>(&mut self, all: &Densities<N>, place: usize, out: &mut Hypothesis, stroke: usize) {
        self.noise = out.noise;
        (self.density, self.stray) = all.tell(place, &mut out.noise, stroke);
    }
}

/// How likely the measured time is under each of some hypotheses.
struct Weighing<'a> {
    looks: &'a mut [Look],
    hypotheses: &'a mut [Hypothesis],
    open: &'a [usize],
    observed: &'a Observation,
    stroke: usize,
}

impl Wide for Weighing<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Self { looks, hypotheses, open, observed, stroke } = self;
        if observed.time_s[stroke].is_none() {
            return;
        }
        for places in open.chunks(SIDE) {
            let mut side = Innovations::<SIDE>::new();
            for (k, &i) in places.iter().enumerate() {
                looks[i].set_in(&mut side, k, &hypotheses[i], stroke);
            }
            let densities = side.densities(observed.shape, STRAY_VARIANCE);
            for (k, &i) in places.iter().enumerate() {
                looks[i].take_from(&densities, k, &mut hypotheses[i], stroke);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use leak_table::TableBundle;

    use super::*;
    use crate::bayes::config::BayesConfig;
    use crate::bayes::plant::CycleConditions;
    use crate::bayes::start;

    #[test]
    fn all_at_once_meet_a_reading_as_each_by_itself() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tables");
        let tables = TableBundle::read(&folder).expect("tables/ is sound");
        let plant = Plant::new(&tables, CycleConditions::default());
        let (shape, sd_s) = (20.0, 0.012);
        let hypotheses = start::hypotheses(&plant, &BayesConfig::default(), shape, shape * sd_s * sd_s);
        // A healthy reading, a worn one, one that makes hypotheses go about it several times, and strokes that are missing.
        let cases = [
            ([Some(1.05), Some(2.13)], [false; 2]),
            ([Some(1.3), Some(1.7)], [false; 2]),
            ([Some(2.6), Some(0.9)], [false; 2]),
            ([None, Some(2.3)], [false; 2]),
            ([None, None], [true, false]),
        ];
        for (time_s, stalled) in cases {
            let observed = Observation { time_s, stalled, outlier_share: 0.005, weight: 1.0, shape, ln_idle: -9.0 };
            let mut alone = hypotheses.clone();
            let mut all = hypotheses.clone();
            let mut meeting = Meeting { before: hypotheses.clone(), ..Meeting::default() };
            assimilate_all(&mut all, &mut meeting, &plant, &observed);
            for (i, hypothesis) in alone.iter_mut().enumerate() {
                let update = assimilate(hypothesis, &hypotheses[i], &plant, &observed);
                // Their texts, in which numbers that are none are the same.
                assert_eq!(format!("{hypothesis:?}"), format!("{:?}", all[i]), "{time_s:?}, {i}");
                assert_eq!(format!("{update:?}"), format!("{:?}", meeting.updates[i]), "{time_s:?}, {i}");
            }
        }
    }
}
