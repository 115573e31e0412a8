//! Which parameters may move, and the coordinates in which a fit moves them.
//!
//! A tolerated parameter p moves as p0 exp(sigma u) with u ~ N(0, 1): u counts its own tolerances. The
//! size of an effect moves linearly from its neutral value (u = 0) through its typical size (u = 1),
//! its shape parameters logarithmically about what is typical of the valve.

use identify::special::chi_squared_quantile_99;
use valve_file::Tolerance;
use valve_model::custom::CustomEffect;
use valve_model::effects::{DefaultValue, Search};
use valve_model::{Effect, EffectKind, ParameterId, Parameters, Switches, Valve};

/// What a coordinate moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// A parameter of the base model.
    Base(ParameterId),
    /// A parameter of an effect of the catalogue: position in [`Space::effects`], index of the parameter.
    Effect(usize, usize),
    /// A parameter of a custom effect: position in [`Space::custom`], index of the parameter.
    Custom(usize, usize),
}

/// How a coordinate maps to a value.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Map {
    /// centre + scale u.
    Linear,
    /// centre exp(scale u).
    Logarithmic,
    /// centre / u: from infinity at 0 through the centre at 1.
    Reciprocal,
}

/// One coordinate of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinate {
    /// What it moves.
    pub target: Target,
    map: Map,
    centre: f64,
    scale: f64,
    /// Smallest u.
    pub lower: f64,
    /// Largest u.
    pub upper: f64,
    /// Where a fit starts.
    pub start: f64,
    /// Mean and standard deviation of u beforehand, if anything is known.
    pub prior: Option<(f64, f64)>,
    /// Step for finite differences in u.
    pub step: f64,
}

impl Coordinate {
    /// The value at a coordinate, SI (of a parameter that is an excess over another: that excess, relative).
    pub fn value(&self, u: f64) -> f64 {
        match self.map {
            Map::Linear => self.centre + self.scale * u,
            Map::Logarithmic => self.centre * (self.scale * u).exp(),
            Map::Reciprocal => self.centre / u,
        }
    }

    /// The relative tolerance of the base parameter that it moves, one standard deviation; nothing for effects.
    pub fn tolerance(&self) -> Option<f64> {
        matches!(self.target, Target::Base(_)).then_some(self.scale)
    }

    /// The coordinate of a value.
    pub fn coordinate(&self, value: f64) -> f64 {
        let u = match self.map {
            Map::Linear => (value - self.centre) / self.scale,
            Map::Logarithmic => (value / self.centre).ln() / self.scale,
            Map::Reciprocal => self.centre / value,
        };
        u.clamp(self.lower, self.upper)
    }

    /// A step for finite differences at u that stays within the bounds.
    pub fn step_at(&self, u: f64) -> f64 {
        let step =
            if self.prior.is_none() && self.map != Map::Logarithmic { self.step * u.abs().max(0.4) } else { self.step };
        if u + step > self.upper { -step } else { step }
    }
}

/// The range of a refinement is this many standard deviations of its prior wide.
const REFINEMENT_SIGMAS: f64 = 8.0;

/// The parameters that may move, around a valve.
#[derive(Debug, Clone)]
pub struct Space {
    parameters: Parameters,
    switches: Switches,
    /// Kinds of the effects of the catalogue, with the values that do not move.
    effects: Vec<Effect>,
    custom: Vec<CustomEffect>,
    /// The coordinates, tolerated parameters first.
    pub coordinates: Vec<Coordinate>,
}

impl Space {
    /// The tolerated parameters of a valve; its effects stay as they are.
    pub fn new(valve: &Valve, tolerances: &[Tolerance]) -> Self {
        let coordinates = tolerances
            .iter()
            .map(|tolerance| Coordinate {
                target: Target::Base(tolerance.parameter),
                map: Map::Logarithmic,
                centre: valve.parameters().get(tolerance.parameter),
                scale: tolerance.relative_sigma,
                lower: -6.0,
                upper: 6.0,
                start: 0.0,
                prior: Some((0.0, 1.0)),
                step: 0.02,
            })
            .collect();
        Self {
            parameters: valve.parameters().clone(),
            switches: valve.switches(),
            effects: valve.effects().to_vec(),
            custom: valve.custom().to_vec(),
            coordinates,
        }
    }

    /// The same valve with nothing that may move.
    #[must_use]
    pub fn fixed(&self) -> Self {
        Self { coordinates: Vec::new(), ..self.clone() }
    }

    /// The effects of the catalogue in the space.
    pub fn effects(&self) -> &[Effect] {
        &self.effects
    }

    /// The custom effects in the space.
    pub fn custom(&self) -> &[CustomEffect] {
        &self.custom
    }

    /// The valve's parameters before any fit.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The space with an effect of the catalogue that may move; one that is there already is freed.
    #[must_use]
    pub fn with_effect(&self, kind: EffectKind) -> Self {
        let mut space = self.clone();
        let slot = space.effects.iter().position(|effect| effect.kind() == kind).unwrap_or(space.effects.len());
        if slot == space.effects.len() {
            space.effects.push(typical(kind, &self.parameters));
        }
        for index in 0..kind.parameters().len() {
            let target = Target::Effect(slot, index);
            if kind.parameters()[index].is_refinement() {
                continue;
            }
            if space.coordinates.iter().all(|coordinate| coordinate.target != target) {
                let given = self.effects.get(slot).filter(|effect| effect.kind() == kind);
                space.coordinates.push(effect_coordinate(kind, index, target, &self.parameters, given));
            }
        }
        space
    }

    /// The same with the effect's refinements free as well: shapes that hardly anybody knows, each with a prior about
    /// its default.
    #[must_use]
    pub fn with_refined_effect(&self, kind: EffectKind) -> Self {
        let mut space = self.with_effect(kind);
        let Some(slot) = space.effects.iter().position(|effect| effect.kind() == kind) else { return space };
        for (index, parameter) in
            kind.parameters().iter().enumerate().filter(|(_, parameter)| parameter.is_refinement())
        {
            let target = Target::Effect(slot, index);
            if space.coordinates.iter().any(|coordinate| coordinate.target == target) {
                continue;
            }
            let range = (parameter.range)(&self.parameters);
            let centre = space.effects[slot].values()[index];
            let is_positive = range.lower > 0.0 && centre > 0.0;
            let (map, width) = if is_positive {
                (Map::Logarithmic, (range.upper / range.lower).ln())
            } else {
                (Map::Linear, range.upper - range.lower)
            };
            let scale = width / REFINEMENT_SIGMAS;
            let at = |value: f64| if is_positive { (value / centre).ln() / scale } else { (value - centre) / scale };
            space.coordinates.push(Coordinate {
                target,
                map,
                centre,
                scale,
                lower: at(range.lower),
                upper: at(range.upper),
                start: 0.0,
                prior: Some((0.0, 1.0)),
                step: 0.05,
            });
        }
        space
    }

    /// The space with a custom effect whose parameters may move.
    #[must_use]
    pub fn with_custom(&self, effect: &CustomEffect) -> Self {
        let mut space = self.clone();
        let slot = space.custom.len();
        space.custom.push(effect.clone());
        for (index, parameter) in effect.parameters().iter().enumerate() {
            let width = parameter.upper - parameter.lower;
            let scale = if width > 0.0 { 0.1 * width } else { 1.0 };
            space.coordinates.push(Coordinate {
                target: Target::Custom(slot, index),
                map: Map::Linear,
                centre: parameter.value,
                scale,
                lower: (parameter.lower - parameter.value) / scale,
                upper: (parameter.upper - parameter.value) / scale,
                start: 0.0,
                // Wide beside the range; only keeps a parameter that the data do not feel in place.
                prior: Some((0.0, 10.0)),
                step: 0.02,
            });
        }
        space
    }

    /// Writes what a point of another space says of the coordinates that both have.
    pub fn carry(&self, from: &Self, u: &[f64], into: &mut [f64]) {
        for (place, coordinate) in self.coordinates.iter().enumerate() {
            if let Some(same) = from.coordinates.iter().position(|other| self.is_same(coordinate, from, other)) {
                into[place] = u[same];
            }
        }
    }

    /// Writes the refinements that effects of another space, which this one has not, share by name with effects that only this one
    /// has: bristles are as stiff whatever law the friction on them follows.
    pub fn carry_refinements(&self, from: &Self, u: &[f64], into: &mut [f64]) {
        let refinement = |space: &Self, other: &Self, coordinate: &Coordinate| {
            let Target::Effect(slot, index) = coordinate.target else { return None };
            let kind = space.effects[slot].kind();
            let is_exchanged = other.effects.iter().all(|effect| effect.kind() != kind);
            let parameter = &kind.parameters()[index];
            (is_exchanged && parameter.is_refinement()).then_some(parameter.name)
        };
        for (place, coordinate) in self.coordinates.iter().enumerate() {
            let Some(name) = refinement(self, from, coordinate) else { continue };
            let same = from.coordinates.iter().position(|other| refinement(from, self, other) == Some(name));
            if let Some(same) = same {
                into[place] = coordinate.coordinate(from.coordinates[same].value(u[same]));
            }
        }
    }

    /// Whether a coordinate moves the same as one of another space does.
    pub fn is_same(&self, one: &Coordinate, other_space: &Self, other: &Coordinate) -> bool {
        match (one.target, other.target) {
            (Target::Base(one), Target::Base(other)) => one == other,
            (Target::Effect(slot, index), Target::Effect(other_slot, other_index)) => {
                index == other_index && self.effects[slot].kind() == other_space.effects[other_slot].kind()
            }
            (Target::Custom(slot, index), Target::Custom(other_slot, other_index)) => {
                index == other_index && self.custom[slot].name() == other_space.custom[other_slot].name()
            }
            _ => false,
        }
    }

    /// Where a fit starts.
    pub fn start(&self) -> Vec<f64> {
        self.coordinates.iter().map(|coordinate| coordinate.start).collect()
    }

    /// The coordinates of an effect, by position in the space.
    pub fn effect_coordinates(&self, kind: EffectKind) -> Vec<usize> {
        let slot = self.effects.iter().position(|effect| effect.kind() == kind);
        let belongs = |target: Target| matches!(target, Target::Effect(s, _) if Some(s) == slot);
        (0..self.coordinates.len()).filter(|index| belongs(self.coordinates[*index].target)).collect()
    }

    /// Whether the shapes of an effect at a point lie, all together, where less than one such effect in a hundred has them.
    pub fn has_strange_shape(&self, u: &[f64], kind: EffectKind) -> bool {
        let of_effect = self.effect_coordinates(kind).into_iter();
        let squares: Vec<f64> = of_effect
            .filter_map(|index| {
                let (mean, sigma) = self.coordinates[index].prior?;
                Some(((u[index] - mean) / sigma).powi(2))
            })
            .collect();
        !squares.is_empty() && squares.iter().sum::<f64>() > chi_squared_quantile_99(squares.len())
    }

    /// The base parameters at a point.
    pub fn base_at(&self, u: &[f64]) -> Parameters {
        let mut parameters = self.parameters.clone();
        for (coordinate, u) in self.coordinates.iter().zip(u) {
            if let Target::Base(id) = coordinate.target {
                parameters.set(id, coordinate.value(*u));
            }
        }
        parameters
    }

    /// The effects of the catalogue at a point.
    pub fn effects_at(&self, u: &[f64]) -> Vec<Effect> {
        let mut values: Vec<Vec<f64>> = self.effects.iter().map(|effect| effect.values().to_vec()).collect();
        for (coordinate, u) in self.coordinates.iter().zip(u) {
            if let Target::Effect(slot, index) = coordinate.target {
                values[slot][index] = coordinate.value(*u);
            }
        }
        self.effects
            .iter()
            .zip(&mut values)
            .enumerate()
            .map(|(slot, (effect, values))| {
                for (index, parameter) in effect.kind().parameters().iter().enumerate() {
                    let moves = || self.coordinates.iter().any(|c| c.target == Target::Effect(slot, index));
                    if let Search::ExcessOver { other, .. } = parameter.search
                        && moves()
                    {
                        values[index] = values[other] * (1.0 + values[index]);
                    }
                }
                let given: Vec<Option<f64>> = values.iter().copied().map(Some).collect();
                Effect::new(effect.kind(), &given).unwrap_or(*effect)
            })
            .collect()
    }

    /// The custom effects at a point.
    pub fn custom_at(&self, u: &[f64]) -> Vec<CustomEffect> {
        let mut values: Vec<Vec<f64>> =
            self.custom.iter().map(|effect| effect.parameters().iter().map(|p| p.value).collect()).collect();
        for (coordinate, u) in self.coordinates.iter().zip(u) {
            if let Target::Custom(slot, index) = coordinate.target {
                values[slot][index] = coordinate.value(*u);
            }
        }
        self.custom.iter().zip(values).map(|(effect, values)| effect.with_values(&values)).collect()
    }

    /// The valve at a point; nothing if the point is no possible valve.
    pub fn valve(&self, u: &[f64]) -> Option<Valve> {
        Valve::new(self.base_at(u), self.switches, self.effects_at(u), self.custom_at(u)).ok()
    }

    /// The values of an effect's parameters at a point, SI.
    pub fn effect_values(&self, kind: EffectKind, u: &[f64]) -> Option<Vec<f64>> {
        let effects = self.effects_at(u);
        effects.iter().find(|effect| effect.kind() == kind).map(|effect| effect.values().to_vec())
    }
}

/// An effect at its typical size on this valve.
pub fn typical(kind: EffectKind, parameters: &Parameters) -> Effect {
    let values: Vec<Option<f64>> =
        kind.parameters().iter().map(|parameter| Some((parameter.range)(parameters).typical)).collect();
    Effect::new(kind, &values).unwrap_or_else(|_| unreachable!("the typical size of {} is valid", kind.id()))
}

fn effect_coordinate(
    kind: EffectKind,
    index: usize,
    target: Target,
    parameters: &Parameters,
    given: Option<&Effect>,
) -> Coordinate {
    let parameter = &kind.parameters()[index];
    let range = (parameter.range)(parameters);
    let neutral = kind.info().neutral;
    let linear = |centre: f64, scale: f64, start: f64| {
        let (a, b) = ((range.lower - centre) / scale, (range.upper - centre) / scale);
        Coordinate {
            target,
            map: Map::Linear,
            centre,
            scale,
            lower: a.min(b),
            upper: a.max(b),
            start,
            prior: None,
            step: 0.02,
        }
    };
    let logarithmic = |centre: f64, prior: Option<(f64, f64)>| Coordinate {
        target,
        map: Map::Logarithmic,
        centre,
        scale: 1.0,
        lower: (range.lower.max(1e-12) / centre).ln(),
        upper: (range.upper / centre).ln(),
        start: 0.0,
        prior,
        step: 0.02,
    };
    let mut coordinate = match parameter.search {
        Search::Size => linear(neutral, range.typical - neutral, 1.0),
        Search::InverseSize => Coordinate {
            map: Map::Reciprocal,
            centre: range.typical,
            scale: 1.0,
            lower: 0.0,
            upper: range.typical / range.lower,
            start: 1.0,
            ..linear(0.0, 1.0, 1.0)
        },
        Search::SizeFrom { least } => linear(least, range.typical - least, 1.0),
        Search::ExcessOver { start, .. } => Coordinate {
            target,
            map: Map::Linear,
            centre: 0.0,
            scale: 1.0,
            lower: 0.0,
            upper: 4.0,
            start,
            prior: Some((0.0, 1.0)),
            step: 0.02,
        },
        Search::Share => Coordinate { prior: Some((0.5, 0.5)), ..linear(0.0, 1.0, 0.5) },
        // Shape parameters: about what is typical of this valve, within a factor of three or so. Refinements: about what the model
        // does without them.
        Search::Shape => logarithmic(range.typical, Some((0.0, 1.0))),
        Search::Refinement => {
            let centre = match parameter.default {
                DefaultValue::Value(value) => value,
                _ => range.typical,
            };
            logarithmic(centre.clamp(range.lower.max(1e-12), range.upper), Some((0.0, 1.0)))
        }
    };
    if let Some(effect) = given {
        let value = match parameter.search {
            Search::ExcessOver { other, .. } => effect.values()[index] / effect.values()[other].max(1e-9) - 1.0,
            _ => effect.values()[index],
        };
        coordinate.start = coordinate.coordinate(value);
    }
    coordinate
}
