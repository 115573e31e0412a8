#[path = "marks.rs"]
#[allow(dead_code)]
mod marks;
use leak_table::*;
use prognoser::study::NoiseSource;
use prognoser::bayes::*;
use prognoser::Reading;
fn main() {
    let b = marks::bundle(); let eol = 25.0;
    let gen_ = |rep: u64, n: u64, life: f64| { let mut s = NoiseSource::new(rep, 3); (0..n).map(|k| { let area = b.limit_area_m2(Fault::Supply) * (k as f64 / life).min(1.0);
            let mut t = |st| b.table(Fault::Supply).curve(st).extrapolated_time_and_slope(area).0 + 0.0316 * s.normal();
            Reading { cycle: k, close_time_s: Some(t(Stroke::Close)), open_time_s: Some(t(Stroke::Open)) } }).collect::<Vec<_>>() };
    for (name, n, life, reps) in [("first 8", 8, eol, 2000), ("life of 25", 25, eol, 1000), ("life of 1000", 1000, 1000.0, 50), ("healthy 1000", 1000, 1e12, 50), ("const at limit", 1000, 25.0, 10)] {
        if let Some(only) = std::env::args().nth(1) { if only != name { continue; } }
        let lives: Vec<_> = (0..reps).map(|r| gen_(r, n, life)).collect();
        let mut best = f64::MAX;
        for _ in 0..5 { let t0 = std::time::Instant::now(); let mut cnt = 0; let mut sum = 0.0;
        for l in &lives { let mut e = BayesEstimator::new(&BayesConfig::default()); for r in l { sum += e.update(&b, r).eol_cycle; cnt += 1; } }
        std::hint::black_box(sum);
        best = best.min(t0.elapsed().as_nanos() as f64 / cnt as f64); }
        println!("{name}: {best:.0} ns per cycle");
    }
}
