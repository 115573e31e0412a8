//! What each key of a valve file means, for messages about missing ones.

use valve_model::ParameterId;

/// What the parameter is, with an example of how it is written.
pub(crate) fn meaning(id: ParameterId) -> &'static str {
    match id {
        ParameterId::MovingMass => "the mass of piston, rod and plug, such as \"1.5 kg\"",
        ParameterId::Stroke => "the travel between the stops, such as \"25.4 mm\"",
        ParameterId::PistonArea => "the area of the piston, such as \"31.17 cm2\"",
        ParameterId::DeadVolume => "the chamber volume with the valve fully open, such as \"30 cm3\"",
        ParameterId::ViscousFriction => "the viscous friction, such as \"600 N s/m\"",
        ParameterId::SpringStiffness => "the stiffness of the spring, such as \"16 kN/m\"",
        ParameterId::PreloadCompression => "the spring's compression with the valve fully open, such as \"36 mm\"",
        ParameterId::ContactStiffness => "the stiffness of the stops, such as \"1 MN/m\"",
        ParameterId::StopDamping => "the damping of the stops, such as \"800 N s/m\"",
        ParameterId::RatioOfSpecificHeats => "the gas's ratio of specific heats, such as 1.4",
        ParameterId::SpecificGasConstant => "the specific gas constant, such as \"296.8 J/(kg K)\"",
        ParameterId::Compressibility => "the gas's compressibility factor, such as 1.0",
        ParameterId::SupplyPressure => "the supply pressure, such as \"75 psig\"",
        ParameterId::AmbientPressure => "the absolute pressure of the atmosphere, such as \"101.325 kPa\"",
        ParameterId::Temperature => "the temperature of gas and walls, such as \"293.15 K\"",
        ParameterId::PipeVolume => "the volume between solenoid and port, such as \"40 cm3\"",
        ParameterId::FlowCoefficient => "the flow coefficient that multiplies every orifice area, such as 0.86",
        ParameterId::SolenoidOrificeArea => "the orifice area of the solenoid, such as \"0.5 mm2\"",
        ParameterId::PortOrificeArea => "the orifice area of the cylinder port, such as \"3.5 mm2\"",
    }
}
