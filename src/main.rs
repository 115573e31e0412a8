//! Physics-based prognosis of pneumatic valves from their stroke times.

fn main() {}
