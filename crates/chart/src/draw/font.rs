//! The font of the figures: `DejaVu Sans Condensed`, carried by a crate, so that
//! nothing is assumed of the machine.

use std::sync::OnceLock;

use ttf_parser::{Face, OutlineBuilder};

/// The face, parsed once.
pub(super) fn face(bold: bool) -> &'static Face<'static> {
    static REGULAR: OnceLock<Face<'static>> = OnceLock::new();
    static BOLD: OnceLock<Face<'static>> = OnceLock::new();
    // The files are part of the program, so reading them cannot fail.
    if bold {
        BOLD.get_or_init(|| Face::parse(dejavu::sans_condensed::bold(), 0).expect("the bundled font is valid"))
    } else {
        REGULAR.get_or_init(|| Face::parse(dejavu::sans_condensed::regular(), 0).expect("the bundled font is valid"))
    }
}

/// Width of a text in pixels when set at `size` pixels.
pub fn text_width_px(text: &str, size: f64, bold: bool) -> f64 {
    let face = face(bold);
    let units: u32 = text
        .chars()
        .filter_map(|letter| face.glyph_index(letter))
        .filter_map(|glyph| face.glyph_hor_advance(glyph))
        .map(u32::from)
        .sum();
    f64::from(units) * size / f64::from(face.units_per_em())
}

/// Calls `draw` for every letter with its distance from the start of the text
/// in font units. Letters that the font lacks are left out.
pub(super) fn for_each_glyph(text: &str, bold: bool, mut draw: impl FnMut(Glyph)) {
    let face = face(bold);
    let mut offset_units = 0.0;
    for letter in text.chars() {
        let Some(id) = face.glyph_index(letter) else { continue };
        draw(Glyph { face, id, offset_units });
        offset_units += f64::from(face.glyph_hor_advance(id).unwrap_or(0));
    }
}

/// A letter and where it stands.
pub(super) struct Glyph {
    face: &'static Face<'static>,
    id: ttf_parser::GlyphId,
    /// Distance from the start of the text, font units.
    pub offset_units: f64,
}

impl Glyph {
    /// Hands the letter's outline, in font units with y upwards, to `builder`.
    pub fn outline(&self, builder: &mut dyn OutlineBuilder) {
        // A space has no outline, which is no error.
        let _ = self.face.outline_glyph(self.id, builder);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn width_grows_with_text_and_size() {
        let short = text_width_px("leak", 12.0, false);
        assert!(text_width_px("leak area", 12.0, false) > 1.8 * short);
        assert!((text_width_px("leak", 24.0, false) - 2.0 * short).abs() < 1e-9);
        assert!(text_width_px("leak", 12.0, true) > short);
    }

    #[test]
    fn symbols_of_the_figures_are_in_the_font() {
        for letter in "µ²³⁻⁴⁵·±−–σΔχαβ→≤≥×°…".chars() {
            assert!(face(false).glyph_index(letter).is_some(), "no glyph for {letter}");
            assert!(face(true).glyph_index(letter).is_some(), "no bold glyph for {letter}");
        }
    }
}
