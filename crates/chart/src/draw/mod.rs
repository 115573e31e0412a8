//! A scene: the few kinds of shapes that a figure is made of.
//!
//! Both outputs, SVG and PNG, are made from the same list of shapes, so they
//! show the same picture. Coordinates are in CSS pixels, y downwards.

mod font;
mod png;
mod svg;

pub use font::text_width_px;

/// An opaque colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Colour(pub u8, pub u8, pub u8);

impl Colour {
    /// The colour between `self` (share 0) and `other` (share 1).
    #[must_use]
    pub fn towards(self, other: Self, share: f64) -> Self {
        let mix = |a: u8, b: u8| {
            let value = f64::from(a) + (f64::from(b) - f64::from(a)) * share.clamp(0.0, 1.0);
            // The value lies between two bytes, so the cast is exact.
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in 0..=255")]
            let byte = value.round() as u8;
            byte
        };
        Self(mix(self.0, other.0), mix(self.1, other.1), mix(self.2, other.2))
    }

    /// True where white text on this colour reads better than black text.
    pub fn is_dark(self) -> bool {
        0.299 * f64::from(self.0) + 0.587 * f64::from(self.1) + 0.114 * f64::from(self.2) < 140.0
    }
}

/// How an area is filled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fill {
    /// Colour of the area.
    pub colour: Colour,
    /// 0 invisible to 1 opaque.
    pub opacity: f64,
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pen {
    /// Colour of the line.
    pub colour: Colour,
    /// Width in pixels.
    pub width: f64,
    /// Lengths of dash and gap in pixels; a solid line has none.
    pub dash: Option<[f64; 2]>,
}

impl Pen {
    /// A solid line.
    pub fn solid(colour: Colour, width: f64) -> Self {
        Self { colour, width, dash: None }
    }
}

/// Which part of a text stands at its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// The text begins there.
    Start,
    /// The text is centred there.
    Middle,
    /// The text ends there.
    End,
}

/// A line of text.
#[derive(Debug, Clone, PartialEq)]
pub struct Text {
    /// What it says.
    pub content: String,
    /// Position of the anchor on the base line.
    pub at: [f64; 2],
    /// Height of the font in pixels.
    pub size: f64,
    /// Bold face.
    pub bold: bool,
    /// Colour of the letters.
    pub colour: Colour,
    /// What stands at the position.
    pub anchor: Anchor,
    /// Turned by a quarter, to be read from below.
    pub upright: bool,
    /// A white rim, for text over lines.
    pub halo: bool,
}

/// A rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rect {
    /// Left edge.
    pub x: f64,
    /// Upper edge.
    pub y: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

impl Rect {
    /// Right edge.
    pub fn right(&self) -> f64 {
        self.x + self.width
    }

    /// Lower edge.
    pub fn bottom(&self) -> f64 {
        self.y + self.height
    }
}

/// One thing to draw.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Straight lines through points; closed where it is filled.
    Path {
        /// The corners.
        points: Vec<[f64; 2]>,
        /// Inside, if any.
        fill: Option<Fill>,
        /// Outline, if any.
        stroke: Option<Pen>,
    },
    /// A rectangle.
    Rect {
        /// Where it is.
        rect: Rect,
        /// Inside, if any.
        fill: Option<Fill>,
        /// Outline, if any.
        stroke: Option<Pen>,
    },
    /// A circle.
    Circle {
        /// Its centre.
        centre: [f64; 2],
        /// Its radius.
        radius: f64,
        /// Inside, if any.
        fill: Option<Fill>,
        /// Outline, if any.
        stroke: Option<Pen>,
    },
    /// A line of text.
    Text(Text),
    /// Shapes of which only what is inside the rectangle is seen.
    Clipped {
        /// The window.
        window: Rect,
        /// What is seen through it.
        shapes: Vec<Shape>,
    },
}

/// A finished drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Width in pixels.
    pub width: f64,
    /// Height in pixels.
    pub height: f64,
    /// A sentence that says what is seen, for those who cannot see it.
    pub description: String,
    /// What is drawn, from the back to the front.
    pub shapes: Vec<Shape>,
}

impl Scene {
    /// The drawing as an SVG document; the same scene gives the same bytes.
    pub fn to_svg(&self) -> String {
        svg::render(self)
    }

    /// The drawing as a PNG image with `scale` image points per pixel.
    pub fn to_png(&self, scale: f64) -> Result<Vec<u8>, crate::ChartError> {
        png::render(self, scale)
    }
}
