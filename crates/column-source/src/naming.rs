//! The names of columns: how a name is found again, and the unit that may stand at its end.

use quantity::{Dimension, Unit, suggest};

use crate::heading::{other_unit_at_end, time_in_words};

/// The unit behind the last underscore of a name, in any case: "position_mm", "T_DEGC", "Supply_PSIG".
#[must_use]
pub fn unit_at_end(name: &str, dimension: Dimension) -> Option<Unit> {
    let (_, end) = name.rsplit_once('_')?;
    let in_words = || time_in_words(end).filter(|_| dimension == Dimension::Time);
    let known = dimension.unit_ignoring_case(end).or_else(in_words);
    // Bare psi and bar are none of the usual units, and must not be overlooked either.
    let bare =
        ["psi", "bar"].into_iter().find(|unit| dimension == Dimension::Pressure && unit.eq_ignore_ascii_case(end));
    Unit::parse(known.or(bare)?).ok()
}

/// The unit behind the last underscore of a name, of whatever a recorder writes down.
#[must_use]
pub fn any_unit_at_end(name: &str) -> Option<Unit> {
    let all = [Dimension::Time, Dimension::Length, Dimension::Pressure, Dimension::Temperature, Dimension::Area];
    all.into_iter().find_map(|dimension| unit_at_end(name, dimension))
}

/// A name without the unit behind its last underscore.
#[must_use]
pub fn without_unit(bare: &str) -> &str {
    match (any_unit_at_end(bare), bare.rsplit_once('_')) {
        (Some(_), Some((stem, _))) => stem,
        _ => bare,
    }
}

/// A name in small letters, umlauts and accents written out.
#[must_use]
pub fn written_out(name: &str) -> String {
    let mut plain = String::with_capacity(name.len());
    for character in name.to_lowercase().chars() {
        match character {
            'ä' => plain.push_str("ae"),
            'ö' => plain.push_str("oe"),
            'ü' => plain.push_str("ue"),
            'ß' => plain.push_str("ss"),
            'é' | 'è' | 'ê' => plain.push('e'),
            'à' | 'â' | 'á' | 'ã' => plain.push('a'),
            'ô' | 'ó' | 'ò' | 'õ' => plain.push('o'),
            'í' | 'ì' | 'î' => plain.push('i'),
            'ú' | 'ù' | 'û' => plain.push('u'),
            'ñ' => plain.push('n'),
            'ç' => plain.push('c'),
            other => plain.push(other),
        }
    }
    plain
}

/// The columns of this name among names with and without their units: as it is written, else without the unit in
/// brackets, else in any case, else without the unit behind an underscore, else without a unit in brackets that is none of this program's,
/// as in "ZT [%]". Where recordings of one campaign differ in
/// a column's unit, the name without it is that of all.
#[must_use]
pub fn named(headings: &[(&str, &str)], name: &str) -> Vec<usize> {
    let small = name.to_lowercase();
    let fits = |way: usize, whole: &str, bare: &str| match way {
        0 => whole == name,
        1 => bare == name,
        2 => whole.to_lowercase() == small || bare.to_lowercase() == small,
        3 => without_unit(bare).to_lowercase() == small,
        _ => other_unit_at_end(whole).is_some_and(|(bare, _)| bare.to_lowercase() == small),
    };
    let all = |way| (0..headings.len()).filter(|index| fits(way, headings[*index].0, headings[*index].1)).collect();
    (0..5).map(all).find(|found: &Vec<usize>| !found.is_empty()).unwrap_or_default()
}

/// Names of columns in quotation marks for a message; of a great many the first ones, and how many more there are.
#[must_use]
pub fn listed<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> String {
    const MOST: usize = 24;
    let more = names.len().saturating_sub(MOST);
    let mut all: Vec<String> = names.take(MOST).map(|name| format!("\"{name}\"")).collect();
    if more > 0 {
        all.push(format!("and {more} more"));
    }
    all.join(", ")
}

/// " (did you mean ...?)" for a name among names with and without their units, or nothing.
#[must_use]
pub fn did_you_mean<'a>(headings: impl Iterator<Item = (&'a str, &'a str)>, name: &str) -> String {
    let names =
        |(whole, bare)| [whole, bare, without_unit(bare), other_unit_at_end(whole).map_or(whole, |(bare, _)| bare)];
    suggest::did_you_mean(name, headings.flat_map(names))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Heading;

    #[test]
    fn seconds_behind_an_underscore_may_be_written_out() {
        for (name, unit) in [("CLOSE_TIME_SEC", "s"), ("time_msec", "ms"), ("t_seconds", "s")] {
            assert_eq!(unit_at_end(name, Dimension::Time).unwrap().text(), unit);
            assert_eq!(unit_at_end(name, Dimension::Length), None);
        }
    }

    #[test]
    fn a_unit_of_another_kind_may_be_left_out_of_a_name() {
        for heading in ["XV-1203.ZT [%]", "XV-1203.ZT (mA)", "XV-1203.ZT / V", "xv-1203.zt [percent]"] {
            let all = [Heading::new("XV-1203.CMD"), Heading::new(heading)];
            let names: Vec<_> = all.iter().map(|heading| (heading.name.as_str(), heading.bare())).collect();
            assert_eq!(named(&names, "XV-1203.ZT"), [1], "{heading}");
        }
        // A column in mm goes before one of the same name in percent.
        let all = [Heading::new("ZT [%]"), Heading::new("ZT [mm]")];
        let names: Vec<_> = all.iter().map(|heading| (heading.name.as_str(), heading.bare())).collect();
        assert_eq!((named(&names, "ZT"), named(&names, "ZT [%]")), (vec![1], vec![0]));
    }
}
