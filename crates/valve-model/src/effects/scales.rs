//! The scales of a valve that the ranges of the effects are made of: the forces on its piston, the flow of its
//! solenoid, its volumes, and the time and speed of a stroke that follow from them. A valve may lack any one force
//! (a cylinder without a spring, a horizontal one), so that no range hangs on one alone.

use super::FitRange;
use crate::orifice::CHOKED_FLOW;
use crate::params::{Parameters, STANDARD_GRAVITY_M_PER_S2};

/// Largest share of what drives a stroke that an effect of typical size takes: no part sticks for it.
const MODEST: f64 = 0.35;

/// The largest of the forces that move the piston, N: the spring's when closed, the supply's, the weight.
pub(super) fn force_n(p: &Parameters) -> f64 {
    spring_n(p, p.stroke_m).max(supply_n(p)).max(weight_n(p))
}

/// A typical force: a share of the largest one, but no more than lets the weaker stroke begin and end.
pub(super) fn modest_force_n(p: &Parameters, share: f64) -> f64 {
    let typical = share * force_n(p);
    let margins = [opening_margin_n(p), closing_margin_n(p)];
    margins.into_iter().filter(|margin| *margin > 0.0).map(|margin| MODEST * margin).fold(typical, f64::min)
}

/// A typical force against the opening piston as it leaves its seat, N.
pub(super) fn modest_at_seat_n(p: &Parameters, share: f64) -> f64 {
    let typical = share * force_n(p);
    let opening = spring_n(p, p.stroke_m) - weight_n(p) * p.orientation.closing_share();
    if opening > 0.0 { typical.min(MODEST * opening) } else { typical }
}

/// A typical pressure against the opening piston, Pa: a share of the supply's, but no more than lets it open.
pub(super) fn modest_back_pressure_pa(p: &Parameters, share: f64) -> f64 {
    let (typical, opening) = (share * gauge_pa(p), opening_margin_n(p));
    if opening > 0.0 { typical.min(MODEST * opening / p.piston_area_m2) } else { typical }
}

/// A delay or a time constant, s: that of usual parts, but not most of a short stroke, and longer for a valve that
/// takes minutes, whose parts are larger as well.
pub(super) fn delay(p: &Parameters, usual_s: f64, most_s: f64) -> FitRange {
    let stroke_s = stroke_time_s(p);
    FitRange {
        lower: 0.0,
        typical: usual_s.min(0.2 * stroke_s).max(0.005 * stroke_s),
        upper: most_s.max(0.3 * stroke_s),
    }
}

/// The force that opens a vented valve where it is weakest, at the open end, N.
fn opening_margin_n(p: &Parameters) -> f64 {
    spring_n(p, 0.0) - weight_n(p) * p.orientation.closing_share()
}

/// The force that closes a filled valve where it is weakest, at the closed end, N.
fn closing_margin_n(p: &Parameters) -> f64 {
    supply_n(p) - spring_n(p, p.stroke_m) + weight_n(p) * p.orientation.closing_share()
}

/// The spring force so far from the open end, N.
fn spring_n(p: &Parameters, compressed_m: f64) -> f64 {
    p.spring_stiffness_n_per_m * (compressed_m + p.preload_compression_m)
}

fn supply_n(p: &Parameters) -> f64 {
    gauge_pa(p) * p.piston_area_m2
}

fn weight_n(p: &Parameters) -> f64 {
    p.moving_mass_kg * STANDARD_GRAVITY_M_PER_S2
}

/// Supply pressure above atmosphere, Pa.
pub(super) fn gauge_pa(p: &Parameters) -> f64 {
    p.supply_pressure_pa - p.ambient_pressure_pa
}

/// The choked flow through the solenoid at the valve's supply pressure, kg/s (diatomic gas).
pub(super) fn flow_kg_per_s(p: &Parameters) -> f64 {
    CHOKED_FLOW * p.flow_coefficient * p.solenoid_orifice_area_m2 * p.supply_pressure_pa
        / libm::sqrt(p.specific_gas_constant_j_per_kg_k * p.temperature_k)
}

/// What holds gas with the valve closed: pipe and chamber, m³.
pub(super) fn volume_m3(p: &Parameters) -> f64 {
    p.pipe_volume_m3 + p.dead_volume_m3 + p.piston_area_m2 * p.stroke_m
}

/// The gas that fills them at the supply's pressure, kg.
pub(super) fn gas_kg(p: &Parameters) -> f64 {
    p.supply_pressure_pa * volume_m3(p) / (p.specific_gas_constant_j_per_kg_k * p.temperature_k)
}

/// About the time of a stroke, s: how long the solenoid takes to fill them. Speeds are strokes per such a time.
pub(super) fn stroke_time_s(p: &Parameters) -> f64 {
    gas_kg(p) / flow_kg_per_s(p)
}

/// About the speed of a stroke, m/s.
pub(super) fn speed_m_per_s(p: &Parameters) -> f64 {
    p.stroke_m / stroke_time_s(p)
}
