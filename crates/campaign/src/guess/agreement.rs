//! Whether recordings agree in what their columns are called, and what one campaign file can call them.

use column_source::{did_you_mean, without_unit};
use quantity::{Reference, Unit};

use super::draft::found_by_itself;
use super::{ColumnGuess, Conflict, Hints, Recording, Understanding};

/// Finds a name for each column that all recordings understand, and what they do not agree in.
pub(super) fn find(recordings: &[Recording], hints: &Hints, found: &mut Understanding) {
    let (first, others) = (&recordings[0], &recordings[1..]);
    for (channel, name) in &hints.columns {
        let lacking = recordings.iter().find(|recording| recording.columns_named(name).is_empty());
        found.conflicts.extend(lacking.map(|recording| no_column(recording, channel, name)));
    }
    let mut columns = std::mem::take(&mut found.columns);
    for column in &mut columns {
        let hinted = hints.columns.iter().any(|(channel, _)| channel == column.channel);
        let may_be_missing = column.channel.ends_with("pressure") && column.is_plain(found_by_itself(column, first));
        let lacking = others.iter().find(|other| other.same_as(first, column.index).is_none());
        if let Some(other) = lacking
            && !may_be_missing
            && !hinted
        {
            found.conflicts.push(no_column(other, column.channel, &column.name));
        }
        name_for_all(recordings, column, found);
    }
    found.columns = columns;
    let same =
        |one: &Recording, other: &Recording| (0..other.names.len()).all(|index| one.same_as(other, index).is_some());
    let strange: Vec<&str> = others
        .iter()
        .filter(|other| !same(other, first) || !same(first, other))
        .map(|other| other.file.as_str())
        .collect();
    if !strange.is_empty() {
        let file = &first.file;
        let words = if strange.len() == 1 { "has" } else { "have" };
        found.said.push(format!(
            "{} {words} other columns than {file}; they are looked for by the same names",
            strange.join(", ")
        ));
    }
}

/// Leaves the unit out of the name where recordings differ in it; each recording's own counts then.
fn name_for_all(recordings: &[Recording], column: &mut ColumnGuess, found: &mut Understanding) {
    let first = &recordings[0];
    let own: Vec<(&Recording, usize)> =
        recordings.iter().filter_map(|other| Some((other, other.same_as(first, column.index)?))).collect();
    let bare = first.bare[column.index].clone();
    let names = [column.name.clone(), bare.clone(), without_unit(&bare).to_owned()];
    let is_of_all = |name: &&String| own.iter().all(|(other, index)| other.columns_named(name)[..] == [*index]);
    if let Some(name) = names.iter().find(is_of_all) {
        column.call.clone_from(name);
    }
    // Timestamps have no unit and need none.
    let is_stamp = |(other, index): &(&Recording, usize)| column.channel == "time" && other.timestamps[*index];
    let own: Vec<_> = own.into_iter().filter(|own| !is_stamp(own)).collect();
    let unit = |(other, index): &(&Recording, usize)| other.unit(*index);
    // Files by unit; "bar(g)" and "barg" are one.
    let mut groups: Vec<(Option<Unit>, Vec<&str>)> = Vec::new();
    for own in &own {
        let unit = unit(own);
        match groups.iter_mut().find(|(other, _)| is_same(other.as_ref(), unit.as_ref())) {
            Some((_, files)) => files.push(&own.0.file),
            None => groups.push((unit, vec![&own.0.file])),
        }
    }
    let [(one, in_one), (other, in_other), ..] = &groups[..] else { return };
    let text = |unit: &Option<Unit>| unit.as_ref().map_or("a unit that it does not say", Unit::text).to_owned();
    let told =
        groups.iter().all(|(unit, _)| unit.as_ref().is_some_and(|unit| unit.reference() != Reference::Ambiguous));
    let by_level = column.channel == "command" && found.threshold.is_some();
    if column.unit.is_some() || by_level || !told {
        found.conflicts.push(Conflict::Units {
            channel: column.channel.to_owned(),
            files: [in_one[0].to_owned(), in_other[0].to_owned()],
            units: [text(one), text(other)],
        });
        return;
    }
    let said: Vec<String> =
        groups.iter().map(|(unit, files)| format!("{} in {}", text(unit), files.join(", "))).collect();
    found.said.push(format!("{}: each recording's own unit counts: {}", column.channel, said.join("; ")));
}

/// Whether numbers in both units mean the same.
fn is_same(one: Option<&Unit>, other: Option<&Unit>) -> bool {
    let meaning = |unit: &Unit| (unit.dimension(), unit.reference(), unit.to_si(0.0), unit.to_si(1.0));
    one.map(meaning) == other.map(meaning)
}

fn no_column(recording: &Recording, channel: &str, name: &str) -> Conflict {
    Conflict::NoColumn {
        channel: channel.to_owned(),
        name: name.to_owned(),
        suggestion: did_you_mean(recording.headings(), name),
        file: recording.file.clone(),
        found: recording.listed(),
    }
}
