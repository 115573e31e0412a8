//! Charts: panels with axes and layers, laid out on a page, turned into one list of shapes, and drawn as SVG or PNG.
//!
//! It knows nothing of what it draws, reads no file and writes none.
//!
//! ```
//! use chart::theme::BLUE;
//! use chart::{Axis, Figure, Layer, Panel};
//!
//! let points = vec![[0.0, 1.0], [1.0, 2.0], [2.0, 4.0]];
//! let panel = Panel::new(Axis::linear("time, s"), Axis::linear("pressure, bar"), 200.0).with(Layer::line(points, BLUE));
//! let svg = Figure::new("Filling", "a made-up vessel").with(panel).to_svg();
//! assert!(svg.contains("pressure, bar"));
//! ```

mod axis;
pub mod draw;
mod error;
mod layer;
mod layout;
mod legend;
mod marks;
mod panel;
pub mod theme;

pub use axis::{Axis, AxisKind};
pub use error::ChartError;
pub use layer::{Bar, Cell, Layer, LineDirection, Marker};
pub use legend::{LegendEntry, Swatch};
pub use panel::Panel;

use crate::draw::Scene;

/// A page of panels.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Headline: what the picture says.
    pub title: String,
    /// A smaller line below the headline: conditions, numbers.
    pub subtitle: String,
    /// Panels side by side.
    pub columns: usize,
    /// Width of the page in pixels.
    pub width: f64,
    /// The panels, row by row.
    pub panels: Vec<Panel>,
}

impl Figure {
    /// A page of one column, 760 pixels wide.
    pub fn new(title: impl Into<String>, subtitle: impl Into<String>) -> Self {
        Self { title: title.into(), subtitle: subtitle.into(), columns: 1, width: 760.0, panels: Vec::new() }
    }

    /// The same page with a panel more.
    #[must_use]
    pub fn with(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// The drawing.
    pub fn scene(&self) -> Scene {
        layout::scene(self)
    }

    /// The figure as an SVG document.
    pub fn to_svg(&self) -> String {
        self.scene().to_svg()
    }

    /// The figure as a PNG image, `scale` image points per pixel (2 suits
    /// today's screens).
    pub fn to_png(&self, scale: f64) -> Result<Vec<u8>, ChartError> {
        self.scene().to_png(scale)
    }
}
