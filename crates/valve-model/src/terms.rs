//! Which groups of terms the equations of a valve have beside the base model.

/// Which groups of terms the equations of a valve have beside the base model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
#[expect(clippy::struct_excessive_bools, reason = "each is an independent group of terms of the equations")]
pub struct Terms {
    /// Forces on the piston beside those of the base model.
    pub forces: bool,
    /// Dry friction, of whatever kind.
    pub friction: bool,
    /// Flows into the pipe or the chamber beside those of the base model.
    pub flows: bool,
    /// A vent whose law differs from that of the orifices.
    pub vent: bool,
    /// Orifices whose discharge coefficient depends on the pressures.
    pub discharge: bool,
    /// Stops with a damping of their own.
    pub stop_damping: bool,
    /// Gas temperatures as states.
    pub heating: bool,
    /// Supply line pressure as a state.
    pub line: bool,
    /// A spool that travels.
    pub spool: bool,
    /// Custom effects.
    pub custom: bool,
    /// The pipe pressure is measured, not simulated.
    pub prescribed_pipe: bool,
    /// The chamber pressure is measured, not simulated.
    pub prescribed_chamber: bool,
    /// The supply pressure is measured, not constant.
    pub prescribed_supply: bool,
}

/// Groups of terms as bits: for which of them a loop is compiled.
pub mod groups {
    /// Forces on the piston.
    pub const FORCES: u8 = 1;
    /// Friction.
    pub const FRICTION: u8 = 1 << 1;
    /// Gas temperatures.
    pub const HEATING: u8 = 1 << 2;
    /// The supply line.
    pub const LINE: u8 = 1 << 3;
    /// A spool that travels.
    pub const SPOOL: u8 = 1 << 4;
    /// Custom effects.
    pub const CUSTOM: u8 = 1 << 5;
    /// Measured pressures.
    pub const PRESCRIBED: u8 = 1 << 6;
    /// Flows into pipe and chamber, and laws of the vent and of discharge.
    pub const FLOWS: u8 = 1 << 7;
    /// Any of them: asked at run time.
    pub const ANY: u8 = u8::MAX;
}

impl Terms {
    /// The groups in use; none for the base model.
    pub fn groups(self) -> u8 {
        let bit = |group: u8, used: bool| if used { group } else { 0 };
        bit(groups::FORCES, self.forces)
            | bit(groups::FRICTION, self.friction)
            | bit(groups::FLOWS, self.flows || self.vent || self.discharge)
            | bit(groups::HEATING, self.heating)
            | bit(groups::LINE, self.line)
            | bit(groups::SPOOL, self.spool)
            | bit(groups::CUSTOM, self.custom)
            | bit(groups::PRESCRIBED, self.is_prescribed())
    }

    /// Whether any pressure is measured.
    pub fn is_prescribed(self) -> bool {
        self.prescribed_pipe || self.prescribed_chamber || self.prescribed_supply
    }
}
