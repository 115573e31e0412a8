//! Physics of a pneumatic valve: checked parameters in, strokes out
