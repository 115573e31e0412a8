//! Tables over supply pressure and temperature.
//!
//! The table at the valve's own conditions says at which shares of its end points are needed. The same shares are
//! simulated at a few nodes of pressure and temperature, each time of the end there. What lies between is measured
//! by simulating it: points are added between severities, nodes between pressures or temperatures, wherever one of
//! them misses, until the whole is as accurate as asked.

use std::collections::BTreeMap;

use leak_table::{
    Condition, ConditionInfo, ConditionRange, ConditionTable, Conditions, ConditionsError, InterpolationError,
    MOST_SHARES, NodeTimes, RowError, SeverityPoint, SeverityTable, Stroke,
};
use valve_model::Conditions as ModelConditions;

use crate::chebyshev::{between, extrema};
use crate::ends::{self, End};
use crate::error::BuildError;
use crate::levelled::levelled;
use crate::model::Options;
use crate::simulation::{Simulation, stored};
use crate::ticks::Ticks;

/// Nodes of a condition that varies, to start with; they double until the table is accurate.
const FIRST_NODES: [usize; 2] = [5, 3];
/// The most nodes of pressure and of temperature.
const MOST_NODES: [usize; 2] = [17, 9];
/// Severities placed at first are at least this share of the end apart.
const FIRST_GAP: f64 = 1.0 / 128.0;
/// Gaps narrower than this share of the end are not cut: what needs it is too steep.
const NARROWEST_GAP: f64 = 1.0 / 1024.0;
/// The share of the tolerance that errors may use where they decide about points.
const MARGIN: f64 = 0.5;
/// Places all over the table at which it is measured in the end.
const PLACES: u32 = 48;
/// Shares of the end at which the gaps between nodes are measured.
const SHARES_BETWEEN_NODES: usize = 6;
/// How often ends that turn out to be too far are drawn in.
const MOST_SHRINKS: usize = 12;
/// By how much, where a stroke is not finished at one.
const SHRINK: f64 = 0.995;
/// Rounds of adding points and nodes.
const MOST_ROUNDS: usize = 12;
/// By how much the ends are drawn in where the times before the stall are too steep to follow.
const RETREAT: f64 = 0.97;
/// How often.
const MOST_RETREATS: usize = 3;
/// Where nodes are missed only beyond this share, it is the end that is too steep.
const STEEP_FROM: f64 = 0.95;
/// A table need not reach its limits if a stroke is no longer finished at most this far beyond its end.
const FARTHEST_STALL: f64 = 1.15;

/// Nodes of a condition that varies where times are no smooth function of it: between two of them any times go one way.
const ROUGH_NODES: [usize; 3] = [5, 3, 2];
/// Severities there, at most about so many: more of them follow single turns.
const ROUGH_SHARES: usize = 30;
/// By what share of itself a time may turn there: by any.
const TURNS_ANYHOW: f64 = 1.0;

/// A table over conditions and how many severities were simulated for it.
pub(crate) struct OverConditions {
    pub table: ConditionTable,
    pub simulated: usize,
    /// Whether it goes through the middle of times that it does not follow.
    pub is_rough: bool,
}

/// Where a table is measured: conditions and a share of the end there.
type CheckPoint = (Conditions, f64);

/// What is simulated to fill a table over conditions.
struct Grid<'a> {
    simulation: &'a Simulation<'a>,
    nodes: [Vec<f64>; 2],
    range: ConditionRange,
    end: End,
    shares: Vec<f64>,
    samples: BTreeMap<(u64, u64, Ticks), SeverityPoint>,
    /// How often its end was drawn in for being too steep.
    retreats: usize,
    /// Whether times that turn are evened out however far they do.
    is_rough: bool,
}

/// Builds the table of one degradation over a range of conditions, from its table at the valve's own.
pub(crate) fn build(
    simulation: &Simulation<'_>,
    table: &SeverityTable,
    range: &ConditionRange,
) -> Result<OverConditions, BuildError> {
    let nodes = Condition::ALL.map(|condition| extrema(range.get(condition), first_nodes(range, condition)));
    let end = ends::find(simulation, table, range)?;
    let begun = (end.clone(), thinned(&shares(table)));
    let mut grid = Grid {
        simulation,
        nodes,
        range: *range,
        end,
        shares: shares(table),
        samples: BTreeMap::new(),
        retreats: 0,
        is_rough: false,
    };
    loop {
        let (nodes, shares) = (grid.nodes.clone(), grid.shares.clone());
        match grid.built() {
            Err(BuildError::NotSmooth { .. } | BuildError::TooManyPoints { .. }) if grid.retreats < MOST_RETREATS => {
                (grid.nodes, grid.shares) = (nodes, shares);
                grid.retreats += 1;
                grid.end.shrink(RETREAT);
            }
            Err(error @ (BuildError::NotSmooth { .. } | BuildError::TooManyPoints { .. })) if simulation.sticks() => {
                return grid.roughly(begun).unwrap_or(Err(error));
            }
            table => return grid.finish(&table?),
        }
    }
}

/// How far a table is from the simulation at one place.
struct Missed {
    /// As a share of the tolerance there.
    share: f64,
    error_s: f64,
    up_to_limit: bool,
}

impl Grid<'_> {
    /// The table of a valve that sticks and slips, whose times turn to and fro from one severity and pressure to the next: through
    /// their middle, over as many nodes as it can be had with. None if it cannot be had at all.
    fn roughly(mut self, (end, shares): (End, Vec<f64>)) -> Option<Result<OverConditions, BuildError>> {
        self.is_rough = true;
        for count in ROUGH_NODES {
            let nodes_of = |condition| if self.range.varies(condition) { count } else { 1 };
            self.nodes = Condition::ALL.map(|condition| extrema(self.range.get(condition), nodes_of(condition)));
            (self.end, self.shares) = (end.clone(), shares.clone());
            match self.table() {
                Ok(table) => {
                    let places: Vec<CheckPoint> = places(&self.range).collect();
                    return Some(self.points(&places).and_then(|_| self.finish(&table)));
                }
                Err(BuildError::NotSmooth { .. }) => {}
                Err(error) => return Some(Err(error)),
            }
        }
        None
    }

    /// Adds points and nodes until the table is as accurate as asked.
    fn built(&mut self) -> Result<ConditionTable, BuildError> {
        for _ in 0..MOST_ROUNDS {
            let table = self.table()?;
            if self.add_points(&table)? | self.add_nodes(&table)? {
                continue;
            }
            let places: Vec<CheckPoint> = places(&self.range).collect();
            self.points(&places)?;
            let errors = self.errors(&table, &self.between_points())?;
            let worst = errors.iter().map(|error| error.share).fold(0.0, f64::max);
            if worst <= 1.0 {
                return Ok(table);
            }
            // What was placed between severities and nodes is fine and something else is not: finer all over.
            self.refine_all()?;
        }
        Err(self.not_smooth())
    }

    /// All nodes, temperatures within pressures.
    fn conditions(&self) -> Vec<Conditions> {
        let [pressures, temperatures] = &self.nodes;
        let at = |supply_pressure_pa: f64| {
            temperatures.iter().map(move |&temperature_k| Conditions { supply_pressure_pa, temperature_k })
        };
        pressures.iter().flat_map(|pressure| at(*pressure)).collect()
    }

    /// Simulates what was not simulated yet; the times at each place, in their order.
    fn points(&mut self, places: &[CheckPoint]) -> Result<Vec<SeverityPoint>, BuildError> {
        let keys: Vec<(u64, u64, Ticks)> = places
            .iter()
            .map(|(at, share)| {
                let severity = self.simulation.nearest(share * self.end.at(at));
                (at.supply_pressure_pa.to_bits(), at.temperature_k.to_bits(), severity)
            })
            .collect();
        let mut missing: Vec<_> = keys.iter().filter(|key| !self.samples.contains_key(key)).copied().collect();
        missing.sort_unstable();
        missing.dedup();
        let wanted: Vec<(ModelConditions, Ticks)> = missing
            .iter()
            .map(|(pressure, temperature, ticks)| {
                let at = Conditions {
                    supply_pressure_pa: f64::from_bits(*pressure),
                    temperature_k: f64::from_bits(*temperature),
                };
                (self.simulation.under(&at), *ticks)
            })
            .collect();
        let points = self.simulation.points(&wanted)?;
        self.samples.extend(missing.into_iter().zip(points));
        Ok(keys.iter().map(|key| self.samples[key]).collect())
    }

    /// The table through the nodes and shares at hand, its ends drawn in until every stroke is finished there and
    /// every time is monotone.
    fn table(&mut self) -> Result<ConditionTable, BuildError> {
        for _ in 0..MOST_SHRINKS {
            let conditions = self.conditions();
            let places: Vec<CheckPoint> =
                conditions.iter().flat_map(|at| self.shares.iter().map(|share| (*at, *share))).collect();
            let points = self.points(&places)?;
            if points.iter().any(|point| point.close_time_s.is_none() || point.open_time_s.is_none()) {
                self.end.shrink(SHRINK);
                continue;
            }
            let tolerance_s = MARGIN * self.options().tolerance_up_to_limit_s;
            let moves = |stroke: Stroke| self.simulation.wear.degradation.moves.stroke(stroke).is_some();
            let times = |points: &[SeverityPoint], stroke: Stroke| -> Vec<f64> {
                points.iter().filter_map(|point| point.time_s(stroke)).collect()
            };
            // One way for all conditions: that of where it moves farthest.
            let ways = Stroke::ALL.map(|stroke| {
                let moved = points.chunks(self.shares.len()).map(|points| times(points, stroke));
                let moved = moved.map(|times| times[times.len() - 1] - times[0]);
                moved.max_by(|a, b| a.abs().total_cmp(&b.abs())).is_some_and(|moved_s| moved_s < 0.0)
            });
            // A time that need not move and turns for good: the end comes before that.
            let staying = Stroke::ALL.into_iter().filter(|stroke| !moves(*stroke));
            let sound = staying.flat_map(|stroke| {
                let sound = move |points: &[SeverityPoint]| {
                    levelled(&times(points, stroke), ways[stroke as usize], tolerance_s).1
                };
                points.chunks(self.shares.len()).map(sound)
            });
            match sound.min() {
                Some(many) if many < self.shares.len() && many > 1 => {
                    self.end.shrink(self.shares[many - 1]);
                    continue;
                }
                _ => {}
            }
            let node = |(index, points): (usize, &[SeverityPoint])| {
                let stored_times = |stroke: Stroke| {
                    let times = times(points, stroke);
                    let even = if moves(stroke) {
                        self.simulation.evened(&self.shares, &times, self.is_rough.then_some(TURNS_ANYHOW))
                    } else {
                        levelled(&times, ways[stroke as usize], tolerance_s).0
                    };
                    even.into_iter().map(stored).collect()
                };
                NodeTimes {
                    end: self.end.at(&conditions[index]),
                    close_time_s: stored_times(Stroke::Close),
                    open_time_s: stored_times(Stroke::Open),
                }
            };
            let nodes: Vec<NodeTimes> = points.chunks(self.shares.len()).enumerate().map(node).collect();
            let [pressures, temperatures] = self.nodes.clone();
            let (wear, info) = (
                &self.simulation.wear.degradation,
                ConditionInfo { stall_share: self.end.stall_share(), ..ConditionInfo::default() },
            );
            match ConditionTable::new(wear, pressures, temperatures, self.shares.clone(), &nodes, info) {
                Ok(table) => return Ok(table),
                // A time that turns before the end: the end comes before that.
                Err(RowError::NotMonotone { row, .. }) if row % self.shares.len() > 1 => {
                    self.end.shrink(self.shares[row % self.shares.len() - 1]);
                }
                Err(RowError::NotMonotoneBetween { .. }) => break,
                Err(source) => return Err(BuildError::Grid { fault: self.simulation.id(), source: Box::new(source) }),
            }
        }
        Err(self.not_smooth())
    }

    /// That the times cannot be followed, and where the valve bears least.
    fn not_smooth(&self) -> BuildError {
        let parameters = self.simulation.model.valve.parameters();
        let (supply_pressure_pa, temperature_k) = (parameters.supply_pressure_pa, parameters.temperature_k);
        let own = self.end.at(&Conditions { supply_pressure_pa, temperature_k });
        let share = |at: &Conditions| self.end.at(at) / own;
        let conditions = self.conditions();
        let least = conditions.iter().min_by(|a, b| share(a).total_cmp(&share(b))).expect("there are nodes");
        BuildError::NotSmooth {
            fault: self.simulation.id(),
            supply_pressure_pa: least.supply_pressure_pa,
            temperature_k: least.temperature_k,
            least_share: share(least),
        }
    }

    fn options(&self) -> &Options {
        self.simulation.options
    }

    /// How far a table is from the simulation, of the worse stroke at each place.
    fn errors(&mut self, table: &ConditionTable, places: &[CheckPoint]) -> Result<Vec<Missed>, BuildError> {
        let points = self.points(places)?;
        let limits = self.simulation.limits();
        let least_s = 2.0 * self.simulation.wandering_s();
        let options = *self.options();
        let missed = |((at, _), point): (&CheckPoint, &SeverityPoint)| {
            let slice = table.slice(at).map_err(uncovered)?;
            let limit = slice.limit_severity(&limits);
            let up_to_limit = point.severity <= limit;
            let tolerance_s = if up_to_limit {
                options.tolerance_over_conditions_s
            } else {
                options.tolerance_over_conditions_beyond_s
            };
            let miss = |stroke: Stroke| {
                let (time_s, _) = slice.curve(stroke).extrapolated_time_and_slope(point.severity);
                // A stroke that is not finished just before the end is no error of the times.
                point.time_s(stroke).map_or(0.0, |simulated_s| (time_s - simulated_s).abs())
            };
            let error_s = miss(Stroke::Close).max(miss(Stroke::Open));
            Ok(Missed { share: error_s / tolerance_s.max(least_s), error_s, up_to_limit })
        };
        places.iter().zip(&points).map(missed).collect()
    }

    /// Adds a severity in the middle of each gap that is missed there; says whether it did.
    fn add_points(&mut self, table: &ConditionTable) -> Result<bool, BuildError> {
        let (conditions, shares) = (self.corners(), self.shares.clone());
        let middles: Vec<f64> = shares.windows(2).map(|gap| f64::midpoint(gap[0], gap[1])).collect();
        let places: Vec<CheckPoint> =
            middles.iter().flat_map(|share| conditions.iter().map(|at| (*at, *share))).collect();
        let errors = self.errors(table, &places)?;
        let missed = |errors: &[Missed]| errors.iter().any(|error| error.share > MARGIN);
        let gaps = shares.windows(2).zip(errors.chunks(conditions.len()));
        let missed: Vec<[f64; 2]> =
            gaps.filter(|(_, errors)| missed(errors)).map(|(gap, _)| [gap[0], gap[1]]).collect();
        if missed.iter().any(|gap| gap[1] - gap[0] < NARROWEST_GAP) {
            return Err(self.not_smooth());
        }
        self.add_shares(missed.iter().map(|gap| f64::midpoint(gap[0], gap[1])))?;
        Ok(!missed.is_empty())
    }

    fn add_shares(&mut self, added: impl IntoIterator<Item = f64>) -> Result<(), BuildError> {
        self.shares.extend(added);
        self.shares.sort_by(f64::total_cmp);
        if self.shares.len() > MOST_SHARES {
            return Err(BuildError::TooManyPoints { fault: self.simulation.id(), most: MOST_SHARES });
        }
        Ok(())
    }

    /// Doubles the nodes of each condition between whose nodes the table misses; says whether it did.
    fn add_nodes(&mut self, table: &ConditionTable) -> Result<bool, BuildError> {
        let mut any = false;
        for condition in Condition::ALL {
            let other = Condition::ALL.into_iter().find(|other| *other != condition).expect("there are two");
            let held = self.nodes[other as usize].clone();
            let held = held[held.len() / 2];
            let middles = between(self.range.get(condition), self.nodes[condition as usize].len());
            let step = (self.shares.len() / SHARES_BETWEEN_NODES).max(1);
            let shares: Vec<f64> = self.shares.iter().rev().step_by(step).copied().collect();
            let at = |value: f64| match condition {
                Condition::SupplyPressure => Conditions { supply_pressure_pa: value, temperature_k: held },
                Condition::Temperature => Conditions { supply_pressure_pa: held, temperature_k: value },
            };
            let places: Vec<CheckPoint> =
                middles.iter().flat_map(|value| shares.iter().map(|share| (at(*value), *share))).collect();
            let errors = self.errors(table, &places)?;
            let missed = |(error, _): &(&Missed, &CheckPoint)| error.share > MARGIN;
            let mut missed = errors.iter().zip(&places).filter(missed).map(|(_, (_, share))| *share).peekable();
            if missed.peek().is_some() {
                if missed.all(|share| share > STEEP_FROM) && self.may_retreat(table)? {
                    self.retreats += 1;
                    self.end.shrink(RETREAT);
                } else {
                    self.double(condition)?;
                }
                any = true;
            }
        }
        Ok(any)
    }

    /// Whether drawing the end in once more takes no limit out of the table.
    fn may_retreat(&self, table: &ConditionTable) -> Result<bool, BuildError> {
        let limits = self.simulation.limits();
        for at in self.corners() {
            let slice = table.slice(&at).map_err(uncovered)?;
            if slice.crossing(&limits).is_some_and(|limit| limit > RETREAT * RETREAT * self.end.at(&at)) {
                return Ok(false);
            }
        }
        Ok(self.retreats < MOST_RETREATS)
    }

    fn double(&mut self, condition: Condition) -> Result<(), BuildError> {
        let count = 2 * self.nodes[condition as usize].len() - 1;
        if count > MOST_NODES[condition as usize] {
            return Err(self.not_smooth());
        }
        self.nodes[condition as usize] = extrema(self.range.get(condition), count);
        Ok(())
    }

    fn refine_all(&mut self) -> Result<(), BuildError> {
        for condition in Condition::ALL {
            if self.range.varies(condition) {
                self.double(condition)?;
            }
        }
        let middles: Vec<f64> = self.shares.windows(2).map(|gap| f64::midpoint(gap[0], gap[1])).collect();
        self.add_shares(middles)
    }

    /// The nodes at the ends of the range and in its middle.
    fn corners(&self) -> Vec<Conditions> {
        let of = |nodes: &[f64]| {
            let mut some = vec![nodes[0], nodes[nodes.len() / 2], nodes[nodes.len() - 1]];
            some.dedup();
            some
        };
        let [pressures, temperatures] = [of(&self.nodes[0]), of(&self.nodes[1])];
        let last = temperatures.len() - 1;
        // Along the diagonal, and back along the other one.
        let pairs = pressures.iter().enumerate().flat_map(|(i, pressure)| {
            let mut some = vec![temperatures[i.min(last)], temperatures[last - i.min(last)]];
            some.dedup();
            some.into_iter().map(move |temperature_k| Conditions { supply_pressure_pa: *pressure, temperature_k })
        });
        let mut pairs: Vec<Conditions> = pairs.collect();
        if pressures.len() == 1 {
            let at =
                |temperature_k: &f64| Conditions { supply_pressure_pa: pressures[0], temperature_k: *temperature_k };
            pairs = temperatures.iter().map(at).collect();
        }
        pairs
    }

    /// The table with its error, measured at every place that was simulated and is none of its points.
    fn finish(mut self, table: &ConditionTable) -> Result<OverConditions, BuildError> {
        let limits = self.simulation.limits();
        for at in self.conditions() {
            if table.slice(&at).map_err(uncovered)?.crossing(&limits).is_none()
                && !self.end.stall_share().is_some_and(|share| share <= FARTHEST_STALL)
            {
                return Err(BuildError::LimitOutsideConditions {
                    fault: self.simulation.id(),
                    supply_pressure_pa: at.supply_pressure_pa,
                    temperature_k: at.temperature_k,
                });
            }
        }
        let places = self.between_points();
        let mut error = InterpolationError::default();
        for missed in self.errors(table, &places)? {
            let worst = if missed.up_to_limit { &mut error.up_to_limit_s } else { &mut error.beyond_limit_s };
            *worst = worst.max(missed.error_s);
        }
        let nodes: Vec<NodeTimes> = (0..table.node_count()).map(|index| table.node(index)).collect();
        let [pressures, temperatures] = self.nodes.clone();
        let wear = &self.simulation.wear.degradation;
        let info = ConditionInfo { interpolation_error: error, checked: places.len(), ..*table.info() };
        let table = ConditionTable::new(wear, pressures, temperatures, self.shares.clone(), &nodes, info)
            .map_err(|source| BuildError::Grid { fault: self.simulation.id(), source: Box::new(source) })?;
        Ok(OverConditions { table, simulated: self.samples.len() + self.end.simulated(), is_rough: self.is_rough })
    }

    /// Every place that was simulated and is none of the table's points.
    fn between_points(&self) -> Vec<CheckPoint> {
        let nodes = self.conditions();
        let is_point = |(at, share): &CheckPoint| {
            nodes.contains(at) && self.shares.iter().any(|known| (known - share).abs() < 1e-6)
        };
        self.samples
            .iter()
            .map(|((pressure, temperature, _), point)| {
                let at = Conditions {
                    supply_pressure_pa: f64::from_bits(*pressure),
                    temperature_k: f64::from_bits(*temperature),
                };
                (at, point.severity / self.end.at(&at))
            })
            .filter(|place @ (_, share)| *share <= 1.0 && !is_point(place))
            .collect()
    }
}

/// Conditions that a grid simulates lie in the range that its table covers.
fn uncovered(source: ConditionsError) -> BuildError {
    BuildError::Conditions(source)
}

/// Where the points of a table are, as shares of its end.
fn shares(table: &SeverityTable) -> Vec<f64> {
    let finished = |point: &&SeverityPoint| point.close_time_s.is_some() && point.open_time_s.is_some();
    let points: Vec<f64> = table.points().iter().filter(finished).map(|point| point.severity).collect();
    let last = points[points.len() - 1];
    // Points are dense where one set of conditions stalls the valve; others do so elsewhere.
    let mut shares = vec![0.0];
    for share in points.iter().map(|severity| severity / last) {
        if share - shares[shares.len() - 1] >= FIRST_GAP && (share == 1.0 || 1.0 - share >= FIRST_GAP) {
            shares.push(share);
        }
    }
    shares
}

/// Some of them, the first and the last among these.
fn thinned(shares: &[f64]) -> Vec<f64> {
    let (last, step) = (shares.len() - 1, shares.len().div_ceil(ROUGH_SHARES));
    let kept = |(index, _): &(usize, &f64)| index % step == 0 && index + step <= last || *index == last;
    shares.iter().enumerate().filter(kept).map(|(_, share)| *share).collect()
}

fn first_nodes(range: &ConditionRange, condition: Condition) -> usize {
    if range.varies(condition) { FIRST_NODES[condition as usize] } else { 1 }
}

/// Places all over the range and the severities (Halton's sequence).
fn places(range: &ConditionRange) -> impl Iterator<Item = CheckPoint> {
    let within = |(from, to): (f64, f64), part: f64| from + part * (to - from);
    (1..=PLACES).map(move |index| {
        let at = Conditions {
            supply_pressure_pa: within(range.supply_pressure_pa, halton(index, 2)),
            temperature_k: within(range.temperature_k, halton(index, 3)),
        };
        (at, halton(index, 5))
    })
}

/// The digits of an index behind the point, in reverse.
fn halton(mut index: u32, base: u32) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0);
    while index > 0 {
        digit /= f64::from(base);
        value += digit * f64::from(index % base);
        index /= base;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_double_into_nodes_and_the_places_between() {
        let (coarse, fine) = (extrema((2.0, 6.0), 5), extrema((2.0, 6.0), 9));
        let middles = between((2.0, 6.0), 5);
        for (j, node) in fine.iter().enumerate() {
            let expected = if j % 2 == 0 { coarse[j / 2] } else { middles[j / 2] };
            assert!((node - expected).abs() < 1e-12);
        }
        assert_eq!((coarse[0], coarse[4], extrema((3.0, 3.0), 1)[0]), (2.0, 6.0, 3.0));
        assert!(between((3.0, 3.0), 1).is_empty());
    }

    #[test]
    fn places_fill_the_range() {
        assert_eq!([halton(1, 2), halton(2, 2), halton(3, 2), halton(1, 3)], [0.5, 0.25, 0.75, 1.0 / 3.0]);
    }
}
