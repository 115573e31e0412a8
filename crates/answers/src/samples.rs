//! What comes along to try things on: the valve of the paper, and the timing log of one whose pipe leaks.

use valve_file::ValveFile;

const VALVE: &str = include_str!("../../../models/testbed.toml");

/// A timing log of 25 cycles with a missing cycle and a mistyped time; how it was made is in `data/README.md`.
pub const LEAKING_LOG: &str = include_str!("../../../data/leaking-valve.csv");

/// The valve file of the paper's valve.
pub fn reference_valve() -> ValveFile {
    ValveFile::parse(VALVE, "models/testbed.toml").expect("a test reads it")
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_reference_valve_can_be_read() {
        assert_eq!(super::reference_valve().text(), super::VALVE);
    }
}
