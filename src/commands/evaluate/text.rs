//! The study for people.

use std::fmt::Write;

use answers::evaluation::Study;
use answers::tables::fault_name;
use leak_table::Fault;
use prognoser::study::{Percentiles, StudyResult};

use crate::output::{Align, TextTable};

/// Accuracy beside the paper's, then how honest and how close to the bound.
pub fn render(study: &Study) -> String {
    let paper = if study.is_paper { ", and the paper's one run" } else { "" };
    let mut out = format!(
        "Relative accuracy of the remaining life (median; 10 to 90 % of {} lives of {} cycles){paper}:\n\n{}",
        study.seeds,
        study.end_cycle,
        accuracy(study)
    );
    // Writing to a string cannot fail.
    let _ = write!(out, "\nThe default method, valve known healthy at cycle 0:\n\n{}", quality(&study.results, true));
    let _ = write!(
        out,
        "\nThe default method, nothing known of the leak at cycle 0:\n\n{}",
        quality(&study.results_unknown_start, false)
    );
    out
}

fn accuracy(study: &Study) -> String {
    let mut columns = vec![
        ("fault", Align::Left),
        ("noise variance (s²)", Align::Right),
        ("least squares", Align::Right),
        ("default method", Align::Right),
    ];
    if study.is_paper {
        columns.insert(2, ("paper", Align::Right));
    }
    let mut table = TextTable::new(&columns);
    for fault in Fault::ALL {
        for result in of(&study.results, fault, "bayes") {
            let variance = result.noise_variance_s2;
            let plain = of(&study.results, fault, "ols").find(|other| other.noise_variance_s2 == variance);
            let mut row = vec![
                fault_name(fault).to_owned(),
                level(variance),
                plain.map_or_else(|| "-".to_owned(), |other| spread(&other.relative_accuracy)),
                spread(&result.relative_accuracy),
            ];
            if study.is_paper {
                let paper = study.paper(fault, variance);
                row.insert(2, paper.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}")));
            }
            table.row(row);
        }
    }
    table.render()
}

fn quality(results: &[StudyResult], known_start: bool) -> String {
    let mut table = TextTable::new(&[
        ("fault", Align::Left),
        ("noise variance (s²)", Align::Right),
        ("relative accuracy", Align::Right),
        ("converged at", Align::Right),
        ("isolated at", Align::Right),
        ("coverage of 90 %", Align::Right),
        ("error to bound at 1/4, 1/2, 3/4, end", Align::Right),
    ]);
    for fault in Fault::ALL {
        for result in of(results, fault, "bayes") {
            let ratio = if known_start { &result.eol_error_to_bound } else { &result.eol_error_to_bound_unknown_start };
            let ratio = ratio.as_ref().map_or_else(
                || "-".to_owned(),
                |values| values.iter().map(|value| format!("{value:.2}")).collect::<Vec<_>>().join("  "),
            );
            table.row(vec![
                fault_name(fault).to_owned(),
                level(result.noise_variance_s2),
                spread(&result.relative_accuracy),
                format!("{:.0}", result.convergence_cycle.p50),
                format!("{:.0}", result.isolation_cycle),
                result.coverage_90.map_or_else(|| "-".to_owned(), |share| format!("{share:.3}")),
                ratio,
            ]);
        }
    }
    table.render()
}

fn of<'a>(results: &'a [StudyResult], fault: Fault, method: &'a str) -> impl Iterator<Item = &'a StudyResult> {
    results.iter().filter(move |result| result.fault == fault && result.method == method)
}

fn level(variance: f64) -> String {
    if variance == 0.0 { "0".to_owned() } else { format!("{variance:e}") }
}

fn spread(values: &Percentiles) -> String {
    format!("{:.3} ({:.3} to {:.3})", values.p50, values.p10, values.p90)
}
