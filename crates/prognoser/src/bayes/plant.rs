//! The tables as the estimator sees them: severity 1 is the limit under the
//! reference conditions.

use std::cell::OnceCell;

use leak_table::{
    Condition, Conditions, Cut, DegradationId, Equivalent, SeverityAt, SeverityTable, Stroke, TableBundle,
};

/// Most kinds of wear with a table that are looked at.
pub(crate) const MOST_WEARS: usize = 8;

/// The conditions of one cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct CycleConditions {
    /// Absolute supply pressure in Pa, if it is known.
    pub supply_pressure_pa: Option<f64>,
    /// Temperature in K, if it is known.
    pub temperature_k: Option<f64>,
}

/// All tables under the conditions of one cycle.
pub(crate) struct Plant<'t> {
    bundle: &'t TableBundle,
    wears: usize,
    ids: [DegradationId; MOST_WEARS],
    limits: [f64; MOST_WEARS],
    healthy_s: [f64; 2],
    /// The tables under the reference conditions.
    tables: [Option<&'t SeverityTable>; MOST_WEARS],
    /// By how much an end moves with the unit, from when it is asked first.
    end_shifts: [OnceCell<[f64; 2]>; MOST_WEARS],
    /// The conditions, where the tables have them.
    conditions: Option<Conditions>,
    /// Each table under the conditions, from when it is asked first; none where it does not have them.
    cuts: [OnceCell<Option<Cut<'t>>>; MOST_WEARS],
}

impl<'t> Plant<'t> {
    pub(crate) fn new(bundle: &'t TableBundle, stated: CycleConditions) -> Self {
        let wears = bundle.len().min(MOST_WEARS);
        let mut ids = [DegradationId::new(""); MOST_WEARS];
        let mut limits = [1.0; MOST_WEARS];
        let mut tables = [None; MOST_WEARS];
        for (index, entry) in bundle.entries().enumerate().take(wears) {
            (ids[index], limits[index], tables[index]) =
                (entry.degradation.id, entry.limit_severity, Some(entry.table));
        }
        let mut plant = Self {
            bundle,
            wears,
            ids,
            limits,
            healthy_s: [0.0; 2],
            tables,
            end_shifts: Default::default(),
            conditions: conditions(bundle, stated),
            cuts: Default::default(),
        };
        plant.healthy_s = plant.times_and_slopes(0, 0.0).map(|(time, _)| time);
        plant
    }

    /// How many kinds of wear there are tables for.
    #[expect(clippy::cast_possible_truncation, reason = "at most MOST_WEARS")]
    pub(crate) fn wears(&self) -> u8 {
        self.wears as u8
    }

    /// The name of a kind of wear.
    pub(crate) fn id(&self, wear: u8) -> DegradationId {
        self.ids[usize::from(wear)]
    }

    /// Times in s of both strokes, each with its derivative by the severity.
    #[inline]
    pub(crate) fn times_and_slopes(&self, wear: u8, severity: f64) -> [(f64, f64); 2] {
        let wear = usize::from(wear);
        let limit = self.limits[wear];
        let cut = self.conditions.as_ref().and_then(|conditions| {
            let table = || self.bundle.entry(wear).over_conditions.and_then(|table| table.cut(conditions).ok());
            self.cuts[wear].get_or_init(table).as_ref()
        });
        let at = severity * limit;
        let times = match (cut, self.tables[wear]) {
            (Some(cut), _) => cut.times_and_slopes(at),
            (None, Some(table)) => Stroke::ALL.map(|stroke| {
                let (time_s, slope) = table.curve(stroke).extrapolated_time_and_slope(at);
                let factor = self.healthy_factor(stroke, table);
                (factor * time_s, factor * slope)
            }),
            (None, None) => unreachable!("wears are counted by their tables"),
        };
        times.map(|(time, slope)| (time, slope * limit))
    }

    /// What conditions make of a time that only the reference conditions have a table of: as much as of the healthy one's.
    fn healthy_factor(&self, stroke: Stroke, table: &SeverityTable) -> f64 {
        let under_conditions_s = self.healthy_s[stroke as usize];
        if self.conditions.is_none() || under_conditions_s == 0.0 {
            return 1.0;
        }
        under_conditions_s / table.curve(stroke).extrapolated_time_and_slope(0.0).0
    }

    /// Time of the healthy valve in s.
    #[inline]
    pub(crate) fn healthy_s(&self, stroke: usize) -> f64 {
        self.healthy_s[stroke]
    }

    /// Whether there is a table of both leaks at once.
    pub(crate) fn knows_both_leaks(&self) -> bool {
        self.bundle.both_leaks().is_some()
    }

    /// Times in s of both strokes with leaks of both kinds, and their derivatives
    /// by the two severities. Without a table of both, what each leak alone adds to
    /// the pace of a stroke, or takes from it, adds up, as the flows do.
    pub(crate) fn both_leaks(&self, severities: [f64; 2]) -> [(f64, [f64; 2]); 2] {
        if let Some(table) = self.bundle.both_leaks() {
            let limits = [self.limits[0], self.limits[1]];
            let equivalents = table.equivalents([severities[0] * limits[0], severities[1] * limits[1]]);
            let of = |stroke: usize| {
                let Equivalent { fault, area_m2, by } = equivalents[stroke];
                let limit = limits[fault as usize];
                let (time, slope) = self.times_and_slopes(fault as u8, area_m2 / limit)[stroke];
                let per_area = slope / limit;
                (time, [per_area * by[0] * limits[0], per_area * by[1] * limits[1]])
            };
            return [of(0), of(1)];
        }
        let alone = [0, 1].map(|leak| self.times_and_slopes(leak, severities[usize::from(leak)]));
        [0, 1].map(|stroke| {
            let own = alone.map(|leak| leak[stroke]);
            let pace = 1.0 / own[0].0 + 1.0 / own[1].0 - 1.0 / self.healthy_s(stroke);
            // Slower than the window is not told apart.
            let time = 1.0 / pace.max(0.5 / self.window_s(stroke));
            (time, own.map(|(alone_s, slope)| slope * (time / alone_s).powi(2)))
        })
    }

    /// Where each stroke stands with leaks of both kinds, 1 where it is at its limit under the reference conditions, and
    /// the derivatives by the two severities: nearly straight lines. Only with a table of both.
    pub(crate) fn stand(&self, severities: [f64; 2]) -> Option<[(f64, [f64; 2]); 2]> {
        let limits = [self.limits[0], self.limits[1]];
        let table = self.bundle.both_leaks()?;
        let slowing = table.slowing([severities[0] * limits[0], severities[1] * limits[1]]);
        let of = |stroke: usize| {
            let Equivalent { fault, area_m2, by } = slowing[stroke];
            let own = limits[fault as usize];
            (area_m2 / own, [by[0] * limits[0] / own, by[1] * limits[1] / own])
        };
        Some([of(0), of(1)])
    }

    /// The limit of a stroke in s.
    pub(crate) fn limit_s(&self, stroke: usize) -> f64 {
        self.bundle.manifest().limits.within_s(Stroke::ALL[stroke])
    }

    /// The time within which a stroke counts as finished, in s.
    #[inline]
    pub(crate) fn window_s(&self, stroke: usize) -> f64 {
        self.bundle.manifest().schedule.window_s(Stroke::ALL[stroke])
    }

    /// The severity at which the limit is reached with another supply pressure;
    /// 1 where the tables do not know.
    pub(crate) fn end_at_supply(&self, wear: u8, supply_pressure_pa: f64) -> f64 {
        let entry = self.bundle.entry(usize::from(wear));
        let stated = CycleConditions { supply_pressure_pa: Some(supply_pressure_pa), temperature_k: None };
        let slice = conditions(self.bundle, stated)
            .and_then(|conditions| entry.over_conditions.and_then(|table| table.slice(&conditions).ok()));
        let Some(slice) = slice else { return 1.0 };
        let ends = Stroke::ALL.map(|stroke| match slice.curve(stroke).severity_at(self.limit_s(stroke as usize)) {
            SeverityAt::Within(severity) => severity / self.limits[usize::from(wear)],
            _ => f64::INFINITY,
        });
        let end = ends[0].min(ends[1]);
        if end.is_finite() { end } else { 1.0 }
    }

    /// By how much a valve whose time is off by a share reaches its limit at a
    /// smaller severity, per unit of that share, for each stroke.
    pub(crate) fn end_shift(&self, wear: u8) -> [f64; 2] {
        *self.end_shifts[usize::from(wear)].get_or_init(|| {
            let entry = self.bundle.entry(usize::from(wear));
            let limit = self.limits[usize::from(wear)];
            [0, 1].map(|stroke| {
                let ends_it = entry.info.stroke(Stroke::ALL[stroke]).limit_severity == Some(limit);
                let (time, slope) = entry.table.curve(Stroke::ALL[stroke]).extrapolated_time_and_slope(limit);
                if ends_it && slope > 0.0 { time / (slope * limit) } else { 0.0 }
            })
        })
    }
}

/// Both times of the healthy valve in s where one condition is as given, the other one that of the tables' reference.
pub(crate) fn healthy_times_s(bundle: &TableBundle, condition: Condition, value: f64) -> [f64; 2] {
    let stated = match condition {
        Condition::SupplyPressure => CycleConditions { supply_pressure_pa: Some(value), temperature_k: None },
        Condition::Temperature => CycleConditions { supply_pressure_pa: None, temperature_k: Some(value) },
    };
    Plant::new(bundle, stated).healthy_s
}

/// The conditions of a cycle as far as the tables have them; what is not known
/// is taken for the reference, what is outside for the nearest inside.
fn conditions(bundle: &TableBundle, stated: CycleConditions) -> Option<Conditions> {
    if stated == CycleConditions::default() {
        return None;
    }
    let range = bundle.condition_range()?;
    let reference = bundle.manifest().reference?;
    let conditions = Conditions {
        supply_pressure_pa: stated.supply_pressure_pa.unwrap_or(reference.supply_pressure_pa),
        temperature_k: stated.temperature_k.unwrap_or(reference.temperature_k),
    };
    Some(range.nearest(&conditions))
}
