//! The table of a world: a row a kind of campaign.

use std::fmt::{self, Display};

use crate::scored::{Scored, Size};
use crate::wanted::Kind;

/// The scores of one world's campaigns.
#[derive(Debug)]
pub struct Table<'a> {
    /// Its name.
    pub title: &'a str,
    /// All of them.
    pub all: &'a [Scored],
}

const COLUMNS: [(&str, usize); 13] = [
    ("", 12),
    ("campaigns", 10),
    ("right", 12),
    ("right first", 12),
    ("in its group", 13),
    ("wrong, sure", 12),
    ("alarm", 10),
    ("left is told", 13),
    ("size off", 9),
    ("size told", 10),
    ("90 % holds", 11),
    ("held out", 9),
    ("s (worst)", 14),
];

/// The value in the middle, none of none.
pub(crate) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.retain(|value| value.is_finite());
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

fn share(hits: usize, count: usize) -> String {
    if count == 0 { "-".into() } else { format!("{hits} ({:.0} %)", 100.0 * hits as f64 / count as f64) }
}

fn row(name: &str, rows: &[&Scored]) -> [String; 13] {
    let count = |test: fn(&Scored) -> bool| rows.iter().filter(|scored| test(scored)).count();
    let some = |wanted: &[Kind], test: fn(&Scored) -> bool| {
        let of: Vec<_> = rows.iter().filter(|scored| wanted.contains(&scored.wanted.kind)).collect();
        share(of.iter().filter(|scored| test(scored)).count(), of.len())
    };
    let sizes: Vec<Size> = rows.iter().flat_map(|scored| scored.sizes()).collect();
    let told = |test: fn(Size) -> bool| share(sizes.iter().filter(|size| test(**size)).count(), sizes.len());
    let number = |value: Option<f64>, digits: usize| value.map_or("-".into(), |v| format!("{v:.digits$}"));
    let held_out = median(rows.iter().filter_map(|scored| scored.answer.held_out).collect());
    let seconds: Vec<f64> = rows.iter().map(|scored| scored.seconds).collect();
    let worst = seconds.iter().fold(0.0_f64, |most, s| most.max(*s));
    [
        name.to_owned(),
        rows.len().to_string(),
        share(count(Scored::is_right), rows.len()),
        some(&[Kind::One, Kind::Two], Scored::first_is_right),
        some(&[Kind::One, Kind::Two], Scored::is_in_groups),
        share(count(Scored::is_wrong_in_confidence), rows.len()),
        some(&[Kind::Nothing, Kind::Faint], Scored::is_false_alarm),
        some(&[Kind::Outside], Scored::says_left),
        median(sizes.iter().map(|size| size.error).collect()).map_or("-".into(), |v| format!("{:.1} %", 100.0 * v)),
        told(Size::is_told),
        told(Size::is_covered),
        number(held_out, 2),
        format!("{} ({worst:.0})", number(median(seconds), 1)),
    ]
}

impl Display for Table<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {} campaigns", self.title, self.all.len())?;
        let mut line = |cells: [String; 13]| {
            for (cell, (_, width)) in cells.iter().zip(COLUMNS) {
                write!(f, "{cell:>width$}")?;
            }
            writeln!(f)
        };
        line(COLUMNS.map(|(title, _)| title.to_owned()))?;
        for kind in Kind::ALL {
            let rows: Vec<&Scored> = self.all.iter().filter(|scored| scored.wanted.kind == kind).collect();
            if !rows.is_empty() {
                line(row(kind.word(), &rows))?;
            }
        }
        line(row("all", &self.all.iter().collect::<Vec<_>>()))?;
        let failed = self.all.iter().filter(|scored| scored.failure.is_some()).count();
        if failed > 0 {
            writeln!(f, "no answer: {failed}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Answer;
    use crate::wanted::Wanted;
    use serde_json::json;

    fn scored(truth: &serde_json::Value, verdict: &str, recommended: &[&str]) -> Scored {
        let recommended: Vec<String> = recommended.iter().map(|id| (*id).to_owned()).collect();
        Scored {
            wanted: Wanted::from_json("x", truth),
            tidy: None,
            answer: Answer {
                verdict: verdict.to_owned(),
                groups: recommended.iter().map(|id| vec![id.clone()]).collect(),
                recommended,
                ..Answer::default()
            },
            failure: None,
            seconds: 1.0,
        }
    }

    #[test]
    fn answers_are_told_apart_by_how_wrong_they_are() {
        let one = json!({ "needed": ["dry-friction"], "allowed": ["outside"], "sizes": { "Fc": 1.0 } });
        let right = scored(&one, "effect-found", &["dry-friction"]);
        assert!(right.is_right() && !right.is_wrong_in_confidence());
        let beside = scored(&one, "effect-found", &["dry-friction", "sensor-lag"]);
        assert!(!beside.is_right() && beside.is_wrong_in_confidence() && beside.first_is_right());
        let missed = scored(&one, "outside-catalogue", &[]);
        assert!(!missed.is_right() && !missed.is_wrong_in_confidence());
        let nothing = json!({ "needed": [], "allowed": [], "sizes": {} });
        assert!(scored(&nothing, "adequate", &[]).is_right());
        assert!(scored(&nothing, "outside-catalogue", &[]).is_false_alarm());
        assert!(scored(&nothing, "effect-found", &["sensor-lag"]).is_wrong_in_confidence());
        let odd =
            json!({ "needed": [], "allowed": ["outside"], "outside": { "detent": {} }, "outside_is_plain": true });
        assert!(scored(&odd, "partly-explained", &["dry-friction"]).is_right());
        assert!(scored(&odd, "effect-found", &["dry-friction"]).is_wrong_in_confidence());
        let either = json!({ "needed": [], "one_of": ["clock-offset", "solenoid-lag"], "allowed": [] });
        assert!(scored(&either, "effect-found", &["clock-offset"]).is_right());
    }

    #[test]
    fn the_table_counts() {
        let one = json!({ "needed": ["dry-friction"], "allowed": [], "sizes": { "Fc": 1.0 } });
        let all = [scored(&one, "effect-found", &["dry-friction"]), scored(&one, "effect-found", &["sensor-lag"])];
        let text = Table { title: "plant", all: &all }.to_string();
        let row = text.lines().find(|line| line.trim_start().starts_with("one effect")).unwrap();
        assert!(row.contains("1 (50 %)"), "{text}");
    }
}
