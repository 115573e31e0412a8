//! What is kept between runs: states, the place in the log and the length of the output, all of one instant.

use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom};
use std::path::{Path, PathBuf, absolute};
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context;
use leak_table::TableBundle;
use prognoser::{LogPosition, Method, Prognosis, bayes::STATE_VERSION};
use state_store::{Fingerprint, Progress, Store, Term};

use super::rows::from_broker;
use super::shards::Shards;
use super::writer::Writer;
use crate::cli::PrognoseArgs;
use crate::failure::Hinted;
use crate::output::{self, Outputs};

/// Time between two commits while there is more to read; at the end of what is there, one is made at once.
const INTERVAL: Duration = Duration::from_secs(5);
/// Valves that may have changed since the last commit.
const MOST_TOUCHED: usize = 1 << 15;

/// The states of a call, and its output.
pub struct Keeping {
    store: Arc<Store>,
    /// The same open file as that which is written to, if there is one.
    out: Option<File>,
    progress: Progress,
    committed: Instant,
}

impl Keeping {
    /// Opens or begins the states in a directory, and cuts the output back to where they are; none without `--state`.
    pub fn open(
        args: &PrognoseArgs,
        tables: &TableBundle,
        method: &Method,
        outputs: &mut Outputs,
    ) -> anyhow::Result<Option<Self>> {
        let Some(folder) = &args.state else { return Ok(None) };
        if args.out.is_none() && args.broker.publish.is_none() {
            return Err(Hinted::error(
                "--state: found neither --out nor --publish, expected one: what went to stdout cannot be cut back",
                "add --out lives.jsonl, or with a broker --publish plant/{valve}/prognosis",
            ));
        }
        if matches!(method, Method::Ols) {
            return Err(Hinted::error("--state: found --method ols, expected bayes", "leave --method out"));
        }
        if args.log == Path::new("-") {
            return Err(Hinted::error(
                "--state: found stdin as the log, expected a file: a place in a pipe cannot be found again",
                "write the rows to a file and give its name",
            ));
        }
        let store = Store::open(folder, &terms(args, tables, method)?)?;
        let kept = store.progress()?;
        let Some(target) = &args.out else {
            let progress = kept.unwrap_or_default();
            return Ok(Some(Self { store: Arc::new(store), out: None, progress, committed: Instant::now() }));
        };
        let shown = target.display();
        let cannot = || format!("{shown}: cannot be written");
        let begun = kept.as_ref().is_some_and(|kept| kept.output_bytes > 0);
        let mut progress = kept.clone().unwrap_or_default();
        let out = if begun && target.exists() {
            let out = OpenOptions::new().read(true).write(true).open(target).with_context(cannot)?;
            let found = out.metadata().with_context(cannot)?.len();
            if found < progress.output_bytes {
                return Err(Hinted::error(
                    format!(
                        "{shown}: found {found} bytes, expected at least the {} written so far",
                        progress.output_bytes
                    ),
                    format!(
                        "restore it, or move it away to go on in a new one; or begin anew without {}",
                        folder.display()
                    ),
                ));
            }
            out
        } else {
            if begun {
                output::note(&format!("{shown}: is not there any more; rows go on in a new one"));
            } else if kept.is_none() {
                outputs.claim(target)?;
            }
            (progress.output_bytes, progress.output_rows) = (0, 0);
            // From here on the output is known as this state's.
            store.commit(&progress, &[], std::iter::empty())?;
            let out = File::create(target).with_context(cannot)?;
            sync_folder(target).with_context(cannot)?;
            out
        };
        out.set_len(progress.output_bytes).with_context(cannot)?;
        (&out).seek(SeekFrom::End(0)).with_context(cannot)?;
        Ok(Some(Self { store: Arc::new(store), out: Some(out), progress, committed: Instant::now() }))
    }

    /// The states.
    pub fn store(&self) -> &Arc<Store> {
        &self.store
    }

    /// Where the last run got to in the log.
    pub fn position(&self) -> Option<LogPosition> {
        self.progress.position.clone()
    }

    /// Rows that are in the output, and a file to write more to, if there is one.
    pub fn output(&self) -> io::Result<Option<(u64, File)>> {
        self.out.as_ref().map(|out| Ok((self.progress.output_rows, out.try_clone()?))).transpose()
    }

    /// Keeps what has come if it is time to, or at once; with it the messages that it came in.
    pub fn step(
        &mut self,
        at_once: bool,
        position: Option<LogPosition>,
        taken: &[Fingerprint],
        writer: &mut Writer,
        shards: &mut Shards,
    ) -> anyhow::Result<()> {
        let due = at_once || self.committed.elapsed() >= INTERVAL || shards.touched() >= MOST_TOUCHED;
        if !due || shards.touched() == 0 {
            return Ok(());
        }
        writer.flush()?;
        if let Some(out) = &mut self.out {
            let cannot = "the output cannot be written";
            out.sync_data().context(cannot)?;
            self.progress.output_bytes = out.stream_position().context(cannot)?;
        }
        self.progress.output_rows = writer.rows();
        self.progress.position = position;
        shards.commit(&self.store, &self.progress, taken)?;
        self.committed = Instant::now();
        Ok(())
    }

    /// How all valves stand that were ever seen.
    pub fn lasts(&self) -> anyhow::Result<Vec<Prognosis>> {
        let mut lasts = Vec::new();
        self.store.reader()?.each(|valve, state| lasts.extend(state.last(valve)))?;
        Ok(lasts)
    }
}

/// What states depend on.
fn terms(args: &PrognoseArgs, tables: &TableBundle, method: &Method) -> anyhow::Result<Vec<Term>> {
    let entries = &tables.manifest().entries;
    let files =
        entries.iter().flat_map(|entry| [Some(&entry.file), entry.over_conditions.as_ref().map(|over| &over.file)]);
    let hashes: Vec<&str> = files.flatten().map(|file| &file.blake3[..12]).collect();
    let path = |path: &Path| Ok::<_, io::Error>(absolute(path)?.display().to_string());
    let log = match &args.broker.topic {
        // A broker may move; its readings are the same.
        Some(topic) if from_broker(args) => topic.clone(),
        _ => path(&args.log)?,
    };
    let map = match &args.broker.map {
        Some(map) => {
            blake3::hash(&std::fs::read(map).with_context(|| map.display().to_string())?).to_hex()[..12].to_owned()
        }
        None => String::new(),
    };
    let output = args.out.as_deref().map_or_else(|| Ok(String::new()), path)?;
    let format = format!("{:?}", args.format).to_lowercase();
    let stalled = if args.empty_is_stalled { ", empty times as stalled" } else { "" };
    let term = |name, value| Term { name, value };
    let mut terms = vec![
        term("version", STATE_VERSION.to_string()),
        term("tables", hashes.join(" ")),
        term("log", log),
        term("output", output),
        term("format", format),
        term("options", format!("{method:?}{stalled}")),
    ];
    if from_broker(args) {
        terms.push(term("map", map));
    }
    Ok(terms)
}

/// Makes the name of a new file last, where a system can.
fn sync_folder(target: &Path) -> io::Result<()> {
    let folder: PathBuf = absolute(target)?.parent().map(Path::to_path_buf).unwrap_or_default();
    if cfg!(unix) { File::open(folder)?.sync_all() } else { Ok(()) }
}
