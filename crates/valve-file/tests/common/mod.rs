//! A valve of round numbers for the tests.

/// The text of a whole valve file with comments.
pub const VALVE: &str = r#"# A valve for tests.
name = "test valve"

[actuator]
moving_mass = "1.2 kg"
stroke = "20 mm"
piston_area = "25 cm2"
dead_volume = "30 cm3"            # with the valve fully open
viscous_friction = '500 N s/m'

[spring]
stiffness = "12 kN/m"
preload_compression = "30 mm"

[stops]
contact_stiffness = "1 MN/m"

[gas]
ratio_of_specific_heats = 1.40
specific_gas_constant = "287 J/(kg K)"
compressibility = 1

[pneumatics]
supply_pressure = "75 psig"       # at the manifold
ambient_pressure = "100 kPa"
temperature = "20 degC"
pipe_volume = "40 cm3"
flow_coefficient = 0.86
solenoid_orifice_area = "0.5 mm2"
port_orifice_area = "3.5 mm2"

[cycle]
close_at = "0 s"
open_at = "4 s"
end = "12 s"

[limits]
close_within = "3 s"
open_within = "6 s"

[tolerance]
"actuator.viscous_friction" = 0.20
"spring.stiffness" = 0.02
"#;
