//! Numbers to text, quickly.

/// Decimals above which a number is written by the standard library.
const MOST_DECIMALS: usize = 9;
/// Largest magnitude that is written here.
const LARGEST: f64 = 1e9;

/// Appends a number with at most so many decimals, zeros at the end left out.
pub fn push_number(out: &mut Vec<u8>, value: f64, decimals: usize) {
    let scale = 10_f64.powi(i32::try_from(decimals).unwrap_or(0));
    if decimals > MOST_DECIMALS || !value.is_finite() || value.abs() >= LARGEST {
        out.extend_from_slice(format!("{value:?}").as_bytes());
        return;
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below 1e9 times 1e9")]
    let scaled = (value.abs() * scale).round() as u64;
    if value < 0.0 && scaled > 0 {
        out.push(b'-');
    }
    let mut digits = [b'0'; 24];
    let mut at = digits.len();
    let mut rest = scaled;
    let mut written = 0;
    while rest > 0 || written <= decimals {
        at -= 1;
        let digit = (rest % 10) as u8;
        digits[at] = b'0' + digit;
        rest /= 10;
        written += 1;
    }
    let (whole, fraction) = digits[at..].split_at(written - decimals);
    out.extend_from_slice(whole);
    let kept = fraction.iter().rposition(|digit| *digit != b'0').map_or(1, |last| last + 1);
    if decimals > 0 {
        out.push(b'.');
        out.extend_from_slice(&fraction[..kept]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_as_they_were() {
        let text = |value: f64, decimals: usize| {
            let mut out = Vec::new();
            push_number(&mut out, value, decimals);
            String::from_utf8(out).expect("digits")
        };
        assert_eq!(text(0.0, 4), "0.0");
        assert_eq!(text(-1.5, 4), "-1.5");
        assert_eq!(text(-0.000_01, 4), "0.0");
        assert_eq!(text(12.0, 0), "12");
        assert_eq!(text(0.000_123_456_789, 9), "0.000123457");
        assert_eq!(text(f64::INFINITY, 3), "inf");
        for i in 0..10_000 {
            let value = (f64::from(i) * 0.771_3 - 2000.0) * 1.01;
            let back: f64 = text(value, 6).parse().expect("a number");
            assert!((back - value).abs() < 0.51e-6, "{value}");
        }
    }
}
