//! Numbers as different countries write them.

/// How numbers are written in one file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NumberStyle {
    /// The decimal separator, b'.' or b','.
    pub decimal: u8,
    /// What parts thousands, where anything does.
    pub thousands: Option<char>,
}

impl NumberStyle {
    pub const PLAIN: Self = Self { decimal: b'.', thousands: None };

    /// What numbers in these fields say; the examples are the fields that made the difference.
    pub fn of<'a>(
        fields: impl Iterator<Item = &'a str>,
        comma_parts_fields: bool,
    ) -> (Self, Option<&'a str>, Option<&'a str>) {
        let mut style = Self::PLAIN;
        let (mut decimal_example, mut thousands_example) = (None, None);
        let (mut point_seen, mut comma_groups, mut all_grouped) = (false, None, true);
        for field in fields {
            let body = field.trim().trim_start_matches(['+', '-']);
            let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
            if !body.starts_with(|first: char| first.is_ascii_digit() || first == '.' || first == ',') {
                continue;
            }
            for separator in ['\'', '\u{2019}', '\u{a0}', '\u{202f}', ' '] {
                if grouped(body, separator, &['.', ',']) {
                    style.thousands = Some(separator);
                    thousands_example.get_or_insert(field);
                }
            }
            match (body.rfind(','), body.rfind('.')) {
                (Some(comma), Some(point)) if comma > point && grouped(body, '.', &[',']) => {
                    style = Self { decimal: b',', thousands: Some('.') };
                    thousands_example.get_or_insert(field);
                    decimal_example.get_or_insert(field);
                }
                (Some(comma), Some(point)) if point > comma && grouped(body, ',', &['.']) => {
                    style.thousands = Some(',');
                    thousands_example.get_or_insert(field);
                }
                (Some(_), None) if body.matches(',').count() > 1 && grouped(body, ',', &[]) => {
                    style.thousands = Some(',');
                    thousands_example.get_or_insert(field);
                }
                (None, Some(_)) if body.matches('.').count() > 1 && grouped(body, '.', &[]) => {
                    style = Self { decimal: b',', thousands: Some('.') };
                    thousands_example.get_or_insert(field);
                }
                (Some(comma), None) => {
                    let (whole, rest) = (&body[..comma], &body[comma + 1..]);
                    let fraction = rest.split(['e', 'E']).next().unwrap_or_default();
                    if (whole.is_empty() || whole.chars().all(|c| c.is_ascii_digit() || style.thousands == Some(c)))
                        && (fraction.is_empty() || digits(fraction))
                    {
                        comma_groups.get_or_insert(field);
                        all_grouped &= grouped(body, ',', &[]) && !body.starts_with('0');
                    }
                }
                // A date has more than one, or more than digits.
                (None, Some(_)) => point_seen |= body.parse::<f64>().is_ok(),
                _ => {}
            }
        }
        // A single comma is a decimal one, unless the file has decimal points. Among fields that are parted by commas,
        // in quotation marks, it is one of thousands where all could be.
        if let Some(field) = comma_groups
            && style.thousands != Some(',')
        {
            let decimal = style.decimal == b',' || !(point_seen || comma_parts_fields && all_grouped);
            if decimal {
                style.decimal = b',';
                decimal_example = Some(field);
            } else if all_grouped {
                style.thousands = Some(',');
                thousands_example.get_or_insert(field);
            }
        }
        (style, decimal_example, thousands_example)
    }

    /// A field as a number in this style; `None` where it is none.
    pub fn parse(self, field: &str) -> Option<f64> {
        let mut plain = String::with_capacity(field.len());
        let decimal = char::from(self.decimal);
        let end = field.rfind(decimal).unwrap_or(field.len());
        for (index, character) in field.char_indices() {
            if Some(character) == self.thousands && index < end {
                continue;
            }
            plain.push(match character {
                '\u{2212}' => '-',
                _ if character == decimal => '.',
                // The other separator, where it is none of thousands.
                ',' | '.' => return None,
                _ => character,
            });
        }
        // A comma twice is two points now, which is no number.
        plain.parse::<f64>().ok().filter(|number| number.is_finite())
    }
}

/// Whether the whole part of a number is digits in groups of three, parted by `separator`, at least one group.
fn grouped(body: &str, separator: char, ends: &[char]) -> bool {
    let whole = body.split(|character| ends.contains(&character)).next().unwrap_or_default();
    let mut groups = whole.split(separator);
    let first = groups.next().unwrap_or_default();
    let all_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let mut any = false;
    for group in groups {
        any = true;
        if group.len() != 3 || !all_digits(group) {
            return false;
        }
    }
    any && (1..=3).contains(&first.len()) && all_digits(first)
}

/// What stands where a reading is missing: in spreadsheets and programs, and what historians write in its place (AVEVA PI's system digital
/// states, and the like of other ones).
const GAPS: [&[u8]; 24] = [
    b"nan",
    b"na",
    b"n/a",
    b"null",
    b"none",
    b"-",
    b"--",
    b"#n/a",
    b"#nv",
    b"1.#qnan",
    b"bad",
    b"bad input",
    b"bad quality",
    b"no data",
    b"i/o timeout",
    b"io timeout",
    b"comm fail",
    b"not connect",
    b"pt created",
    b"shutdown",
    b"intf shut",
    b"scan off",
    b"scan timeout",
    b"configure",
];

/// Whether a field stands for a reading that is missing.
pub(crate) fn is_gap(field: &[u8]) -> bool {
    field.is_empty() || GAPS.iter().any(|gap| field.eq_ignore_ascii_case(gap))
}

/// A short decimal number such as "-25.945"; `None` for everything else. Digits below 2^53 divided
/// by a power of ten below 10^22 round correctly (Clinger, "How to read floating point numbers
/// accurately", 1990).
pub(crate) fn plain_decimal(field: &[u8]) -> Option<f64> {
    const POWERS: [f64; 16] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
    let (negative, digits) = match field {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, field),
    };
    // Fifteen digits and a point; more need not fit.
    if digits.is_empty() || digits.len() > 16 {
        return None;
    }
    let (mut mantissa, mut count, mut decimals) = (0u64, 0usize, None);
    for &byte in digits {
        match byte {
            b'0'..=b'9' => {
                mantissa = mantissa * 10 + u64::from(byte - b'0');
                count += 1;
            }
            b'.' if decimals.is_none() => decimals = Some(count),
            _ => return None,
        }
    }
    if count == 0 || count > 15 {
        return None;
    }
    let value = mantissa as f64 / POWERS[count - decimals.unwrap_or(count)];
    Some(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_decimals_are_read_as_the_standard_library_does() {
        for text in ["0", "-0.0", "25.945", "+1.5", "0.001", "123456789012345", "0.12345678901234", ".5", "7."] {
            let fast = plain_decimal(text.as_bytes()).unwrap();
            assert_eq!(fast.to_bits(), text.parse::<f64>().unwrap().to_bits(), "{text}");
        }
        for text in ["", "-", ".", "1e3", "1.2.3", "1234567890123456", "x", "1 "] {
            assert_eq!(plain_decimal(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn each_country_is_read_as_it_writes() {
        let read = |fields: &[&str], commas: bool| {
            let (style, ..) = NumberStyle::of(fields.iter().copied(), commas);
            fields.iter().map(|field| style.parse(field)).collect::<Vec<_>>()
        };
        let all = |numbers: &[f64]| numbers.iter().copied().map(Some).collect::<Vec<_>>();
        assert_eq!(read(&["1.5", "-2e-1"], true), all(&[1.5, -0.2]));
        assert_eq!(read(&["1,5", "0,123", "-2,5e-1"], false), all(&[1.5, 0.123, -0.25]));
        assert_eq!(read(&["1,5", "2,123"], true), all(&[1.5, 2.123]));
        assert_eq!(read(&["999", "1,000"], true), all(&[999.0, 1000.0]));
        assert_eq!(read(&["1.234,5", "7,25", "1.000"], false), all(&[1234.5, 7.25, 1000.0]));
        assert_eq!(read(&["1,234.5", "7.25", "1,000"], true), all(&[1234.5, 7.25, 1000.0]));
        assert_eq!(read(&["1'234.5", "7.25"], true), all(&[1234.5, 7.25]));
        assert_eq!(read(&["1 234,5", "7,25"], false), all(&[1234.5, 7.25]));
        assert_eq!(read(&["12.345.678", "7,25"], false), all(&[12_345_678.0, 7.25]));
        // A comma once among points stands for thousands, if it can.
        assert_eq!(read(&["1.5", "2,000"], false), all(&[1.5, 2000.0]));
        assert_eq!(read(&["1.5", "2,00"], false), [Some(1.5), None]);
        assert_eq!(read(&["1,2,3"], false), [None]);
        // Dates are no numbers with points.
        assert_eq!(read(&["1.3.2026", "01.03.2026 06:30", "2016,3"], false), [None, None, Some(2016.3)]);
    }
}
