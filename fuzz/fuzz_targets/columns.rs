//! Recordings of any format: text, gzip, TDMS, Parquet, MATLAB, HDF5.
#![no_main]

#[path = "../bodies/columns.rs"]
mod body;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::look(bytes));
