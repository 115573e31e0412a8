//! What an axis or a limit counts.

/// A quantity with the unit that its values have, such as a leak area in mm².
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Quantity {
    /// In words, in the singular: "leak area".
    pub name: String,
    /// As it is shown: "mm²"; empty for a share.
    pub unit: String,
}

impl Quantity {
    /// A quantity of this name and unit.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }

    /// The label of an axis: "leak area (mm²)".
    pub(super) fn label(&self) -> String {
        if self.unit.is_empty() { self.name.clone() } else { format!("{} ({})", self.name, self.unit) }
    }

    /// A value with its unit.
    pub(super) fn text(&self, value: f64, decimals: usize) -> String {
        let space = if self.unit.is_empty() { "" } else { " " };
        format!("{value:.decimals$}{space}{}", self.unit)
    }
}
