//! A broker's message: pattern, topic, map and payload, parted by lines of three dashes.
#![no_main]

#[path = "../bodies/message.rs"]
mod body;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::look(bytes));
