//! Worlds that are not tidy: campaigns as laboratories and plants record them.
//!
//! A campaign is a believed valve, a real one that differs from it within (sometimes beyond) its tolerances and a
//! little in what nobody doubts, effects hidden in it, and realisms: of the instrument, of the conditions, of the
//! records and of the laws. Sizes of hidden effects aim at a visible change between hardly anything and what nobody
//! misses. The truth tells what has to be named (`needed`, or at least one of `one_of`), what else is honest
//! (`allowed`: effects too faint to be told, twins, what a realism looks like) and how visible each effect is.

pub mod folder;
mod hide;
mod instrument;
mod plan;
mod play;
pub mod realism;
mod secret;
mod take;
pub mod valves;
pub mod visible;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

pub use folder::{File, Recording, write_truths};
pub use realism::{Realisms, World};
pub use valves::Class;

use crate::draw::category_of;

/// What to draw in a world.
#[derive(Debug, Clone, PartialEq)]
pub struct WorldSpec {
    /// The world, not the tidy one.
    pub world: World,
    /// Weights of the categories nothing, one, two, outside, in this order.
    pub weights: [f64; 4],
    /// The kind of valve; by default drawn.
    pub class: Option<Class>,
    /// The realisms; by default drawn.
    pub realisms: Option<Realisms>,
}

impl WorldSpec {
    /// Everything is drawn.
    pub fn of(world: World) -> Self {
        Self { world, weights: [0.25, 0.45, 0.15, 0.15], class: None, realisms: None }
    }
}

/// Draws the campaign `index` of `seed`. The same arguments give the same campaign, whatever else was drawn before.
pub fn draw_world(seed: u64, index: usize, spec: &WorldSpec) -> Recording {
    let (category, rank) = category_of(index, spec.weights);
    let world = match spec.world {
        World::Tidy => 0,
        World::Laboratory => 1_u64,
        World::Plant => 2,
    };
    for attempt in 0_u64.. {
        let mixed = seed.wrapping_mul(0x2545_f491_4f6c_dd1d)
            ^ (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15)
            ^ (attempt * 3 + world).wrapping_mul(0xd1b5_4a32_d192_ed03);
        let mut rng = StdRng::seed_from_u64(mixed);
        let class = spec.class.unwrap_or_else(|| Class::draw(&mut rng));
        let Some(subject) = valves::subject(class, &mut rng) else { continue };
        let place = secret::Place { seed, index, category, rank };
        let Some(secret) = secret::Secret::draw(&place, spec, &subject, &mut rng) else { continue };
        if let Some(recording) = take::take(&place, spec.world, &subject, &secret, &mut rng) {
            return recording;
        }
    }
    unreachable!("the attempts are endless")
}

fn sign(rng: &mut StdRng) -> f64 {
    if rng.random_bool(0.5) { 1.0 } else { -1.0 }
}

#[cfg(test)]
mod tests;
