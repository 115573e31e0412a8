//! Every figure draws, the same way each time, and as a document that others read.

#[path = "../examples/gallery/samples.rs"]
mod samples;

use report::html::{Block, Page, Section};

#[test]
fn drawing_twice_gives_the_same_bytes() {
    for ((name, first), (_, second)) in samples::all().into_iter().zip(samples::all()) {
        assert_eq!(first.to_svg(), second.to_svg(), "{name}");
    }
    let (_, figure) = samples::all().swap_remove(0);
    assert_eq!(figure.to_png(1.0).unwrap(), figure.to_png(1.0).unwrap());
}

#[test]
fn svg_is_well_formed_and_needs_nothing_else() {
    for (name, figure) in samples::all() {
        let svg = figure.to_svg();
        assert_eq!(svg.matches("<svg").count(), svg.matches("</svg>").count(), "{name}");
        assert_eq!(svg.matches("<text").count(), svg.matches("</text>").count(), "{name}");
        assert_eq!(svg.matches('"').count() % 2, 0, "{name}");
        for foreign in ["NaN", "inf", "href", "id=\"", "url("] {
            assert!(!svg.contains(foreign), "{name} contains {foreign}");
        }
    }
}

#[test]
fn a_key_names_only_what_is_drawn() {
    use report::figures::{Candidate, LeaderboardFigure};
    let drawn = |held_out, without| {
        let candidate = Candidate { name: "dry-friction".to_owned(), fitted: 5.0, held_out, ..Candidate::default() };
        LeaderboardFigure { candidates: vec![candidate], without, ..LeaderboardFigure::default() }.figure().to_svg()
    };
    assert!(drawn(Some(6.0), None).contains("held out"));
    assert!(!drawn(None, None).contains("held out") && !drawn(None, None).contains("no effect"));
    assert!(drawn(None, Some(9.0)).contains("no effect"));
    assert!(!drawn(None, None).contains("recommended") && !drawn(None, None).contains("alike"));
}

/// Texts of a picture, from top to bottom.
fn texts(figure: &report::Figure) -> Vec<String> {
    let mut texts: Vec<(f64, String)> = Vec::new();
    for shape in figure.scene().shapes {
        if let chart::draw::Shape::Text(text) = shape {
            texts.push((text.at[1], text.content));
        }
    }
    texts.sort_by(|a, b| a.0.total_cmp(&b.0));
    texts.into_iter().map(|(_, text)| text).collect()
}

#[test]
fn candidates_stand_by_the_error_that_remains_and_the_verdict_is_among_them() {
    use report::figures::{Candidate, LeaderboardFigure, Standing};
    let candidate = |name: String, fitted: f64, held_out: Option<f64>, standing| Candidate {
        name,
        fitted,
        held_out,
        standing,
        text: String::new(),
    };
    let other =
        |index: u32| candidate(format!("other-{index:02}"), 9.0 - 0.1 * f64::from(index), None, Standing::Rejected);
    let mut candidates: Vec<Candidate> = (0..30).map(other).collect();
    candidates.push(candidate("overfitted".to_owned(), 0.9, Some(6.85), Standing::Rejected));
    candidates.push(candidate("twin + b".to_owned(), 1.1, Some(1.1), Standing::Alike));
    candidates.push(candidate("a + b".to_owned(), 1.3, Some(1.2), Standing::Recommended));
    let figure = LeaderboardFigure { candidates, without: Some(9.5), ..LeaderboardFigure::default() }.figure();
    let is_name = |text: &String| text.contains(" + b") || text.starts_with("other-") || text == "overfitted";
    let names: Vec<String> = texts(&figure).into_iter().filter(is_name).collect();
    assert_eq!(names[..3], ["a + b", "twin + b", "other-29"], "{names:?}");
    let at = names.iter().position(|name| name == "overfitted").expect("it is drawn");
    assert_eq!([&*names[at - 1], &*names[at + 1]], ["other-22", "other-21"], "by what was held out");
}

#[test]
fn a_remaining_life_that_is_cut_off_is_marked() {
    use report::figures::{PrognosisFigure, PrognosisPoint};
    let drawn = |first: f64, first_high: f64| {
        let point = |cycle: u32| {
            let rul = if cycle == 0 { first } else { 25.0 - f64::from(cycle) };
            let high = if cycle == 0 { first_high } else { rul + 1.0 };
            PrognosisPoint {
                cycle: f64::from(cycle),
                rul_cycles: Some(rul),
                rul_bounds_cycles: Some([0.8 * rul, high]),
                ..PrognosisPoint::default()
            }
        };
        texts(&PrognosisFigure { points: (0..20).map(point).collect(), ..PrognosisFigure::default() }.figure())
    };
    let marked = |texts: &[String]| texts.iter().find(|text| text.contains("goes on above")).cloned();
    assert_eq!(marked(&drawn(25.0, 26.0)), None);
    assert_eq!(marked(&drawn(40.0, 41.0)), None, "near enough to be shown");
    assert_eq!(marked(&drawn(25.0, 441.4)).as_deref(), Some("goes on above, to 441 at most"));
    assert_eq!(marked(&drawn(900.0, 950.0)).as_deref(), Some("goes on above, to 950 at most"));
}

#[test]
fn closing_and_opening_differ_without_colour() {
    use report::figures::{MissingFigure, MissingPoint, SignatureFigure};
    let dashes = |figure: report::Figure| figure.to_svg().matches("stroke-dasharray").count();
    let bins = |value: f64| [0.0, 1.0].map(|at| MissingPoint { at, value, standard_error: 0.1 }).to_vec();
    let missing = |opening: Vec<MissingPoint>| MissingFigure {
        axes: vec![("x".to_owned(), bins(1.0), opening)],
        ..MissingFigure::default()
    };
    // One in the legend, one for the line.
    assert_eq!([dashes(missing(bins(-1.0)).figure()), dashes(missing(Vec::new()).figure())], [2, 1]);
    let path = vec![[0.0, 0.0], [1.0, 1.0]];
    let signature =
        SignatureFigure { closing: path.clone(), opening: path.clone(), spring: path, ..SignatureFigure::default() };
    assert_eq!(dashes(signature.figure()), 2);
}

#[test]
fn png_has_the_size_asked_for() {
    let (_, figure) = samples::all().swap_remove(0);
    let scene = figure.scene();
    let png = figure.to_png(2.0).unwrap();
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    let side = |at: usize| f64::from(u32::from_be_bytes(png[at..at + 4].try_into().unwrap()));
    assert!((side(16) - 2.0 * scene.width).abs() <= 1.0);
    assert!((side(20) - 2.0 * scene.height).abs() <= 1.0);
}

#[test]
fn absurd_scales_are_refused() {
    let (_, figure) = samples::all().swap_remove(0);
    for scale in [0.0, -1.0, f64::NAN, 1e6] {
        let error = figure.to_png(scale).unwrap_err().to_string();
        assert!(error.contains("choose a scale"), "{error}");
    }
}

#[test]
fn texts_stay_on_the_page() {
    for (name, figure) in samples::all() {
        let scene = figure.scene();
        let mut texts = 0;
        for shape in &scene.shapes {
            if let chart::draw::Shape::Text(text) = shape {
                let width = chart::draw::text_width_px(&text.content, text.size, text.bold);
                let (left, right) = match (text.upright, text.anchor) {
                    (true, _) => (text.at[0] - text.size, text.at[0]),
                    (false, chart::draw::Anchor::Start) => (text.at[0], text.at[0] + width),
                    (false, chart::draw::Anchor::Middle) => (text.at[0] - width / 2.0, text.at[0] + width / 2.0),
                    (false, chart::draw::Anchor::End) => (text.at[0] - width, text.at[0]),
                };
                assert!(left >= 0.0, "{name}: {:?} leaves the page on the left", text.content);
                assert!(right <= scene.width, "{name}: {:?} leaves the page", text.content);
                texts += 1;
            }
        }
        assert!(texts > 4, "{name} has hardly any text");
    }
}

#[test]
fn report_carries_its_figures() {
    let blocks = samples::all().into_iter().map(|(_, figure)| Block::Figure(Box::new(figure))).collect();
    let section = Section { title: "All".to_owned(), blocks };
    let html = Page { title: "Gallery".to_owned(), sections: vec![section], ..Page::default() }.to_html();
    assert_eq!(html.matches("<figure>").count(), samples::all().len());
}
