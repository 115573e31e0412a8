//! The figures of tidy campaigns, counted by what was recorded.

use std::fmt::{self, Display};

use blind_benchmark::truth::{Category, Channels};

use crate::table::median;
use crate::{Kind, Scored};

/// The scores of many campaigns.
#[derive(Debug)]
pub struct Summary<'a> {
    /// All of them.
    pub all: &'a [Scored],
}

/// One row of the table.
struct Row {
    what: &'static str,
    wanted: &'static str,
    category: Option<Category>,
    counts: fn(&Scored) -> bool,
}

const ROWS: [Row; 7] = [
    Row {
        what: "one effect: the right one first",
        wanted: "90 / 97 %",
        category: Some(Category::One),
        counts: Scored::first_is_right,
    },
    Row {
        what: "one effect: in a reported group of at most three",
        wanted: "97 %",
        category: Some(Category::One),
        counts: Scored::is_in_groups,
    },
    Row {
        what: "one effect: that one and no other",
        wanted: "",
        category: Some(Category::One),
        counts: Scored::is_exact,
    },
    Row {
        what: "two effects: both named",
        wanted: "75 / 90 %",
        category: Some(Category::Two),
        counts: Scored::names_all,
    },
    Row {
        what: "two effects: both in groups of at most three",
        wanted: "",
        category: Some(Category::Two),
        counts: Scored::is_in_groups,
    },
    Row {
        what: "nothing hidden: false alarms",
        wanted: "at most 2 %",
        category: Some(Category::Nothing),
        counts: |scored| !scored.is_right(),
    },
    Row {
        what: "outside the catalogue: told",
        wanted: "85 %",
        category: Some(Category::Outside),
        counts: Scored::is_right,
    },
];

const COLUMNS: [(&str, Channels); 3] = [
    ("position", Channels::Position),
    ("with pressures", Channels::PositionAndPressures),
    ("stroke times", Channels::Timings),
];

impl Summary<'_> {
    fn of(&self, category: Option<Category>, channels: Channels) -> impl Iterator<Item = &Scored> {
        self.all.iter().filter(move |scored| {
            scored.tidy.as_ref().is_some_and(|truth| {
                category.is_none_or(|category| truth.category == category) && truth.channels == channels
            })
        })
    }

    fn share(&self, row: &Row, channels: Channels) -> String {
        let count = self.of(row.category, channels).count();
        if count == 0 {
            return "-".into();
        }
        let hits = self.of(row.category, channels).filter(|scored| (row.counts)(scored)).count();
        format!("{hits} of {count} ({:.0} %)", 100.0 * hits as f64 / count as f64)
    }

    fn median(&self, channels: Channels, value: impl Fn(&Scored) -> Vec<f64>) -> String {
        median(self.of(None, channels).flat_map(value).collect()).map_or("-".into(), |median| format!("{median:.3}"))
    }
}

/// What a median is of, what is wanted, and the values of one campaign.
type Median<'a> = (&'a str, &'a str, &'a dyn Fn(&Scored) -> Vec<f64>);

fn is_of_catalogue(scored: &Scored) -> bool {
    matches!(scored.wanted.kind, Kind::One | Kind::Two)
}

impl Display for Summary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let used: Vec<_> =
            COLUMNS.into_iter().filter(|(_, channels)| self.of(None, *channels).next().is_some()).collect();
        write!(f, "{:52}{:>14}", "", "wanted")?;
        for (title, _) in &used {
            write!(f, "{title:>20}")?;
        }
        writeln!(f)?;
        for row in &ROWS {
            write!(f, "{:52}{:>14}", row.what, row.wanted)?;
            for (_, channels) in &used {
                write!(f, "{:>20}", self.share(row, *channels))?;
            }
            writeln!(f)?;
        }
        let held_out = |scored: &Scored| {
            scored.answer.held_out.filter(|_| is_of_catalogue(scored)).into_iter().collect::<Vec<_>>()
        };
        let medians: [Median<'_>; 3] = [
            ("median error on left-out conditions, in noise", "1.05", &held_out),
            ("median error of an effect's size, share", "", &|scored: &Scored| {
                scored.sizes().iter().map(|size| size.error).collect()
            }),
            ("median time, s", "", &|scored: &Scored| vec![scored.seconds]),
        ];
        for (what, wanted, value) in medians {
            write!(f, "{what:52}{wanted:>14}")?;
            for (_, channels) in &used {
                write!(f, "{:>20}", self.median(*channels, value))?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}
