//! From answers to the numbers of their pictures, one file for each kind of answer.

pub mod calibration;
pub mod comparison;
pub mod explanation;
pub mod life;
pub mod simulation;
