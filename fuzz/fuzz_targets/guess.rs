//! A look at a recording, and the campaign file that comes of it.
#![no_main]

#[path = "../bodies/guess.rs"]
mod body;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::look(bytes));
