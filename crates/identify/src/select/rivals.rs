//! The sets that come next to an accepted one, with one effect exchanged, fitted once more from its optimum.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::race::settling;
use super::{Family, Level, Search, Set};
use crate::fit::{Fit, FitOptions, go_on};
use crate::problem::Problem;

impl<F: Family> Search<'_, F> {
    /// Of a set and those that came next to it, with one effect exchanged, the most likely one. What came next may have been held
    /// in another valley by parameters that had made up for what was missing, or for want of shapes that are free in the end
    /// only; now both are known better.
    pub(super) fn best_rival(&mut self, set: Set) -> Set {
        let mut rivals: BTreeMap<&Set, f64> = BTreeMap::new();
        let is_rival = |other: &Set| {
            let shared = other.iter().filter(|one| set.contains(one)).count();
            other.len() == set.len() && shared + 1 == set.len()
        };
        for model in self.models.values().filter(|model| is_rival(&model.set)) {
            let Some(base) = self.evidence(&[], model.level) else { continue };
            let gain = model.fit.log_evidence - base;
            if gain > self.options.accept {
                // A first look sees a few of the records only. The last level is the most exact one.
                let rows: usize = model.problem.records().iter().map(crate::Record::row_count).sum();
                rivals.insert(&model.set, gain / rows as f64);
            }
        }
        let gains = rivals.into_iter().map(|(rival, gain)| (gain, rival.clone())).collect();
        let rivals = best_of_each(&set, gains, self.options.rivals).into_iter();
        // A pair that was fitted to the end began where a smaller set had put right what else was off.
        let is_ended =
            |rival: &Set| self.models.get(&(rival.clone(), Level::High)).is_some_and(|model| model.fit.converged);
        let rivals: Vec<Set> = rivals.filter(|rival| rival.len() < 2 || !is_ended(rival)).collect();
        let of_set = self.evidence(&set, Level::High).unwrap_or(f64::NEG_INFINITY);
        // As exactly as they are reported from the outset: what is free in the end only may decide between them.
        let a_little = settling(self.options.rounds[1], self.family.options());
        let begun = self.begun_from(&set, &rivals, Level::High, a_little);
        let is_near =
            |fit: &Fit| fit.log_evidence + self.options.optimism * fit.predicted_gain > of_set - self.options.margin;
        let ended = begun.into_par_iter().filter(|(.., fit)| is_near(fit)).map(|(rival, problem, begun)| {
            let base = self.family.options().exact();
            let options = FitOptions { known: Some(begun.noise.clone()), ..settling(base.settled, base) };
            let further = go_on(&problem, &begun, &options);
            let ended = further.filter(|fit| fit.log_evidence > begun.log_evidence).unwrap_or(begun);
            (rival, problem, ended)
        });
        for (rival, problem, fit) in ended.collect::<Vec<_>>() {
            self.keep(rival, Level::High, problem, fit);
        }
        let of = |set: &Set| self.evidence(set, Level::High).unwrap_or(f64::NEG_INFINITY);
        let best = rivals.into_iter().max_by(|a, b| of(a).total_cmp(&of(b)));
        best.filter(|rival| of(rival) > of_set).unwrap_or(set)
    }
}

/// Of sets that lack one effect of a set each, by gain, the best few for each of its effects: those that lack the one may all be
/// likelier than those that lack the other, since they began closer to where the set is best.
fn best_of_each(set: &[usize], mut gains: Vec<(f64, Set)>, each: usize) -> Vec<Set> {
    gains.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut left = vec![each; set.len()];
    let mut best = Vec::new();
    for (_, rival) in gains {
        let lacking = set.iter().position(|one| !rival.contains(one));
        if let Some(left) = lacking.map(|place| &mut left[place]).filter(|left| **left > 0) {
            *left -= 1;
            best.push(rival);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::best_of_each;

    #[test]
    fn each_effect_of_a_pair_has_rivals_of_its_own() {
        let gains = vec![(700.0, vec![8, 12]), (300.0, vec![11, 12]), (690.0, vec![8, 9]), (680.0, vec![5, 8])];
        assert_eq!(best_of_each(&[8, 11], gains.clone(), 2), [vec![8, 12], vec![8, 9], vec![11, 12]]);
        assert_eq!(best_of_each(&[8, 11], gains, 0), [[0_usize; 0]; 0]);
        assert_eq!(best_of_each(&[3], vec![(1.0, vec![4]), (2.0, vec![5]), (3.0, vec![6])], 2), [vec![6], vec![5]]);
    }
}
