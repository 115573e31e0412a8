//! Colours and sizes that all figures share.
//!
//! The qualitative colours are those of Okabe and Ito (2008), chosen to be told
//! apart with any common colour vision; the diverging scale runs from blue to red
//! through near-white, which keeps its order in all of them.

use crate::draw::Colour;

/// Text and axes.
pub const INK: Colour = Colour(0x22, 0x22, 0x22);
/// Secondary text.
pub const MUTED: Colour = Colour(0x5a, 0x5a, 0x5a);
/// Grid lines.
pub const GRID: Colour = Colour(0xe4, 0xe4, 0xe4);
/// Reference lines.
pub const GREY: Colour = Colour(0x8c, 0x8c, 0x8c);
/// First colour: the model, the estimate.
pub const BLUE: Colour = Colour(0x00, 0x72, 0xb2);
/// Second colour: limits, what is wrong.
pub const VERMILLION: Colour = Colour(0xd5, 0x5e, 0x00);
/// Third colour: what is right, the truth.
pub const GREEN: Colour = Colour(0x00, 0x9e, 0x73);
/// Fourth colour.
pub const ORANGE: Colour = Colour(0xe6, 0x9f, 0x00);
/// Fifth colour.
pub const PURPLE: Colour = Colour(0xcc, 0x79, 0xa7);
/// Sixth colour.
pub const SKY: Colour = Colour(0x56, 0xb4, 0xe9);
/// Colours for series in order.
pub const SERIES: [Colour; 6] = [BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY];

/// Height of the headline, pixels.
pub const TITLE_SIZE: f64 = 17.0;
/// Height of a panel's title and of the line below the headline.
pub const SUBTITLE_SIZE: f64 = 13.0;
/// Height of the axis labels, tick labels, legends and notes.
pub const TEXT_SIZE: f64 = 12.0;

/// Colour of a value between -1 (blue), 0 (near white) and 1 (red).
pub fn diverging(value: f64) -> Colour {
    const COLD: [Colour; 2] = [Colour(0x92, 0xc5, 0xde), Colour(0x05, 0x5a, 0x9c)];
    const WARM: [Colour; 2] = [Colour(0xf4, 0xa5, 0x82), Colour(0xa5, 0x12, 0x26)];
    const NONE: Colour = Colour(0xf7, 0xf7, 0xf7);
    let arm = if value < 0.0 { COLD } else { WARM };
    let size = value.abs().min(1.0);
    if size < 0.5 { NONE.towards(arm[0], 2.0 * size) } else { arm[0].towards(arm[1], 2.0 * size - 1.0) }
}

/// Colour of a value between 0 (near white) and 1 (dark blue).
pub fn sequential(value: f64) -> Colour {
    const STOPS: [Colour; 3] = [Colour(0xf4, 0xf8, 0xfc), Colour(0x6b, 0xae, 0xd6), Colour(0x08, 0x36, 0x6f)];
    let value = value.clamp(0.0, 1.0);
    if value < 0.5 { STOPS[0].towards(STOPS[1], 2.0 * value) } else { STOPS[1].towards(STOPS[2], 2.0 * value - 1.0) }
}
