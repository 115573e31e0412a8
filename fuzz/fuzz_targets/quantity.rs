//! Quantities.
#![no_main]

#[path = "../bodies/quantity.rs"]
mod body;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::look(bytes));
