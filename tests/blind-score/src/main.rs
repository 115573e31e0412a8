//! Draws campaigns with hidden effects or takes a folder of them, has each explained, and prints how often the
//! answer is right.

use std::collections::VecDeque;
use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use blind_benchmark::draw::{DrawSpec, draw};
use blind_benchmark::world::{Class, Realisms, World, WorldSpec, draw_world};
use blind_score::program::from_program;
use blind_score::{Answer, Scored, Summary, Table, Wanted, answer};
use clap::{Parser, ValueEnum};
use serde_json::{Map, Value};

/// Score the search for missing effects on campaigns drawn by an emulator that shares no code with it.
#[derive(Debug, Parser)]
#[command(name = "blind-score", version)]
struct Arguments {
    /// Where the campaigns are recorded; several worlds give several tables.
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [WorldName::Tidy])]
    world: Vec<WorldName>,
    /// Score this folder of campaigns instead of drawing any: it holds a truth.json by their names, or each of them its own.
    #[arg(long, value_name = "DIR", conflicts_with = "world")]
    folder: Option<PathBuf>,
    /// Only campaigns whose name or kind contains this.
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
    /// Run this built program instead of the library.
    #[arg(long, value_name = "PATH")]
    program: Option<PathBuf>,
    /// Give the program up after so many seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 300.0)]
    limit: f64,
    /// Campaigns that are explained at the same time.
    #[arg(long, value_name = "N", default_value_t = 1)]
    jobs: usize,
    /// Keep the drawn campaigns in this folder.
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
    /// How many campaigns of each world.
    #[arg(long, default_value_t = 60)]
    cases: usize,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Index of the first campaign.
    #[arg(long, default_value_t = 0)]
    first: usize,
    /// Laboratory and plant: just these realisms instead of drawn ones, such as gain=0.01,many-cycles or none.
    #[arg(long, value_delimiter = ',', value_name = "NAME=SIZE,...")]
    realisms: Option<Vec<String>>,
    /// Laboratory and plant: just valves of this kind, one of common, needle, gate, slow, springless.
    #[arg(long, value_parser = class)]
    class: Option<Class>,
    /// Weights of: nothing hidden, one effect, two effects, one outside the catalogue.
    #[arg(long, value_delimiter = ',', value_name = "N,N,N,N", default_values_t = DrawSpec::default().weights)]
    mix: Vec<f64>,
    /// Tidy: record pressures too; by default in half of the campaigns.
    #[arg(long)]
    pressures: Option<bool>,
    /// Tidy: repeat conditions with scatter from stroke to stroke; by default in half of the campaigns.
    #[arg(long)]
    repeats: Option<bool>,
    /// Tidy: let strokes scatter even where none is repeated.
    #[arg(long)]
    scatter: bool,
    /// Tidy: take stroke times only.
    #[arg(long)]
    timings: bool,
    /// Append one line of JSON a campaign to this file.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum WorldName {
    /// An exact model but for what is hidden, and white noise of a stated size.
    Tidy,
    /// A few small realisms at once.
    Laboratory,
    /// Many and larger realisms at once.
    Plant,
}

/// A campaign to be explained.
enum Task {
    /// Drawn from the seed, in a world.
    Drawn(WorldName, usize),
    /// A folder with its entry of the truth.
    Folder(PathBuf, Value),
}

fn class(word: &str) -> Result<Class, String> {
    Class::of_word(word).ok_or_else(|| "one of common, needle, gate, slow, springless is right".to_owned())
}

impl Arguments {
    fn tidy(&self, weights: [f64; 4]) -> DrawSpec {
        DrawSpec {
            weights,
            pressures: self.pressures,
            repeats: self.repeats,
            always_scatters: self.scatter,
            timings_only: self.timings,
            ..DrawSpec::default()
        }
    }

    fn weights(&self) -> Result<[f64; 4]> {
        let weights = <[f64; 4]>::try_from(self.mix.as_slice());
        let weights = weights.ok().with_context(|| format!("--mix needs four weights; got {}", self.mix.len()))?;
        ensure!(
            weights.iter().all(|w| *w >= 0.0) && weights.iter().sum::<f64>() > 0.0,
            "--mix needs four weights, none below zero and one above; got {weights:?}"
        );
        Ok(weights)
    }

    /// What is to be done, table by table.
    fn tasks(&self) -> Result<Vec<(String, VecDeque<Task>)>> {
        let Some(folder) = &self.folder else {
            let indices = self.first..self.first + self.cases;
            let of = |world: &WorldName| {
                let title = format!("{world:?}, seed {}", self.seed).to_lowercase();
                (title, indices.clone().map(|index| Task::Drawn(*world, index)).collect())
            };
            return Ok(self.world.iter().map(of).collect());
        };
        let path = folder.join("truth.json");
        let entries = if path.exists() {
            let Value::Object(entries) = json_of(&path)? else {
                bail!("{}: expected an object with an entry a campaign", path.display());
            };
            entries
        } else {
            own_truths(folder)?
        };
        let chosen = entries.iter().filter(|(name, entry)| {
            name.contains(&self.only) || entry["kind"].as_str().is_some_and(|kind| kind.contains(&self.only))
        });
        let tasks: VecDeque<Task> =
            chosen.map(|(name, entry)| Task::Folder(folder.join(name), entry.clone())).collect();
        ensure!(!tasks.is_empty(), "{}: no campaign has {:?} in its name or kind", path.display(), self.only);
        Ok(vec![(folder.display().to_string(), tasks)])
    }

    fn ask(&self, folder: &Path) -> Result<Answer> {
        match &self.program {
            Some(program) => from_program(program, folder, Duration::from_secs_f64(self.limit)),
            None => answer::from_library(folder),
        }
    }

    fn score(&self, task: Task) -> Result<Scored> {
        let temporary = tempfile::tempdir()?;
        let parent = self.keep.as_deref().unwrap_or_else(|| temporary.path());
        let mut tidy = None;
        let (folder, wanted) = match task {
            Task::Drawn(WorldName::Tidy, index) => {
                let drawn = draw(self.seed, index, &self.tidy(self.weights()?));
                let wanted = Wanted::of_tidy(&drawn.name, &drawn.truth);
                let folder = drawn.write_to(parent)?;
                tidy = Some(drawn.truth);
                (folder, wanted)
            }
            Task::Drawn(world, index) => {
                let world = if world == WorldName::Plant { World::Plant } else { World::Laboratory };
                let realisms = self.realisms.as_deref().map(Realisms::from_words).transpose()?;
                let spec = WorldSpec { world, weights: self.weights()?, class: self.class, realisms };
                let drawn = draw_world(self.seed, index, &spec);
                (drawn.write_to(parent)?, Wanted::from_json(&drawn.name, &drawn.truth))
            }
            Task::Folder(folder, truth) => {
                let name = folder.file_name().unwrap_or_default().to_string_lossy();
                let kind = truth["kind"].as_str().map_or(String::new(), |kind| format!(" {kind}"));
                let wanted = Wanted::from_json(&format!("{name}{kind}"), &truth);
                (folder, wanted)
            }
        };
        let start = Instant::now();
        // A campaign without an answer is a miss, not the end of the others.
        let (answer, failure) = match self.ask(&folder) {
            Ok(answer) => (answer, None),
            Err(error) => (Answer::default(), Some(format!("{error:#}"))),
        };
        Ok(Scored { wanted, tidy, answer, failure, seconds: start.elapsed().as_secs_f64() })
    }

    fn log(&self, scored: &Scored) -> Result<()> {
        let Some(path) = &self.log else { return Ok(()) };
        let mut file =
            OpenOptions::new().create(true).append(true).open(path).with_context(|| path.display().to_string())?;
        writeln!(file, "{}", scored.to_json())?;
        Ok(())
    }
}

fn json_of(path: &Path) -> Result<Value> {
    let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
    serde_json::from_str(&text).with_context(|| path.display().to_string())
}

/// What the campaigns in a folder say of themselves, as `--keep` leaves them.
fn own_truths(folder: &Path) -> Result<Map<String, Value>> {
    let mut entries = Map::new();
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path().join("truth.json");
        if let (true, Some(name)) = (path.exists(), path.parent().and_then(Path::file_name)) {
            entries.insert(name.to_string_lossy().into_owned(), json_of(&path)?);
        }
    }
    ensure!(!entries.is_empty(), "{}: no truth.json, neither here nor in a campaign's folder", folder.display());
    Ok(entries)
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    arguments.weights()?;
    ensure!(arguments.jobs > 0, "--jobs is how many campaigns run at once, 1 or more; got 0");
    ensure!(arguments.limit > 0.0, "--limit is a time in seconds above zero; got {}", arguments.limit);
    for (title, tasks) in arguments.tasks()? {
        let all = worked_off(&arguments, tasks)?;
        println!();
        if all.iter().any(|scored| scored.tidy.is_some()) {
            println!("{}", Summary { all: &all });
        }
        println!("{}", Table { title: &title, all: &all });
    }
    Ok(())
}

/// Scores all tasks on as many threads as wanted, with a line for each as soon as it is done.
fn worked_off(arguments: &Arguments, tasks: VecDeque<Task>) -> Result<Vec<Scored>> {
    let queue = Mutex::new(tasks);
    let done = Mutex::new(Vec::new());
    let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
    let work = || -> Result<()> {
        while let Some(task) = next() {
            let scored = arguments.score(task)?;
            let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
            println!("{}", scored.line());
            arguments.log(&scored)?;
            done.push(scored);
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..arguments.jobs).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| match worker.join() {
            Ok(result) => result,
            Err(_) => bail!("a worker panicked; its message stands above"),
        })
    })?;
    Ok(done.into_inner().unwrap_or_else(PoisonError::into_inner))
}
