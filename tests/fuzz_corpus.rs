//! What the fuzz targets look at, by plain Rust: every seed, and some thousands of inputs made from them by slips of all kinds.

use std::collections::BTreeSet;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// The targets' own code.
#[path = "../fuzz/bodies"]
mod bodies {
    pub mod bundle;
    pub mod campaign;
    pub mod columns;
    pub mod cycle;
    mod drawn;
    pub mod formula;
    pub mod guess;
    pub mod log;
    pub mod message;
    pub mod prior;
    pub mod quantity;
    pub mod table;
    pub mod valve_file;
}

/// Name of a target, what it does with an input, and inputs made from its seeds.
type Target = (&'static str, fn(&[u8]), usize);

const TARGETS: [Target; 12] = [
    ("bundle", bodies::bundle::look, 300),
    ("campaign", bodies::campaign::look, 2000),
    ("columns", bodies::columns::look, 2000),
    ("cycle", bodies::cycle::look, 60),
    ("formula", bodies::formula::look, 5000),
    ("guess", bodies::guess::look, 1000),
    ("log", bodies::log::look, 5000),
    ("message", bodies::message::look, 5000),
    ("prior", bodies::prior::look, 500),
    ("quantity", bodies::quantity::look, 5000),
    ("table", bodies::table::look, 2000),
    ("valve_file", bodies::valve_file::look, 1000),
];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz")
}

fn seeds(target: &str) -> Vec<Vec<u8>> {
    let files = fs::read_dir(folder().join("corpus").join(target)).unwrap_or_else(|error| panic!("{target}: {error}"));
    let mut paths: Vec<PathBuf> = files.map(|entry| entry.expect("readable").path()).collect();
    paths.sort();
    paths.into_iter().map(|path| fs::read(path).expect("readable")).collect()
}

/// Numbers that look random, the same at every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, most: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        usize::try_from(self.0 >> 33).expect("31 bits") % most.max(1)
    }
}

/// Pieces of text that readers stumble over.
const PIECES: [&[u8]; 16] = [
    b"\0",
    b"\xff",
    b"\n",
    b"\r\n",
    b"\"",
    b"-",
    b"1e999",
    b"-0",
    b"NaN",
    b"99999999999999999999",
    b"{",
    b"[",
    b"]]]",
    b"\\u0007",
    b"=",
    b",,,",
];

/// An input with some slips in it: bytes changed, cut out, doubled, put in, or taken from another seed.
fn slipped(dice: &mut Dice, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = seeds[dice.below(seeds.len())].clone();
    for _ in 0..=dice.below(4) {
        let at = dice.below(bytes.len() + 1);
        let end = (at + dice.below(24)).min(bytes.len());
        match dice.below(6) {
            0 if at < bytes.len() => bytes[at] ^= 1 << dice.below(8),
            1 => drop(bytes.drain(at..end)),
            2 => {
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            3 => drop(bytes.splice(at..at, PIECES[dice.below(PIECES.len())].iter().copied())),
            4 => bytes.truncate(at),
            _ => {
                let other = &seeds[dice.below(seeds.len())];
                let from = dice.below(other.len() + 1);
                bytes.splice(at..end, other[from..].iter().copied().take(40));
            }
        }
    }
    bytes
}

#[test]
fn no_input_makes_a_reader_panic() {
    for (name, look, count) in TARGETS {
        let seeds = seeds(name);
        assert!(!seeds.is_empty(), "{name} has no seeds");
        let mut dice = Dice(count as u64);
        let made = (0..count).map(|_| slipped(&mut dice, &seeds)).collect::<Vec<_>>();
        for input in seeds.iter().chain(&made) {
            let passes = catch_unwind(AssertUnwindSafe(|| look(input))).is_ok();
            assert!(passes, "{name} fails for {:?}", String::from_utf8_lossy(input));
        }
    }
}

#[test]
fn every_target_has_seeds_and_is_looked_at_here() {
    let told: BTreeSet<String> = TARGETS.iter().map(|(name, ..)| (*name).to_owned()).collect();
    let names = |folder: &Path| -> BTreeSet<String> {
        let files = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("readable").path());
        files.map(|path| path.file_stem().expect("a name").to_string_lossy().into_owned()).collect()
    };
    assert_eq!(names(&folder().join("fuzz_targets")), told);
    assert_eq!(names(&folder().join("corpus")), told);
    let manifest = fs::read_to_string(folder().join("Cargo.toml")).expect("readable");
    for name in &told {
        assert!(manifest.contains(&format!("path = \"fuzz_targets/{name}.rs\"")), "{name}");
    }
}
