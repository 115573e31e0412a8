//! The valve signature: chamber pressure against travel, both strokes, as valve engineers read it.

use nalgebra::{Matrix2, Vector2};

use super::weak::{Mechanics, Missing};
use crate::crossing::Direction;

/// Bins of the travel.
const BINS: usize = 30;

/// Pressure against travel with what can be read from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Signature {
    /// Whether the pressure was measured, or simulated along the measured motion.
    pub is_measured: bool,
    /// Travel from open, m, and gauge pressure in the chamber, Pa, while closing.
    pub closing: Vec<[f64; 2]>,
    /// The same while opening.
    pub opening: Vec<[f64; 2]>,
    /// The middle line between both, from open to closed.
    pub spring: [[f64; 2]; 2],
    /// Stiffness of the spring from the slope of the middle line, N/m.
    pub spring_rate_n_per_m: f64,
    /// Gauge pressures at which the middle line leaves open and reaches closed, Pa.
    pub bench_set_pa: [f64; 2],
    /// Half the pressure between both strokes, Pa.
    pub friction_band_pa: f64,
    /// The same as a force, N; viscous friction included.
    pub friction_n: f64,
    /// How much of it the model's viscous friction explains, N.
    pub viscous_n: f64,
}

/// The signature of the strokes of some runs. Nothing unless both strokes cover common travel.
pub fn signature(
    windows: &[Missing],
    with: &Mechanics,
    (stroke_m, ambient_pa): (f64, f64),
    is_measured: bool,
) -> Option<Signature> {
    let line = |direction: Direction| -> Vec<Option<[f64; 3]>> {
        (0..BINS)
            .map(|bin| {
                let inside: Vec<&Missing> = windows
                    .iter()
                    .filter(|window| window.direction == direction)
                    .filter(|window| {
                        let travel = (stroke_m - window.position_m) / stroke_m * BINS as f64;
                        travel >= bin as f64 && travel < bin as f64 + 1.0
                    })
                    .collect();
                let count = inside.len() as f64;
                let mean = |value: &dyn Fn(&Missing) -> f64| inside.iter().map(|one| value(one)).sum::<f64>() / count;
                (!inside.is_empty()).then(|| {
                    [
                        mean(&|one| stroke_m - one.position_m),
                        mean(&|one| one.chamber_pressure_pa - ambient_pa),
                        mean(&|one| one.velocity_m_per_s),
                    ]
                })
            })
            .collect()
    };
    let (closing, opening) = (line(Direction::Closing), line(Direction::Opening));
    let both: Vec<([f64; 3], [f64; 3])> =
        closing.iter().zip(&opening).filter_map(|(closing, opening)| Some(((*closing)?, (*opening)?))).collect();
    if both.len() < 5 {
        return None;
    }
    let (mut matrix, mut vector) = (Matrix2::zeros(), Vector2::zeros());
    let (mut band, mut viscous) = (0.0, 0.0);
    for (closing, opening) in &both {
        let row = Vector2::new(1.0, 0.5 * (closing[0] + opening[0]));
        matrix += row * row.transpose();
        vector += row * (0.5 * (closing[1] + opening[1]));
        band += 0.5 * (closing[1] - opening[1]) / both.len() as f64;
        viscous += 0.5 * with.viscous * (opening[2] - closing[2]) / both.len() as f64;
    }
    let line = matrix.try_inverse()? * vector;
    let points = |line: &[Option<[f64; 3]>]| line.iter().flatten().map(|point| [point[0], point[1]]).collect();
    let bench_set_pa = [line[0], line[0] + line[1] * stroke_m];
    Some(Signature {
        is_measured,
        spring: [[0.0, bench_set_pa[0]], [stroke_m, bench_set_pa[1]]],
        closing: points(&closing),
        opening: points(&opening),
        spring_rate_n_per_m: line[1] * with.area_m2,
        bench_set_pa,
        friction_band_pa: band,
        friction_n: band * with.area_m2,
        viscous_n: viscous,
    })
}
