//! What can be drawn inside a panel.

use crate::draw::{Anchor, Colour};

/// Which way a reference line or a bar runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineDirection {
    /// At one y, along x.
    Horizontal,
    /// At one x, along y.
    Vertical,
}

/// The look of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    /// A filled dot.
    Dot,
    /// A ring.
    Ring,
    /// A filled square, turned by an eighth.
    Diamond,
    /// An empty triangle.
    Triangle,
    /// A filled triangle that points up: it goes on above.
    Up,
}

/// A bar along x on a row of names, or along y at an x.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    /// Row (or x) of the bar's middle.
    pub at: f64,
    /// Where it begins.
    pub from: f64,
    /// Where it ends.
    pub to: f64,
    /// Its colour.
    pub colour: Colour,
    /// Text behind its end.
    pub text: String,
    /// A mark that the text must stand behind as well.
    pub mark: Option<f64>,
}

/// A rectangle of one colour.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Left and right edge, axis values.
    pub x: [f64; 2],
    /// The two horizontal edges, axis values.
    pub y: [f64; 2],
    /// Its colour.
    pub colour: Colour,
    /// Text in its middle.
    pub text: String,
}

/// One layer of a panel; later layers lie over earlier ones.
#[derive(Debug, Clone, PartialEq)]
pub enum Layer {
    /// A line through points; a point that is not a number interrupts it.
    Line {
        /// The points, x and y.
        points: Vec<[f64; 2]>,
        /// Its colour.
        colour: Colour,
        /// Its width in pixels.
        width: f64,
        /// Dashed rather than solid.
        dashed: bool,
    },
    /// The area between two lines: x, lower y, upper y.
    Band {
        /// The edges.
        points: Vec<[f64; 3]>,
        /// Its colour.
        colour: Colour,
        /// 0 invisible to 1 opaque.
        opacity: f64,
    },
    /// Single points.
    Points {
        /// The points, x and y.
        points: Vec<[f64; 2]>,
        /// Their colour.
        colour: Colour,
        /// Their radius in pixels.
        radius: f64,
        /// Their look.
        marker: Marker,
    },
    /// Error bars along x or y: position across, lower end, upper end.
    Whiskers {
        /// Position, lower end, upper end.
        spans: Vec<[f64; 3]>,
        /// Their colour.
        colour: Colour,
        /// Along x (on rows) or along y.
        direction: LineDirection,
    },
    /// A reference line across the panel.
    Level {
        /// The value it stands for.
        at: f64,
        /// Which way it runs.
        direction: LineDirection,
        /// Its colour.
        colour: Colour,
        /// Dashed rather than solid.
        dashed: bool,
        /// What it is, written beside it.
        text: String,
    },
    /// A shaded stretch of the x axis.
    Stretch {
        /// From and to, x values.
        x: [f64; 2],
        /// Its colour.
        colour: Colour,
        /// What it is, written at its top.
        text: String,
    },
    /// Text at a place.
    Note {
        /// Where, x and y values.
        at: [f64; 2],
        /// Shift in pixels, right and down.
        shift: [f64; 2],
        /// What it says.
        text: String,
        /// Its colour.
        colour: Colour,
        /// Which part of it stands there.
        anchor: Anchor,
    },
    /// Bars.
    Bars {
        /// The bars.
        bars: Vec<Bar>,
        /// Along x or along y.
        direction: LineDirection,
        /// Thickness in axis units of the other axis.
        thickness: f64,
    },
    /// A map of coloured cells.
    Cells(Vec<Cell>),
    /// A bracket right of the panel, over rows from one to another.
    Bracket {
        /// First and last row.
        rows: [f64; 2],
        /// Distance from the panel's right edge, pixels.
        offset: f64,
        /// What they have in common.
        text: String,
    },
}

impl Layer {
    /// A solid line of normal width.
    pub fn line(points: Vec<[f64; 2]>, colour: Colour) -> Self {
        Self::Line { points, colour, width: 2.0, dashed: false }
    }

    /// Dots of normal size.
    pub fn dots(points: Vec<[f64; 2]>, colour: Colour) -> Self {
        Self::Points { points, colour, radius: 3.2, marker: Marker::Dot }
    }

    /// A band that lets lines below it shine through.
    pub fn band(points: Vec<[f64; 3]>, colour: Colour) -> Self {
        Self::Band { points, colour, opacity: 0.22 }
    }

    /// All x values of the layer that the axis should show.
    pub(super) fn xs(&self) -> Vec<f64> {
        match self {
            Self::Line { points, .. } | Self::Points { points, .. } => points.iter().map(|point| point[0]).collect(),
            Self::Band { points, .. } => points.iter().map(|point| point[0]).collect(),
            Self::Whiskers { spans, direction: LineDirection::Horizontal, .. } => {
                spans.iter().flat_map(|span| [span[1], span[2]]).collect()
            }
            Self::Whiskers { spans, .. } => spans.iter().map(|span| span[0]).collect(),
            Self::Level { at, direction: LineDirection::Vertical, .. } => vec![*at],
            Self::Stretch { x, .. } => x.to_vec(),
            Self::Note { at, .. } => vec![at[0]],
            Self::Bars { bars, direction: LineDirection::Horizontal, .. } => {
                bars.iter().flat_map(|bar| [bar.from, bar.to]).collect()
            }
            Self::Bars { bars, thickness, .. } => {
                bars.iter().flat_map(|bar| [bar.at - thickness, bar.at + thickness]).collect()
            }
            Self::Cells(cells) => cells.iter().flat_map(|cell| cell.x).collect(),
            Self::Level { .. } | Self::Bracket { .. } => Vec::new(),
        }
    }

    /// All y values of the layer that the axis should show.
    pub(super) fn ys(&self) -> Vec<f64> {
        match self {
            Self::Line { points, .. } | Self::Points { points, .. } => points.iter().map(|point| point[1]).collect(),
            Self::Band { points, .. } => points.iter().flat_map(|edge| [edge[1], edge[2]]).collect(),
            Self::Whiskers { spans, direction: LineDirection::Vertical, .. } => {
                spans.iter().flat_map(|span| [span[1], span[2]]).collect()
            }
            Self::Whiskers { spans, .. } => spans.iter().map(|span| span[0]).collect(),
            Self::Level { at, direction: LineDirection::Horizontal, .. } => vec![*at],
            Self::Note { at, .. } => vec![at[1]],
            Self::Bars { bars, direction: LineDirection::Vertical, .. } => {
                bars.iter().flat_map(|bar| [bar.from, bar.to]).collect()
            }
            Self::Bars { bars, .. } => bars.iter().map(|bar| bar.at).collect(),
            Self::Cells(cells) => cells.iter().flat_map(|cell| cell.y).collect(),
            Self::Level { .. } | Self::Stretch { .. } | Self::Bracket { .. } => Vec::new(),
        }
    }
}
