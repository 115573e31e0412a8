//! Where a search of other records of the same valve ended.

use identify::Scope;
use valve_model::Effect;

use super::nuisance::Nuisance;
use super::problem::ValveProblem;
use crate::space::Space;

/// A point that explains other records of the valve.
#[derive(Debug, Clone)]
pub struct Known {
    /// Parameters and effects.
    pub space: Space,
    /// Where these are, and whatever follows them.
    u: Vec<f64>,
    /// What instruments and conditions that all records share are off by, in prior deviations.
    shared: Vec<(Nuisance, f64)>,
}

impl Known {
    /// A point of a problem.
    pub fn new(problem: &ValveProblem<'_>, u: &[f64]) -> Self {
        let all = problem.nuisances.iter().zip(&u[problem.space.coordinates.len()..]);
        let shared = all.filter(|(entry, _)| entry.nuisance.scope() == Scope::Shared);
        Self {
            space: problem.space.clone(),
            u: u.to_vec(),
            shared: shared.map(|(entry, u)| (entry.nuisance, *u)).collect(),
        }
    }

    /// What an instrument or a condition that all records share is off by, in prior deviations.
    pub fn shared(&self, nuisance: Nuisance) -> Option<f64> {
        self.shared.iter().find(|(known, _)| *known == nuisance).map(|(_, u)| *u)
    }

    /// The point as one of another problem; nothing where that lacks one of its effects.
    pub fn start(&self, member: &ValveProblem<'_>) -> Option<Vec<f64>> {
        let has = |effect: &Effect| member.space.effects().iter().any(|other| other.kind() == effect.kind());
        if !self.space.effects().iter().all(has) {
            return None;
        }
        let mut start = member.start();
        member.space.carry(&self.space, &self.u, &mut start);
        member.space.carry_refinements(&self.space, &self.u, &mut start);
        let own = member.space.coordinates.len();
        for (value, entry) in start[own..].iter_mut().zip(member.nuisances) {
            *value = self.shared(entry.nuisance).unwrap_or(*value);
        }
        Some(start)
    }
}
