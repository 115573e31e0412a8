//! How far a log was read, so that another run can go on from there.

use serde::{Deserialize, Serialize};

use super::siblings::{FileId, Known};

/// A place in a log that is followed, with what is needed to find it again after rotations: which file it is in (device,
/// inode, first bytes, the bytes before the place), and which files beside it are older.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LogPosition {
    pub(super) id: FileId,
    pub(super) offset: u64,
    /// Lines before the place.
    pub(super) line: u64,
    pub(super) head: Vec<u8>,
    pub(super) trace: Vec<u8>,
    pub(super) known: Vec<Known>,
    pub(super) header: String,
}
