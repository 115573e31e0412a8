use leak_table::*;
use prognoser::bayes::*;
use prognoser::study::NoiseSource;
use prognoser::Reading;
pub fn bundle() -> TableBundle {
    let read = |name: &str, fault| {
        let text = std::fs::read_to_string(format!("{}/tests/data/{name}.csv", env!("CARGO_MANIFEST_DIR"))).unwrap();
        let pts = text.lines().skip(1).map(|l| { let f: Vec<&str> = l.split(',').collect();
            LeakPoint { leak_area_m2: m2_from_mm2(f[0].parse().unwrap()), close_time_s: f[1].parse().ok(), open_time_s: f[2].parse().ok() } }).collect();
        LeakTable::new(fault, pts).unwrap()
    };
    let (a, s) = (read("atmosphere", Fault::Atmosphere), read("supply", Fault::Supply));
    let limits = Limits { close_within_s: 3.0, open_within_s: 6.0 };
    TableBundle::new(BundleInfo { valve: "t".into(), model_hash: "x".into(), schedule: CycleSchedule { close_at_s: 0.0, open_at_s: 4.0, end_s: 12.0 }, limits,
        atmosphere: FaultInfo::from_table(&a, &limits), supply: FaultInfo::from_table(&s, &limits) }, &a, &s).unwrap()
}
fn q(v: &mut Vec<f64>, p: f64) -> f64 { v.sort_by(f64::total_cmp); v[((v.len()-1) as f64 * p).round() as usize] }
fn arg(name: &str, d: f64) -> f64 { std::env::args().find_map(|a| a.strip_prefix(name).and_then(|v| v.strip_prefix('=')).map(|v| v.parse().unwrap())).unwrap_or(d) }
fn main() {
    let med = arg("med", 0.0) > 0.0;
    let pt = |e: &BayesEstimate| if med { e.eol.p50 } else { e.eol_cycle };
    let base = || { let mut c = BayesConfig::default(); c.life_median_cycles = arg("life", c.life_median_cycles); c.life_ln_sd = arg("lsd", c.life_ln_sd); c.no_start_leak = arg("spike", c.no_start_leak); c.no_fault = arg("none", c.no_fault); c.outlier_share = arg("out", c.outlier_share);
        c.noise = Noise::Estimated { prior_readings: arg("dof", 2.0), prior_sd_s: arg("psd", 0.012) }; c };
    let b = bundle();
    let args: Vec<String> = std::env::args().collect();
    let seeds: u64 = args.get(1).map_or(500, |s| s.parse().unwrap());
    let known = args.iter().any(|a| a == "known");
    let outl = args.iter().any(|a| a == "outliers");
    let unk = args.iter().any(|a| a == "unknown");
    let eol = 25.0;
    for fault in Fault::ALL { for var in [1e-6f64, 1e-4, 1e-3, 1e-2] {
        let sd = var.sqrt();
        let mut ras = vec![]; let mut conv = vec![]; let mut iso = 0; let mut isoc=vec![];
        let mut cover = vec![0.0; 25]; let mut se = vec![0.0; 25]; let mut ra_k = vec![0.0;25];
        let mut bad = 0; let mut changes = [0; 4];
        for seed in 0..seeds { if arg("seed", -1.0) >= 0.0 && arg("seed", -1.0) != seed as f64 { continue; }
            let mut cfg = base();
            if known { cfg.noise = Noise::Known { sd_s: sd }; }
            if unk { cfg.start = StartPrior::Unknown; }
            let mut n = NoiseSource::new(seed, fault as u64 * 100 + (1.0/var) as u64);
            let mut e = BayesEstimator::new(&cfg);
            let mut ra = 0.0; let mut converged = 2; let mut isolated = 0;
            for k in 0..25u64 {
                let area = b.limit_area_m2(fault) * k as f64 / eol;
                let mut t = |s| { let x = b.table(fault).curve(s).extrapolated_time_and_slope(area).0 + sd * n.normal();
                    if outl && n.uniform() < 0.05 { x + 1.0 } else { x } };
                let r = Reading { cycle: k, close_time_s: Some(t(Stroke::Close)), open_time_s: Some(t(Stroke::Open)) };
                let est = e.update(&b, &r); if arg("seed", -1.0) == seed as f64 { println!("{k} {:.1} [{:.1} {:.1}] sd {:.4} inl {:.3?} z {:.2?} p {:.3?} {:?}", pt(&est), est.eol.p05, est.eol.p95, est.noise_sd_s, est.inlier, est.surprise, est.probability.of(fault), est.change); } if let Some(c) = est.change { if args.iter().any(|a| a == "dbgc") { println!("seed {seed} {k} {c:?}"); } changes[c as usize] += 1; }
                if est.probability.of(fault) <= 0.95 { isolated = k + 1; }
                if k == 3 && est.probability.of(fault) > 0.95 { iso += 1; }
                if k >= 2 {
                    let rul = eol - k as f64;
                    let err = (pt(&est) - eol).abs() / rul;
                    ra += (1.0 - err).max(0.0); ra_k[k as usize] += (1.0 - err).max(0.0)/seeds as f64;
                    if err > 0.1 { converged = k + 1; }
                    if est.leading != fault && k > 8 { bad += 1; }
                }
                if est.eol.p05 <= eol && eol <= est.eol.p95 { cover[k as usize] += 1.0 / seeds as f64; }
                if (k == 12 && (pt(&est) - eol).abs() > 6.0) && args.iter().any(|a| a == "dbg") { println!("  seed {seed} k {k} pt {} {:?}", pt(&est), est); }
                se[k as usize] += (pt(&est) - eol).powi(2) / seeds as f64;
            }
            ras.push(ra / 23.0); conv.push(converged as f64); isoc.push(isolated as f64);
        }
        // bound
        let mut s2 = 0.0; let mut ratio = vec![];
        let g = b.limit_area_m2(fault) / eol;
        for k in 0..25 { for s in Stroke::ALL { let d = b.table(fault).curve(s).extrapolated_time_and_slope(g * k as f64).1; s2 += d*d*(k*k) as f64 / var; }
            ratio.push((se[k] / (eol*eol/(g*g*s2))).sqrt()); }
        let pooled: f64 = cover[2..].iter().sum::<f64>() / 23.0;
        println!("{fault} {var:.0e}: RA p10 {:.3} p50 {:.3} p90 {:.3} conv {} iso3 {:.3} isop95 {} cov {:.3} [k6 {:.3} k12 {:.3} k18 {:.3} k24 {:.3}] ratio k6 {:.2} k12 {:.2} k15 {:.2} k18 {:.2} k21 {:.2} k24 {:.2} bad {bad} {changes:?}",
            q(&mut ras, 0.1), q(&mut ras, 0.5), q(&mut ras, 0.9), q(&mut conv, 0.5), iso as f64 / seeds as f64, q(&mut isoc, 0.95), pooled, cover[6], cover[12], cover[18], cover[24], ratio[6], ratio[12], ratio[15], ratio[18], ratio[21], ratio[24]);
        if args.iter().any(|a| a == "v") { println!("   ra {:.2?}\n cov {:.2?}", &ra_k[2..], &cover[2..]); }
    } }
    if args.iter().any(|a| a == "healthy") {
        let mut called = 0; let mut p95 = 0;
        for seed in 0..seeds { let mut n = NoiseSource::new(seed, 77);
            let cfg = base(); let mut e = BayesEstimator::new(&cfg); let mut c = false; let mut c95=false;
            for k in 0..1000u64 { let mut t = |s| b.table(Fault::Supply).curve(s).extrapolated_time_and_slope(0.0).0 + 0.0316 * n.normal();
                let r = Reading { cycle: k, close_time_s: Some(t(Stroke::Close)), open_time_s: Some(t(Stroke::Open)) };
                let est = e.update(&b, &r); let m = est.probability.atmosphere.max(est.probability.supply); c |= m > 0.995; c95 |= m > 0.95; }
            called += c as u32; p95 += c95 as u32; }
        println!("healthy called {called} p95 {p95} of {seeds}");
    }
    { let t0 = std::time::Instant::now(); let mut cnt = 0; for rep in 0..1000 { let mut e = BayesEstimator::new(&BayesConfig::default()); let mut n = NoiseSource::new(rep, 3);
        for k in 0..8u64 { let area = b.limit_area_m2(Fault::Supply) * k as f64 / eol;
            let mut t = |s| b.table(Fault::Supply).curve(s).extrapolated_time_and_slope(area).0 + 0.0316 * n.normal();
            let r = Reading { cycle: k, close_time_s: Some(t(Stroke::Close)), open_time_s: Some(t(Stroke::Open)) }; e.update(&b, &r); cnt += 1; } }
      println!("first 8: {:.0} ns", t0.elapsed().as_nanos() as f64 / cnt as f64); }
    for life in [25.0, 1000.0, 1e9] { let t0 = std::time::Instant::now(); let mut cnt = 0; for rep in 0..20 { let mut e = BayesEstimator::new(&BayesConfig::default()); let mut n = NoiseSource::new(rep, 3);
        for k in 0..1000u64 { let area = b.limit_area_m2(Fault::Supply) * (k as f64 / life).min(1.0);
            let mut t = |s| b.table(Fault::Supply).curve(s).extrapolated_time_and_slope(area).0 + 0.0316 * n.normal();
            let r = Reading { cycle: k, close_time_s: Some(t(Stroke::Close)), open_time_s: Some(t(Stroke::Open)) }; e.update(&b, &r); cnt += 1; } }
      println!("life {life}: {:.0} ns", t0.elapsed().as_nanos() as f64 / cnt as f64); }
    let t0 = std::time::Instant::now(); let mut sum = 0.0; let mut cnt = 0;
    for rep in 0..400 { let mut e = BayesEstimator::new(&BayesConfig::default()); let mut n = NoiseSource::new(rep, 3);
        for k in 0..25u64 { let area = b.limit_area_m2(Fault::Supply) * k as f64 / eol;
            let mut t = |s| b.table(Fault::Supply).curve(s).extrapolated_time_and_slope(area).0 + 0.0316 * n.normal();
            let r = Reading { cycle: k, close_time_s: Some(t(Stroke::Close)), open_time_s: Some(t(Stroke::Open)) };
            sum += e.update(&b, &r).eol.p50; cnt += 1; } }
    println!("{:.0} ns per update {sum}", t0.elapsed().as_nanos() as f64 / cnt as f64);
}
