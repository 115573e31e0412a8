//! Tables: a manifest and its two files, parted by lines of three dashes. Their lengths and hashes are put where the manifest
//! says LENGTH and HASH, so that what is behind those checks is reached too.
#![no_main]

#[path = "../bodies/bundle.rs"]
mod body;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::look(bytes));
