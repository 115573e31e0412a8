//! Draws campaigns with hidden effects and writes them as folders.

use std::path::PathBuf;
use std::process::ExitCode;

use blind_benchmark::campaign::WriteError;
use blind_benchmark::draw::{DrawSpec, POSITION_NOISES_M, draw};
use blind_benchmark::hidden::Bristles;
use blind_benchmark::world::{Class, Realisms, World, WorldSpec, draw_world, write_truths};
use clap::{Parser, ValueEnum};
use rayon::prelude::*;

/// Draw measurement campaigns with hidden effects, each with its truth beside it.
#[derive(Debug, Parser)]
#[command(name = "blind-benchmark", version)]
struct Arguments {
    /// Folder that gets one folder a campaign.
    #[arg(long, value_name = "DIR")]
    generate: PathBuf,
    /// How many campaigns.
    #[arg(long, default_value_t = 60)]
    cases: usize,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Index of the first campaign.
    #[arg(long, default_value_t = 0)]
    first: usize,
    /// Where the campaigns are recorded.
    #[arg(long, value_enum, default_value_t = WorldName::Tidy)]
    world: WorldName,
    /// Laboratory and plant: just these realisms instead of drawn ones, such as gain=0.01,many-cycles or none.
    #[arg(long, value_delimiter = ',', value_name = "NAME=SIZE,...")]
    realisms: Option<Vec<String>>,
    /// Laboratory and plant: just valves of this kind, one of common, needle, gate, slow, springless.
    #[arg(long, value_parser = class)]
    class: Option<Class>,
    /// Weights of: nothing hidden, one effect, two effects, one outside the catalogue.
    #[arg(long, value_delimiter = ',', value_name = "N,N,N,N", default_values_t = DrawSpec::default().weights)]
    mix: Vec<f64>,
    /// Record pressures too; by default in half of the campaigns.
    #[arg(long)]
    pressures: Option<bool>,
    /// Repeat conditions with scatter from stroke to stroke; by default in half of the campaigns.
    #[arg(long)]
    repeats: Option<bool>,
    /// Let strokes scatter even where none is repeated.
    #[arg(long)]
    scatter: bool,
    /// Position noise in millimetres; by default one of 0.03, 0.1 and 0.3.
    #[arg(long, value_name = "MM")]
    noise: Option<f64>,
    /// Share of campaigns on the testbed valve.
    #[arg(long, default_value_t = DrawSpec::default().testbed_share)]
    testbed_share: f64,
    /// Take stroke times only.
    #[arg(long)]
    timings: bool,
    /// How dry friction gives before it slides.
    #[arg(long, value_enum, default_value_t = Friction::Compliant)]
    friction: Friction,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum WorldName {
    /// An exact model but for what is hidden, and white noise of a stated size; all other options are for this one.
    Tidy,
    /// A few small realisms of instruments, conditions, records and laws at once.
    Laboratory,
    /// Many and larger realisms at once.
    Plant,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Friction {
    Compliant,
    Stiff,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let Ok(weights) = <[f64; 4]>::try_from(arguments.mix.as_slice()) else {
        eprintln!("error: --mix needs four weights such as 1,2,1,1; got {}", arguments.mix.len());
        return ExitCode::from(2);
    };
    if weights.iter().any(|w| w.is_nan() || *w < 0.0) || weights.iter().sum::<f64>() <= 0.0 {
        eprintln!("error: --mix needs four weights, none below zero and one above; got {weights:?}");
        return ExitCode::from(2);
    }
    if !(0.0..=1.0).contains(&arguments.testbed_share) {
        eprintln!("error: --testbed-share is a share from 0 to 1; got {}", arguments.testbed_share);
        return ExitCode::from(2);
    }
    if arguments.noise.is_some_and(|mm| mm.is_nan() || mm <= 0.0) {
        let usual = POSITION_NOISES_M.map(|m| m * 1e3);
        eprintln!("error: --noise is one sigma in mm and above zero, for instance one of {usual:?}");
        return ExitCode::from(2);
    }
    let indices = arguments.first..arguments.first + arguments.cases;
    let world = match arguments.world {
        WorldName::Tidy => World::Tidy,
        WorldName::Laboratory => World::Laboratory,
        WorldName::Plant => World::Plant,
    };
    if world != World::Tidy {
        let realisms = match arguments.realisms.as_deref().map(Realisms::from_words).transpose() {
            Ok(realisms) => realisms,
            Err(error) => {
                eprintln!("error: --realisms: {error}");
                return ExitCode::from(2);
            }
        };
        let spec = WorldSpec { world, weights, class: arguments.class, realisms };
        let written: Result<Vec<_>, _> = indices
            .into_par_iter()
            .map(|index| {
                let recording = draw_world(arguments.seed, index, &spec);
                let folder = recording.write_to(&arguments.generate)?;
                Ok((folder, (recording.name, recording.truth)))
            })
            .collect();
        return finished(written.and_then(|all| {
            let (folders, truths): (Vec<_>, Vec<_>) = all.into_iter().unzip();
            write_truths(&truths, &arguments.generate)?;
            Ok(folders)
        }));
    }
    let spec = DrawSpec {
        weights,
        pressures: arguments.pressures,
        repeats: arguments.repeats,
        always_scatters: arguments.scatter,
        position_noise_m: arguments.noise.map(|mm| mm * 1e-3),
        testbed_share: arguments.testbed_share,
        timings_only: arguments.timings,
        bristles: match arguments.friction {
            Friction::Compliant => Bristles::Compliant,
            Friction::Stiff => Bristles::Stiff,
        },
        ..DrawSpec::default()
    };
    let written: Result<Vec<PathBuf>, _> =
        indices.into_par_iter().map(|index| draw(arguments.seed, index, &spec).write_to(&arguments.generate)).collect();
    finished(written)
}

fn class(word: &str) -> Result<Class, String> {
    Class::of_word(word).ok_or_else(|| "one of common, needle, gate, slow, springless is right".to_owned())
}

fn finished(written: Result<Vec<PathBuf>, WriteError>) -> ExitCode {
    match written {
        Ok(folders) => {
            for folder in folders {
                println!("{}", folder.display());
            }
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}
