//! The name of a degradation in files and output.

use std::fmt;
use std::ops::Deref;
use std::sync::Mutex;

use serde::{Serialize, Serializer};

/// The name of a degradation in files and output, such as "friction"; as cheap to copy as a number.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DegradationId(&'static str);

/// Names that came from files. They stay for the life of the program: there are as many as there are kinds of wear
/// that anybody has made tables of.
static FROM_FILES: Mutex<Vec<&'static str>> = Mutex::new(Vec::new());

impl DegradationId {
    /// A name that the program knows.
    #[must_use]
    pub const fn new(name: &'static str) -> Self {
        Self(name)
    }

    /// A name that was read.
    #[must_use]
    pub fn read(name: &str) -> Self {
        // A list of names is whole even where another thread has panicked.
        let mut names = FROM_FILES.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(known) = names.iter().find(|known| **known == name) {
            return Self(known);
        }
        let kept: &'static str = Box::leak(name.into());
        names.push(kept);
        Self(kept)
    }

    /// The name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.0
    }
}

impl Deref for DegradationId {
    type Target = str;

    fn deref(&self) -> &str {
        self.0
    }
}

impl PartialEq<str> for DegradationId {
    fn eq(&self, other: &str) -> bool {
        self.0 == other
    }
}

impl PartialEq<&str> for DegradationId {
    fn eq(&self, other: &&str) -> bool {
        self.0 == *other
    }
}

impl Serialize for DegradationId {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0)
    }
}

impl fmt::Display for DegradationId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.0)
    }
}

impl fmt::Debug for DegradationId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.0, formatter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_was_read_is_kept_once() {
        let (first, second) = (DegradationId::read("worn-out"), DegradationId::read("worn-out"));
        assert!(std::ptr::eq(first.name(), second.name()));
        assert!(first == DegradationId::new("worn-out") && first == "worn-out");
    }
}
