//! A log that grows, is rotated, cut back, moved away and read by one run after the other: every row once, in order.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime};

use prognoser::{FollowOptions, Followed, FollowedLog, LogPosition};
use proptest::prelude::*;
use tempfile::TempDir;

const HEADER: &str = "valve,cycle,close_time_s,open_time_s\n";

/// Who writes the log, and what has been done to it.
struct Writer {
    dir: TempDir,
    path: PathBuf,
    rotations: u64,
    clock: SystemTime,
}

impl Writer {
    fn new() -> Self {
        let dir = tempfile::tempdir().expect("a directory");
        let path = dir.path().join("log.csv");
        let writer = Self { dir, path, rotations: 0, clock: SystemTime::UNIX_EPOCH + Duration::from_hours(500_000) };
        fs::write(&writer.path, HEADER).expect("written");
        writer
    }

    fn write(&mut self, bytes: &str) {
        let mut file = OpenOptions::new().append(true).create(true).open(&self.path).expect("opens");
        file.write_all(bytes.as_bytes()).expect("written");
        // Faster than a file system's clock ticks, the tests give the times themselves.
        self.clock += Duration::from_millis(1);
        file.set_modified(self.clock).expect("set");
    }

    /// Renames as logrotate does: .1 is the newest.
    fn rotate_by_number(&mut self) {
        let numbered = |number: u64| self.dir.path().join(format!("log.csv.{number}"));
        for number in (1..=self.rotations).rev().filter(|number| numbered(*number).exists()) {
            fs::rename(numbered(number), numbered(number + 1)).expect("renamed");
        }
        fs::rename(&self.path, numbered(1)).expect("renamed");
        self.rotations += 1;
    }

    fn rotate_by_date(&mut self) {
        fs::rename(&self.path, self.dated()).expect("renamed");
        self.rotations += 1;
    }

    fn copy_and_cut(&mut self) {
        let copy = self.dated();
        fs::copy(&self.path, &copy).expect("copied");
        self.clock += Duration::from_millis(1);
        File::options().write(true).open(&copy).and_then(|file| file.set_modified(self.clock)).expect("set");
        File::options().write(true).open(&self.path).and_then(|file| file.set_len(0)).expect("cut");
        self.rotations += 1;
    }

    fn dated(&self) -> PathBuf {
        self.dir.path().join(format!("log.csv-2026{:04}", self.rotations))
    }

    fn reader(&self, from: Option<LogPosition>) -> Reader {
        let stop = Arc::new(AtomicBool::new(false));
        let options =
            FollowOptions { forever: true, poll: Duration::ZERO, stop: Arc::clone(&stop), empty_is_stalled: false };
        Reader { log: FollowedLog::open(&self.path, from, options).expect("a log"), stop, said: Vec::new() }
    }
}

struct Reader {
    log: FollowedLog,
    stop: Arc<AtomicBool>,
    said: Vec<String>,
}

impl Reader {
    /// The cycles of the next rows, at most so many; fewer if there are no more for now.
    fn take(&mut self, most: usize) -> Vec<u64> {
        let mut cycles = Vec::new();
        while cycles.len() < most {
            match self.log.next().expect("is readable") {
                Followed::Row(row) => cycles.push(row.reading.cycle),
                Followed::Skipped(error) => self.said.push(error.to_string()),
                Followed::Notice(notice) => self.said.push(notice.to_string()),
                Followed::Idle | Followed::End => break,
            }
        }
        cycles
    }

    fn all(&mut self) -> Vec<u64> {
        // A file is changed over to in one call and read in the next.
        (0..2).flat_map(|_| self.take(usize::MAX)).collect()
    }
}

fn row(cycle: u64) -> String {
    format!("V,{cycle},1.{cycle:05},2.{cycle:05}\n")
}

fn rows(cycles: std::ops::Range<u64>) -> String {
    cycles.map(row).collect()
}

#[test]
fn a_line_in_two_halves_is_one_row() {
    let mut writer = Writer::new();
    let mut reader = writer.reader(None);
    writer.write("V,0,1.0");
    assert_eq!(reader.all(), [0; 0]);
    writer.write("4,2.1\nV,1,");
    assert_eq!(reader.all(), [0]);
    writer.write("1.05,2.2\n");
    assert_eq!(reader.all(), [1]);
    assert_eq!(reader.said, [""; 0]);
    reader.stop.store(true, Ordering::Relaxed);
    assert!(matches!(reader.log.next(), Ok(Followed::End)));
}

#[test]
fn rotations_lose_nothing_and_double_nothing() {
    for rotate in [Writer::rotate_by_number, Writer::rotate_by_date, Writer::copy_and_cut] {
        let mut writer = Writer::new();
        let mut reader = writer.reader(None);
        writer.write(&rows(0..3));
        assert_eq!(reader.all(), [0, 1, 2]);
        writer.write(&rows(3..5));
        writer.write("V,5,1.");
        rotate(&mut writer);
        writer.write("5,2.5\n");
        writer.write(&rows(6..8));
        assert_eq!(reader.all(), [3, 4, 5, 6, 7]);
        rotate(&mut writer);
        assert_eq!(reader.all(), [0; 0]);
        writer.write(&format!("{HEADER}{}", rows(8..10)));
        assert_eq!(reader.all(), [8, 9]);
        assert_eq!(reader.log.position().clone(), reader.log.position());
    }
}

#[test]
fn a_row_written_late_to_the_old_file_counts() {
    let mut writer = Writer::new();
    let mut reader = writer.reader(None);
    writer.write(&rows(0..2));
    assert_eq!(reader.all(), [0, 1]);
    writer.rotate_by_number();
    writer.write(HEADER);
    assert_eq!(reader.all(), [0; 0]);
    let mut late = OpenOptions::new().append(true).open(writer.dir.path().join("log.csv.1")).expect("opens");
    late.write_all(row(2).as_bytes()).expect("written");
    assert_eq!(reader.all(), [2]);
    writer.write(&row(3));
    assert_eq!(reader.all(), [3]);
}

#[test]
fn a_log_that_vanishes_comes_back_and_says_so() {
    let mut writer = Writer::new();
    let mut reader = writer.reader(None);
    writer.write(&rows(0..2));
    assert_eq!(reader.all(), [0, 1]);
    fs::remove_file(&writer.path).expect("removed");
    assert_eq!(reader.all(), [0; 0]);
    writer.write(&format!("{HEADER}{}", rows(2..3)));
    assert_eq!(reader.all(), [2]);
    assert_eq!(
        reader.said,
        ["it is gone; reading goes on when it is back", "another file has taken its name; reading goes on there"]
    );
}

#[test]
fn a_log_that_is_cut_without_a_copy_is_read_from_its_beginning() {
    let mut writer = Writer::new();
    let mut reader = writer.reader(None);
    writer.write(&rows(0..9));
    assert_eq!(reader.all().len(), 9);
    File::options().write(true).open(&writer.path).and_then(|file| file.set_len(0)).expect("cut");
    writer.write(&format!("{HEADER}{}", rows(9..99)));
    assert_eq!(reader.all().first(), Some(&9), "longer than before, and cut all the same");
    assert!(reader.said[0].contains("became shorter"), "{:?}", reader.said);
}

#[test]
fn a_log_that_an_editor_writes_anew_goes_on() {
    let mut writer = Writer::new();
    let mut reader = writer.reader(None);
    writer.write(&rows(0..30));
    assert_eq!(reader.all().len(), 30);
    fs::copy(&writer.path, writer.dir.path().join("log.csv~")).expect("copied");
    let anew = writer.dir.path().join("new");
    fs::write(&anew, format!("{HEADER}{}", rows(0..32))).expect("written");
    fs::rename(anew, &writer.path).expect("renamed");
    assert_eq!(reader.all(), [30, 31]);
}

#[test]
fn what_is_no_row_is_skipped_by_name() {
    let mut writer = Writer::new();
    let mut reader = writer.reader(None);
    writer.write(&format!("V,0,1,2\nV,1,fast,2\n{}\nV,2\n\n# a, b\n#7,3,1,2\n", "9".repeat(200_000)));
    assert_eq!(reader.all(), [0, 3]);
    let said: Vec<&str> = reader.said.iter().map(|said| said.split("log.csv").last().unwrap_or_default()).collect();
    assert!(said[0].starts_with(":3: close_time_s: found \"fast\""), "{said:?}");
    assert!(said[1].starts_with(":4: found a line of more than 65536 bytes"), "{said:?}");
    assert!(said[2].starts_with(":5: found 2 fields, expected 4"), "{said:?}");
    writer.write("V,4,1");
    reader.all();
    writer.rotate_by_number();
    writer.write(&format!("{HEADER}{}", row(5)));
    assert_eq!(reader.all(), [5]);
    let unfinished = |said: &String| said.contains("\"V,4,1\" without an end of line");
    assert!(reader.said.iter().any(unfinished), "{:?}", reader.said);
}

#[test]
fn a_place_whose_file_is_gone_is_said() {
    let mut writer = Writer::new();
    let mut reader = writer.reader(None);
    writer.write(&rows(0..3));
    assert_eq!(reader.all(), [0, 1, 2]);
    let place = reader.log.position();
    drop(reader);
    fs::remove_file(&writer.path).expect("removed");
    writer.write(&format!("{HEADER}{}", rows(3..5)));
    let mut reader = writer.reader(Some(place));
    assert_eq!(reader.all(), [3, 4]);
    assert!(
        reader.said[0].starts_with("the file that was read up to line 4 is not here any more"),
        "{:?}",
        reader.said
    );
}

#[test]
fn a_clock_that_jumps_loses_and_doubles_nothing() {
    let day = Duration::from_hours(24);
    for rotate in [Writer::rotate_by_number, Writer::rotate_by_date, Writer::copy_and_cut] {
        let mut writer = Writer::new();
        let mut reader = writer.reader(None);
        for cycle in 0..12 {
            writer.write(&row(cycle));
            assert_eq!(reader.all(), [cycle]);
            match cycle % 4 {
                0 => writer.clock -= day,
                1 => rotate(&mut writer),
                2 => writer.clock += 3 * day,
                _ => {
                    let place = reader.log.position();
                    reader = writer.reader(Some(place));
                }
            }
        }
        assert_eq!(reader.all(), [0; 0]);
    }
}

/// What is done to a log.
#[derive(Debug, Clone, Copy)]
enum Deed {
    Write(usize),
    /// Up to the end of a line, which itself is left out.
    WriteLines(usize),
    Rotate(usize),
    Read(usize),
    Restart,
}

fn deeds() -> impl Strategy<Value = Vec<Deed>> {
    let deed = prop_oneof![
        5 => (1_usize..400).prop_map(Deed::Write),
        3 => (1_usize..9).prop_map(Deed::WriteLines),
        2 => (0_usize..3).prop_map(Deed::Rotate),
        4 => (0_usize..30).prop_map(Deed::Read),
        2 => Just(Deed::Restart),
    ];
    prop::collection::vec(deed, 1..60)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// Bytes written in any pieces, files rotated in any way at any instant, readers that stop anywhere and are replaced
    /// by others: all rows, in order, once.
    #[test]
    fn whatever_is_done_to_a_log_every_row_is_read_once(deeds in deeds()) {
        let mut writer = Writer::new();
        let text = rows(0..3000);
        let mut written = 0;
        // Without a row in it, a log tells nothing of which file it is.
        let first = row(0).len();
        writer.write(&text[..first]);
        written += first;
        let mut reader = writer.reader(None);
        let mut found = reader.take(1);
        for deed in deeds {
            match deed {
                Deed::Write(count) => {
                    let end = (written + count).min(text.len());
                    writer.write(&text[written..end]);
                    written = end;
                }
                Deed::WriteLines(count) => {
                    let ends = text[written + 1..].match_indices('\n').map(|(at, _)| written + 1 + at);
                    let end = ends.take(count).last().unwrap_or(text.len());
                    writer.write(&text[written..end]);
                    written = end;
                }
                Deed::Rotate(_) if fs::metadata(&writer.path).map_or(0, |log| log.len()) == 0 => {}
                Deed::Rotate(0) => writer.rotate_by_number(),
                Deed::Rotate(1) => writer.rotate_by_date(),
                Deed::Rotate(_) => writer.copy_and_cut(),
                Deed::Read(most) => found.extend(reader.take(most)),
                Deed::Restart if writer.path.exists() => {
                    let place = reader.log.position();
                    let kept = serde_json::to_string(&place).expect("is JSON");
                    reader = writer.reader(Some(serde_json::from_str(&kept).expect("was just written")));
                }
                Deed::Restart => {}
            }
        }
        let end = (written + 1000).min(text.len());
        let end = text[..end].rfind('\n').map_or(0, |end| end + 1).max(written);
        writer.write(&text[written..end]);
        found.extend(reader.all());
        let expected: Vec<u64> = (0..text[..end].matches('\n').count() as u64).collect();
        prop_assert_eq!(found, expected, "{:?}", reader.said);
    }
}

#[test]
fn a_log_that_is_not_there_or_has_no_header_is_refused() {
    let options = FollowOptions {
        forever: false,
        poll: Duration::ZERO,
        stop: Arc::new(AtomicBool::new(false)),
        empty_is_stalled: false,
    };
    let refused = |path: &Path| FollowedLog::open(path, None, options.clone()).expect_err("is refused").to_string();
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("log.csv");
    assert!(refused(&path).contains("No such file"), "{}", refused(&path));
    fs::write(&path, "").expect("written");
    assert!(refused(&path).contains("found an empty file"), "{}", refused(&path));
    fs::write(&path, "a,b\n1,2\n").expect("written");
    assert!(refused(&path).contains("found columns \"a,b\""), "{}", refused(&path));
}
