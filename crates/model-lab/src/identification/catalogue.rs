//! The catalogue of effects as a family of problems: what a search goes through.

use std::cmp::Ordering;

use campaign::{Campaign, Uncertainty};
use identify::problem::predict_all;
use identify::select::{Family, Level, Model, News, base, look};
use identify::{Coordinate, FitOptions, Problem, Record, Scope, Stop};
use rayon::prelude::*;
use valve_file::{Tolerance, ValveFile};
use valve_model::effects::{EffectParameter, Search};
use valve_model::{EffectKind, Fidelity, ParameterId};

use super::fidelity;
use super::force_balance::ForceBalance;
use super::known::Known;
use super::nuisance::{Entry, Nuisance, NuisanceSizes, nuisances};
use super::problem::{DEFAULT_TOLERANCES, ValveProblem};
use super::scattered::Scattered;
use super::setup::Setup;
use super::start::Beginning;
use crate::data::Dataset;
use crate::space::{Space, Target};

/// A campaign on a valve, ready for a search.
#[derive(Debug)]
pub struct Subject {
    low: Setup,
    /// As finely as what decides asks for, then finer and finer.
    high: Vec<Setup>,
    nuisances: Vec<Entry>,
    /// A few of the records, their nuisances, and where those stand among all of them.
    screen: Setup,
    screen_nuisances: Vec<Entry>,
    places: Vec<usize>,
    /// What moves freely in the records of a first look.
    pub balance: ForceBalance,
    /// Where fits may start beside the values of the valve file.
    scattered: Scattered,
    /// The tolerated parameters.
    pub space: Space,
    /// Whether the valve file names no tolerances, so that default ones stand in.
    pub tolerances_are_assumed: bool,
    /// Whether steps were taken with the valve file before: it states no datasheet any more.
    pub was_fitted: bool,
}

/// Sizes of an effect that a fit may start from, in typical sizes.
const SIZES: [f64; 4] = [0.1, 0.4, 1.0, 3.0];

/// Shapes that it may start from beside the usual one, in prior deviations from it.
const SHAPES: [f64; 2] = [-1.0, 1.0];

/// How long before a record its first command may have been given, in travel times: a step where that is short, a share
/// of it where it is long, and the longest; a small pipe that feeds a large chamber takes many travel times to fill it.
const UNSEEN: (f64, f64, f64) = (0.04, 0.08, 8.0);

/// Two unseen edges are as good where their errors differ by less than this share: a valve that was filled long ago does
/// not show when.
const SAME: f64 = 1e-3;

/// A delay shifts what follows and nothing else where it moves what comes after the next command by no more than this many
/// standard deviations of a row.
const CARRIED_OVER: f64 = 0.3;

/// How far an unseen edge may lie from the best one at the values of the valve file, in travel times.
const UNSEEN_SIGMA: f64 = 0.3;

impl Subject {
    /// Makes a campaign ready for a valve file. Where somebody asks to stop on the way it is ready all the same, less closely looked at.
    pub fn new(file: &ValveFile, campaign: &Campaign, sizes: &NuisanceSizes, stop: &Stop) -> Self {
        let data = Dataset::new(campaign, file.schedule());
        let parameters = file.valve().parameters();
        let assumed = DEFAULT_TOLERANCES.map(|(parameter, relative_sigma)| Tolerance { parameter, relative_sigma });
        let tolerances_are_assumed = file.tolerances().is_empty();
        let tolerances = if tolerances_are_assumed { assumed.as_slice() } else { file.tolerances() };
        let positive: Vec<Tolerance> =
            tolerances.iter().filter(|one| parameters.get(one.parameter) > 0.0).copied().collect();
        let space = Space::new(file.valve(), &positive);
        let setup = Setup::new(campaign, &data, parameters);
        let mut subject = Self {
            low: setup.clone(),
            high: vec![setup.clone()],
            nuisances: Vec::new(),
            screen: setup,
            screen_nuisances: Vec::new(),
            places: Vec::new(),
            balance: ForceBalance::default(),
            scattered: Scattered::default(),
            space,
            tolerances_are_assumed,
            was_fitted: !file.history().is_empty(),
        };
        subject.low = fidelity::roughly(&subject.low);
        subject.find_unseen_edges(&campaign.uncertainty, sizes);
        subject.choose_screen();
        subject.look_for_starts(&data);
        let at = subject.roughly_fitted(stop);
        subject.choose_fidelity(&at);
        subject.find_carried_over();
        subject.choose_screen();
        subject
    }

    /// Where fits may start beside the values of the valve file.
    fn look_for_starts(&mut self, data: &Dataset) {
        self.balance = ForceBalance::new(&self.screen, data);
        self.scattered = Scattered::find(&self.problem(self.space.clone(), Level::Screen, Stop::never()));
    }

    /// About where the coordinates are where something is thrown back: what a step cuts short of that depends on when and where it
    /// happens, and a datasheet's values may lead elsewhere. All else is looked at where the valve file states it.
    fn roughly_fitted(&self, stop: &Stop) -> Vec<f64> {
        let mut at = self.problem(self.space.clone(), Level::Low, stop).start();
        let turns = |record: &Record| record.rows().any(|row| row.turns > 0);
        if !self.low.records.iter().any(turns) {
            return at;
        }
        let catalogue = Catalogue::new(self, &[], &|_| (), stop);
        let screen = self.problem(self.space.clone(), Level::Screen, stop);
        if let Some(fit) = look(&catalogue, &screen) {
            let own = self.space.coordinates.len();
            at[..own].copy_from_slice(&fit.u[..own]);
            for (place, value) in self.places.iter().zip(&fit.u[own..]) {
                at[own + place] = *value;
            }
        }
        at
    }

    /// The campaign as finely as results are computed.
    pub fn setup(&self, level: Level) -> &Setup {
        match level {
            Level::Screen => &self.screen,
            Level::Low => &self.low,
            Level::High => &self.high[0],
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

    /// The model as its file states it, but for what instruments and conditions may be off by: that alone is fitted. Nothing
    /// where its strokes cannot be simulated.
    pub fn stated<'a>(&'a self, stop: &'a Stop) -> Option<Model<ValveProblem<'a>>> {
        let catalogue = Catalogue { base: self.space.fixed(), ..Catalogue::new(self, &[], &|_| (), stop) };
        base(&catalogue).map(|[_, high]| high)
    }

    /// The model with its tolerated parameters fitted, and no effect beyond those it has: where every search begins.
    pub fn calibrated<'a>(&'a self, stop: &'a Stop) -> Option<Model<ValveProblem<'a>>> {
        base(&Catalogue::new(self, &[], &|_| (), stop)).map(|[_, high]| high)
    }

    /// Records for a first look: those whose conditions and commands lie farthest apart.
    fn choose_screen(&mut self) {
        let chosen = farthest_apart(&self.low);
        (self.screen, self.screen_nuisances, self.places) = self.part(&self.low, &chosen);
    }

    /// Some of the records, their nuisances, and where those stand among all of them.
    pub fn part(&self, setup: &Setup, chosen: &[usize]) -> (Setup, Vec<Entry>, Vec<usize>) {
        let (mut entries, mut places) = (Vec::new(), Vec::new());
        for (place, entry) in self.nuisances.iter().enumerate() {
            let own = match entry.nuisance.scope() {
                Scope::Shared => Some(entry.nuisance),
                Scope::Record(record) => {
                    chosen.iter().position(|one| *one == record).map(|new| entry.nuisance.of_record(new))
                }
            };
            if let Some(nuisance) = own {
                let coordinate = Coordinate { scope: nuisance.scope(), ..entry.coordinate.clone() };
                entries.push(Entry { nuisance, coordinate, ..entry.clone() });
                places.push(place);
            }
        }
        (setup.only(chosen), entries, places)
    }

    /// How closely to simulate each record on the way, and for what decides. The valve as its file has it may be none that can
    /// be simulated; then it stays as it is.
    fn choose_fidelity(&mut self, at: &[f64]) {
        let usual: Vec<Fidelity> = self.high[0].recordings.iter().map(|recording| recording.fidelity).collect();
        let predict = |setup: &Setup| {
            let problem = ValveProblem::new(setup, self.space.clone(), &self.nuisances, Stop::never());
            predict_all(&problem, &[at.to_vec()]).remove(0)
        };
        if let Some(chosen) = fidelity::chosen(&self.low, &usual, &predict) {
            (self.low, self.high) = (chosen.low, chosen.high);
        }
    }

    /// A problem as finely as what decides asks for, finer; nothing where it is as fine as any is, or is none of these.
    fn finer<'a>(&'a self, member: &ValveProblem<'a>) -> Option<ValveProblem<'a>> {
        let place = self.high.iter().position(|setup| std::ptr::eq(setup, member.setup()))?;
        self.high.get(place + 1).map(|finer| member.on(finer))
    }

    /// Which delays only a simulation tells: those of records in which a command finds the valve still filling, emptying or
    /// moving. Where it rests, a delay shifts what follows, up to the next command, and nothing else.
    fn find_carried_over(&mut self) {
        let is_moving = self.low.recordings.iter().any(|recording| recording.beginning.is_moving());
        let problem = self.problem(self.space.clone(), Level::Low, Stop::never());
        let own = self.space.coordinates.len();
        let delayed = |which: fn(usize) -> Nuisance| {
            let mut u = problem.start();
            for (place, entry) in self.nuisances.iter().enumerate() {
                if matches!(entry.nuisance.scope(), Scope::Record(record) if entry.nuisance == which(record)) {
                    u[own + place] = entry.coordinate.mean + 1.0;
                }
            }
            u
        };
        let points = [problem.start(), delayed(Nuisance::CloseDelay), delayed(Nuisance::OpenDelay)];
        let predicted = predict_all(&problem, &points);
        let carried_over: Vec<bool> = (0..self.low.recordings.len())
            .map(|recording| {
                let [Some(start), Some(closing), Some(opening)] = &predicted[..] else { return true };
                [(true, closing), (false, opening)].iter().any(|(closes, delayed)| {
                    let record = &problem.records()[recording];
                    let after = self.low.recordings[recording].followed_by_another(*closes, record);
                    let moved = delayed[recording].iter().zip(&start[recording]).zip(record.rows()).zip(after);
                    let moved = moved.filter(|(_, after)| *after);
                    let moved = moved.map(|(((to, from), row), _)| ((to - from) / row.sigma).abs());
                    moved.fold(0.0, f64::max) > CARRIED_OVER
                })
            })
            .collect();
        for entry in &mut self.nuisances {
            entry.is_simulated |= match entry.nuisance {
                Nuisance::CloseDelay(record) | Nuisance::OpenDelay(record) => carried_over[record],
                Nuisance::Clock => is_moving,
                _ => false,
            };
        }
    }

    /// Records that begin with the command on and the valve still open: about when it was given; in the
    /// first row, long before, or between.
    fn find_unseen_edges(&mut self, stated: &Uncertainty, sizes: &NuisanceSizes) {
        let is_bore_tolerated =
            self.space.coordinates.iter().any(|c| c.target == Target::Base(ParameterId::PistonArea));
        self.nuisances = nuisances(&self.low, self.space.parameters(), sizes, stated, is_bore_tolerated);
        let filling: Vec<usize> = (0..self.low.recordings.len())
            .filter(|recording| self.low.recordings[*recording].beginning == Beginning::Filling)
            .collect();
        if filling.is_empty() {
            return;
        }
        let shares: Vec<f64> = std::iter::successors(Some(0.0), |share: &f64| {
            Some(share + UNSEEN.0.max(UNSEEN.1 * share)).filter(|next| *next <= UNSEEN.2)
        })
        .collect();
        let travel_s = self.low.whole_travel_s;
        for recording in &filling {
            self.low.begin_earlier(*recording, (UNSEEN.2 + 1.0) * travel_s);
        }
        let first = self.nuisances.len();
        self.nuisances.extend(filling.iter().map(|recording| Entry::new(Nuisance::UnseenEdge(*recording), travel_s)));
        let problem = self.problem(self.space.clone(), Level::Low, Stop::never());
        let own = self.space.coordinates.len() + first;
        let points: Vec<Vec<f64>> = shares
            .iter()
            .map(|share| {
                let mut u = problem.start();
                u[own..].fill(*share);
                u
            })
            .collect();
        let predicted = predict_all(&problem, &points);
        let error = |point: usize, recording: usize| -> f64 {
            let Some(records) = &predicted[point] else { return f64::INFINITY };
            problem.records()[recording].error_in_activity(&records[recording])
        };
        let best: Vec<f64> = filling
            .iter()
            .map(|recording| {
                let least = (0..shares.len()).map(|point| error(point, *recording)).fold(f64::INFINITY, f64::min);
                let as_good = (0..shares.len()).rev().find(|point| error(*point, *recording) <= (1.0 + SAME) * least);
                as_good.map_or(0.0, |point| shares[point])
            })
            .collect();
        let longest = shares.last().copied().unwrap_or(0.0);
        let entries = self.nuisances.split_off(first);
        // A recorder that a command starts writes it down in the first row of every record; where it does not in one, it does in none, and
        // the best time at the values of the valve file may be none for what these are off by.
        let is_started = best.iter().all(|best| *best <= 0.0 || *best >= longest);
        for ((recording, best), mut entry) in filling.into_iter().zip(best).zip(entries) {
            if best >= longest {
                self.low.begin_closed(recording);
                continue;
            }
            if is_started {
                self.low.begin_open(recording);
                continue;
            }
            let coordinate = &mut entry.coordinate;
            coordinate.mean = best;
            coordinate.sigma = UNSEEN_SIGMA * f64::max(best, 1.0);
            coordinate.lower = 0.0;
            coordinate.upper = best + 3.0 * coordinate.sigma;
            coordinate.step = 0.01;
            self.low.begin_earlier(recording, coordinate.upper * travel_s + self.low.lead_s);
            self.nuisances.push(entry);
        }
    }
}

/// An effect at its typical size that moves no row by more than this share of its noise does not act at all.
const INERT: f64 = 1e-6;

/// Records of a first look: all up to the first number, then that many and a share of the others.
const SCREENED: (usize, f64) = (3, 0.25);

/// A few records whose conditions and commands lie far apart, by index.
fn farthest_apart(setup: &Setup) -> Vec<usize> {
    let count = setup.recordings.len();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a few records")]
    let wanted = SCREENED.0 + (SCREENED.1 * count.saturating_sub(SCREENED.0) as f64).floor() as usize;
    if count <= wanted + 1 {
        return (0..count).collect();
    }
    let features = |recording: usize| {
        let run = &setup.recordings[recording].run;
        let conditions = &run.conditions;
        let span =
            (setup.recordings.iter().map(|recording| recording.run.conditions.supply_pressure_pa)).fold(0.0, f64::max);
        let leak = setup
            .recordings
            .iter()
            .map(|recording| recording.run.conditions.leak_to_atmosphere_m2)
            .fold(1e-12, f64::max);
        let fed =
            setup.recordings.iter().map(|recording| recording.run.conditions.leak_from_supply_m2).fold(1e-12, f64::max);
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
        let nearest =
            |recording: usize| chosen.iter().map(|one| distance(recording, *one)).fold(f64::INFINITY, f64::min);
        let next = (0..count)
            .filter(|recording| !chosen.contains(recording))
            .max_by(|a, b| nearest(*a).total_cmp(&nearest(*b)));
        chosen.extend(next);
    }
    chosen.sort_unstable();
    chosen
}

/// The effects that a search adds to a subject.
pub struct Catalogue<'a> {
    /// The campaign and the valve.
    pub subject: &'a Subject,
    /// What moves without any effect.
    base: Space,
    /// The effects, in the order of the candidates' indices.
    pub kinds: Vec<EffectKind>,
    /// Whether what a fitted model leaves is as little as was asked for.
    pub enough: &'a (dyn Fn(&Model<ValveProblem<'_>>) -> bool + Sync),
    /// Where news go.
    pub tell: &'a (dyn Fn(News<'_>) + Sync),
    /// Where a search of other records ended.
    pub known: Option<&'a Known>,
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
        Self { subject, base: subject.space.clone(), kinds, enough: &|_| false, tell, known: None, stop }
    }

    /// Without effects that move no row, such as any upstream of a pressure that drives the model.
    #[must_use]
    pub fn without_inert(self) -> Self {
        let predicted = |space: Space| {
            let problem = self.subject.problem(space, Level::Screen, self.stop);
            predict_all(&problem, &[problem.start()]).remove(0)
        };
        let Some(without) = predicted(self.base.clone()) else { return self };
        let moves = |kind: &EffectKind| {
            let Some(with) = predicted(self.base.with_effect(*kind)) else { return true };
            let records = self.subject.screen.records.iter().zip(with.iter().zip(&without));
            let mut rows = records.flat_map(|(record, (with, without))| record.rows().zip(with.iter().zip(without)));
            rows.any(|(row, (with, without))| (with - without).abs() > INERT * row.sigma)
        };
        let kinds = self.kinds.par_iter().copied().filter(moves).collect();
        Self { kinds, ..self }
    }

    /// The effects of a set.
    pub fn kinds_of(&self, set: &[usize]) -> Vec<EffectKind> {
        set.iter().map(|one| self.kinds[*one]).collect()
    }

    /// Points with the sizes of some effects varied about `u`, one effect after the other, and with their shapes: a force that
    /// fades in proportion is a weaker spring, and only with another exponent something of its own.
    fn varied(member: &ValveProblem<'_>, u: &[f64], kinds: &[EffectKind]) -> Vec<Vec<f64>> {
        let mut points = vec![u.to_vec()];
        for kind in kinds {
            let coordinates = member.space.effect_coordinates(*kind);
            let Some(size) = coordinates.first().copied() else { continue };
            let lower = member.coordinates()[size].lower;
            let start = points[0].clone();
            let signs: &[f64] = if lower >= 0.0 { &[1.0] } else { &[1.0, -1.0] };
            for (factor, sign) in SIZES.iter().flat_map(|factor| signs.iter().map(move |sign| (factor, sign))) {
                let mut point = start.clone();
                point[size] = sign * factor;
                points.push(point);
            }
            // None of a share is a law of its own, at every size.
            let is_share = |(_, parameter): &(&usize, &EffectParameter)| parameter.search == Search::Share;
            let sized = points[points.len() - SIZES.len() * signs.len()..].to_vec();
            for (share, _) in coordinates.iter().zip(kind.parameters()).filter(is_share) {
                points.extend(sized.iter().cloned().map(|mut point| {
                    point[*share] = 0.0;
                    point
                }));
            }
            let is_shape =
                |(_, parameter): &(&usize, &EffectParameter)| matches!(parameter.search, Search::Shape | Search::Share);
            for (shape, _) in coordinates.iter().zip(kind.parameters()).filter(is_shape) {
                for (sign, by) in signs.iter().flat_map(|sign| SHAPES.iter().map(move |by| (sign, by))) {
                    let mut point = start.clone();
                    // At a small size what the other parameters take of it stays linear.
                    point[size] = sign * SIZES[0];
                    point[*shape] += by;
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
        let mut space = self.base.clone();
        for kind in self.kinds_of(set) {
            // Refinements are for the end of a fit: on the way they open valleys that lead nowhere.
            space = if level == Level::High { space.with_refined_effect(kind) } else { space.with_effect(kind) };
        }
        Some(self.subject.problem(space, level, self.stop))
    }

    fn finer(&self, member: &Self::Member) -> Option<Self::Member> {
        self.subject.finer(member)
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
        let mut starts = if kinds.len() > 1 { vec![start.clone()] } else { Self::varied(member, &start, &kinds) };
        let own = member.space.coordinates.len();
        if let Some(balanced) = self.subject.balance.optimum(&member.space, &start[..own], self.stop) {
            let mut start = start.clone();
            start[..own].copy_from_slice(&balanced);
            starts.push(start);
        }
        starts.extend(self.subject.scattered.starts(member, &start));
        starts.extend(self.known.and_then(|known| known.start(member)));
        starts
    }

    fn warm(&self, member: &Self::Member, from: &Self::Member, u: &[f64]) -> Vec<Vec<f64>> {
        // What both have keeps its values: parameters, effects and nuisances.
        let mut start = member.start();
        let nuisances = member.nuisances.len();
        let (own, theirs) = (member.space.coordinates.len(), from.space.coordinates.len());
        start[own..own + nuisances].copy_from_slice(&u[theirs..theirs + nuisances]);
        member.space.carry(&from.space, u, &mut start);
        member.space.carry_refinements(&from.space, u, &mut start);
        let has = |kind: EffectKind| from.space.effects().iter().any(|effect| effect.kind() == kind);
        let kinds: Vec<EffectKind> =
            member.space.effects().iter().map(valve_model::Effect::kind).filter(|kind| !has(*kind)).collect();
        Self::varied(member, &start, &kinds)
    }

    fn shared(&self, from: &Self::Member, to: &Self::Member) -> Vec<Option<usize>> {
        let theirs = &from.space.coordinates;
        let of_space = to.space.coordinates.iter();
        let same = of_space.map(|one| theirs.iter().position(|other| to.space.is_same(one, &from.space, other)));
        same.chain((0..to.nuisances.len()).map(|place| Some(theirs.len() + place))).collect()
    }

    fn is_enough(&self, model: &Model<Self::Member>) -> bool {
        (self.enough)(model)
    }

    fn options(&self) -> FitOptions {
        FitOptions::new(self.subject.setup(Level::High).groups.clone())
    }

    fn tell(&self, news: News<'_>) {
        (self.tell)(news);
    }

    fn stop(&self) -> &Stop {
        self.stop
    }
}
