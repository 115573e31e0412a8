//! Recording a campaign: what is set, what happens, what is written down.

use rand::RngExt;
use rand::rngs::StdRng;

use crate::adaptive::Accuracy;
use crate::hidden::Hidden;
use crate::measure::normal;
use crate::rig::{Conditions, Sag, Surroundings};
use crate::spool::Edge;
use crate::valve::{TEMPERATURE_K, Valve};
use crate::world::folder::{File, Recording};
use crate::world::instrument::Instrument;
use crate::world::plan::{Sheet, conditions, interval_s, sheets};
use crate::world::play::{Change, Play};
use crate::world::realism::{Realisms, World};
use crate::world::secret::{Place, Secret};
use crate::world::sign;
use crate::world::valves::{Class, Subject};

/// What is the same for all files of a campaign.
struct Setup<'a> {
    subject: &'a Subject,
    secret: &'a Secret,
    instrument: Instrument,
    interval_s: f64,
    /// Factor on every supply pressure: what the gauge throughout does not show.
    gauge: f64,
    /// Factor on every leak opened on purpose.
    leak: f64,
    /// Actual temperature.
    temperature_k: f64,
    sag: Option<Sag>,
    /// Time by which all commands come late.
    late_s: f64,
    clock_rate: f64,
    has_command: bool,
}

impl Setup<'_> {
    fn realisms(&self) -> &Realisms {
        &self.secret.realisms
    }
}

/// Records the campaign; none where a stroke cannot be followed.
pub(crate) fn take(
    place: &Place,
    world: World,
    subject: &Subject,
    secret: &Secret,
    rng: &mut StdRng,
) -> Option<Recording> {
    let is_springless = subject.class == Class::Springless;
    let (conditions, _) = conditions(world, subject, rng);
    let realisms = &secret.realisms;
    let temperature_k = if rng.random_bool(0.6) { TEMPERATURE_K } else { rng.random_range(276.0..312.0_f64).round() };
    let setup = Setup {
        subject,
        secret,
        instrument: Instrument::draw(realisms, subject.valve.stroke_m, secret.noise_m, subject.close_s, rng),
        interval_s: interval_s(realisms, subject),
        gauge: 1.0 + sign(rng) * realisms.size("supply-gauge"),
        leak: 1.0 + realisms.size("leak-area") * normal(rng),
        temperature_k: temperature_k + sign(rng) * realisms.size("temperature"),
        sag: realisms
            .has("supply-sag")
            .then(|| Sag { depth: realisms.size("supply-sag"), time_s: subject.close_s * rng.random_range(0.1..1.0) }),
        late_s: sign(rng) * realisms.size("late-command"),
        clock_rate: 1.0 + sign(rng) * realisms.size("clock-rate"),
        has_command: !is_springless,
    };
    let sheets = sheets(realisms, subject, &conditions, rng);
    let files = sheets.iter().map(|sheet| setup.file(sheet, rng)).collect::<Option<Vec<File>>>()?;
    // Springless cylinders need a tolerance to be of use at all.
    let says_tolerance = is_springless || rng.random_bool([0.95, 0.8][usize::from(world == World::Plant)]);
    let says_noise = rng.random_bool([0.5, 0.2][usize::from(world == World::Plant)]);
    let off = (0.2 * normal(rng)).exp();
    let mut truth = secret.to_json(place, world, subject.class);
    truth["tolerance_stated"] = says_tolerance.into();
    truth["strokes"] = sheets.iter().map(|sheet| sheet.commanded.len()).sum::<usize>().into();
    Some(Recording {
        name: format!(
            "{}{:03}-{}",
            &world.word()[..1],
            place.index,
            crate::draw::label(&secret.effects, &secret.outside)
        ),
        valve: subject.valve.clone(),
        tolerances: says_tolerance.then(|| subject.tolerances()),
        stated_noise_m: says_noise.then(|| crate::effects::three_digits(secret.noise_m * off)),
        temperature_k,
        driven_above_pa: is_springless.then(|| driven_above_pa(&files)),
        files,
        truth,
    })
}

/// Threshold and hysteresis by which commands are read off the pipe pressures that were recorded: half way between an empty
/// and a full pipe, in every file, with room for noise. A cylinder that falls early never sees all of the supply's.
fn driven_above_pa(files: &[File]) -> (f64, f64) {
    let span = |file: &File| {
        let mut sorted: Vec<f64> = file.pressures_pa[0].1.clone();
        sorted.sort_by(f64::total_cmp);
        // Without the few rows that a spike may be.
        let few = sorted.len() / 50;
        (sorted[few], sorted[sorted.len() - 1 - few])
    };
    let common = |(low, high): (f64, f64), (from, to): (f64, f64)| (low.max(from), high.min(to));
    let (low, high) = files.iter().map(span).fold((0.0, f64::INFINITY), common);
    ((0.5 * (low + high)).round(), (0.1 * (high - low) / 1e3).round().max(1.0) * 1e3)
}

impl Setup<'_> {
    fn file(&self, sheet: &Sheet, rng: &mut StdRng) -> Option<File> {
        let play = self.play(sheet, rng);
        let nominal_s = (0_u32..).map(|row| f64::from(row) * self.interval_s).take_while(|t| *t <= sheet.end_s);
        let jitter = self.realisms().size("jitter");
        let (mut at_s, mut kept_s) = (Vec::new(), Vec::new());
        let mut gap = 0;
        for nominal in nominal_s {
            if gap > 0 {
                gap -= 1;
                continue;
            }
            // Rows are lost in bursts of one to nine.
            if nominal > 0.0 && rng.random_bool(self.realisms().size("lost-rows") / 5.0) {
                gap = rng.random_range(0..9);
                continue;
            }
            kept_s.push(nominal);
            at_s.push(nominal + jitter * self.interval_s * rng.random_range(-0.5..0.5));
        }
        let position_at: Vec<f64> = at_s.iter().map(|t| t - self.secret.hidden.clock_offset_s).collect();
        let has_supply = self.secret.has_supply;
        let wants_pressures = self.secret.has_pressures || !self.has_command || has_supply;
        let seen = play.watch(&position_at, if wants_pressures { &at_s } else { &[] });
        let position_m = self.instrument.read(&seen.position_m, &position_at, &seen.impacts, rng);
        let mut pressures_pa = Vec::new();
        if self.secret.has_pressures {
            pressures_pa.push(("chamber_pressure_kpa", self.instrument.read_pressure(&seen.chamber_pa, rng)));
        }
        if self.secret.has_pressures || !self.has_command {
            pressures_pa.push(("pipe_pressure_kpa", self.instrument.read_pressure(&seen.pipe_pa, rng)));
        }
        if has_supply {
            pressures_pa.push(("supply_pressure_kpa", self.instrument.read_pressure(&seen.supply_pa, rng)));
        }
        let given = |t: f64| sheet.commanded.iter().rev().find(|e| e.at_s <= t + 1e-9).is_some_and(|e| e.close);
        let file = File {
            conditions: sheet.conditions.clone(),
            command: self.has_command.then(|| kept_s.iter().map(|t| given(*t)).collect()),
            time_s: kept_s.iter().map(|t| t * self.clock_rate).collect(),
            position_m,
            pressures_pa,
        };
        (!seen.is_broken).then_some(file)
    }

    /// What really happens: pressures that are not what the gauge says, edges that come late, strokes that differ.
    fn play(&self, sheet: &Sheet, rng: &mut StdRng) -> Play {
        let realisms = self.realisms();
        let by_run = 1.0 + realisms.size("supply-by-run") * normal(rng);
        let set = &sheet.conditions;
        let conditions = Conditions {
            supply_psig: set.supply_psig * self.gauge * by_run,
            leak_to_atmosphere_m2: set.leak_to_atmosphere_m2 * self.leak,
            leak_from_supply_m2: set.leak_from_supply_m2 * self.leak,
        };
        let jitter_s = realisms.size("command-jitter");
        let mut edges: Vec<Edge> = sheet
            .commanded
            .iter()
            .map(|edge| Edge { at_s: edge.at_s + self.late_s + jitter_s * normal(rng).abs(), ..*edge })
            .collect();
        edges.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        let scatter = realisms.size("scatter");
        // Friction differs within a stroke pair between closing and opening too.
        let changes = if scatter > 0.0 {
            edges
                .iter()
                .map(|edge| Change {
                    at_s: edge.at_s,
                    friction: (1.0 + 3.0 * scatter * normal(rng)).max(0.2),
                    load_n: 0.5 * scatter * self.subject.force_n() * normal(rng),
                    supply: 1.0 + 0.3 * scatter * normal(rng),
                })
                .collect()
        } else {
            Vec::new()
        };
        Play {
            valve: Valve::clone(&self.secret.actual),
            hidden: Hidden::clone(&self.secret.hidden),
            conditions,
            around: Surroundings { temperature_k: self.temperature_k, sag: self.sag },
            edges,
            changes,
            accuracy: Accuracy { factor: 1.0, longest_s: self.subject.close_s / 100.0 },
        }
    }
}
