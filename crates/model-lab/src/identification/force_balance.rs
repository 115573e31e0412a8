//! The valve held against the recorded motion instead of its own: where fits of cylinders that swing may begin.
//!
//! A cylinder that rests on no stop, and one that is thrown back by the gas in it, leaves the recorded path for good where a
//! parameter is a little off; fits of its path end in whichever valley they begin. Along the recorded motion only the gas is
//! simulated, and what the forces on the piston leave in each window hangs together smoothly with all parameters (the
//! equation error of system identification: Ljung, "System Identification", 1999).

use identify::{Coordinate, FitOptions, GroupPrior, Problem, Record, Request, Row, Series, Stop, fit};
use rayon::prelude::*;
use valve_model::{ChamberStart, Run, Start, Valve};

use super::problem::coordinate_of;
use super::setup::{Kind, Recording, Setup};
use super::start::Beginning;
use crate::data::{Channel, ChannelData, Dataset, RunData};
use crate::residual_force::Free;
use crate::space::Space;

/// Records are followed up to this duration altogether, s.
const LONGEST_S: f64 = 20.0;

/// Free motions of a campaign.
#[derive(Debug, Clone, Default)]
pub struct ForceBalance {
    motions: Vec<Free>,
}

impl ForceBalance {
    /// Of the recorded runs of a campaign whose recorded pressure drives the model; empty for others, whose strokes begin
    /// and end at rest.
    pub fn new(setup: &Setup, data: &Dataset) -> Self {
        let mut left_s = LONGEST_S;
        let recordings = setup.recordings.iter().filter(|recording| setup.is_prescribed && recording.is_trace());
        let motions = recordings.filter_map(|recording| {
            let motion = motion(recording, data, setup.stroke_m).filter(|motion| motion.duration_s() <= left_s)?;
            left_s -= motion.duration_s();
            Some(motion)
        });
        Self { motions: motions.collect() }
    }

    /// Where the forces of a space balance best, as the space's coordinates; nothing where nothing is free.
    pub fn optimum(&self, space: &Space, from: &[f64], stop: &Stop) -> Option<Vec<f64>> {
        let problem = Balance::new(self, space, from, stop)?;
        let groups = vec![GroupPrior {
            multiplier_sigma: 1.0,
            multiplier: (0.3, 20.0),
            discrepancy: (1e-5, 0.3),
            time_s: (1e-3, 1e-3),
        }];
        fit(&problem, from, &FitOptions { settled: 0, ..FitOptions::new(groups) }).map(|fit| fit.u)
    }
}

/// The samples and the run of a recording, in the time of its simulation.
fn motion(recording: &Recording, data: &Dataset, stroke_m: f64) -> Option<Free> {
    let Kind::Trace(trace) = &recording.kind else { return None };
    let of_file = data.runs.get(recording.source)?;
    let samples = || trace.channels.first().into_iter().flat_map(|channel| &channel.samples_s);
    let (first_s, last_s) =
        samples().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), time| (a.min(*time), b.max(*time)));
    let first = of_file.times_s.partition_point(|time| *time < first_s - 1e-9);
    let end = of_file.times_s.partition_point(|time| *time <= last_s + 1e-9);
    let cut = |channel: &ChannelData| ChannelData { samples: channel.samples[first..end].to_vec(), ..channel.clone() };
    let start = match recording.beginning {
        Beginning::Moving { position_m, velocity_m_per_s, .. } => {
            Start::Moving { position_m, velocity_m_per_s, chamber: ChamberStart::BALANCE, pipe_pressure_pa: None }
        }
        Beginning::Venting { pressure_pa, .. } => Start::Venting { pressure_pa },
        Beginning::Closed => Start::ClosedRest,
        Beginning::Open | Beginning::Filling => Start::Rest,
    };
    let run = RunData {
        name: recording.name.clone(),
        run: Run { start, ..recording.run.clone() },
        driving: None,
        times_s: of_file.times_s[first..end].iter().map(|time| time - recording.origin_s).collect(),
        channels: of_file.channels.iter().filter(|channel| channel.channel == Channel::Position).map(cut).collect(),
    };
    Free::new(run, stroke_m)
}

/// What the forces leave as a problem of identification.
struct Balance<'a> {
    of: &'a ForceBalance,
    space: &'a Space,
    coordinates: Vec<Coordinate>,
    records: Vec<Record>,
    stop: &'a Stop,
}

impl<'a> Balance<'a> {
    fn new(of: &'a ForceBalance, space: &'a Space, from: &[f64], stop: &'a Stop) -> Option<Self> {
        let valve = space.valve(from)?;
        let p = valve.parameters();
        let largest_n = (p.supply_pressure_pa - p.ambient_pressure_pa).abs() * p.piston_area_m2;
        let records: Option<Vec<Record>> = of
            .motions
            .iter()
            .map(|motion| {
                let missing = motion.missing(&valve)?;
                let row = |one: &crate::residual_force::Missing| Row {
                    time_s: one.since_command_s,
                    observed: 0.0,
                    sigma: one.force_error_n.max(1e-6 * largest_n),
                    activity: largest_n,
                    turns: 0,
                };
                let series = Series { rows: missing.iter().map(row).collect(), group: 0, is_process: true };
                Some(Record { series: vec![series], condition: 0 })
            })
            .collect();
        let coordinates = space.coordinates.iter().enumerate().map(coordinate_of).collect();
        records.filter(|records| !records.is_empty()).map(|records| Self { of, space, coordinates, records, stop })
    }

    fn rows(&self, valve: &Valve, record: usize) -> Option<Vec<f64>> {
        let missing = self.of.motions[record].missing(valve)?;
        (missing.len() == self.records[record].row_count()).then(|| missing.iter().map(|one| one.force_n).collect())
    }
}

impl Problem for Balance<'_> {
    fn coordinates(&self) -> &[Coordinate] {
        &self.coordinates
    }

    fn records(&self) -> &[Record] {
        &self.records
    }

    fn predict(&self, points: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>> {
        let valves: Vec<Option<Valve>> = points.iter().map(|point| self.space.valve(point)).collect();
        let of = |request: &Request| self.rows(valves[request.point].as_ref()?, request.record);
        requests.par_iter().map(of).collect()
    }

    fn stop(&self) -> &Stop {
        self.stop
    }
}
