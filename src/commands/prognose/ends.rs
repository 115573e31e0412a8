//! How all valves stand in the end, the worst first.

use leak_table::Limits;
use prognoser::{FaultCall, Prognosis, Status};
use quantity::{Dimension, format_number};
use report::html::Cell;

use super::standing::Standing;
use crate::output::{Align, TextTable, told_in};
use answers::figures::life::{bounds, bounds_words, fault_words};

/// How a valve stood after its last row.
#[derive(Debug, Clone)]
pub struct End(Prognosis);

/// The last state of every valve, the worst first: by state, then by the cycles that are left almost surely (the 5 %
/// bound), then by name.
#[derive(Debug, Default)]
pub struct Ends(Vec<End>);

impl Ends {
    /// From the last prognosis of every valve.
    pub fn of(lasts: impl Iterator<Item = Prognosis>) -> Self {
        let mut ends: Vec<End> = lasts.map(End).collect();
        let left = |end: &End| end.0.rul_p05.unwrap_or(f64::INFINITY);
        ends.sort_by(|a, b| {
            let worse = b.0.status.cmp(&a.0.status).then(left(a).total_cmp(&left(b)));
            worse.then_with(|| a.0.valve.cmp(&b.0.valve))
        });
        Self(ends)
    }

    /// All valves.
    pub fn iter(&self) -> impl Iterator<Item = &End> {
        self.0.iter()
    }

    /// Number of valves.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// How many valves stand where, the worst first: "▲ 2 act-now", "✓ 5 healthy".
    pub fn counts(&self) -> Vec<Cell> {
        let count = |status: Status| self.0.iter().filter(|end| end.0.status == status).count();
        let shown = Status::ALL.into_iter().rev().map(|status| (count(status), Standing::of(status)));
        let shown = shown.filter(|(count, _)| *count > 0);
        shown.map(|(count, standing)| standing.cell(&format!("{count} "))).collect()
    }

    /// All valves in a table.
    pub fn table(&self) -> TextTable {
        let is_dated = self.0.iter().any(|End(one)| one.eol_time.is_some());
        let columns = [
            ("valve", Align::Left),
            ("cycle", Align::Right),
            ("status", Align::Left),
            ("fault", Align::Left),
            ("wear", Align::Right),
            ("cycles left", Align::Right),
            ("5 to 95 %", Align::Right),
            ("replace by", Align::Right),
            ("end", Align::Right),
            ("caveat", Align::Left),
        ];
        let has_caveats = self.0.iter().any(|End(one)| one.caveat.is_some());
        let told = |name: &str| match name {
            "end" => is_dated,
            "caveat" => has_caveats,
            _ => true,
        };
        // Dates are told in UTC, whatever zone the log has.
        let named = |name| match name {
            "replace by" if is_dated => "replace by (UTC)",
            "end" => "end (UTC)",
            name => name,
        };
        let columns: Vec<(&str, Align)> =
            columns.into_iter().filter(|(name, _)| told(name)).map(|(name, align)| (named(name), align)).collect();
        let mut table = TextTable::new(&columns);
        for End(one) in &self.0 {
            let missing = || "-".to_owned();
            let number =
                |value: Option<f64>, digits: usize| value.map_or_else(missing, |value| format!("{value:.digits$}"));
            let named = one.fault.wears();
            let bounds = bounds(one).filter(|_| named);
            let [replace_by, end] = dates(one);
            let replace_by = replace_by.or(one.replace_by_cycle.map(|by| by.to_string()));
            let end = end.unwrap_or_else(missing);
            let standing = Standing::of(one.status);
            let cells = [
                one.cycle.to_string(),
                one.fault.name().to_owned(),
                one.severity.filter(|_| named).map_or_else(missing, |severity| format!("{:.0} %", 100.0 * severity)),
                number(one.rul_cycles.filter(|_| named), 1),
                bounds.map_or_else(missing, bounds_words),
                replace_by.unwrap_or_else(missing),
                one.caveat.clone().unwrap_or_default(),
            ];
            let mut row: Vec<Cell> = cells.into_iter().map(Cell::from).collect();
            row.insert(0, one.valve.clone().into());
            row.insert(2, standing.cell(""));
            if is_dated {
                row.insert(row.len() - 1, end.into());
            }
            if !has_caveats {
                row.pop();
            }
            table.cells(row);
        }
        table
    }
}

/// What counts as the end of life: nobody is to take a limit for granted that was assumed when the valve file was made.
pub fn limits_words(limits: &Limits) -> String {
    format!(
        "End of life: a closing of more than {} s or an opening of more than {} s, the [limits] of the tables' valve file.",
        format_number(limits.close_within_s),
        format_number(limits.open_within_s)
    )
}

/// By when to replace a valve, and when it ends, as people say dates.
fn dates(one: &Prognosis) -> [Option<String>; 2] {
    let named = one.fault.wears();
    dates_in_words([one.replace_by.as_deref(), one.eol_time.as_deref().filter(|_| named)])
}

/// Dates of RFC 3339 by their days, since nobody replaces a valve to the second; to the minute where they are of one day.
fn dates_in_words(dates: [Option<&str>; 2]) -> [Option<String>; 2] {
    let day = |date: &str| date.split('T').next().unwrap_or(date).to_owned();
    let [first, last] = dates.map(|date| date.map(day));
    let is_one_day = first.is_some() && first == last;
    let minute = |date: &str| date.get(..MINUTE).unwrap_or(date).replace('T', " ");
    dates.map(|date| date.map(|date| if is_one_day { minute(date) } else { day(date) }))
}

/// Where the seconds of a date of RFC 3339 begin.
const MINUTE: usize = "2026-10-02T14:00".len();

impl End {
    /// The last row.
    pub fn row(&self) -> &Prognosis {
        &self.0
    }

    /// By when it is to be replaced, in a sentence; nothing where that is never.
    pub fn replacement(&self) -> Option<String> {
        let cycle = self.0.replace_by_cycle?;
        let [replace_by, _] = dates(&self.0);
        Some(match replace_by {
            Some(date) => format!("replace {} by {date} UTC (cycle {cycle})", self.0.valve),
            None => format!("replace {} by cycle {cycle}", self.0.valve),
        })
    }

    /// The state in a sentence.
    pub fn sentence(&self) -> String {
        let one = &self.0;
        let (name, cycle) = (&one.valve, one.cycle);
        let mut sentence = if one.fault.wears() {
            let kind = fault_words(one.fault);
            let leak = one.leak_area_mm2.map_or_else(String::new, |area| {
                let unit = told_in(Dimension::Area);
                format!(" of {} {}", unit.number(1e-6 * area, 4), unit.name())
            });
            let life = match (one.status, one.rul_cycles, bounds(one)) {
                (Status::EolReached, ..) => "end of life is reached".to_owned(),
                (_, Some(rul), Some(bounds)) => {
                    format!("{rul:.1} cycles left (5 to 95 %: {})", bounds_words(bounds))
                }
                (_, Some(rul), None) => format!("{rul:.1} cycles left"),
                (_, None, _) => "too early to tell the remaining life".to_owned(),
            };
            format!("{name}, cycle {cycle}: {kind}{leak}; {life}")
        } else {
            let known = match (one.status, one.fault) {
                (Status::EolReached, _) => "end of life is reached: strokes take too long",
                // Far off the tables from the first row on.
                (Status::Unknown, FaultCall::None) => "nothing has changed since the log began",
                (_, FaultCall::None) => "nothing wears",
                _ => "no fault can be named yet",
            };
            format!("{name}, cycle {cycle}: {known}")
        };
        if let Some(caveat) = &one.caveat {
            sentence.push_str(" (");
            sentence.push_str(caveat);
            sentence.push(')');
        }
        sentence
    }
}

#[cfg(test)]
mod tests {
    use super::dates_in_words;

    #[test]
    fn dates_of_one_day_have_their_hours() {
        let told = |dates: [Option<&str>; 2]| dates_in_words(dates).map(Option::unwrap_or_default);
        let (early, late) = ("2026-10-02T14:00:00Z", "2026-10-02T17:45:09Z");
        assert_eq!(told([Some(early), Some(late)]), ["2026-10-02 14:00", "2026-10-02 17:45"]);
        assert_eq!(told([Some(early), Some("2026-10-04T01:00:00Z")]), ["2026-10-02", "2026-10-04"]);
        assert_eq!(told([Some(early), None]), ["2026-10-02", ""]);
    }
}
