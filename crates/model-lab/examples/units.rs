use std::path::Path;
use model_lab::data::valve_facts;
use model_lab::identification::*;
use valve_file::ValveFile;
fn main() {
    for folder in std::env::args().skip(1) {
        let folder = Path::new(&folder);
        let file = ValveFile::read(&folder.join("valve.toml")).unwrap();
        let campaign = campaign::Campaign::read(&folder.join("campaign.toml"), &valve_facts(file.valve())).unwrap();
        for w in &campaign.warnings { println!("{w}"); }
        let subject = Subject::new(&file, &campaign, &NuisanceSizes::default());
        let s = subject.setup(identify::select::Level::High);
        println!("{} travel {:.3} step {:.5} rows {}", folder.display(), s.travel_s, s.step_s, s.records.iter().map(|r| r.row_count()).sum::<usize>());
        for (u, r) in s.units.iter().zip(s.records.iter()) { println!("  {} origin {:.3} {:?} end {:.2} edges {:?} rows {} cond {} t {:.3}..{:.3}", u.name, u.origin_s, u.beginning, u.run.end_s, u.run.commands.iter().map(|e| (e.time_s, e.close)).collect::<Vec<_>>(), r.row_count(), r.condition, r.rows().next().unwrap().time_s, r.series[0].rows.last().unwrap().time_s); }
        for n in subject.nuisances() { if matches!(n.nuisance, Nuisance::UnseenEdge(_)) { println!("  {:?} {:?}", n.nuisance, n.coordinate); } }
    }
}
