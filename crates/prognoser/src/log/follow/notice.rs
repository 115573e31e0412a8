//! What can happen to a file that is followed.

use std::fmt;

/// Something that happened to a file that is followed, and does no harm or was made good as far as it can be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FollowNotice {
    /// Another file took the log's name; it is read on in that.
    Rotated,
    /// The log became shorter; it is read from its beginning.
    CutBack,
    /// The log is gone; it is read on once it is back.
    Vanished,
    /// The file that was read up to here by an earlier run is not there any more.
    Lost {
        /// The last line that was read of it.
        line: u64,
    },
}

impl fmt::Display for FollowNotice {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rotated => write!(formatter, "another file has taken its name; reading goes on there"),
            Self::CutBack => write!(
                formatter,
                "it became shorter and is read from its beginning; rows that were cut off before they were read are lost, \
                 if there were any"
            ),
            Self::Vanished => write!(formatter, "it is gone; reading goes on when it is back"),
            Self::Lost { line } => write!(
                formatter,
                "the file that was read up to line {line} is not here any more; rows behind that line are lost, if there \
                 were any; reading goes on with the oldest file that came after it"
            ),
        }
    }
}
