//! A bundle is replaced as one: whoever reads, whenever the writer dies, finds the older one or the new one.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use leak_table::{
    BundleInfo, BundlePart, CycleSchedule, Degradation, Fault, FaultInfo, Limits, MANIFEST_FILE, SeverityPoint,
    SeverityTable, TableBundle,
};

/// The environment variable that tells the writer of the kill test where to write.
const WRITE_INTO: &str = "LEAK_TABLE_TEST_WRITES_INTO";
/// How often the writer is killed.
const KILLS: u32 = 40;
/// The writer has written by then.
const START_UP: Duration = Duration::from_secs(30);

/// Tables of the leaks, and of friction if asked for, whose times depend on a number.
fn bundle(sound_s: f64, friction: bool) -> TableBundle {
    let limits = Limits { close_within_s: 3.0 * sound_s, open_within_s: 6.0 * sound_s };
    let ids = ["atmosphere", "supply", "friction"];
    let part = |id: &&str| {
        let point = |i: u32| {
            let share = f64::from(i) / 40.0;
            let (slow, fast) = (sound_s / (1.0 - 0.9 * share), sound_s / (1.0 + share));
            let (close, open) = if *id == Fault::Supply.name() { (fast, slow) } else { (slow, fast) };
            let open = if *id == "friction" { 1.5 * slow } else { open };
            SeverityPoint { severity: share * 1e-6, close_time_s: Some(close), open_time_s: Some(open) }
        };
        let degradation = Degradation::from_id(id).expect("of the catalogue");
        let table = SeverityTable::new(degradation, (0..=40).map(point).collect()).expect("monotone");
        BundlePart { info: FaultInfo::from_table(&table, &limits), table, over_conditions: None }
    };
    let parts: Vec<BundlePart> = ids.iter().take(if friction { 3 } else { 2 }).map(part).collect();
    let info = BundleInfo {
        valve: "made up".into(),
        model_hash: format!("{sound_s}"),
        schedule: CycleSchedule { close_at_s: 0.0, open_at_s: 40.0, end_s: 120.0 },
        limits,
        reference: None,
    };
    TableBundle::new(info, &parts).expect("limits are inside the tables")
}

fn names(dir: &Path) -> Vec<String> {
    let entries = fs::read_dir(dir).expect("a directory");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("entry").file_name().into_string().expect("text")).collect();
    names.sort();
    names
}

#[test]
fn interrupted_before_the_manifest_it_is_the_older_one_and_the_next_write_tidies_up() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let (older, newer) = (bundle(1.0, false), bundle(2.0, false));
    older.write(dir.path()).expect("written");
    fs::write(dir.path().join(".writing-a1b2c3"), "half").expect("left behind");
    fs::write(dir.path().join(".next-0123456789abcdef-supply.csv"), "severity").expect("left behind");
    fs::write(dir.path().join("notes.txt"), "mine").expect("somebody else's");
    assert_eq!(TableBundle::read(dir.path()).expect("whole"), older);
    newer.write(dir.path()).expect("written");
    assert_eq!(TableBundle::read(dir.path()).expect("whole"), newer);
    assert_eq!(names(dir.path()), ["atmosphere.csv", MANIFEST_FILE, "notes.txt", "supply.csv"]);
}

#[test]
fn interrupted_after_the_manifest_it_is_the_new_one() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let (older, newer, newest) = (bundle(1.0, false), bundle(2.0, false), bundle(3.0, false));
    older.write(dir.path()).expect("written");
    let elsewhere = tempfile::tempdir().expect("a temporary directory");
    newer.write(elsewhere.path()).expect("written");
    // As it is when the manifest has its name and only one of the tables has.
    for name in [MANIFEST_FILE, "atmosphere.csv"] {
        fs::copy(elsewhere.path().join(name), dir.path().join(name)).expect("copied");
    }
    let supply = fs::read(elsewhere.path().join("supply.csv")).expect("readable");
    let digits = &blake3::hash(&supply).to_hex()[..16];
    fs::write(dir.path().join(format!(".next-{digits}-supply.csv")), &supply).expect("written");
    assert_eq!(TableBundle::read(dir.path()).expect("whole"), newer);
    newest.write(dir.path()).expect("written");
    assert_eq!(TableBundle::read(dir.path()).expect("whole"), newest);
    assert_eq!(names(dir.path()), ["atmosphere.csv", MANIFEST_FILE, "supply.csv"]);
}

#[test]
fn tables_that_the_new_set_has_not_are_removed() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    bundle(1.0, true).write(dir.path()).expect("written");
    assert_eq!(names(dir.path()), ["atmosphere.csv", "friction.csv", MANIFEST_FILE, "supply.csv"]);
    bundle(1.0, false).write(dir.path()).expect("written");
    assert_eq!(names(dir.path()), ["atmosphere.csv", MANIFEST_FILE, "supply.csv"]);
    // A file of the same name that is not the table is not ours to remove.
    bundle(1.0, true).write(dir.path()).expect("written");
    fs::write(dir.path().join("friction.csv"), "mine").expect("written");
    bundle(1.0, false).write(dir.path()).expect("written");
    assert_eq!(fs::read_to_string(dir.path().join("friction.csv")).expect("kept"), "mine");
}

/// Does nothing by itself: the test below starts this one alone, in a process that it kills while it writes.
#[test]
fn writer() {
    let Some(dir) = std::env::var_os(WRITE_INTO) else { return };
    let start = Instant::now();
    while start.elapsed() < Duration::from_mins(1) {
        bundle(1.0, true).write(dir.as_ref()).expect("written");
        bundle(2.0, false).write(dir.as_ref()).expect("written");
    }
}

fn start_writer(dir: &Path) -> Child {
    Command::new(std::env::current_exe().expect("this test"))
        .args(["--exact", "writer"])
        .env(WRITE_INTO, dir)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("started")
}

#[test]
fn killed_at_any_instant_it_is_whole() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let sets = [bundle(1.0, true), bundle(2.0, false)];
    sets[0].write(dir.path()).expect("written");
    let look = |when: &str| {
        let read = TableBundle::read(dir.path()).unwrap_or_else(|error| panic!("{when}: {error}"));
        sets.iter().position(|set| *set == read).unwrap_or_else(|| panic!("{when}: neither set"))
    };
    for kill in 0..KILLS {
        let before = look("before");
        let mut writer = start_writer(dir.path());
        let start = Instant::now();
        while look("while it is written") == before && start.elapsed() < START_UP {
            sleep(Duration::from_micros(300));
        }
        assert!(start.elapsed() < START_UP, "the writer writes");
        let lives = Duration::from_micros(u64::from(kill * 7919 % 10_000));
        let start = Instant::now();
        while start.elapsed() < lives {
            look("while it is written");
        }
        writer.kill().expect("killed");
        writer.wait().expect("ended");
        look("after a kill");
    }
    sets[0].write(dir.path()).expect("written");
    assert_eq!(names(dir.path()), ["atmosphere.csv", "friction.csv", MANIFEST_FILE, "supply.csv"]);
}
