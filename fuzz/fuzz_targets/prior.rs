//! What sister valves have taught, and a few rows by it.
#![no_main]

#[path = "../bodies/prior.rs"]
mod body;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::look(bytes));
