//! Numbers out of bytes, the lowest byte first or the highest.

/// Up to eight bytes as a number.
pub(crate) fn unsigned(bytes: &[u8], big: bool) -> u64 {
    let add = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
    if big { bytes.iter().fold(0, add) } else { bytes.iter().rev().fold(0, add) }
}

/// The same with a sign.
pub(crate) fn signed(bytes: &[u8], big: bool) -> i64 {
    let unused = 64 - 8 * u32::try_from(bytes.len()).unwrap_or(8).clamp(1, 8);
    unsigned(bytes, big).cast_signed() << unused >> unused
}

/// Four or eight bytes as a number with a point.
pub(crate) fn floating(bytes: &[u8], big: bool) -> f64 {
    let bits = unsigned(bytes, big);
    // Four bytes fit.
    if bytes.len() == 4 { f32::from_bits(u32::try_from(bits).unwrap_or_default()).into() } else { f64::from_bits(bits) }
}
