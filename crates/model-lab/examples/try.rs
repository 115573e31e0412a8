use std::path::Path;
use std::time::Instant;
use identify::{FitOptions, Stop, fit, Fit, Problem};
use identify::held_out::{folds, held_out};
use model_lab::data::valve_facts;
use model_lab::identification::*;
use model_lab::{Dataset, Space};
use valve_file::ValveFile;
use valve_model::EffectKind;

fn report(name: &str, p: &ValveProblem, f: &Fit, base: f64, t: f64) {
    let rec = p.records();
    let (mut s, mut n) = (0.0, 0.0);
    for (r, res) in rec.iter().zip(&f.linear.residual) { for (_, v) in r.series[0].rows.iter().zip(res) { s += v * v; n += 1.0; } }
    let rms = (s / n as f64).sqrt() * 1e3;
    let g = f.noise.groups[0];
    let ho = held_out(p, f, &folds(p)).map(|h| { let q = |v: &Vec<Vec<f64>>| { let (mut s, mut n) = (0.0, 0.0); for (r, res) in rec.iter().zip(v) { for (_, v) in r.series[0].rows.iter().zip(res) { s += v * v; n += 1.0; } } (s / n as f64).sqrt() * 1e3 }; (q(&h.at_mean), q(&h.own)) });
    let eff: Vec<String> = p.space.effects().iter().flat_map(|e| p.space.effect_values(e.kind(), &f.u).unwrap()).map(|v| format!("{v:.4e}")).collect();
    println!("{name:22} ev {:10.1} rms {rms:8.4} ho {:?} m {:.2} a {:.1e} t {:.3} conv {} left {:.2} d {} p {} {:.2}s held {} {}", f.log_evidence - base, ho.map(|h| (format!("{:.4}", h.0), format!("{:.4}", h.1))), g.multiplier, g.discrepancy, g.time_s, f.converged, f.promised, f.derivatives, f.predictions, t, f.held.iter().filter(|h| **h).count(), eff.join(" "));
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let folder = Path::new(&args[1]);
    let only: Vec<&str> = args.get(2).map(|a| a.split(',').collect()).unwrap_or_default();
    let file = ValveFile::read(&folder.join("valve.toml")).unwrap();
    let campaign = campaign::Campaign::read(&folder.join("campaign.toml"), &valve_facts(file.valve())).unwrap();
    let data = Dataset::new(&campaign, file.schedule());
    let fid = if std::env::var("HIGH").is_ok() { Fidelity::High } else { Fidelity::Low };
    let p = file.valve().parameters();
    let setup = Setup::new(&campaign, &data, p.stroke_m, p.ambient_pressure_pa, fid);
    let space = if file.tolerances().is_empty() { Space::new(file.valve(), &problem::DEFAULT_TOLERANCES.map(|(parameter, relative_sigma)| valve_file::Tolerance { parameter, relative_sigma })) } else { Space::tolerated(&file) };
    let nuis = nuisances(&setup, file.valve().parameters(), &NuisanceSizes::default(), &campaign.uncertainty, space.coordinates.iter().any(|c| c.target == model_lab::space::Target::Base(valve_model::ParameterId::PistonArea)));
    let stop = Stop::new();
    println!("rows {:?} groups {:?}", setup.records.iter().map(|r| r.row_count()).collect::<Vec<_>>(), setup.groups[0]);
    let options = FitOptions::new(setup.groups.clone());
    let base = ValveProblem::new(&setup, space.clone(), &nuis, &stop);
    let t = Instant::now();
    let f0 = fit(&base, &base.start(), &options).unwrap();
    report("base", &base, &f0, f0.log_evidence, t.elapsed().as_secs_f64());
    if std::env::var("NUIS").is_ok() {
        for (e, u) in nuis.iter().zip(&f0.u[space.coordinates.len()..]) { println!("{:?} {:.2} sd = {:.3e}", e.nuisance, u, u * e.size); }
        println!("theta {:?}", &f0.u[..space.coordinates.len()]);
    }
    for kind in EffectKind::ALL {
        if !only.is_empty() && !only.contains(&kind.id()) { continue; }
        let t = Instant::now();
        let problem = ValveProblem::new(&setup, space.with_effect(*kind), &nuis, &stop);
        if let Some(f) = fit(&problem, &problem.start(), &options) {
            report(kind.id(), &problem, &f, f0.log_evidence, t.elapsed().as_secs_f64());
            if std::env::var("NUIS").is_ok() && only.len() > 0 {
        for (e, u) in nuis.iter().zip(&f.u[problem.space.coordinates.len()..]) { println!("{:?} {:.2} sd = {:.3e}", e.nuisance, u, u * e.size); }
        println!("theta {:?}", &f.u[..problem.space.coordinates.len()]);
            }
        }
    }
}
