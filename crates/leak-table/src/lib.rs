//! Monotone tables from leak area to stroke times, with a manifest
