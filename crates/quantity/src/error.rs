//! What can be wrong with a quantity.

/// A quantity that was refused: what was found, and what would be right.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum QuantityError {
    /// The text does not begin with a number.
    #[error("\"{found}\" does not begin with a number; expected {expected}")]
    MissingNumber {
        /// The whole text.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// A comma stands where the decimal point should.
    #[error("\"{found}\" has a decimal comma; write a decimal point, as in {fixed}")]
    DecimalComma {
        /// The whole text.
        found: String,
        /// The text with a point, in quotes; one for gauge and one for absolute where its pressure would not say.
        fixed: String,
    },
    /// Not a finite number, where only a finite one makes sense.
    #[error("\"{found}\" is not a finite number; expected {expected}")]
    NotFinite {
        /// The whole text.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// A number without a unit.
    #[error("\"{found}\" has no unit; expected {expected}")]
    MissingUnit {
        /// The whole text.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// A unit that is not known.
    #[error("unknown unit \"{unit}\"{suggestion}; expected {expected}")]
    UnknownUnit {
        /// The unit as written.
        unit: String,
        /// " (did you mean ...?)", or empty.
        suggestion: String,
        /// What would be right.
        expected: String,
    },
    /// A known unit of another kind of quantity.
    #[error("\"{unit}\" is a unit of {found}{suggestion}; expected {expected}")]
    WrongDimension {
        /// The unit as written.
        unit: String,
        /// What kind of quantity it measures.
        found: String,
        /// " (did you mean ...?)", or empty.
        suggestion: String,
        /// What would be right.
        expected: String,
    },
    /// A gauge pressure where only an absolute one makes sense.
    #[error("\"{unit}\" is a gauge pressure, but this one is absolute; expected psia, bara, kPa, MPa or Pa")]
    GaugePressure {
        /// The unit as written.
        unit: String,
    },
    /// An absolute pressure where a gauge pressure or a difference is wanted.
    #[error(
        "\"{unit}\" is an absolute pressure, but this one counts from the atmosphere or is a difference; \
         expected psig, psi, barg, bar, kPa, MPa or Pa"
    )]
    AbsolutePressure {
        /// The unit as written.
        unit: String,
    },
    /// A pressure that could be either.
    #[error(
        "\"{unit}\" does not say from where it counts; expected {unit}g (gauge, above the atmosphere) or {unit}a (absolute)"
    )]
    AmbiguousPressure {
        /// The unit as written.
        unit: String,
    },
}
