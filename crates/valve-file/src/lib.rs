//! The valve file: TOML text to checked parameters and back, comments kept
