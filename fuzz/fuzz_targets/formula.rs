//! The user's own formulas.
#![no_main]

#[path = "../bodies/formula.rs"]
mod body;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::look(bytes));
