//! Numbers to text, quickly.

/// Decimals above which a number is written by the standard library.
const MOST_DECIMALS: usize = 9;
/// What a number with so many decimals is a whole multiple of one over.
const SCALES: [f64; MOST_DECIMALS + 1] = [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9];
/// Largest magnitude that is written here.
const LARGEST: f64 = 1e9;

/// Appends a number with at most so many decimals, zeros at the end left out.
pub fn push_number(out: &mut Vec<u8>, value: f64, decimals: usize) {
    if decimals > MOST_DECIMALS || !value.is_finite() || value.abs() >= LARGEST {
        out.extend_from_slice(format!("{value:?}").as_bytes());
        return;
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below 1e9 times 1e9")]
    let mut rest = (value.abs() * SCALES[decimals] + 0.5) as u64;
    if rest == 0 {
        out.extend_from_slice(if decimals > 0 { b"0.0" } else { b"0" });
        return;
    }
    if value < 0.0 {
        out.push(b'-');
    }
    let mut after = decimals;
    while after > 1 && rest.is_multiple_of(10) {
        rest /= 10;
        after -= 1;
    }
    let mut digits = [b'0'; 24];
    let mut at = digits.len();
    let mut digit = |rest: &mut u64| {
        at -= 1;
        digits[at] = b'0' + (*rest % 10) as u8;
        *rest /= 10;
    };
    for _ in 0..after {
        digit(&mut rest);
    }
    loop {
        digit(&mut rest);
        if rest == 0 {
            break;
        }
    }
    let (whole, fraction) = digits[at..].split_at(digits.len() - at - after);
    out.extend_from_slice(whole);
    if after > 0 {
        out.push(b'.');
        out.extend_from_slice(fraction);
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
        assert_eq!(text(-100.25, 1), "-100.3");
        assert_eq!(text(99_999.999_96, 4), "100000.0");
        assert_eq!(text(0.05, 9), "0.05");
        for i in 0..10_000 {
            let value = (f64::from(i) * 0.771_3 - 2000.0) * 1.01;
            let back: f64 = text(value, 6).parse().expect("a number");
            assert!((back - value).abs() < 0.51e-6, "{value}");
        }
    }
}
