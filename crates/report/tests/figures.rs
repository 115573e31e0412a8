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
    let drawn = |held_out_gain| {
        let candidate =
            Candidate { name: "dry-friction".to_owned(), gain: 500.0, held_out_gain, ..Candidate::default() };
        LeaderboardFigure { candidates: vec![candidate], acceptance_gain: 30.0, ..LeaderboardFigure::default() }
            .figure()
            .to_svg()
    };
    assert!(drawn(Some(400.0)).contains("held out"));
    assert!(!drawn(None).contains("held out"));
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
            if let report::draw::Shape::Text(text) = shape {
                let width = report::draw::text_width_px(&text.content, text.size, text.bold);
                let (left, right) = match (text.upright, text.anchor) {
                    (true, _) => (text.at[0] - text.size, text.at[0]),
                    (false, report::draw::Anchor::Start) => (text.at[0], text.at[0] + width),
                    (false, report::draw::Anchor::Middle) => (text.at[0] - width / 2.0, text.at[0] + width / 2.0),
                    (false, report::draw::Anchor::End) => (text.at[0] - width, text.at[0]),
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
