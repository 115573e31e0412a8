//! What looks wrong in a campaign but can be used.

use column_source::NoticeKind;

use crate::types::Campaign;

/// A warning with its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Warning {
    /// The file.
    pub file: String,
    /// The line, counted from 1.
    pub line: usize,
    /// What looks wrong.
    pub doubt: Doubt,
}

impl std::fmt::Display for Warning {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}:{}: {}", self.file, self.line, self.doubt)
    }
}

/// What looks wrong, and the remedy.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Doubt {
    /// The valve does not move although it is told to.
    #[error(
        "no motion: the position spans {span_mm:.3} mm of a stroke of {stroke_mm:.3} mm; \
         is the sensor connected and the right column named?"
    )]
    NoMotion {
        /// Span of the position, mm.
        span_mm: f64,
        /// The valve's stroke, mm.
        stroke_mm: f64,
    },
    /// The motion is shorter than the stroke.
    #[error(
        "the motion spans {span_mm:.3} mm of a stroke of {stroke_mm:.3} mm: partial strokes, \
         or a wrong scale or stroke?"
    )]
    ShortMotion {
        /// Span of the position, mm.
        span_mm: f64,
        /// The valve's stroke, mm.
        stroke_mm: f64,
    },
    /// The motion lies outside the stops.
    #[error(
        "the position lies between {lowest_mm:.3} and {highest_mm:.3} mm, the stops at 0 and {stroke_mm:.3} mm; \
         set an offset in [columns] if the zero is elsewhere"
    )]
    Offset {
        /// Lowest position, mm.
        lowest_mm: f64,
        /// Highest position, mm.
        highest_mm: f64,
        /// The valve's stroke, mm.
        stroke_mm: f64,
    },
    /// Many samples at exactly one extreme value.
    #[error(
        "{share:.2} of the samples near that end are exactly {value_mm:.4} mm, without noise: the sensor looks \
         clipped; widen its range, or leave these strokes out"
    )]
    Clipped {
        /// The extreme value, mm.
        value_mm: f64,
        /// Share of the samples within a tenth of the span from it that equal it.
        share: f64,
    },
    /// A command that says close throughout, with a closing stroke only.
    #[error("the command is 1 from the first row to the last: taken as a closing stroke that is under way")]
    OnlyClosing,
    /// A command that says open throughout, with an opening stroke only.
    #[error("the command is 0 from the first row to the last: taken as an opening stroke that is under way")]
    OnlyOpening,
    /// A run that nothing could be told of, beside others.
    #[error("this run was left out: {reason}")]
    LeftOut {
        /// What is wrong with it.
        reason: String,
    },
    /// Another time column than the one that is named.
    #[error("has no column \"{named}\", which [columns] names for the time; its \"{column}\" was taken")]
    OtherTime {
        /// The column that was taken.
        column: String,
        /// The one that `[columns]` names.
        named: String,
    },
    /// Rows without a time.
    #[error("{rows} rows have no time and were left out")]
    RowsWithoutTime {
        /// How many.
        rows: usize,
    },
    /// Rows without a command.
    #[error("{rows} rows have no command; the one before was kept")]
    RowsWithoutCommand {
        /// How many.
        rows: usize,
    },
    /// Readings that are missing.
    #[error("{share:.2} of the readings of the {channel} are missing")]
    ManyGaps {
        /// The channel.
        channel: String,
        /// Share of missing readings.
        share: f64,
    },
    /// Readings that were taken out.
    #[error("{count} readings of the {channel} are far from all around them and were left out: {named}")]
    Outliers {
        /// The channel.
        channel: &'static str,
        /// How many.
        count: usize,
        /// The first ones, with value, time and line.
        named: String,
    },
    /// Readings of a sensor that was stuck while the valve moved.
    #[error(
        "the {channel} stays at {value} for {rows} rows, from {from_s:.4} s on, and then jumps to where the motion has come: \
         was the sensor or the recorder stuck? They were left out"
    )]
    Stuck {
        /// The channel.
        channel: &'static str,
        /// The reading, with its unit.
        value: String,
        /// How many rows repeat it.
        rows: usize,
        /// When that begins, s.
        from_s: f64,
    },
    /// So many jumps that they are no outliers.
    #[error(
        "{count} of {of} readings of the {channel} jump far from those around them: too many to leave out; \
         is the cable or the sensor loose, or are two signals mixed?"
    )]
    Jumpy {
        /// The channel.
        channel: &'static str,
        /// How many jump.
        count: usize,
        /// How many readings there are.
        of: usize,
    },
    /// Absolute pressures that lie too low for it.
    #[error(
        "the {channel} falls to {lowest_kpa:.1} kPa, far below the ambient pressure of {ambient_kpa:.1} kPa: \
         is the column gauge? Then give it a gauge unit in [columns], such as barg or psig"
    )]
    LooksGauge {
        /// The channel.
        channel: String,
        /// Lowest reading, kPa.
        lowest_kpa: f64,
        /// Ambient pressure, kPa.
        ambient_kpa: f64,
    },
    /// A pressure above the supply that the run states.
    #[error(
        "the {channel} (column \"{column}\") reaches {found_kpa:.1} kPa absolute, above the supply pressure of {supply_kpa:.1} kPa \
         that its run states: was that mistyped or exchanged with another run's, or is the unit of the column wrong? Give \
         the one in [[run]], the other in [columns]"
    )]
    AboveSupply {
        /// The channel.
        channel: &'static str,
        /// Its column.
        column: String,
        /// What it reaches, kPa absolute.
        found_kpa: f64,
        /// The run's supply pressure, kPa absolute.
        supply_kpa: f64,
    },
    /// A column that is not read and looks like one that is.
    #[error("column \"{column}\" is not read; did you mean \"{known}\"?")]
    UnreadColumn {
        /// The column.
        column: String,
        /// The column that it looks like.
        known: String,
    },
    /// A run that does not say its supply pressure.
    #[error("the supply pressure is not given; the valve file's {assumed_kpa:.1} kPa absolute is taken")]
    SupplyAssumed {
        /// The valve file's supply pressure, kPa absolute.
        assumed_kpa: f64,
    },
    /// Runs or rows that do not say their temperature.
    #[error("the temperature is not given; the valve file's {assumed_k:.2} K is taken, {:.1} degC", .assumed_k - 273.15)]
    TemperatureAssumed {
        /// The valve file's temperature, K.
        assumed_k: f64,
    },
    /// A temperature at which hardly any valve works.
    #[error("a temperature of {temperature_k:.1} K, which is {temperature_degc:.1} degC: is its unit right?")]
    TemperatureFar {
        /// The temperature, K.
        temperature_k: f64,
        /// The same in degrees Celsius.
        temperature_degc: f64,
    },
    /// A leak larger than anything that is opened on purpose.
    #[error("{key} is {area_mm2} mm2, as large as a pipe: is it meant in mm2?")]
    LargeLeak {
        /// Which leak.
        key: &'static str,
        /// Its area, mm2.
        area_mm2: f64,
    },
    /// A recording that another run has too.
    #[error("the same recording as {other}: was one of them copied under a second name?")]
    SameRecording {
        /// The file of the other run.
        other: String,
    },
    /// Long times without a reading.
    #[error(
        "{count} gap{} without a position of {least_s:.2} s or more, the longest of {longest_s:.2} s at {at_s:.3} s \
         from the first row: did the recorder stop?",
        if *count == 1 { "" } else { "s" }
    )]
    TimeGap {
        /// How many.
        count: usize,
        /// From which length on, s.
        least_s: f64,
        /// The longest, s.
        longest_s: f64,
        /// Where it begins, s.
        at_s: f64,
    },
    /// Rows so far apart that a stroke has hardly any.
    #[error("the rows are {step_s} s apart: are the times in ms? Then give the column its unit in [columns]")]
    SlowRows {
        /// The usual step, s.
        step_s: f64,
    },
    /// How a file had to be read.
    #[error(transparent)]
    Read(#[from] NoticeKind),
    /// A noise that is stated far from what the recordings show.
    #[error(
        "{key} is stated as {} {unit}, {} times {} than what the recordings show: from reading to reading they scatter by \
         {} {unit}. Is its unit right? What they show is used in its place",
        short(*stated), about(*times), if *is_too_large { "more" } else { "less" }, short(*found)
    )]
    StatedNoise {
        /// Its key in `[sensors]`.
        key: &'static str,
        /// The unit of both numbers.
        unit: &'static str,
        /// What is stated, one standard deviation.
        stated: f64,
        /// What the recordings show.
        found: f64,
        /// How many times more or less that is.
        times: f64,
        /// Whether more is stated than recorded.
        is_too_large: bool,
    },
    /// A noise of stroke times that is stated far from how repeats scatter.
    #[error(
        "timing_noise is stated as {} ms, {} times {} than what the stroke times show: repeated under one condition they \
         scatter by {} ms. Is its unit right? What they show is used in its place",
        short(*stated_ms), about(*times), if *is_too_large { "more" } else { "less" }, short(*found_ms)
    )]
    StatedTimingNoise {
        /// What is stated, ms.
        stated_ms: f64,
        /// What repeats show, ms.
        found_ms: f64,
        /// How many times more or less that is.
        times: f64,
        /// Whether more is stated than recorded.
        is_too_large: bool,
    },
    /// A noise of stroke times of which nothing would be left.
    #[error(
        "timing_noise is stated as {} s, where the longest stroke takes {} s: is its unit right? It is taken as not stated",
        short(*stated_s), short(*longest_s)
    )]
    TimingNoiseLikeTimes {
        /// What is stated, s.
        stated_s: f64,
        /// The longest stroke time, s.
        longest_s: f64,
    },
    /// Stroke times that look like milliseconds.
    #[error("{stroke} times of {time_s} s: are they milliseconds? Then call the column ..._ms")]
    LooksLikeMilliseconds {
        /// "closing" or "opening".
        stroke: &'static str,
        /// Their median, s.
        time_s: f64,
    },
    /// A row whose times are exchanged.
    #[error(
        "closing and opening time of this row fit the rows under the same conditions only when they are exchanged: \
         were they swapped?{}", left_out(*is_left_out)
    )]
    SwappedTimes {
        /// Whether the other rows are sure enough that both were left out.
        is_left_out: bool,
    },
    /// The two columns of times are exchanged.
    #[error(
        "closing takes longer and opening less long at a higher supply pressure, where pressure closes and the \
         spring opens: are the two columns of times swapped?"
    )]
    SwappedTimeColumns,
    /// A time far from those under the same conditions.
    #[error(
        "{article} {stroke} time of {time_s} s, where rows under the same conditions have {usual_s:.4} s \
         (repeats usually agree within {spread_s:.4} s): is it mistyped?{}",
        left_out(*is_left_out),
        article = if *stroke == "opening" { "an" } else { "a" }
    )]
    UnlikeRepeats {
        /// "closing" or "opening".
        stroke: &'static str,
        /// The time, s.
        time_s: f64,
        /// The median of the others, s.
        usual_s: f64,
        /// The usual spread of repeats, one standard deviation, s.
        spread_s: f64,
        /// Whether the other rows are sure enough that it was left out.
        is_left_out: bool,
    },
    /// A time far from what the model says that everything else was fitted to.
    #[error(
        "{article} {stroke} time of {time_s} s, where the model fitted to all readings has {expected_s:.4} s, \
         {deviations:.0} times its usual error away: is it mistyped, or a condition of its row?{}",
        left_out(true),
        article = if *stroke == "opening" { "an" } else { "a" }
    )]
    UnlikeModel {
        /// "closing" or "opening".
        stroke: &'static str,
        /// The time, s.
        time_s: f64,
        /// What the model has, s.
        expected_s: f64,
        /// How far apart they are, in usual errors of the model.
        deviations: f64,
    },
    /// Times longer than what the cycle leaves for them.
    #[error(
        "{count} {stroke} times are longer than the {most_s} s that the valve file's cycle leaves for them, \
         the first of {time_s} s: are unit and cycle right?"
    )]
    LongerThanCycle {
        /// "closing" or "opening".
        stroke: &'static str,
        /// The first of them, s.
        time_s: f64,
        /// What the cycle leaves, s.
        most_s: f64,
        /// How many.
        count: usize,
    },
    /// A supply pressure far from that of the valve file.
    #[error(
        "a supply pressure of {supply_kpa:.1} kPa absolute, where the valve file has {usual_kpa:.1} kPa: \
         is its unit right?"
    )]
    SupplyFar {
        /// The supply pressure of the run, kPa absolute.
        supply_kpa: f64,
        /// The valve file's, kPa absolute.
        usual_kpa: f64,
    },
}

/// Outliers of a channel in more files than this are told together.
const TOLD_ALONE: usize = 2;

impl Campaign {
    /// What looks wrong, a sentence each; readings that were left out of many recordings together.
    #[must_use]
    pub fn doubts(&self) -> Vec<String> {
        sentences(&self.warnings)
    }
}

fn sentences(warnings: &[Warning]) -> Vec<String> {
    let mut told: Vec<&str> = Vec::new();
    let mut sentences = Vec::new();
    for warning in warnings {
        let Doubt::Outliers { channel, .. } = warning.doubt else {
            sentences.push(warning.to_string());
            continue;
        };
        let alike = warnings.iter().filter_map(|other| match &other.doubt {
            Doubt::Outliers { channel: of, count, named } if *of == channel => Some((other, *count, named)),
            _ => None,
        });
        let alike: Vec<_> = alike.collect();
        if alike.len() <= TOLD_ALONE {
            sentences.push(warning.to_string());
        } else if !told.contains(&channel) {
            told.push(channel);
            let all: usize = alike.iter().map(|(_, count, _)| count).sum();
            let first = alike[0].2.split(", ").next().unwrap_or_default();
            let places = alike.iter().map(|(one, count, _)| format!("{}:{} ({count})", one.file, one.line));
            sentences.push(format!(
                "{all} readings of the {channel} are far from all around them and were left out, the first {first}: {}",
                places.collect::<Vec<_>>().join(", ")
            ));
        }
    }
    sentences
}

/// A large number to two digits.
fn about(value: f64) -> String {
    let last = 10f64.powf((value.log10().floor() - 1.0).max(0.0));
    format!("{:.0}", (value / last).round() * last)
}

/// A number with three digits, without zeros behind them.
fn short(value: f64) -> String {
    // The decades of what sensors show are few.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small whole number")]
    let places = (2.0 - value.abs().max(f64::MIN_POSITIVE).log10().floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{value:.places$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// What a doubt adds where a reading was taken out.
fn left_out(is_left_out: bool) -> &'static str {
    if is_left_out { " It was left out" } else { "" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outliers_of_many_recordings_are_one_sentence() {
        let warning = |file: &str, count| Warning {
            file: file.to_owned(),
            line: 3,
            doubt: Doubt::Outliers {
                channel: "position",
                count,
                named: "1.0 mm at 0.2 s (line 3), and 4 more".to_owned(),
            },
        };
        let stuck = Warning { file: "b.csv".to_owned(), line: 9, doubt: Doubt::RowsWithoutTime { rows: 2 } };
        let mut warnings = vec![warning("a.csv", 5), stuck, warning("b.csv", 1)];
        assert_eq!(sentences(&warnings).len(), 3);
        warnings.push(warning("c.csv", 2));
        let doubts = sentences(&warnings);
        assert_eq!(doubts.len(), 2);
        let places = "a.csv:3 (5), b.csv:3 (1), c.csv:3 (2)";
        assert_eq!(
            doubts[0],
            format!(
                "8 readings of the position are far from all around them and were left out, the first 1.0 mm at 0.2 s (line 3): {places}"
            )
        );
    }
}
