//! Builds the tables of a valve file and says how long it took: `build_tables valve.toml DIR`.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use leak_table::Fault;
use lut_builder::{Options, TableModel, build};
use valve_file::ValveFile;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, directory] = arguments.as_slice() else {
        return Err("expected two arguments: a valve file and a directory to write to".into());
    };
    let file = ValveFile::read(Path::new(file))?;
    let model = TableModel {
        name: file.name(),
        canonical_text: &file.canonical_model(),
        valve: file.valve(),
        schedule: file.schedule(),
        limits: file.limits(),
    };
    let start = Instant::now();
    let built = build(&model, &Options::default(), &|_| {})?;
    println!("{:?} for {} leak areas", start.elapsed(), built.simulated);
    for fault in Fault::ALL {
        println!(
            "{fault}: {} points, {:?}",
            built.bundle.table(fault).points().len(),
            built.bundle.manifest().fault(fault)
        );
    }
    for notice in &built.notices {
        println!("{notice}");
    }
    built.bundle.write(Path::new(directory))?;
    Ok(())
}
