//! The catalogue of effects as a family of problems: what a search goes through.

use std::cmp::Ordering;

use campaign::{Campaign, Uncertainty};
use identify::problem::predict_all;
use identify::select::{Family, Level, News};
use identify::{Coordinate, FitOptions, Problem, Scope, Stop};
use valve_file::{Tolerance, ValveFile};
use valve_model::{EffectKind, ParameterId};

use super::nuisance::{Entry, Nuisance, NuisanceSizes, nuisances};
use super::problem::{DEFAULT_TOLERANCES, ValveProblem};
use super::setup::{Fidelity, Setup};
use super::start::Beginning;
use crate::data::Dataset;
use crate::space::{Space, Target};

/// A campaign on a valve, ready for a search.
#[derive(Debug)]
pub struct Subject {
    low: Setup,
    high: Setup,
    nuisances: Vec<Entry>,
    /// A few of the records, their nuisances, and where those stand among all of them.
    screen: Setup,
    screen_nuisances: Vec<Entry>,
    places: Vec<usize>,
    /// The tolerated parameters.
    pub space: Space,
    /// Whether the valve file names no tolerances, so that default ones stand in.
    pub tolerances_are_assumed: bool,
}

/// Sizes of an effect that a fit may start from, in typical sizes.
const SIZES: [f64; 4] = [0.1, 0.4, 1.0, 3.0];

/// How long before a record its first command may have been given, in travel times: the steps, and how many.
const UNSEEN: (f64, usize) = (0.04, 45);

/// An unseen edge is one where it takes away this share of a record's error.
const UNSEEN_SHARE: f64 = 0.5;

impl Subject {
    /// Makes a campaign ready.
    pub fn new(file: &ValveFile, campaign: &Campaign, sizes: &NuisanceSizes) -> Self {
        let data = Dataset::new(campaign, file.schedule());
        let parameters = file.valve().parameters();
        let (stroke_m, ambient_pa) = (parameters.stroke_m, parameters.ambient_pressure_pa);
        let assumed = DEFAULT_TOLERANCES.map(|(parameter, relative_sigma)| Tolerance { parameter, relative_sigma });
        let tolerances_are_assumed = file.tolerances().is_empty();
        let tolerances = if tolerances_are_assumed { assumed.as_slice() } else { file.tolerances() };
        let positive: Vec<Tolerance> =
            tolerances.iter().filter(|one| parameters.get(one.parameter) > 0.0).copied().collect();
        let space = Space::new(file.valve(), &positive);
        let mut subject = Self {
            low: Setup::new(campaign, &data, stroke_m, ambient_pa, Fidelity::Low),
            high: Setup::new(campaign, &data, stroke_m, ambient_pa, Fidelity::High),
            nuisances: Vec::new(),
            screen: Setup::new(campaign, &data, stroke_m, ambient_pa, Fidelity::Low),
            screen_nuisances: Vec::new(),
            places: Vec::new(),
            space,
            tolerances_are_assumed,
        };
        subject.find_unseen_edges(&campaign.uncertainty, sizes);
        subject.choose_screen();
        subject
    }

    /// The campaign as finely as results are computed.
    pub fn setup(&self, level: Level) -> &Setup {
        match level {
            Level::Screen => &self.screen,
            Level::Low => &self.low,
            Level::High => &self.high,
        }
    }

    /// The nuisances.
    pub fn nuisances(&self) -> &[Entry] {
        &self.nuisances
    }

    /// The problem of a space on the campaign.
    pub fn problem<'a>(&'a self, space: Space, level: Level, stop: &'a Stop) -> ValveProblem<'a> {
        let nuisances = if level == Level::Screen { &self.screen_nuisances } else { &self.nuisances };
        ValveProblem::new(self.setup(level), space, nuisances, stop)
    }

    /// Records for a first look: those whose conditions and commands lie farthest apart.
    fn choose_screen(&mut self) {
        let chosen = farthest_apart(&self.low);
        self.screen = self.low.only(&chosen);
        for (place, entry) in self.nuisances.iter().enumerate() {
            let own = match entry.nuisance.scope() {
                Scope::Shared => Some(entry.nuisance),
                Scope::Record(record) => {
                    chosen.iter().position(|one| *one == record).map(|new| entry.nuisance.of_record(new))
                }
            };
            if let Some(nuisance) = own {
                let coordinate = Coordinate { scope: nuisance.scope(), ..entry.coordinate.clone() };
                self.screen_nuisances.push(Entry { nuisance, size: entry.size, coordinate });
                self.places.push(place);
            }
        }
    }

    /// Records that begin with the command on and the valve still open: whether it was given before, and about when.
    fn find_unseen_edges(&mut self, stated: &Uncertainty, sizes: &NuisanceSizes) {
        let is_bore_tolerated =
            self.space.coordinates.iter().any(|c| c.target == Target::Base(ParameterId::PistonArea));
        self.nuisances = nuisances(&self.low, self.space.parameters(), sizes, stated, is_bore_tolerated);
        let filling: Vec<usize> =
            (0..self.low.units.len()).filter(|unit| self.low.units[*unit].beginning == Beginning::Filling).collect();
        if filling.is_empty() {
            return;
        }
        let travel_s = self.low.travel_s;
        let first = self.nuisances.len();
        self.nuisances.extend(filling.iter().map(|unit| Entry::new(Nuisance::UnseenEdge(*unit), travel_s)));
        let problem = self.problem(self.space.clone(), Level::Low, Stop::never());
        let share = |step: usize| UNSEEN.0 * step as f64;
        let points: Vec<Vec<f64>> = (0..UNSEEN.1)
            .map(|step| {
                let mut u = problem.start();
                let own = self.space.coordinates.len() + first;
                u[own..].fill(share(step));
                u
            })
            .collect();
        let predicted = predict_all(&problem, &points);
        let errors: Vec<Vec<f64>> = predicted
            .iter()
            .map(|records| {
                let error = |unit: &usize| {
                    let record = &problem.records()[*unit];
                    let rows = records.as_ref().map(|records| &records[*unit]);
                    rows.map_or(f64::INFINITY, |rows| {
                        record
                            .rows()
                            .zip(rows)
                            .map(|(row, value)| ((row.observed - value) / row.activity).powi(2))
                            .sum()
                    })
                };
                filling.iter().map(error).collect()
            })
            .collect();
        for (place, unit) in filling.iter().enumerate().rev() {
            let best = (0..UNSEEN.1).min_by(|a, b| errors[*a][place].total_cmp(&errors[*b][place])).unwrap_or(0);
            if errors[best][place] < UNSEEN_SHARE * UNSEEN_SHARE * errors[0][place] {
                let coordinate = &mut self.nuisances[first + place].coordinate;
                coordinate.mean = share(best);
                coordinate.sigma = 0.3;
                coordinate.lower = 0.0;
                coordinate.upper = 1.9;
                coordinate.step = 0.01;
            } else {
                self.nuisances.remove(first + place);
                self.low.begin_at_rest(*unit);
                self.high.begin_at_rest(*unit);
            }
        }
    }
}

/// Records of a first look: all up to the first number, then that many and a share of the others.
const SCREENED: (usize, f64) = (3, 0.25);

/// A few records whose conditions and commands lie far apart, by index.
fn farthest_apart(setup: &Setup) -> Vec<usize> {
    let count = setup.units.len();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a few records")]
    let wanted = SCREENED.0 + (SCREENED.1 * count.saturating_sub(SCREENED.0) as f64).floor() as usize;
    if count <= wanted + 1 {
        return (0..count).collect();
    }
    let features = |unit: usize| {
        let run = &setup.units[unit].run;
        let conditions = &run.conditions;
        let span = (setup.units.iter().map(|unit| unit.run.conditions.supply_pressure_pa)).fold(0.0, f64::max);
        let leak = setup.units.iter().map(|unit| unit.run.conditions.leak_to_atmosphere_m2).fold(1e-12, f64::max);
        let fed = setup.units.iter().map(|unit| unit.run.conditions.leak_from_supply_m2).fold(1e-12, f64::max);
        [
            4.0 * conditions.supply_pressure_pa / span,
            conditions.leak_to_atmosphere_m2 / leak,
            conditions.leak_from_supply_m2 / fed,
            conditions.temperature_k / 50.0,
            run.commands.len() as f64,
            run.commands.last().map_or(0.0, |edge| edge.time_s) / run.end_s.max(1e-9),
        ]
    };
    let distance = |one: usize, other: usize| -> f64 {
        features(one).iter().zip(features(other)).map(|(a, b)| (a - b).powi(2)).sum()
    };
    let mut chosen = vec![0];
    while chosen.len() < wanted {
        let nearest = |unit: usize| chosen.iter().map(|one| distance(unit, *one)).fold(f64::INFINITY, f64::min);
        let next = (0..count).filter(|unit| !chosen.contains(unit)).max_by(|a, b| nearest(*a).total_cmp(&nearest(*b)));
        chosen.extend(next);
    }
    chosen.sort_unstable();
    chosen
}

/// The effects that a search adds to a subject.
pub struct Catalogue<'a> {
    /// The campaign and the valve.
    pub subject: &'a Subject,
    /// The effects, in the order of the candidates' indices.
    pub kinds: Vec<EffectKind>,
    /// Where news go.
    pub tell: &'a (dyn Fn(News<'_>) + Sync),
    /// A wish to stop.
    pub stop: &'a Stop,
}

impl<'a> Catalogue<'a> {
    /// Those of the effects that the valve does not have yet.
    pub fn new(
        subject: &'a Subject,
        effects: &[EffectKind],
        tell: &'a (dyn Fn(News<'_>) + Sync),
        stop: &'a Stop,
    ) -> Self {
        let has = |kind: EffectKind| subject.space.effects().iter().any(|effect| effect.kind() == kind);
        let kinds = effects.iter().copied().filter(|kind| !has(*kind)).collect();
        Self { subject, kinds, tell, stop }
    }

    /// The effects of a set.
    pub fn kinds_of(&self, set: &[usize]) -> Vec<EffectKind> {
        set.iter().map(|one| self.kinds[*one]).collect()
    }

    /// Points with the sizes of some effects varied about `u`, one effect after the other.
    fn varied(member: &ValveProblem<'_>, u: &[f64], kinds: &[EffectKind]) -> Vec<Vec<f64>> {
        let mut points = vec![u.to_vec()];
        for kind in kinds {
            let coordinates = member.space.effect_coordinates(*kind);
            let Some(size) = coordinates.first().copied() else { continue };
            let lower = member.coordinates()[size].lower;
            let start = points[0].clone();
            for factor in SIZES {
                for sign in [1.0, -1.0] {
                    if sign < 0.0 && lower >= 0.0 {
                        continue;
                    }
                    let mut point = start.clone();
                    point[size] = sign * factor;
                    points.push(point);
                }
            }
        }
        points
    }
}

impl<'a> Family for Catalogue<'a> {
    type Member = ValveProblem<'a>;

    fn candidates(&self) -> usize {
        self.kinds.len()
    }

    fn member(&self, set: &[usize], level: Level) -> Option<Self::Member> {
        let mut space = self.subject.space.clone();
        for kind in self.kinds_of(set) {
            // Refinements are for the end of a fit: on the way they open valleys that lead nowhere.
            space = if level == Level::High { space.with_refined_effect(kind) } else { space.with_effect(kind) };
        }
        Some(self.subject.problem(space, level, self.stop))
    }

    fn carried(&self, from: &Self::Member, u: &[f64], to: &Self::Member) -> Vec<f64> {
        let mut carried = to.start();
        to.space.carry(&from.space, u, &mut carried);
        let (own, theirs) = (to.space.coordinates.len(), from.space.coordinates.len());
        let (has, had) = (to.nuisances.len(), from.nuisances.len());
        match has.cmp(&had) {
            Ordering::Equal => carried[own..].copy_from_slice(&u[theirs..]),
            Ordering::Greater => {
                for (place, value) in self.subject.places.iter().zip(&u[theirs..]) {
                    carried[own + place] = *value;
                }
            }
            Ordering::Less => {
                for (value, place) in carried[own..].iter_mut().zip(&self.subject.places) {
                    *value = u[theirs + place];
                }
            }
        }
        carried
    }

    fn cold(&self, member: &Self::Member) -> Vec<Vec<f64>> {
        let kinds: Vec<EffectKind> = member.space.effects().iter().map(valve_model::Effect::kind).collect();
        let start = member.start();
        if kinds.len() > 1 { vec![start] } else { Self::varied(member, &start, &kinds) }
    }

    fn warm(&self, member: &Self::Member, from: &Self::Member, u: &[f64]) -> Vec<Vec<f64>> {
        // What both have keeps its values: parameters, effects and nuisances.
        let mut start = member.start();
        let nuisances = member.nuisances.len();
        let (own, theirs) = (member.space.coordinates.len(), from.space.coordinates.len());
        start[own..own + nuisances].copy_from_slice(&u[theirs..theirs + nuisances]);
        member.space.carry(&from.space, u, &mut start);
        let has = |kind: EffectKind| from.space.effects().iter().any(|effect| effect.kind() == kind);
        let kinds: Vec<EffectKind> =
            member.space.effects().iter().map(valve_model::Effect::kind).filter(|kind| !has(*kind)).collect();
        Self::varied(member, &start, &kinds)
    }

    fn options(&self) -> FitOptions {
        FitOptions::new(self.subject.high.groups.clone())
    }

    fn tell(&self, news: News<'_>) {
        (self.tell)(news);
    }

    fn stop(&self) -> &Stop {
        self.stop
    }
}
