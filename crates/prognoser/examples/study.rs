#[path = "marks.rs"]
#[allow(dead_code)]
mod marks;
use prognoser::study::*;
use prognoser::*;
fn main() {
    let b = marks::bundle();
    let mut c = StudyConfig { seeds: std::env::args().nth(1).map_or(500, |s| s.parse().unwrap()), ..StudyConfig::default() };
    if std::env::args().any(|a| a == "unknown") { for m in &mut c.methods { if let Method::Bayes(b) = m { b.start = bayes::StartPrior::Unknown; } } }
    if let Some(x) = std::env::args().find_map(|a| a.strip_prefix("start=").map(|s| s.parse::<f64>().unwrap())) { c.start = x; }
    if let Some(x) = std::env::args().find_map(|a| a.strip_prefix("end=").map(|s| s.parse::<f64>().unwrap())) { c.end_cycle = x; }
    let t = std::time::Instant::now();
    for r in c.run(&b) {
        let f = |v: &Option<Vec<f64>>| v.as_ref().map(|v| v.iter().map(|x| format!("{x:.3}")).collect::<Vec<_>>().join(" ")).unwrap_or_default();
        println!("{:10} {:6.0e} {:5} RA {:.3} {:.3} {:.3} conv {:.0} cov {:.3?} [{}] ratio [{}] unk [{}] al {:.2?} PH {:.1} iso {} {} {:.3} false {:.3}", r.fault, r.noise_variance_s2, r.method, r.relative_accuracy.p10, r.relative_accuracy.p50, r.relative_accuracy.p90, r.convergence_cycle.p50, r.coverage_90, f(&r.coverage_90_at_quarters), f(&r.eol_error_to_bound), f(&r.eol_error_to_bound_unknown_start), r.alpha_lambda_accuracy, r.prognostic_horizon.p50, r.isolation_cycle, r.isolation_cycle_p95, r.isolated_at_cycle_3, r.false_call_share);
    }
    println!("{:?}", t.elapsed());
    println!("false alarms {:?}", StudyConfig { seeds: 1000, noise_variances_s2: vec![1e-4,1e-3,1e-2], ..c }.false_alarms(&b, &Method::default(), 1000));
}
