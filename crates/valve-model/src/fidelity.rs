//! How closely the equations of motion are followed: what a shorter computation may give up.

/// The step of the integrator unless said otherwise, s.
pub const DEFAULT_STEP_S: f64 = 1e-3;

/// Substeps that a lane may take where a supply line feeds the pipe: the laminar width shrinks with their square, down to a
/// relative pressure difference of some 1e-4, where no stroke time feels it any more.
pub(crate) const MOST_SUBSTEPS: u32 = 16;

/// Steps that one may span on a stop.
const MOST_SPAN: u32 = 8;

/// How closely a run is followed. A step of a millisecond gives stroke times to some microseconds; a search that simulates
/// thousands of times may ask for less.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fidelity {
    /// Longest step of the integrator, s.
    pub step_s: f64,
    /// Substeps that a step is cut into at most where the pressures of a supply line and the pipe meet, a power of two.
    pub most_substeps: u32,
    /// Steps that one may span at most while the piston rests on a stop. Which ones may depends on the terms of a valve: where
    /// models are compared with and without an effect, with fewer the difference is the effect's alone.
    pub most_span: u32,
    /// How many times wider than in a step of a millisecond the orifice law may be regularised, and how many times
    /// lower the bound of the quickest rates may be; at least 1.
    pub roughness: f64,
    /// The piston may be as inert as a mass of this, kg, where that lets steps be longer; its weight stays. 0 for the
    /// piston as it is. The motion of a valve that takes many seconds is a balance of forces in which inertia has no
    /// part, but how quickly the piston swings on its stops would still bound the step.
    pub most_inert_kg: f64,
}

impl Fidelity {
    /// As results are computed.
    pub const FINE: Self = Self {
        step_s: DEFAULT_STEP_S,
        most_substeps: MOST_SUBSTEPS,
        most_span: MOST_SPAN,
        roughness: 1.0,
        most_inert_kg: 0.0,
    };

    /// With steps of at most this, s. One longer than a millisecond is meant to be rough.
    pub fn with_step(step_s: f64) -> Self {
        Self { step_s, roughness: (step_s / DEFAULT_STEP_S).max(1.0), ..Self::FINE }
    }

    /// With at most this many substeps.
    #[must_use]
    pub fn with_most_substeps(self, most_substeps: u32) -> Self {
        Self { most_substeps: most_substeps.max(1), ..self }
    }

    /// With every step taken, on a stop as well.
    #[must_use]
    pub fn with_every_step(self) -> Self {
        Self { most_span: 1, ..self }
    }
}

impl From<f64> for Fidelity {
    /// [`Fidelity::with_step`].
    fn from(step_s: f64) -> Self {
        Self::with_step(step_s)
    }
}
