//! Measured pressures that drive the model in place of the simulated ones.

/// Measured pressures over time, interpolated linearly and held beyond the ends.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Prescribed {
    /// Times, s, rising.
    pub time_s: Vec<f64>,
    /// Pipe pressure at those times, Pa, if it drives the model.
    pub pipe_pressure_pa: Option<Vec<f64>>,
    /// Chamber pressure at those times, Pa, if it drives the model.
    pub chamber_pressure_pa: Option<Vec<f64>>,
    /// Supply pressure at those times, Pa, if it drives the model: at the solenoid and at a leak from the supply, or
    /// at the source of a supply line.
    pub supply_pressure_pa: Option<Vec<f64>>,
}

/// The pressures at one time, Pa; 0 where a channel does not drive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct PrescribedPressures {
    pub pipe: f64,
    pub chamber: f64,
    pub supply: f64,
}

/// A sample this many places from where it is looked for is close.
const NEAR: usize = 4;

/// A stretch over which the pressures change evenly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stretch {
    /// When it begins and ends, s.
    pub from_s: f64,
    pub until_s: f64,
    /// The pressures as it begins, Pa.
    pub start: PrescribedPressures,
    /// Their rates, Pa/s.
    pub rate: PrescribedPressures,
}

/// Before the first sample: a time that no run begins at, s.
const LONG_AGO_S: f64 = -1e30;

impl Prescribed {
    /// The pressures at a time.
    pub(crate) fn at(&self, time_s: f64) -> PrescribedPressures {
        let Stretch { from_s, start, rate, .. } = self.stretch_at(time_s);
        let at = |start: f64, rate: f64| start + rate * (time_s - from_s);
        PrescribedPressures {
            pipe: at(start.pipe, rate.pipe),
            chamber: at(start.chamber, rate.chamber),
            supply: at(start.supply, rate.supply),
        }
    }

    /// The stretch that a time lies in.
    pub(crate) fn stretch_at(&self, time_s: f64) -> Stretch {
        let right = self.next_after(time_s);
        let left = right.saturating_sub(1);
        let ends = (self.time_s.get(left).copied(), self.time_s.get(right).copied());
        let (from_s, until_s, left, right) = match ends {
            (Some(from), _) if time_s < from => (LONG_AGO_S, from, left, left),
            (Some(from), Some(to)) if to > from && time_s <= to => (from, to, left, right),
            (_, Some(to)) => (to, f64::INFINITY, right, right),
            _ => (LONG_AGO_S, f64::INFINITY, 0, 0),
        };
        let duration_s = until_s - from_s;
        let of = |channel: &Option<Vec<f64>>| {
            let values = channel.as_deref().unwrap_or_default();
            match (values.get(left), values.get(right)) {
                (Some(from), Some(to)) => (*from, (to - from) / duration_s),
                _ => (0.0, 0.0),
            }
        };
        let (pipe, chamber) = (of(&self.pipe_pressure_pa), of(&self.chamber_pressure_pa));
        let supply = of(&self.supply_pressure_pa);
        Stretch {
            from_s,
            until_s,
            start: PrescribedPressures { pipe: pipe.0, chamber: chamber.0, supply: supply.0 },
            rate: PrescribedPressures { pipe: pipe.1, chamber: chamber.1, supply: supply.1 },
        }
    }

    /// The first sample later than a time, but never the very first one nor one beyond the last. A recorder takes samples
    /// evenly, so that it is looked for about where it would then be.
    fn next_after(&self, time_s: f64) -> usize {
        let times = self.time_s.as_slice();
        let last = times.len().saturating_sub(1);
        let (Some(from), Some(to)) = (times.first(), times.last()) else { return 0 };
        let share = ((time_s - from) / (to - from)).clamp(0.0, 1.0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of the samples")]
        let mut right = (1 + (share * last as f64) as usize).min(last);
        for _ in 0..NEAR {
            if right > 1 && times[right - 1] > time_s {
                right -= 1;
            } else if right < last && times[right] <= time_s {
                right += 1;
            } else {
                return right;
            }
        }
        times.partition_point(|time| *time <= time_s).max(1).min(last)
    }

    /// What drives a run that begins at one time and ends at another, in its own time.
    #[must_use]
    pub fn between(&self, from_s: f64, until_s: f64) -> Self {
        let first = self.time_s.partition_point(|time| *time <= from_s).saturating_sub(1);
        let end = (self.time_s.partition_point(|time| *time < until_s) + 1).clamp(first, self.time_s.len());
        let cut = |channel: &Option<Vec<f64>>| channel.as_ref().map(|values| values[first..end].to_vec());
        Self {
            time_s: self.time_s[first..end].iter().map(|time| time - from_s).collect(),
            pipe_pressure_pa: cut(&self.pipe_pressure_pa),
            chamber_pressure_pa: cut(&self.chamber_pressure_pa),
            supply_pressure_pa: cut(&self.supply_pressure_pa),
        }
    }

    /// What is wrong with it, in words.
    pub(crate) fn fault(&self) -> Option<String> {
        let count = self.time_s.len();
        if count == 0 {
            return Some("no samples, expected at least one".into());
        }
        let rising = |pair: &[f64]| pair[0].is_finite() && pair[1].is_finite() && pair[1] >= pair[0];
        if let Some(at) = self.time_s.windows(2).position(|pair| !rising(pair)) {
            let (from, to) = (self.time_s[at], self.time_s[at + 1]);
            return Some(format!("{to} s after {from} s as the time of sample {}, expected a later one", at + 2));
        }
        let channels = [
            ("pipe", &self.pipe_pressure_pa),
            ("chamber", &self.chamber_pressure_pa),
            ("supply", &self.supply_pressure_pa),
        ];
        channels.into_iter().find_map(|(name, channel)| {
            let samples = channel.as_deref()?;
            if samples.len() != count {
                let found = samples.len();
                return Some(format!("{found} samples of the {name} pressure, expected {count}, one at each time"));
            }
            let at = samples.iter().position(|pressure| !(pressure.is_finite() && *pressure > 0.0))?;
            let (found, number) = (samples[at], at + 1);
            Some(format!("{found} Pa as sample {number} of the {name} pressure, expected an absolute pressure above 0"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pressures_are_linear_between_samples_and_held_beyond() {
        let prescribed = Prescribed {
            time_s: vec![1.0, 2.0, 4.0],
            pipe_pressure_pa: Some(vec![1e5, 2e5, 6e5]),
            chamber_pressure_pa: None,
            supply_pressure_pa: Some(vec![5e5, 5e5, 4e5]),
        };
        let at = |time: f64| (prescribed.at(time).pipe, prescribed.at(time).chamber, prescribed.at(time).supply);
        assert_eq!(at(0.0), (1e5, 0.0, 5e5));
        assert_eq!(at(1.5), (1.5e5, 0.0, 5e5));
        assert_eq!(at(3.0), (4e5, 0.0, 4.5e5));
        assert_eq!(at(9.0), (6e5, 0.0, 4e5));
        // A part of it says the same in its own time, as far as it goes.
        let part = prescribed.between(1.5, 3.0);
        for time in [1.5, 2.0, 2.7, 3.0] {
            assert_eq!(part.at(time - 1.5), prescribed.at(time), "{time}");
        }
        assert_eq!(
            (prescribed.between(-1.0, 1.5).time_s, prescribed.between(5.0, 6.0).time_s),
            (vec![2.0, 3.0], vec![-1.0])
        );
    }

    #[test]
    fn samples_are_found_however_they_lie() {
        let even: Vec<f64> = (0..50).map(|i| 0.1 * f64::from(i)).collect();
        let uneven: Vec<f64> = (0..50).map(|i| 0.002 * f64::from(i).powi(2)).collect();
        let doubled = vec![0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 5.0];
        for time_s in [even, uneven, doubled] {
            let last = time_s.len() - 1;
            let prescribed = Prescribed { time_s: time_s.clone(), ..Prescribed::default() };
            for time in (-20..120).map(|i| 0.05 * f64::from(i)).chain(time_s.iter().copied()) {
                let expected = time_s.iter().filter(|one| **one <= time).count().clamp(1, last);
                assert_eq!(prescribed.next_after(time), expected, "{time} s");
            }
        }
    }

    #[test]
    fn a_single_sample_holds_and_none_is_a_fault() {
        let one = Prescribed { time_s: vec![3.0], pipe_pressure_pa: Some(vec![2e5]), ..Prescribed::default() };
        assert_eq!((one.at(0.0).pipe, one.at(3.0).pipe, one.at(5.0).pipe), (2e5, 2e5, 2e5));
        assert_eq!(one.fault(), None);
        assert_eq!(Prescribed::default().at(1.0), PrescribedPressures::default());
        assert!(Prescribed::default().fault().is_some());
        let short = Prescribed { time_s: vec![0.0, 1.0], supply_pressure_pa: Some(vec![5e5]), ..Prescribed::default() };
        assert_eq!(short.fault().as_deref(), Some("1 samples of the supply pressure, expected 2, one at each time"));
    }

    #[test]
    fn what_is_no_pressure_or_goes_back_in_time_is_a_fault() {
        let record = |time_s: [f64; 3], pressures: [f64; 3]| Prescribed {
            time_s: time_s.into(),
            chamber_pressure_pa: Some(pressures.into()),
            ..Prescribed::default()
        };
        assert_eq!(record([0.0, 1.0, 1.0], [1e5; 3]).fault(), None);
        assert!(record([0.0, 2.0, 1.0], [1e5; 3]).fault().is_some_and(|fault| fault.contains("sample 3")));
        assert!(record([0.0, f64::NAN, 1.0], [1e5; 3]).fault().is_some());
        let hole = record([0.0, 1.0, 2.0], [1e5, f64::NAN, 1e5]).fault();
        assert!(hole.is_some_and(|fault| fault.contains("sample 2 of the chamber")));
    }
}
