//! What can go wrong when a figure is drawn.

/// Why a figure could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ChartError {
    /// The image would be empty or larger than any screen or page.
    #[error(
        "an image of {width_px:.0} by {height_px:.0} points cannot be drawn; \
         choose a scale that gives 1 to 16384 points a side"
    )]
    ImageSize {
        /// Width asked for, image points.
        width_px: f64,
        /// Height asked for, image points.
        height_px: f64,
    },
    /// The encoder refused the image.
    #[error("the PNG image could not be encoded: {0}")]
    Png(String),
}
