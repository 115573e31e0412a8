//! From where a pressure counts.

/// From where a pressure counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reference {
    /// A bare unit such as kPa: absolute where an absolute pressure is wanted, else a difference.
    Unstated,
    /// From vacuum, said so (psia, bara).
    Absolute,
    /// From the atmosphere (`psig`, `barg`, `kPag`, `MPag`).
    Gauge,
    /// A bare psi or bar: a difference, or not said. What a European datasheet calls bar is mostly gauge.
    Ambiguous,
}
