//! Evidence, variance components and selection where the answer is known.

mod bounces;
#[path = "../common/mod.rs"]
mod common;
mod densities;
mod drawn;
mod finer;
mod folds;
mod misled;
mod regressors;
mod ripples;
mod rivals;
mod summits;
mod swings;
mod toy;
mod unfinished;
mod valleys;
