//! One figure a file: each a plain struct of numbers, with units in its names,
//! and a function that builds the picture.

mod effect;
mod experiment;
mod leaderboard;
mod missing;
mod overlay;
mod parameters;
mod prognosis;
mod quantity;
mod signature;
mod staircase;
mod strips;
mod study;
mod table;
mod trace;
mod unexplained;

pub use effect::EffectFigure;
pub use experiment::{ExperimentFigure, Prediction};
pub use leaderboard::{Candidate, LeaderboardFigure, Standing};
pub use missing::{MissingFigure, MissingPoint};
pub use overlay::{OverlayFigure, OverlayRun};
pub use parameters::{ParameterShift, ParametersFigure};
pub use prognosis::{PrognosisFigure, PrognosisPoint};
pub use quantity::Quantity;
pub use signature::SignatureFigure;
pub use staircase::{StaircaseFigure, StaircaseStep};
pub use strips::{StripRow, StripsFigure};
pub use study::{StudyFigure, StudyPoint, StudySeries};
pub use table::{TableFigure, TablePoint};
pub use trace::TraceFigure;
pub use unexplained::UnexplainedFigure;
