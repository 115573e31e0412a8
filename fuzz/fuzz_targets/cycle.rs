//! Any valve, drawn from bytes, and one cycle of it.
#![no_main]

#[path = "../bodies/cycle.rs"]
mod body;
#[path = "../bodies/drawn.rs"]
mod drawn;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::look(bytes));
