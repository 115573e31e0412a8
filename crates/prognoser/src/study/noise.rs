//! Random numbers that are the same on every machine and for any number of
//! threads: every life has a generator of its own, seeded by its number.

/// `SplitMix64` (Steele, Lea, Flood 2014): small, fast and good enough for noise.
#[derive(Clone, Debug)]
pub struct NoiseSource {
    state: u64,
    spare: Option<f64>,
}

impl NoiseSource {
    /// A generator for one stream of one seed.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut source = Self { state: seed, spare: None };
        let mixed = source.next_u64() ^ stream.wrapping_mul(0xD129_0D3B_3F4C_9A5B);
        Self { state: mixed, spare: None }
    }

    fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in 0..1.
    pub fn uniform(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Standard normal, by Marsaglia's polar method.
    pub fn normal(&mut self) -> f64 {
        if let Some(value) = self.spare.take() {
            return value;
        }
        loop {
            let (u, v) = (2.0 * self.uniform() - 1.0, 2.0 * self.uniform() - 1.0);
            let s = u * u + v * v;
            if s > 0.0 && s < 1.0 {
                let factor = (-2.0 * s.ln() / s).sqrt();
                self.spare = Some(v * factor);
                return u * factor;
            }
        }
    }
}
