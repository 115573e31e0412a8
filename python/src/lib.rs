//! The Python package: every class holds what a crate of the project made, and hands it on.
//!
//! Long work runs without Python's lock, on all cores. Documents are the program's, as dictionaries; rows of a log go in
//! and out through Arrow's C interface.

mod answer;
mod batch;
mod campaign;
mod error;
mod evaluate;
mod figure;
mod frame;
mod method;
mod prognose;
mod row;
mod simulation;
mod state;
mod tables;
mod valve;

use pyo3::pymodule;

/// Physics-based simulation, identification and prognosis of pneumatic valves.
#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::answer::Answer;
    #[pymodule_export]
    use crate::batch::Strokes;
    #[pymodule_export]
    use crate::campaign::Campaign;
    #[pymodule_export]
    use crate::error::ValveError;
    #[pymodule_export]
    use crate::evaluate::evaluate;
    #[pymodule_export]
    use crate::figure::Figure;
    #[pymodule_export]
    use crate::frame::Rows;
    #[pymodule_export]
    use crate::prognose::Prognoser;
    #[pymodule_export]
    use crate::simulation::Simulation;
    #[pymodule_export]
    use crate::tables::Tables;
    #[pymodule_export]
    use crate::valve::ValveFile;
    #[pymodule_export]
    use crate::valve::leaking_log;
}
