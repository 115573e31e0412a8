//! Builds the tables of a valve file and says how long it took:
//! `build_tables valve.toml DIR [all] [LOW_PSIG HIGH_PSIG [LOW_K HIGH_K]]`.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use leak_table::ConditionRange;
use lut_builder::{Options, Request, TableModel, Wear, build_request};
use valve_file::ValveFile;

/// One psi in Pa.
const PA_PER_PSI: f64 = 6894.757;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, directory, rest @ ..] = arguments.as_slice() else {
        return Err(
            "expected a valve file, a directory to write to, and if wanted: all, psig from to, K from to".into()
        );
    };
    let file = ValveFile::read(Path::new(file))?;
    let all = rest.first().is_some_and(|word| word == "all");
    let numbers: Vec<f64> = rest.iter().skip(usize::from(all)).map(|n| n.parse()).collect::<Result<_, _>>()?;
    let parameters = file.valve().parameters();
    let conditions = numbers.first_chunk().map(|[low, high]| {
        let absolute = |psig: f64| psig * PA_PER_PSI + parameters.ambient_pressure_pa;
        let temperature_k = match numbers[2..] {
            [cold, warm] => (cold, warm),
            _ => (parameters.temperature_k, parameters.temperature_k),
        };
        ConditionRange { supply_pressure_pa: (absolute(*low), absolute(*high)), temperature_k }
    });
    let model = TableModel {
        name: file.name(),
        canonical_text: &file.canonical_model(),
        valve: file.valve(),
        schedule: file.schedule(),
        limits: file.limits(),
    };
    let request = Request { wears: if all { Wear::catalogue() } else { Wear::leaks() }, conditions, both_leaks: true };
    let start = Instant::now();
    let built = build_request(&model, &request, &Options::default(), &|_| {})?;
    println!("{:?} for {} severities", start.elapsed(), built.simulated);
    for entry in built.bundle.entries() {
        let (id, points, limit) = (&entry.degradation.id, entry.table.points().len(), entry.limit_severity);
        println!("{id}: {points} points, limit {}, {:?}", entry.degradation.severity.text(limit), entry.info);
        if let Some(table) = entry.over_conditions {
            let (pressures, temperatures) = (table.pressures_pa().len(), table.temperatures_k().len());
            println!(
                "    {pressures} pressures, {temperatures} temperatures, {} severities, {:?} at {} places",
                table.shares().len(),
                table.info().interpolation_error,
                table.info().checked
            );
        }
    }
    for notice in &built.notices {
        println!("{notice}");
    }
    built.bundle.write(Path::new(directory))?;
    Ok(())
}
