//! Quantities with units as users write them, to SI and back
