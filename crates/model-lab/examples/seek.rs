use std::path::Path;
use std::time::Instant;
use identify::Stop;
use identify::select::*;
use model_lab::data::valve_facts;
use model_lab::identification::*;
use valve_file::ValveFile;

fn main() {
    for folder in std::env::args().skip(1) {
        let folder = Path::new(&folder);
        let name = folder.file_name().unwrap().to_string_lossy();
        let file = match ValveFile::read(&folder.join("valve.toml")) { Ok(f) => f, Err(e) => { println!("{name} REFUSED {e}"); continue } };
        let campaign = match campaign::Campaign::read(&folder.join("campaign.toml"), &valve_facts(file.valve())) { Ok(f) => f, Err(e) => { println!("{name} REFUSED {e}"); continue } };
        let t = Instant::now();
        let subject = Subject::new(&file, &campaign, &NuisanceSizes::default());
        let stop = Stop::new();
        let verbose = std::env::var("VERBOSE").is_ok();
        let t0 = t.elapsed().as_secs_f64();
        let tell = |n: News<'_>| if verbose { eprintln!("{:.2} {n:?}", t.elapsed().as_secs_f64()) };
        let catalogue = Catalogue::new(&subject, &tell, &stop);
        let Some(found) = select(&catalogue, &SelectOptions::default()) else { println!("{name} NOTHING"); continue };
        let ids = |set: &[usize]| catalogue.kinds_of(set).iter().map(|k| k.id()).collect::<Vec<_>>().join("+");
        let show = |set: &[usize]| { let m = found.model(set).unwrap(); let g = m.fit.noise.groups[0];
            let (mut s, mut n) = (0.0, 0.0); for (r, res) in identify::Problem::records(&m.problem).iter().zip(&m.fit.linear.residual) { for (_, v) in r.series[0].rows.iter().zip(res) { s += v * v; n += 1.0; } }
            let eff: Vec<String> = m.problem.space.effects().iter().flat_map(|e| m.problem.space.effect_values(e.kind(), &m.fit.u).unwrap()).map(|v| format!("{v:.3e}")).collect();
            let held: Vec<String> = m.fit.held.iter().zip(&m.fit.u).enumerate().filter(|(_, (h, _))| **h).map(|(i, (_, u))| { let k = m.problem.space.coordinates.len(); if i < k { format!("{i}={u:.1}") } else { format!("{:?}={u:.0}", subject.nuisances()[i - k].nuisance) } }).collect();
            format!("{} {:+.1} rms {:.4} ho {:.2} m {:.2} a {:.1e} left {:.1}{} [{}] {}", if set.is_empty() { "-".into() } else { ids(set) }, found.gain(m), 1e3 * (s / n as f64).sqrt(), m.held_out.unwrap_or(f64::NAN), g.multiplier, g.discrepancy, left_nats(&m.problem, &m.fit, &catalogue.options()), if m.fit.converged { "" } else { "!" }, eff.join(" "), held.join(",")) };
        println!("{name} FOUND {} ({:.1}s, prep {t0:.1}, rows {})", ids(found.accepted()), t.elapsed().as_secs_f64(), subject.setup(Level::High).records.iter().map(|r| r.row_count()).sum::<usize>());
        for set in &found.steps { println!("    step {}", show(set)); }
        let mut m: Vec<_> = found.models.iter().filter(|m| m.level == Level::High && !found.steps.contains(&m.set)).collect();
        m.sort_by(|a, b| b.fit.log_evidence.total_cmp(&a.fit.log_evidence));
        for m in m.iter().take(4) { println!("         {}", show(&m.set)); }
    }
}
