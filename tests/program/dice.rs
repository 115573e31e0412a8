//! Numbers that look random, the same at every run.

pub struct Dice(pub u64);

impl Dice {
    pub fn below(&mut self, most: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % most
    }

    /// Up to so many bytes.
    pub fn length(&mut self, most: usize) -> usize {
        usize::try_from(self.below(most as u64 + 1)).expect("a length")
    }
}
