//! Compares the valve model with measurements, calibrates it and finds missing physics
