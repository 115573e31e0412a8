//! What a campaign hides, how visible that is, and what may honestly be said of it.

use std::collections::BTreeSet;

use rand::RngExt;
use rand::rngs::StdRng;
use serde_json::{Map, Value, json};

use crate::draw::{three_decimals, walk};
use crate::effects::{CATALOGUE, Draft, Drawn, Scale};
use crate::hidden::{Bristles, Hidden, Laws};
use crate::measure::normal;
use crate::strange::{OUTSIDE, hide_outside};
use crate::truth::Category;
use crate::valve::{TOLERANCES, Valve};
use crate::world::hide::{Shape, hide, may_hide, wanted_change};
use crate::world::play::at;
use crate::world::realism::{Realisms, Where, World};
use crate::world::valves::{Class, Subject};
use crate::world::visible::{Bench, PLAIN_NATS, Strokes, TIE_NATS, Visible, minus};
use crate::world::{WorldSpec, sign};

/// Which campaign of which seed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub seed: u64,
    pub index: usize,
    pub category: Category,
    pub rank: usize,
}

/// The real valve with what it hides.
#[derive(Debug, Clone)]
pub(crate) struct Secret {
    pub actual: Valve,
    pub hidden: Hidden,
    pub realisms: Realisms,
    pub has_pressures: bool,
    /// Whether the supply pressure is recorded.
    pub has_supply: bool,
    pub noise_m: f64,
    pub effects: Vec<Drawn>,
    pub outside: Vec<Drawn>,
    visible: Vec<(&'static str, Visible)>,
    factors: Vec<(usize, f64)>,
    needed: Vec<&'static str>,
    one_of: Vec<&'static str>,
    allowed: BTreeSet<&'static str>,
}

/// Effects that an answer may name without being wrong, for a realism that looks like them.
const LOOKS_LIKE: [(&str, f64, &[&str]); 9] = [
    ("late-command", 5e-3, &["clock-offset", "solenoid-lag"]),
    ("perry", 0.0, &["orifice-law", "outside"]),
    ("silencer", 0.0, &["vent-restriction", "back-pressure", "outside"]),
    ("damped-stops", 0.0, &["closing-cushion", "opening-cushion", "outside"]),
    ("friction-asymmetry", 0.1, &["seat-adhesion", "seal-friction", "process-force", "outside"]),
    ("friction-slope", 0.15, &["seat-adhesion", "seal-friction", "process-force", "outside"]),
    ("warm-walls", 0.0, &["outside"]),
    ("supply-sag", 0.0, &["supply-droop", "outside"]),
    ("nonlinearity", 3e-3, &["outside"]),
];

/// Effects that imitate each other: half of the pairs are from one of these groups.
const CONFUSED: [&[&str]; 8] = [
    &["dry-friction", "seal-friction", "supply-droop", "clock-offset"],
    &["solenoid-lag", "sensor-lag", "clock-offset"],
    &["closing-cushion", "sensor-lag", "seat-adhesion", "process-force"],
    &["opening-cushion", "sensor-lag", "progressive-spring"],
    &["gas-heating", "orifice-law", "supply-droop"],
    &["vent-restriction", "back-pressure", "leak-from-supply", "opening-cushion"],
    &["leak-to-atmosphere", "leak-from-supply", "supply-droop"],
    &["process-force", "progressive-spring", "seat-adhesion", "back-pressure"],
];

/// Smallest and largest noise of the position sensor, as shares of the stroke.
fn noise_range(world: World) -> (f64, f64) {
    if world == World::Plant { (4e-4, 5e-3) } else { (2e-4, 2e-3) }
}

impl Secret {
    /// Draws it; none where the valve would not stroke fully.
    pub fn draw(place: &Place, spec: &WorldSpec, subject: &Subject, rng: &mut StdRng) -> Option<Self> {
        let valve = &subject.valve;
        let ids = hidden_ids(place, subject.class, rng);
        let is_sprung = subject.class != Class::Springless;
        let has_pressures = is_sprung && rng.random_bool(0.35);
        let rubs = |id: &&str| ["dry-friction", "seal-friction"].contains(id);
        let mut circumstances = vec![Where::Always, Where::Start];
        let optional = [
            (Where::Pressures, has_pressures || !is_sprung),
            (Where::DryFriction, ids.iter().any(rubs)),
            (Where::Heating, ids.contains(&"gas-heating")),
            (Where::Sprung, is_sprung),
        ];
        circumstances.extend(optional.iter().filter(|(_, there)| *there).map(|(at, _)| *at));
        let realisms = spec.realisms.clone().unwrap_or_else(|| Realisms::draw(spec.world, &circumstances, rng));
        let (low, high) = noise_range(spec.world);
        let noise_m = valve.stroke_m * crate::effects::log_uniform(rng, low, high);
        let (actual, factors) = actual_valve(spec.world, subject, &realisms, rng);
        let bench = bench(subject, &realisms, noise_m);
        let plain = Hidden { laws: laws(&realisms, valve, rng), ..Hidden::default() };
        let mut secret = Self {
            actual,
            hidden: Hidden { bristles: bristles(&realisms), ..plain.clone() },
            realisms,
            has_pressures,
            has_supply: false,
            noise_m,
            effects: Vec::new(),
            outside: Vec::new(),
            visible: Vec::new(),
            factors,
            needed: Vec::new(),
            one_of: Vec::new(),
            allowed: BTreeSet::new(),
        };
        // A supply that is seen to sag is mostly recorded.
        secret.has_supply = secret.realisms.has("supply-sag") && rng.random_bool(0.7);
        for &id in &ids {
            secret.hide(id, subject, &bench, rng)?;
        }
        if place.category == Category::Outside {
            let id = walk(place.seed, place.rank, &OUTSIDE);
            secret.hide_odd(id, subject, rng);
        }
        let hidden = secret.hidden.clone();
        let full = bench.strokes(&secret.actual, &hidden);
        if !bench.is_full(&full, valve.stroke_m) {
            return None;
        }
        secret.judge(&bench, subject, &plain, &full, rng);
        Some(secret)
    }

    /// Hides an effect of the catalogue at a strength that changes the strokes by what is wanted.
    fn hide(&mut self, id: &'static str, subject: &Subject, bench: &Bench, rng: &mut StdRng) -> Option<()> {
        let stroke = subject.valve.stroke_m;
        let alone = Bench { conditions: vec![at(subject.valve.supply_psig)], ..bench.clone() };
        let (shape, wanted) = (Shape::draw(rng), wanted_change(rng) * stroke);
        let before = alone.strokes(&self.actual, &self.hidden);
        let mut strength: f64 = 0.1;
        for _ in 0..5 {
            let mut tried = self.hidden.clone();
            hide(id, strength, shape, subject, &mut tried);
            let strokes = alone.strokes(&self.actual, &tried);
            let change = alone.change(&strokes, &before, stroke).0;
            if !alone.is_full(&strokes, stroke) {
                strength *= 0.4;
            } else if (change / wanted - 1.0).abs() < 0.2 {
                break;
            } else {
                let power = if id == "gas-heating" { 0.5 } else { 1.0 };
                strength = (strength * (wanted / change.max(1e-9)).powf(power).clamp(0.02, 8.0)).min(1.0);
            }
        }
        let lowest = *subject.pressures_psig.first()?;
        let highest = *subject.pressures_psig.last()?;
        let ends = Bench { conditions: vec![at(lowest), at(highest)], ..bench.clone() };
        for _ in 0..6 {
            let mut tried = self.hidden.clone();
            let drawn = hide(id, strength, shape, subject, &mut tried);
            if ends.is_full(&ends.strokes(&self.actual, &tried), stroke) {
                self.hidden = tried;
                self.effects.push(drawn);
                return Some(());
            }
            strength *= 0.6;
        }
        None
    }

    fn hide_odd(&mut self, id: &'static str, subject: &Subject, rng: &mut StdRng) {
        let valve = &subject.valve;
        let testbed = Valve::testbed();
        let force = subject.force_n() / (testbed.spring_n_per_m * testbed.preload_m);
        let scale = Scale {
            force,
            pressure: force * testbed.piston_area_m2 / valve.piston_area_m2,
            area: valve.solenoid_area_m2 / testbed.solenoid_area_m2,
            time: subject.close_s / 1.0422,
            length: valve.stroke_m / testbed.stroke_m,
        };
        let noise_m = crate::effects::log_uniform(rng, 4e-5, 2.5e-4) * scale.length;
        let mut draft = Draft { rng, scale, noise_m, parameters: Vec::new() };
        let drawn = hide_outside(id, valve, &mut draft, &mut self.hidden);
        self.outside.push(drawn);
    }

    /// Finds out how visible everything is, and what has to be and what may be said.
    fn judge(&mut self, bench: &Bench, subject: &Subject, plain: &Hidden, full: &Strokes, rng: &mut StdRng) {
        for (name, from, ids) in LOOKS_LIKE {
            let is_recorded = name == "supply-sag" && self.has_supply;
            if self.realisms.size(name) > from && !is_recorded {
                self.allowed.extend(ids);
            }
        }
        let stroke = subject.valve.stroke_m;
        let nuisances = bench.nuisances(&self.actual, &self.hidden, full);
        let all: Vec<(&'static str, Hidden)> = (0..self.effects.len())
            .map(|index| (self.effects[index].id, self.without(index, plain)))
            .chain(self.outside.iter().map(|odd| (odd.id, Hidden { outside: Vec::new(), ..self.hidden.clone() })))
            .collect();
        let changes: Vec<Strokes> =
            all.iter().map(|(_, without)| minus(full, &bench.strokes(&self.actual, without))).collect();
        for (index, (id, without)) in all.iter().enumerate() {
            let others: Vec<Strokes> =
                (0..changes.len()).filter(|other| *other != index).map(|other| changes[other].clone()).collect();
            let (position_rms_m, time_rms_s) = bench.change(full, &bench.strokes(&self.actual, without), stroke);
            let (left_rms_m, nats) = bench.left(&changes[index], &nuisances, &others);
            self.visible.push((*id, Visible { position_rms_m, time_rms_s, left_rms_m, nats }));
            let is_odd = !self.outside.is_empty();
            match (is_odd, nats >= PLAIN_NATS) {
                (true, _) => {
                    self.allowed.insert("outside");
                }
                (false, true) => self.needed.push(id),
                (false, false) => {
                    self.allowed.insert(id);
                }
            }
        }
        // Twins of what is hidden, and the joint change of two effects that hide behind each other.
        for (index, change) in changes.iter().enumerate() {
            let nats = self.visible[index].1.nats;
            if nats < TIE_NATS {
                continue;
            }
            let others: Vec<Strokes> =
                (0..changes.len()).filter(|other| *other != index).map(|other| changes[other].clone()).collect();
            self.add_twins(bench, subject, (change, nats), &nuisances, &others, rng);
        }
        if let [first, second] = changes.as_slice()
            && self.needed.is_empty()
        {
            let both: Strokes =
                first.iter().zip(second).map(|(a, b)| a.iter().zip(b).map(|(x, y)| x + y).collect()).collect();
            if bench.left(&both, &nuisances, &[]).1 >= PLAIN_NATS {
                self.one_of = self.effects.iter().map(|effect| effect.id).collect();
            }
        }
        for id in &self.needed {
            self.allowed.remove(id);
        }
    }

    fn add_twins(
        &mut self,
        bench: &Bench,
        subject: &Subject,
        (change, nats): (&Strokes, f64),
        nuisances: &[Strokes],
        others: &[Strokes],
        rng: &mut StdRng,
    ) {
        let stroke = subject.valve.stroke_m;
        let nothing = Hidden { laws: self.hidden.laws.clone(), ..Hidden::default() };
        let base = bench.strokes(&self.actual, &nothing);
        let zero: Strokes = base.iter().map(|x| vec![0.0; x.len()]).collect();
        let wanted = bench.change(change, &zero, stroke).0;
        for id in may_hide(subject.class, &CATALOGUE) {
            if self.effects.iter().any(|effect| effect.id == id) {
                continue;
            }
            let shape = Shape::draw(rng);
            let moved = |strength: f64| {
                let mut other = nothing.clone();
                hide(id, strength, shape, subject, &mut other);
                minus(&bench.strokes(&self.actual, &other), &base)
            };
            let first = moved(0.1);
            let size = bench.change(&first, &zero, stroke).0.max(1e-9);
            let power = if id == "gas-heating" { 0.5 } else { 1.0 };
            let alike = moved((0.1 * (wanted / size).powf(power)).clamp(1e-3, 0.6));
            if bench.is_twin(change, nats, nuisances, others, &alike) {
                self.allowed.insert(id);
            }
        }
    }

    /// What is hidden but for one effect.
    fn without(&self, index: usize, plain: &Hidden) -> Hidden {
        let mut less = self.hidden.clone();
        match self.effects[index].id {
            "dry-friction" => less.dry_friction = None,
            "seal-friction" => less.seal_friction_m2 = 0.0,
            "progressive-spring" => less.hardening = 0.0,
            "closing-cushion" => less.closing_cushion = plain.closing_cushion,
            "opening-cushion" => less.opening_cushion = plain.opening_cushion,
            "seat-adhesion" => less.seat_adhesion = plain.seat_adhesion,
            "process-force" => less.process_force = plain.process_force,
            "gas-heating" => less.wall_conductance_w_per_k = None,
            "supply-droop" => less.supply_droop = None,
            "vent-restriction" => less.vent_factor = 1.0,
            "back-pressure" => less.back_pressure_pa = 0.0,
            "orifice-law" => less.critical_ratio = None,
            "leak-to-atmosphere" => less.leak_to_atmosphere_m2 = 0.0,
            "leak-from-supply" => less.leak_from_supply_m2 = 0.0,
            "solenoid-lag" => less.solenoid = plain.solenoid,
            "sensor-lag" => less.sensor_lag_s = 0.0,
            _ => less.clock_offset_s = 0.0,
        }
        less
    }

    /// For the truth.
    pub fn to_json(&self, place: &Place, world: World, class: Class) -> Value {
        let list = |effects: &[Drawn]| {
            let one = |effect: &Drawn| {
                let parameters: Map<String, Value> =
                    effect.parameters.iter().map(|p| (p.name.to_owned(), json!(p.value))).collect();
                (effect.id.to_owned(), Value::Object(parameters))
            };
            Value::Object(effects.iter().map(one).collect())
        };
        let factors: Map<String, Value> =
            self.factors.iter().map(|(index, factor)| (TOLERANCES[*index].0.to_owned(), json!(factor))).collect();
        let visible: Map<String, Value> = self
            .visible
            .iter()
            .map(|(id, v)| {
                let value = json!({
                    "position_rms_mm": v.position_rms_m * 1e3,
                    "position_rms_of_stroke": v.position_rms_m / self.actual.stroke_m,
                    "stroke_time_rms_ms": v.time_rms_s * 1e3,
                    "left_rms_mm": v.left_rms_m * 1e3,
                    "nats": v.nats,
                });
                ((*id).to_owned(), value)
            })
            .collect();
        json!({
            "seed": place.seed,
            "index": place.index,
            "world": world.word(),
            "class": class.word(),
            "category": place.category.word(),
            "kind": format!("{}.{}", world.word(), crate::draw::label(&self.effects, &self.outside)),
            "needed": self.needed,
            "one_of": self.one_of,
            "allowed": self.allowed,
            "outside_is_plain": !self.outside.is_empty() && self.visible.iter().any(|(_, v)| v.nats >= PLAIN_NATS),
            "sizes": list(&self.effects),
            "outside": list(&self.outside),
            "visible": visible,
            "realisms": self.realisms.to_json(),
            "parameters_times": factors,
            "position_noise_mm": self.noise_m * 1e3,
        })
    }
}

fn hidden_ids(place: &Place, class: Class, rng: &mut StdRng) -> Vec<&'static str> {
    let catalogue = may_hide(class, &CATALOGUE);
    match place.category {
        Category::Nothing | Category::Outside => Vec::new(),
        Category::One => vec![walk(place.seed, place.rank, &catalogue)],
        Category::Two => {
            // Every pair may meet, also those that can hardly be told apart.
            let first = walk(place.seed, place.rank, &catalogue);
            let alike = |other: &&str| CONFUSED.iter().any(|group| group.contains(&first) && group.contains(other));
            let mut others: Vec<_> = catalogue.into_iter().filter(|other| *other != first).collect();
            if rng.random_bool(0.5) && others.iter().any(alike) {
                others.retain(alike);
            }
            vec![first, others[rng.random_range(0..others.len())]]
        }
    }
}

/// The strokes at which things are judged: at the lowest, the usual and the highest pressure.
fn bench(subject: &Subject, realisms: &Realisms, noise_m: f64) -> Bench {
    let valve = &subject.valve;
    let share = |name: &str| realisms.size(name) * valve.stroke_m;
    let resolution_m = share("quantised") / 12.0_f64.sqrt();
    let slow = realisms.has("coloured-noise");
    let pressures = &subject.pressures_psig;
    Bench {
        conditions: [0, pressures.len() / 2, pressures.len() - 1].map(|index| at(pressures[index])).to_vec(),
        open_at_s: 1.6 * subject.slow_close_s,
        end_s: 1.6 * subject.slow_close_s + 1.6 * subject.slow_open_s,
        close_s: subject.close_s,
        noise_m: (noise_m.powi(2) + resolution_m.powi(2) + 0.5 * share("hum").powi(2)).sqrt(),
        systematic_m: (0.5 * share("nonlinearity")).hypot(if slow { 0.3 * noise_m } else { 0.0 }),
        tolerances: subject.tolerances(),
    }
}

fn bristles(realisms: &Realisms) -> Bristles {
    if realisms.has("bristles") { Bristles::Of(realisms.size("bristles")) } else { Bristles::Compliant }
}

fn laws(realisms: &Realisms, valve: &Valve, rng: &mut StdRng) -> Laws {
    Laws {
        friction_asymmetry: sign(rng) * realisms.size("friction-asymmetry"),
        friction_slope: sign(rng) * realisms.size("friction-slope"),
        stop_damping_s_per_m: realisms.size("damped-stops"),
        perry_share: realisms.size("perry"),
        wall_time_s: realisms.has("warm-walls").then(|| realisms.size("warm-walls")),
        silencer: realisms
            .has("silencer")
            .then(|| (realisms.size("silencer") * valve.solenoid_area_m2, 0.2 * valve.pipe_volume_m3)),
    }
}

/// The valve as it is: off within its tolerances, now and then beyond, and a little in what nobody doubts.
fn actual_valve(world: World, subject: &Subject, realisms: &Realisms, rng: &mut StdRng) -> (Valve, Vec<(usize, f64)>) {
    let mut valve = subject.valve.clone();
    let mut factors = Vec::new();
    let tolerances = subject.tolerances();
    let beyond = (world == World::Plant && rng.random_bool(0.3)).then(|| rng.random_range(0..tolerances.len()));
    for (place, (index, sigma)) in tolerances.into_iter().enumerate() {
        let mut pull = normal(rng).clamp(-2.0, 2.0);
        if beyond == Some(place) {
            pull = sign(rng) * rng.random_range(2.0..3.0);
        }
        // What is known badly is off by a factor rather than by a share.
        let factor: f64 = if sigma >= 0.2 { (sigma * pull).exp() } else { 1.0 + sigma * pull };
        let factor = three_decimals(factor);
        *valve.tolerated_mut(index) *= factor;
        factors.push((index, factor));
    }
    let off = realisms.size("untolerated");
    if off > 0.0 {
        valve.piston_area_m2 *= 1.0 + off * normal(rng).clamp(-2.0, 2.0);
        valve.stroke_m *= 1.0 + 0.5 * off * normal(rng).clamp(-2.0, 2.0);
        valve.mass_kg *= 1.0 + off * normal(rng).clamp(-2.0, 2.0);
    }
    (valve, factors)
}
