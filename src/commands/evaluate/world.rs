//! A simulated world: true stroke times of a valve that wears, under changing
//! supply pressure and temperature. It is simulated on grids of its own and
//! interpolated by its own polynomials; the tables of the prognosis have no part
//! in it.

use prognoser::study::scenario::{Scenario, ValveState, Wear, World};
use rayon::prelude::*;
use valve_file::ValveFile;
use valve_model::cycle::cycles;
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{Conditions, Effect, EffectKind, Valve};

/// Cycles after which a valve repeats itself at the latest.
const MOST_CYCLES: usize = 40;
/// Severities of a grid, evenly from 0 to [`LARGEST`].
const SEVERITIES: usize = 56;
const LARGEST: f64 = 1.1;
/// Severities of both leaks at once, evenly from 0 to [`LARGEST_BOTH`].
const BOTH: usize = 49;
const LARGEST_BOTH: f64 = 2.0;
/// Places by which paces are gone on with beyond where strokes are finished: as many as a cubic needs.
const PLACES_BEYOND: usize = 2;
const SUPPLIES: usize = 9;
/// Supply pressures of a grid reach so far from the reference, a share of it.
pub const SUPPLY_SPAN: f64 = 0.12;
const TEMPERATURES: usize = 5;
/// Temperatures of a grid reach so far from the reference, K.
pub const TEMPERATURE_SPAN_K: f64 = 20.0;
/// Valves simulated side by side.
const BATCH: usize = 16;
/// Share of a spring or an orifice that is always left.
const LEAST_LEFT: f64 = 0.01;
/// Halvings by which the wear at a limit is found.
const HALVINGS: usize = 40;

/// Closing and opening time, s; not a number where the valve does not get there.
type Times = [f64; 2];

/// A valve of a grid: what is worn, and the conditions.
struct Case {
    valve: Valve,
    conditions: Conditions,
}

/// The grids of one valve; those that no scenario asks for are empty.
pub struct SimulatedWorld {
    /// Severity of each wear.
    wear: Vec<Vec<Times>>,
    /// Leak by leak: supply pressure, then severity.
    supply: Vec<Vec<Vec<Times>>>,
    /// Leak by leak: temperature, then severity.
    temperature: Vec<Vec<Vec<Times>>>,
    /// Leak to the atmosphere, then from the supply: one over the times, which bends less where a stroke stalls.
    both: Vec<Vec<Times>>,
    limits_s: Times,
    windows_s: Times,
    supply_pa: f64,
    temperature_k: f64,
}

impl SimulatedWorld {
    /// Simulates the grids of a valve that these scenarios need; some seconds.
    pub fn new(file: &ValveFile, scenarios: &[Scenario]) -> anyhow::Result<Self> {
        let limits = file.limits();
        let limits_s = [limits.close_within_s, limits.open_within_s];
        let amounts = Wear::ALL.into_par_iter().map(|wear| limit_amount(file, wear, limits_s)).collect::<Vec<_>>();
        let amounts = amounts.into_iter().collect::<anyhow::Result<Vec<f64>>>()?;
        let at = |wear: Wear, severity: f64| worn(file, wear, severity * amounts[wear as usize]);
        let severities = grid(0.0, LARGEST, SEVERITIES);
        let line = |wear: Wear, change: &(dyn Fn(&mut Conditions) + Sync)| -> anyhow::Result<Vec<Times>> {
            let cases = severities.iter().map(|severity| {
                let mut case = at(wear, *severity)?;
                change(&mut case.conditions);
                Ok(case)
            });
            Ok(times(file, &cases.collect::<anyhow::Result<Vec<_>>>()?))
        };
        let leaks = [Wear::Atmosphere, Wear::Supply];
        let wear = Wear::ALL.map(|wear| line(wear, &|_| {})).into_iter().collect::<anyhow::Result<_>>()?;
        let over_leaks = |nodes: Vec<f64>, change: &(dyn Fn(&mut Conditions, f64) + Sync)| {
            let of = |leak: Wear| nodes.iter().map(|node| line(leak, &|c| change(c, *node))).collect();
            leaks.map(of).into_iter().collect::<anyhow::Result<Vec<Vec<Vec<Times>>>>>()
        };
        let if_wanted = |nodes: Vec<f64>, wanted: fn(&Scenario) -> bool| {
            if scenarios.iter().any(wanted) { nodes } else { Vec::new() }
        };
        let ratios = if_wanted(grid(1.0 - SUPPLY_SPAN, 1.0 + SUPPLY_SPAN, SUPPLIES), Scenario::varies_supply);
        let supply = over_leaks(ratios, &|c, r| c.supply_pressure_pa *= r)?;
        let warmer =
            if_wanted(grid(-TEMPERATURE_SPAN_K, TEMPERATURE_SPAN_K, TEMPERATURES), Scenario::varies_temperature);
        let temperature = over_leaks(warmer, &|c, k| c.temperature_k += k)?;
        let nodes = if_wanted(grid(0.0, LARGEST_BOTH, BOTH), Scenario::has_both_leaks);
        let both = nodes.iter().map(|atmosphere| {
            let cases = nodes.iter().map(|from_supply| {
                let mut case = at(Wear::Atmosphere, *atmosphere)?;
                case.conditions.leak_from_supply_m2 = from_supply * amounts[Wear::Supply as usize];
                Ok(case)
            });
            let times = times(file, &cases.collect::<anyhow::Result<Vec<_>>>()?);
            Ok(times.into_iter().map(|times| times.map(f64::recip)).collect())
        });
        let both = beyond_the_stall(both.collect::<anyhow::Result<_>>()?);
        let schedule = file.schedule();
        let windows_s = [schedule.open_at_s - schedule.close_at_s, schedule.end_s - schedule.open_at_s];
        let parameters = file.valve().parameters();
        let (supply_pa, temperature_k) = (parameters.supply_pressure_pa, parameters.temperature_k);
        Ok(Self { wear, supply, temperature, both, limits_s, windows_s, supply_pa, temperature_k })
    }
}

impl World for SimulatedWorld {
    fn times_s(&self, state: &ValveState) -> [Option<f64>; 2] {
        let present = |wear: &Wear| state.severity[*wear as usize] > 0.0;
        let leaks = Wear::Atmosphere as usize..=Wear::Supply as usize;
        if state.severity[leaks].iter().all(|severity| *severity > 0.0) {
            let rows: Vec<Times> = self
                .both
                .iter()
                .map(|row| along(row, 0.0, LARGEST_BOTH, state.severity[Wear::Supply as usize]))
                .collect();
            let paces = along(&rows, 0.0, LARGEST_BOTH, state.severity[Wear::Atmosphere as usize]);
            let arrives =
                |stroke: usize| Some(1.0 / paces[stroke]).filter(|time| (0.0..self.windows_s[stroke]).contains(time));
            return [arrives(0), arrives(1)];
        }
        let wear = Wear::ALL.into_iter().find(present).unwrap_or(Wear::Atmosphere);
        let severity = state.severity[wear as usize];
        let alone = |line: &Vec<Times>| along(line, 0.0, LARGEST, severity);
        // Only leaks are simulated away from the reference conditions.
        let leak = (wear as usize).min(1);
        if state.supply_ratio != 1.0 {
            let rows: Vec<Times> = self.supply[leak].iter().map(alone).collect();
            return finished(along(&rows, 1.0 - SUPPLY_SPAN, 1.0 + SUPPLY_SPAN, state.supply_ratio));
        }
        if state.warmer_k != 0.0 {
            let rows: Vec<Times> = self.temperature[leak].iter().map(alone).collect();
            return finished(along(&rows, -TEMPERATURE_SPAN_K, TEMPERATURE_SPAN_K, state.warmer_k));
        }
        finished(alone(&self.wear[wear as usize]))
    }

    fn limits_s(&self) -> [f64; 2] {
        self.limits_s
    }

    fn reference_supply_pa(&self) -> f64 {
        self.supply_pa
    }

    fn reference_temperature_k(&self) -> f64 {
        self.temperature_k
    }
}

/// Paces of both strokes, each gone on with in straight lines for some places beyond where it is not finished any more: else
/// a stroke would stall in the world where the grid's last finished place is, up to a place too early.
fn beyond_the_stall(mut paces: Vec<Vec<Times>>) -> Vec<Vec<Times>> {
    for _ in 0..PLACES_BEYOND {
        let known = paces.clone();
        let at = |row: Option<usize>, column: Option<usize>, stroke: usize| {
            known.get(row?)?.get(column?).map(|pace| pace[stroke]).filter(|pace| pace.is_finite())
        };
        for (row, line) in paces.iter_mut().enumerate() {
            for (column, pace) in line.iter_mut().enumerate() {
                for stroke in (0..2).filter(|stroke| known[row][column][*stroke].is_nan()) {
                    let straight = |near: Option<f64>, far: Option<f64>| Some(2.0 * near? - far?);
                    let before = |place: usize, steps: usize| place.checked_sub(steps);
                    let lines = [
                        straight(at(before(row, 1), Some(column), stroke), at(before(row, 2), Some(column), stroke)),
                        straight(at(Some(row + 1), Some(column), stroke), at(Some(row + 2), Some(column), stroke)),
                        straight(at(Some(row), before(column, 1), stroke), at(Some(row), before(column, 2), stroke)),
                        straight(at(Some(row), Some(column + 1), stroke), at(Some(row), Some(column + 2), stroke)),
                    ];
                    let lines: Vec<f64> = lines.into_iter().flatten().collect();
                    if !lines.is_empty() {
                        pace[stroke] = lines.iter().sum::<f64>() / lines.len() as f64;
                    }
                }
            }
        }
    }
    paces
}

fn finished(times: Times) -> [Option<f64>; 2] {
    times.map(|time| Some(time).filter(|time| time.is_finite()))
}

fn grid(first: f64, last: f64, count: usize) -> Vec<f64> {
    (0..count).map(|i| first + (last - first) * i as f64 / (count - 1) as f64).collect()
}

/// The cubic through the four nearest of evenly spaced points (Lagrange); the
/// straight line where a neighbour does not finish.
fn along(points: &[Times], first: f64, last: f64, x: f64) -> Times {
    let count = points.len();
    let place = ((x - first) / (last - first) * (count - 1) as f64).clamp(0.0, (count - 1) as f64);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place in a list")]
    let left = (place.floor() as usize).min(count - 2);
    let start = left.saturating_sub(1).min(count - 4);
    let mut cubic = [0.0; 2];
    for (i, point) in points[start..start + 4].iter().enumerate() {
        let own = (start + i) as f64;
        let others = (start..start + 4).filter(|j| *j != start + i).map(|j| j as f64);
        let weight: f64 = others.map(|other| (place - other) / (own - other)).product();
        cubic[0] += weight * point[0];
        cubic[1] += weight * point[1];
    }
    let part = place - left as f64;
    let line = |stroke: usize| points[left][stroke] * (1.0 - part) + points[left + 1][stroke] * part;
    [0, 1].map(|stroke| if cubic[stroke].is_finite() { cubic[stroke] } else { line(stroke) })
}

/// The valve with an amount of wear beyond what it has: m2, N, or the share that is lost.
fn worn(file: &ValveFile, wear: Wear, amount: f64) -> anyhow::Result<Case> {
    let valve = file.valve();
    let mut parameters = valve.parameters().clone();
    let mut effects = valve.effects().to_vec();
    // An effect with its first parameters changed; by itself where the valve does not have it.
    let mut changed = |kind: EffectKind, own: f64, change: &dyn Fn(f64) -> f64, parameters: usize| {
        let present = effects.iter().position(|effect| effect.kind() == kind).map(|at| effects.remove(at));
        let before = present.map_or(vec![own], |effect| effect.values().to_vec());
        let value = |(place, value): (usize, &f64)| if place < parameters { change(*value) } else { *value };
        let after: Vec<Option<f64>> = before.iter().enumerate().map(value).map(Some).collect();
        effects.push(Effect::new(kind, &after)?);
        anyhow::Ok(())
    };
    let mut conditions = Conditions::nominal(&parameters);
    let left = (1.0 - amount).max(LEAST_LEFT);
    match wear {
        Wear::Atmosphere => conditions.leak_to_atmosphere_m2 = amount,
        Wear::Supply => conditions.leak_from_supply_m2 = amount,
        // Coulomb's and the static force.
        Wear::Friction => changed(EffectKind::DRY_FRICTION, 0.0, &|force_n| force_n + amount, 2)?,
        Wear::Spring => parameters.spring_stiffness_n_per_m *= left,
        Wear::Exhaust => changed(EffectKind::VENT_RESTRICTION, 1.0, &|share| share * left, 1)?,
        Wear::Solenoid => parameters.solenoid_orifice_area_m2 *= left,
        Wear::SupplyLine => {
            parameters.solenoid_orifice_area_m2 *= left;
            changed(EffectKind::VENT_RESTRICTION, 1.0, &|share| share / left, 1)?;
        }
    }
    let valve = Valve::new(parameters, valve.switches(), effects, valve.custom().to_vec())?;
    Ok(Case { valve, conditions })
}

/// The amount of wear that brings a stroke to its limit.
fn limit_amount(file: &ValveFile, wear: Wear, limits_s: Times) -> anyhow::Result<f64> {
    let parameters = file.valve().parameters();
    let (mut low, mut high) = match wear {
        Wear::Atmosphere | Wear::Supply => (0.0, parameters.solenoid_orifice_area_m2 * 4.0),
        Wear::Friction => (0.0, parameters.supply_pressure_pa * parameters.piston_area_m2),
        Wear::Spring | Wear::Exhaust | Wear::SupplyLine | Wear::Solenoid => (0.0, 1.0 - LEAST_LEFT),
    };
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        let reached = &times(file, &[worn(file, wear, middle)?])[0];
        // Not a number is beyond every limit.
        if reached[0] <= limits_s[0] && reached[1] <= limits_s[1] {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(high)
}

fn times(file: &ValveFile, cases: &[Case]) -> Vec<Times> {
    let batch = |cases: &[Case]| {
        let valves: Vec<(&Valve, Conditions)> = cases.iter().map(|case| (&case.valve, case.conditions)).collect();
        let all = cycles(&valves, &file.schedule(), MOST_CYCLES, DEFAULT_STEP_S);
        let last =
            |cycles: &Vec<_>| cycles.last().map(|c: &valve_model::cycle::CycleTimes| [c.close_time_s, c.open_time_s]);
        all.iter().map(|cycles| last(cycles).unwrap_or([None; 2]).map(|t| t.unwrap_or(f64::NAN))).collect::<Vec<_>>()
    };
    cases.par_chunks(BATCH).flat_map_iter(batch).collect()
}
