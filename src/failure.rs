//! How the program ends: its exit codes and what it says when it cannot go on.

use std::fmt;
use std::io::{self, Write};
use std::process::ExitCode;

/// What a command that did its work found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    /// Done.
    Fine,
    /// Done, and the answer is the bad news that the user asked to be told of.
    BadNews,
    /// Somebody asked to stop; what was known by then was told.
    Interrupted,
}

impl Answer {
    /// 0, 1, or what shells give to whoever ends by Ctrl-C.
    pub fn exit_code(self) -> ExitCode {
        match self {
            Self::Fine => ExitCode::SUCCESS,
            Self::BadNews => ExitCode::from(1),
            Self::Interrupted => ExitCode::from(130),
        }
    }
}

/// A refusal with a way out.
#[derive(Debug)]
pub struct Hinted {
    message: String,
    hint: String,
}

impl Hinted {
    /// What is wrong and what to do about it.
    pub fn error(message: impl Into<String>, hint: impl Into<String>) -> anyhow::Error {
        Self { message: message.into(), hint: hint.into() }.into()
    }
}

impl fmt::Display for Hinted {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.message)
    }
}

impl std::error::Error for Hinted {}

/// Says what went wrong on stderr and gives exit code 2; `told` lays text out for stderr. A reader
/// that went away, such as `head`, is no error.
pub fn report(error: &anyhow::Error, told: fn(&str) -> String) -> ExitCode {
    if is_broken_pipe(error) {
        return ExitCode::SUCCESS;
    }
    // Where even stderr is gone, there is nobody left to tell.
    let mut stderr = io::stderr().lock();
    let _ = writeln!(stderr, "{}", told(&format!("error: {}", whole_story(error))));
    if let Some(hint) = error.downcast_ref::<Hinted>() {
        let _ = writeln!(stderr, "{}", told(&format!("hint: {}", hint.hint)));
    }
    ExitCode::from(2)
}

/// The error and its causes in one line. A cause that its error already tells is
/// not said twice.
fn whole_story(error: &anyhow::Error) -> String {
    let mut story = String::new();
    for cause in error.chain() {
        let text = cause.to_string();
        if story.is_empty() {
            story = text;
        } else if !story.contains(&text) {
            story.push_str(": ");
            story.push_str(&text);
        }
    }
    story
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        let io = cause.downcast_ref::<io::Error>().map(io::Error::kind);
        let json = cause.downcast_ref::<serde_json::Error>().and_then(serde_json::Error::io_error_kind);
        io.or(json) == Some(io::ErrorKind::BrokenPipe)
    })
}
