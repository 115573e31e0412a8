//! A directory of its own for each test, and the program run in it.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
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
        sandbox.write("log.csv", include_str!("../../data/leaking-valve.csv"));
        sandbox
    }

    /// A directory that has the tables of its valve beside it.
    pub fn with_tables() -> Self {
        let sandbox = Self::new();
        for (name, text) in [
            ("atmosphere.csv", include_str!("../../tables/atmosphere.csv")),
            ("supply.csv", include_str!("../../tables/supply.csv")),
            ("both-leaks.csv", include_str!("../../tables/both-leaks.csv")),
            ("manifest.json", include_str!("../../tables/manifest.json")),
        ] {
            sandbox.write(&format!("tables/{name}"), text);
        }
        sandbox
    }

    /// Runs the program in the directory.
    pub fn valve(&self, arguments: &[&str]) -> Output {
        self.command(arguments).stdin(Stdio::null()).output().expect("the program runs")
    }

    /// Runs the program with a text on stdin.
    pub fn valve_reading(&self, arguments: &[&str], input: &str) -> Output {
        let mut child = self
            .command(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        // A program that refuses its input early may close the pipe.
        let _ = child.stdin.take().expect("a pipe").write_all(input.as_bytes());
        child.wait_with_output().expect("the program ends")
    }

    /// The program, ready to run in the directory.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_valve"));
        command.args(arguments).current_dir(self.dir.path()).env("COLUMNS", "100");
        command
    }

    /// Path of something in the directory.
    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Copies a folder of texts, each name behind `to`.
    pub fn copy(&self, from: &Path, to: &str) {
        for entry in std::fs::read_dir(from).expect("a sample") {
            let path = entry.expect("an entry").path();
            let name = format!("{to}{}", path.file_name().expect("a name").to_string_lossy());
            if path.is_dir() {
                self.copy(&path, &format!("{name}/"));
            } else {
                self.write(&name, &std::fs::read_to_string(&path).expect("a text"));
            }
        }
    }

    /// Copies the recordings of the sticking valve, with the first and the last run in the campaign: a search over these takes
    /// half as long as over all.
    pub fn copy_sticking_valve(&self, to: &str) {
        self.copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("data/sticking-valve"), to);
        let name = format!("{to}campaign.toml");
        let text = self.read(&name);
        let parts: Vec<&str> = text.split("[[run]]").collect();
        let [head, first, .., last] = &parts[..] else { panic!("runs in {text}") };
        self.write(&name, &[*head, *first, *last].join("[[run]]"));
    }

    pub fn write(&self, name: &str, text: &str) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a directory")).expect("a directory in that of the test");
        fs::write(path, text).expect("a file in the directory of the test");
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

/// The same text with every hash as `<hash>`: any change of the model changes it.
pub fn without_hashes(text: &str) -> String {
    let is_hash = |word: &str| word.len() == 64 && word.bytes().all(|byte| byte.is_ascii_hexdigit());
    let words = text.split_inclusive(|letter: char| !letter.is_ascii_alphanumeric()).map(|piece| {
        let word = piece.trim_end_matches(|letter: char| !letter.is_ascii_alphanumeric());
        if is_hash(word) { piece.replace(word, "<hash>") } else { piece.to_owned() }
    });
    words.collect()
}

/// Every verb of the program.
pub fn verbs() -> Vec<&'static str> {
    vec![
        "init",
        "simulate",
        "build-tables",
        "prognose",
        "evaluate",
        "demo",
        "effects",
        "compare",
        "calibrate",
        "explain",
        "adopt",
        "lab",
        "watch",
        "report",
        "revert",
        "completions",
        "man",
    ]
}
