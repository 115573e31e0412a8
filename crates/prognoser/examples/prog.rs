#[path = "marks.rs"]
#[allow(dead_code)]
mod marks;
use prognoser::*;
use std::io::*;
fn main() {
    let b = std::sync::Arc::new(marks::bundle());
    let a: Vec<String> = std::env::args().collect();
    let m = if a.iter().any(|x| x == "ols") { Method::Ols } else { let mut c = bayes::BayesConfig::default(); if a.iter().any(|x| x == "exp") { c.growth = bayes::GrowthLaw::Exponential; } Method::Bayes(c) };
    let quiet = a.iter().any(|x| x == "quiet");
    let src: Box<dyn BufRead> = if a[1] == "-" { Box::new(stdin().lock()) } else { Box::new(BufReader::new(std::fs::File::open(&a[1]).unwrap())) };
    let mut log = match TimingLog::new(a[1].clone(), src) { Ok(l) => l, Err(e) => { println!("{e}"); return; } };
    let mut p = Prognoser::new(b, m);
    let mut n = 0u64; let mut s = 0.0; let t = std::time::Instant::now();
    loop { match log.next_row() { Ok(Some(r)) => { let o = p.push(&r); n += 1; s += o.rul_cycles.unwrap_or(0.0);
        if !quiet { let f = |x: Option<f64>| x.map_or("-".into(), |x| format!("{x:.2}")); println!("{:4} {:10} {} leak {} rate {} eol {} rul {} [{} {}] {:?} sd {} {}", o.cycle, o.fault.name(), o.fault_probability.map_or(String::new(), |p| format!("{:.3} {:.3} {:.3}", p.none, p.atmosphere, p.supply)), o.leak_area_mm2.map_or("-".into(), |x| format!("{x:.4}")), o.leak_rate_mm2_per_cycle.map_or("-".into(), |x| format!("{x:.5}")), f(o.eol_cycle), f(o.rul_cycles), f(o.rul_p05), f(o.rul_p95), o.status, o.noise_s.map_or("-".into(), |x| format!("{x:.5}")), o.notices.iter().map(|n| n.to_string()).collect::<Vec<_>>().join(" | ")); } }
        Ok(None) => break, Err(e) => { println!("{e}"); return; } } }
    if quiet { println!("{n} rows {} valves {:?} {s}", p.valves(), t.elapsed()); }
}
