//! A row of a prognosis, for programs.

use prognoser::Prognosis;
use serde::Serialize;

use crate::SCHEMA;

/// What is told after a row of a log, with its version.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Document<'a> {
    schema: u32,
    #[serde(flatten)]
    prognosis: &'a Prognosis,
}

/// A prognosis for programs.
pub fn document(prognosis: &Prognosis) -> Document<'_> {
    Document { schema: SCHEMA, prognosis }
}
