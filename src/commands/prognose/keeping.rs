//! What is kept between runs: states, the place in the log and the length of the output, all of one instant.

use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom};
use std::path::{Path, PathBuf, absolute};
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context;
use leak_table::TableBundle;
use prognoser::{LogPosition, Method, Prognosis, bayes::STATE_VERSION};
use state_store::{Progress, Store, Term};

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
    /// The same open file as that which is written to.
    out: File,
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
        let (Some(folder), Some(target)) = (&args.state, &args.out) else { return Ok(None) };
        if matches!(method, Method::Ols) {
            return Err(Hinted::error("--state: found --method ols, expected bayes", "leave --method out"));
        }
        if args.log == Path::new("-") {
            return Err(Hinted::error(
                "--state: found stdin as the log, expected a file: a place in a pipe cannot be found again",
                "write the rows to a file and give its name",
            ));
        }
        let store = Store::open(folder, &terms(args, target, tables, method)?)?;
        let shown = target.display();
        let cannot = || format!("{shown}: cannot be written");
        let kept = store.progress()?;
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
            store.commit(&progress, std::iter::empty())?;
            let out = File::create(target).with_context(cannot)?;
            sync_folder(target).with_context(cannot)?;
            out
        };
        out.set_len(progress.output_bytes).with_context(cannot)?;
        (&out).seek(SeekFrom::End(0)).with_context(cannot)?;
        Ok(Some(Self { store: Arc::new(store), out, progress, committed: Instant::now() }))
    }

    /// The states.
    pub fn store(&self) -> &Arc<Store> {
        &self.store
    }

    /// Where the last run got to in the log.
    pub fn position(&self) -> Option<LogPosition> {
        self.progress.position.clone()
    }

    /// Rows that are in the output, and a file to write more to.
    pub fn output(&self) -> io::Result<(u64, File)> {
        Ok((self.progress.output_rows, self.out.try_clone()?))
    }

    /// Keeps what has come if it is time to, or at once.
    pub fn step(
        &mut self,
        at_once: bool,
        position: Option<LogPosition>,
        writer: &mut Writer,
        shards: &mut Shards,
    ) -> anyhow::Result<()> {
        let due = at_once || self.committed.elapsed() >= INTERVAL || shards.touched() >= MOST_TOUCHED;
        if !due || shards.touched() == 0 {
            return Ok(());
        }
        writer.flush()?;
        self.out.sync_data().context("the output cannot be written")?;
        self.progress.output_bytes = self.out.stream_position().context("the output cannot be written")?;
        self.progress.output_rows = writer.rows();
        self.progress.position = position;
        shards.commit(&self.store, &self.progress)?;
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
fn terms(args: &PrognoseArgs, target: &Path, tables: &TableBundle, method: &Method) -> anyhow::Result<Vec<Term>> {
    let entries = &tables.manifest().entries;
    let files =
        entries.iter().flat_map(|entry| [Some(&entry.file), entry.over_conditions.as_ref().map(|over| &over.file)]);
    let hashes: Vec<&str> = files.flatten().map(|file| &file.blake3[..12]).collect();
    let path = |path: &Path| Ok::<_, io::Error>(absolute(path)?.display().to_string());
    let format = format!("{:?}", args.format).to_lowercase();
    let stalled = if args.empty_is_stalled { ", empty times as stalled" } else { "" };
    let term = |name, value| Term { name, value };
    Ok(vec![
        term("version", STATE_VERSION.to_string()),
        term("tables", hashes.join(" ")),
        term("log", path(&args.log)?),
        term("output", path(target)?),
        term("format", format),
        term("options", format!("{method:?}{stalled}")),
    ])
}

/// Makes the name of a new file last, where a system can.
fn sync_folder(target: &Path) -> io::Result<()> {
    let folder: PathBuf = absolute(target)?.parent().map(Path::to_path_buf).unwrap_or_default();
    if cfg!(unix) { File::open(folder)?.sync_all() } else { Ok(()) }
}
