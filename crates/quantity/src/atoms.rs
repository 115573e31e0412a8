//! The units from which all others are built.

use crate::reference::Reference;

/// Powers of kilogram, metre, second and kelvin.
pub(crate) type Exponents = [i32; 4];

/// One unit. Its value in SI is `(number + shift) * numerator / denominator`;
/// numerator and denominator are kept apart so that "25.4 mm" becomes the
/// same double as 0.0254.
#[derive(Debug)]
pub(crate) struct Atom {
    pub name: &'static str,
    pub numerator: f64,
    pub denominator: f64,
    pub shift: f64,
    pub exponents: Exponents,
    pub reference: Reference,
}

const MASS: Exponents = [1, 0, 0, 0];
const LENGTH: Exponents = [0, 1, 0, 0];
const TIME: Exponents = [0, 0, 1, 0];
const TEMPERATURE: Exponents = [0, 0, 0, 1];
const VOLUME: Exponents = [0, 3, 0, 0];
const FORCE: Exponents = [1, 1, -2, 0];
const PRESSURE: Exponents = [1, -1, -2, 0];
const ENERGY: Exponents = [1, 2, -2, 0];
const POWER: Exponents = [1, 2, -3, 0];

const fn plain(name: &'static str, numerator: f64, denominator: f64, exponents: Exponents) -> Atom {
    Atom { name, numerator, denominator, shift: 0.0, exponents, reference: Reference::Unstated }
}

const fn pressure(name: &'static str, pascal: f64, reference: Reference) -> Atom {
    Atom { name, numerator: pascal, denominator: 1.0, shift: 0.0, exponents: PRESSURE, reference }
}

/// Pascals in a pound-force per square inch, to the digits in which the valve's references are computed.
const PSI: f64 = 6894.757;
/// Newtons in a pound-force (0.453 592 37 kg times one standard gravity).
const LBF: f64 = 4.448_221_615_260_5;

pub(crate) const ATOMS: &[Atom] = &[
    plain("kg", 1.0, 1.0, MASS),
    plain("g", 1.0, 1e3, MASS),
    plain("mg", 1.0, 1e6, MASS),
    plain("lb", 45_359_237.0, 1e8, MASS),
    plain("m", 1.0, 1.0, LENGTH),
    plain("cm", 1.0, 1e2, LENGTH),
    plain("mm", 1.0, 1e3, LENGTH),
    plain("um", 1.0, 1e6, LENGTH),
    plain("in", 254.0, 1e4, LENGTH),
    plain("ft", 3048.0, 1e4, LENGTH),
    plain("s", 1.0, 1.0, TIME),
    plain("ms", 1.0, 1e3, TIME),
    plain("us", 1.0, 1e6, TIME),
    plain("min", 60.0, 1.0, TIME),
    plain("h", 3600.0, 1.0, TIME),
    plain("K", 1.0, 1.0, TEMPERATURE),
    Atom { shift: 273.15, ..plain("degC", 1.0, 1.0, TEMPERATURE) },
    Atom { shift: 459.67, ..plain("degF", 5.0, 9.0, TEMPERATURE) },
    plain("l", 1.0, 1e3, VOLUME),
    plain("L", 1.0, 1e3, VOLUME),
    plain("ml", 1.0, 1e6, VOLUME),
    plain("cc", 1.0, 1e6, VOLUME),
    plain("ccm", 1.0, 1e6, VOLUME),
    plain("N", 1.0, 1.0, FORCE),
    plain("mN", 1.0, 1e3, FORCE),
    plain("kN", 1e3, 1.0, FORCE),
    plain("MN", 1e6, 1.0, FORCE),
    plain("lbf", LBF, 1.0, FORCE),
    pressure("Pa", 1.0, Reference::Unstated),
    pressure("hPa", 1e2, Reference::Unstated),
    pressure("kPa", 1e3, Reference::Unstated),
    pressure("MPa", 1e6, Reference::Unstated),
    pressure("mbar", 1e2, Reference::Unstated),
    pressure("bar", 1e5, Reference::Ambiguous),
    pressure("psi", PSI, Reference::Ambiguous),
    pressure("psia", PSI, Reference::Absolute),
    pressure("bara", 1e5, Reference::Absolute),
    pressure("psig", PSI, Reference::Gauge),
    pressure("barg", 1e5, Reference::Gauge),
    pressure("mbarg", 1e2, Reference::Gauge),
    pressure("kPag", 1e3, Reference::Gauge),
    pressure("MPag", 1e6, Reference::Gauge),
    plain("J", 1.0, 1.0, ENERGY),
    plain("kJ", 1e3, 1.0, ENERGY),
    plain("W", 1.0, 1.0, POWER),
    plain("mW", 1.0, 1e3, POWER),
    plain("kW", 1e3, 1.0, POWER),
];

/// What datasheets call some of them; each can mean nothing else.
const OTHER_NAMES: [(&str, &str); 4] = [("inch", "in"), ("inches", "in"), ("lbs", "lb"), ("lbm", "lb")];

/// A unit by its name. Pressures are read in capitals too ("PSIG", "KPA"), as displays and recorders write them.
pub(crate) fn atom(name: &str) -> Option<&'static Atom> {
    let usual = OTHER_NAMES.iter().find(|(other, _)| *other == name).map_or(name, |(_, usual)| usual);
    let exact = ATOMS.iter().find(|atom| atom.name == usual);
    exact.or_else(|| ATOMS.iter().find(|atom| atom.exponents == PRESSURE && is_same_in_any_case(atom.name, usual)))
}

/// Whether two names differ in nothing but case; a leading m or M, milli or mega, has to stay as it is.
fn is_same_in_any_case(name: &str, written: &str) -> bool {
    name.eq_ignore_ascii_case(written) && (!name.starts_with(['m', 'M']) || name.as_bytes()[0] == written.as_bytes()[0])
}
