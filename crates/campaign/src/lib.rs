//! Measurement campaigns: recorded strokes and stroke times, read and checked.
