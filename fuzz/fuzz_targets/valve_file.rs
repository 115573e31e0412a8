//! Valve files.
#![no_main]

#[path = "../bodies/valve_file.rs"]
mod body;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::look(bytes));
