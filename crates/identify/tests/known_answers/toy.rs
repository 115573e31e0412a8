//! Families of problems whose answer is known: what each of them says of itself. All are searched as one type, so that the search is
//! compiled once.

use identify::select::{Family, Level, Model, News, SelectOptions, Selection, select};
use identify::{Coordinate, FitOptions, Problem, Record, Request};

use crate::drawn::far_off;

/// What a family of such problems says of itself.
pub trait Toy: Sync {
    /// What was observed.
    fn records(&self) -> &[Record];

    /// How many candidates there are.
    fn candidates(&self) -> usize {
        1
    }

    /// The coordinates of a set.
    fn coordinates(&self, set: &[usize], level: Level) -> Vec<Coordinate>;

    /// What a member predicts of a record at a point.
    fn rows(&self, member: &Member<'_>, record: usize, u: &[f64]) -> Vec<f64>;

    /// Where fits start that know nothing.
    fn cold(&self, member: &Member<'_>) -> Vec<f64>;

    /// Where else they may.
    fn elsewhere(&self, _: &Member<'_>) -> Vec<Vec<f64>> {
        Vec::new()
    }

    /// Where fits start from the optimum of another member.
    fn warm(&self, member: &Member<'_>, from: &Member<'_>, u: &[f64]) -> Vec<Vec<f64>>;

    /// A point at one level as one at another.
    fn carried(&self, u: &[f64], _to: &Member<'_>) -> Vec<f64> {
        u.to_vec()
    }

    /// Which coordinate of another member each of one's own is: the first is everybody's, the others are the candidates' sizes.
    fn shared(&self, from: &Member<'_>, to: &Member<'_>) -> Vec<Option<usize>> {
        std::iter::once(Some(0)).chain(to.set.iter().map(|one| from.place_of(*one))).collect()
    }

    /// How much more exact than usual a member may be.
    fn finest(&self) -> usize {
        0
    }

    /// Whether a set leaves as little as was asked for.
    fn is_enough(&self, _model: &Model<Member<'_>>) -> bool {
        false
    }

    /// What is known of the errors.
    fn options(&self) -> FitOptions {
        far_off()
    }

    /// Called as a set has been fitted.
    fn told(&self) {}
}

/// A set of such a family.
pub struct Member<'a> {
    toy: &'a dyn Toy,
    pub set: Vec<usize>,
    pub level: Level,
    /// How much more exact than usual.
    pub exact: usize,
    coordinates: Vec<Coordinate>,
}

impl<'a> Member<'a> {
    /// A set of a family at a level.
    pub fn of(toy: &'a dyn Toy, set: &[usize], level: Level) -> Self {
        Self { toy, set: set.to_vec(), level, exact: 0, coordinates: toy.coordinates(set, level) }
    }

    /// Which coordinate the size of a candidate is.
    pub fn place_of(&self, candidate: usize) -> Option<usize> {
        self.set.iter().position(|one| *one == candidate).map(|place| 1 + place)
    }

    /// The size of a candidate at a point, if it is in the set.
    pub fn size_of(&self, candidate: usize, u: &[f64]) -> Option<f64> {
        self.place_of(candidate).map(|place| u[place])
    }
}

/// What a search finds in a family.
pub fn searched<'a>(toy: &'a dyn Toy, options: &SelectOptions) -> Selection<Member<'a>> {
    select(&toy, options).expect("fitted")
}

impl Problem for Member<'_> {
    fn coordinates(&self) -> &[Coordinate] {
        &self.coordinates
    }

    fn records(&self) -> &[Record] {
        self.toy.records()
    }

    fn predict(&self, points: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>> {
        requests.iter().map(|request| Some(self.toy.rows(self, request.record, &points[request.point]))).collect()
    }
}

impl<'a> Family for &'a dyn Toy {
    type Member = Member<'a>;

    fn candidates(&self) -> usize {
        Toy::candidates(*self)
    }

    fn member(&self, set: &[usize], level: Level) -> Option<Member<'a>> {
        Some(Member::of(*self, set, level))
    }

    fn finer(&self, member: &Member<'a>) -> Option<Member<'a>> {
        let finer = || Member { exact: member.exact + 1, ..Member::of(*self, &member.set, member.level) };
        (member.exact < self.finest()).then(finer)
    }

    fn carried(&self, _: &Member<'a>, u: &[f64], to: &Member<'a>) -> Vec<f64> {
        Toy::carried(*self, u, to)
    }

    fn cold(&self, member: &Member<'a>) -> Vec<Vec<f64>> {
        std::iter::once(Toy::cold(*self, member)).chain(self.elsewhere(member)).collect()
    }

    fn warm(&self, member: &Member<'a>, from: &Member<'a>, u: &[f64]) -> Vec<Vec<f64>> {
        Toy::warm(*self, member, from, u)
    }

    fn shared(&self, from: &Member<'a>, to: &Member<'a>) -> Vec<Option<usize>> {
        Toy::shared(*self, from, to)
    }

    fn is_enough(&self, model: &Model<Member<'a>>) -> bool {
        Toy::is_enough(*self, model)
    }

    fn options(&self) -> FitOptions {
        Toy::options(*self)
    }

    fn tell(&self, news: News<'_>) {
        if let News::Fitted { .. } = news {
            self.told();
        }
    }
}
