//! `valve report`: one file that is read without a server, without a network and without scripts.

use std::fmt::Write;
use std::process::Command;

use serde_json::Value;

use crate::campaign::Recording;
use crate::support::{Sandbox, shown};

const VALVE: &str = include_str!("../../models/testbed.toml");

const FRICTION: &str = "\n[[effect]]\nkind = \"dry-friction\"\ncoulomb_force = \"40 N\"\nstatic_force = \"55 N\"\n";

/// A log of the valve that the sandbox has, which comes to its end, and of healthy ones.
fn fleet(sandbox: &Sandbox, healthy: usize, cycles: usize) {
    let mut log = sandbox.read("log.csv");
    for cycle in 0..cycles {
        for valve in 0..healthy {
            // Neighbouring valves and cycles differ by a few milliseconds, as timers have it.
            let off = f64::from(u32::try_from((7 * valve + 13 * cycle) % 11).unwrap_or(0)) * 4e-4;
            let _ = writeln!(log, "V-{valve:03},{cycle},{:.4},{:.4}", 1.0422 + off, 2.1343 - off);
        }
    }
    sandbox.write("fleet.csv", &log);
}

/// What the page holds for its script.
fn data(page: &str, name: &str) -> Value {
    let (_, rest) = page.split_once(&format!("id=\"data-{name}\">")).expect("the data");
    serde_json::from_str(rest.split("</script>").next().expect("an end")).expect("JSON")
}

#[test]
fn a_page_of_two_thousand_valves_is_small_and_asks_nobody() {
    let sandbox = Sandbox::new();
    fleet(&sandbox, 1999, 40);
    let output = sandbox.valve(&["report", "valve.toml", "--log", "fleet.csv", "--out", "report.html"]);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let page = sandbox.read("report.html");
    assert!(page.len() < 3_000_000, "{} bytes", page.len());
    assert!(page.contains("default-src 'none'"), "the page's own rules");
    for forbidden in ["src=\"", "@import", "url(", "fetch("] {
        assert!(!page.contains(forbidden), "{forbidden}");
    }
    let log = data(&page, "log");
    let valves = log["valves"].as_array().expect("valves");
    assert_eq!(valves.len(), 2000);
    // The first by name is the one that wears: its path is thinned and still ends where the log ends.
    assert_eq!(log["rows"]["valve"][0], "FV-101");
    let past = valves[0][1].as_array().expect("columns");
    assert!(past.iter().all(|column| column.as_array().is_some_and(|column| (10..=14).contains(&column.len()))));
    assert_eq!(past[0].as_array().and_then(|cycles| cycles.last()), Some(&log["rows"]["cycle"][0]));
}

/// Drives the page in headless Chromium: `crates/lab/web/test/report.mjs`.
#[test]
#[ignore = "needs node, Chromium and `npm ci` in crates/lab/web; .ci/run does that and runs it"]
fn a_browser_opens_a_report_without_a_network() {
    let sandbox = Sandbox::new();
    Recording::default().write(&sandbox, &format!("{VALVE}{FRICTION}"));
    fleet(&sandbox, 200, 30);
    let call = ["report", "valve.toml", "--log", "fleet.csv", "--campaign", "campaign.toml", "--out", "report.html"];
    let output = sandbox.valve(&call);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/crates/lab/web/test/report.mjs");
    let driven = Command::new("node").arg(script).arg(sandbox.path("report.html")).output().expect("node runs");
    assert!(driven.status.success(), "{}", shown(&driven));
}

#[test]
fn a_valve_that_no_tables_can_be_built_for_has_its_campaign_told_all_the_same() {
    let sandbox = Sandbox::new();
    // It does not open within the time that its cycle gives it.
    let hasty = VALVE.replace("open_at = \"4 s\"", "open_at = \"11.9 s\"");
    assert_ne!(hasty, VALVE);
    Recording::default().write(&sandbox, VALVE);
    sandbox.write("valve.toml", &hasty);
    let call = ["report", "valve.toml", "--campaign", "campaign.toml", "--out", "report.html"];
    let output = sandbox.valve(&call);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let page = sandbox.read("report.html");
    assert!(page.contains("gives no tables") && page.contains("Recorded strokes"), "the page says why");
    let with_log = sandbox.valve(&["report", "valve.toml", "--log", "log.csv", "--out", "other.html"]);
    assert_ne!(with_log.status.code(), Some(0), "a log needs them");
}

#[test]
fn what_was_adopted_is_told_with_how_sure_it_is_as_the_last_step_has_it() {
    let sandbox = Sandbox::new();
    let step = |action: &str, found: &str| {
        format!(
            "\n[[history]]\naction = \"{action}\"\ncampaign = \"bench 3\"\nerror_before = 4.0\nerror_after = 2.0\n\
             found = [{found}]\nundo = []\n"
        )
    };
    let preload = |value: &str| {
        format!(
            "{{ parameter = \"spring.preload_compression\", value = {value}, standard_error = 2e-4, unit = \"m\" }}"
        )
    };
    let force = "{ effect = \"dry-friction\", parameter = \"coulomb_force\", value = 34.9, standard_error = 1.2, unit = \"N\" }";
    let at_its_bound_since =
        ", { parameter = \"spring.stiffness\", value = 15900.0, standard_error = 50.0, unit = \"N/m\" }";
    let history = step("calibrated", &(preload("0.0355") + at_its_bound_since))
        + &step("added dry-friction", &(preload("0.0362") + ", " + force));
    sandbox.write("valve.toml", &format!("{VALVE}{history}"));
    let output = sandbox.valve(&["report", "valve.toml", "--out", "report.html"]);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let page = sandbox.read("report.html");
    assert!(page.contains("34.90 ± 1.2 N") && page.contains("36.20 ± 0.20 mm"), "{}", &page[page.len() / 2..]);
    assert!(!page.contains("35.50 ±") && !page.contains("15900 ±"), "a later step fitted the valve's own values anew");
}

#[test]
fn the_life_is_told_with_the_physics_that_was_found() {
    let sandbox = Sandbox::new();
    Recording::default().write(&sandbox, &format!("{VALVE}{FRICTION}"));
    let call = ["report", "valve.toml", "--log", "log.csv", "--campaign", "campaign.toml", "--out", "report.html"];
    let output = sandbox.valve(&call);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let page = sandbox.read("report.html");
    let (_, life) = page.split_once("ends at cycle (5 to 95 %)").expect("the life");
    let life: String = life.chars().take(200).collect();
    assert!(life.contains("dry-friction: ") && !life.contains("no tables"), "{life}");
}
