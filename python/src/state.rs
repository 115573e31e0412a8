//! What is kept of valves, as bytes.
//!
//! Eight bytes that say under which tables, settings and version the state was kept, then the state itself (postcard).
//! A state that was kept under others is refused: going on from it would give wrong lives without a word.

use leak_table::TableBundle;
use prognoser::bayes::STATE_VERSION;
use prognoser::{Method, ValveState};
use pyo3::PyResult;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::refused;

/// Length of the mark.
const MARK: usize = 8;

/// What states depend on.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Terms([u8; MARK]);

impl Terms {
    /// Of tables and settings.
    pub fn new(tables: &TableBundle, method: &Method) -> Self {
        let manifest = tables.manifest();
        let of_entries = manifest.entries.iter().flat_map(|entry| {
            [Some(&entry.file), entry.over_conditions.as_ref().map(|over| &over.file)].into_iter().flatten()
        });
        let files = of_entries.chain(manifest.both_leaks.as_ref().map(|both| &both.file));
        let hashes: Vec<&str> = files.map(|file| file.blake3.as_str()).collect();
        let terms = format!("{STATE_VERSION} {} {method:?}", hashes.join(" "));
        let mut mark = [0; MARK];
        mark.copy_from_slice(&blake3::hash(terms.as_bytes()).as_bytes()[..MARK]);
        Self(mark)
    }

    /// The state of one valve, or of all with their names.
    pub fn keep(self, state: &impl Serialize) -> PyResult<Vec<u8>> {
        postcard::to_extend(state, self.0.to_vec()).map_err(refused)
    }

    /// What was kept under the same terms.
    pub fn take_up<T: DeserializeOwned>(self, bytes: &[u8]) -> PyResult<T> {
        match bytes.split_at_checked(MARK) {
            Some((mark, state)) if mark == self.0 => postcard::from_bytes(state)
                .map_err(|error| refused(format!("the state cannot be read ({error}); was it cut off?"))),
            _ => Err(refused(
                "the state was kept with other tables or settings, or by another version; \
                 use those, or begin anew from the log",
            )),
        }
    }
}

/// All valves with their names, by name.
pub type Kept = Vec<(String, ValveState)>;
