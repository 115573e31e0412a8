//! A campaign file and its recording, parted by a line of three dashes.
#![no_main]

#[path = "../bodies/campaign.rs"]
mod body;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::look(bytes));
