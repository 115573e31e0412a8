//! A directory of its own for each test, and the program run in it.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

/// A directory with the reference valve in it.
pub struct Sandbox {
    dir: TempDir,
}

impl Sandbox {
    pub fn new() -> Self {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let sandbox = Self { dir };
        sandbox.write("valve.toml", include_str!("../../models/testbed.toml"));
        sandbox
    }

    /// Runs the program in the directory.
    pub fn valve(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_valve"))
            .args(arguments)
            .current_dir(self.dir.path())
            .stdin(Stdio::null())
            .env("COLUMNS", "100")
            .output()
            .expect("the program runs")
    }

    pub fn write(&self, name: &str, text: &str) {
        fs::write(self.dir.path().join(name), text).expect("a file in the directory of the test");
    }

    pub fn read(&self, name: &str) -> String {
        String::from_utf8(self.bytes(name)).expect("text")
    }

    pub fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.dir.path().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Names of what is in the directory, in order.
    pub fn names(&self) -> Vec<String> {
        names(self.dir.path())
    }
}

fn names(dir: &Path) -> Vec<String> {
    let entries = fs::read_dir(dir).expect("the directory of the test");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Exit code, stdout and stderr in one text.
pub fn shown(output: &Output) -> String {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let code = output.status.code().map_or_else(|| "none".to_owned(), |code| code.to_string());
    format!("exit code: {code}\n----- stdout\n{}----- stderr\n{}", text(&output.stdout), text(&output.stderr))
}

/// Every verb of the program.
pub fn verbs() -> Vec<&'static str> {
    vec!["simulate", "effects", "revert", "completions", "man"]
}
