//! A set of effects and the fit with them: its score, and whether it is of any use.

use valve_model::EffectKind;
use valve_model::effects::ActsOn;

use crate::fit::Fit;
use crate::scatter::Scatter;
use crate::space::Target;

/// Penalty for each free parameter beyond an effect's first; shape parameters have priors of their own.
const PENALTY: f64 = 6.0;

/// Least distance of the critical ratio from that of the ideal nozzle.
const LEAST_CRITICAL: f64 = 0.02;

/// Critical ratio of the ideal nozzle for a diatomic gas.
const IDEAL_CRITICAL: f64 = 0.528;

/// The least size of an effect that is of any use, in typical sizes.
const LEAST_SIZE: f64 = 0.01;

/// The same for effects that only shift a stroke in time: half a millisecond or so, below which the
/// model's own accuracy ends.
const LEAST_DELAY: f64 = 0.035;

/// How many times the scatter of single delays a lasting one must be to be told from it.
const SCATTERED: f64 = 1.5;

/// A set of effects and the fit with them.
#[derive(Debug, Clone)]
pub struct Model {
    /// The effects added, in the order they were found.
    pub kinds: Vec<EffectKind>,
    /// Everything refitted with them.
    pub fit: Fit,
    /// How much better its score is than that of the calibrated model, seen in the same way.
    pub gain: f64,
}

impl Model {
    /// The cost with the penalty for its parameters.
    pub fn score(&self) -> f64 {
        self.fit.cost + penalty(&self.fit)
    }

    /// The same effects with another fit.
    pub(super) fn with(&self, fit: Fit) -> Self {
        Self { kinds: self.kinds.clone(), fit, gain: self.gain }
    }
}

/// The least size of an effect that is of any use, in typical sizes.
pub(super) fn least_size(kind: EffectKind) -> f64 {
    match kind.info().acts_on {
        _ if kind == EffectKind::OrificeLaw => 0.0,
        ActsOn::Solenoid | ActsOn::Measurement => LEAST_DELAY,
        _ => LEAST_SIZE,
    }
}

/// Whether every effect of a model is large enough to be of use: a delay, beside how much the delays of
/// single strokes differ.
pub fn is_practical(model: &Model, scatter: &Scatter) -> bool {
    practical_kinds(model, scatter).len() == model.kinds.len()
}

/// The effects of a model that are large enough to be of use.
pub(super) fn practical_kinds(model: &Model, scatter: &Scatter) -> Vec<EffectKind> {
    let differ = scatter.largest_delay_s();
    let is_of_use = |kind: &EffectKind| {
        let coordinates = model.fit.space.effect_coordinates(*kind);
        let values = model.fit.space.effect_values(*kind, &model.fit.u).unwrap_or_default();
        match kind.info().acts_on {
            _ if *kind == EffectKind::OrificeLaw => (values[0] - IDEAL_CRITICAL).abs() > LEAST_CRITICAL,
            ActsOn::Solenoid | ActsOn::Measurement => values
                .iter()
                .zip(&coordinates)
                .any(|(delay_s, index)| model.fit.u[*index].abs() > LEAST_DELAY && delay_s.abs() > SCATTERED * differ),
            _ => model.fit.u[coordinates[0]].abs() > LEAST_SIZE,
        }
    };
    model.kinds.iter().copied().filter(is_of_use).collect()
}

/// The penalty for the parameters of the effects in a fit.
pub(super) fn penalty(fit: &Fit) -> f64 {
    let free = fit
        .space
        .coordinates
        .iter()
        .filter(|coordinate| !matches!(coordinate.target, Target::Base(_)))
        .map(|coordinate| if coordinate.prior.is_some() { 0.5 } else { 1.0 });
    PENALTY * (free.sum::<f64>() - added(fit) as f64)
}

fn added(fit: &Fit) -> usize {
    let moves =
        |slot: usize| fit.space.coordinates.iter().any(|c| matches!(c.target, Target::Effect(s, _) if s == slot));
    (0..fit.space.effects().len()).filter(|slot| moves(*slot)).count()
}
