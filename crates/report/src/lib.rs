//! Figures and reports of results.
//!
//! A figure is built from plain numbers by a pure function of [`figures`], and
//! drawn by the crate `chart`. The crate knows nothing of valve files, models
//! or logs, reads no file and writes none.
//!
//! ```
//! use report::figures::{Quantity, TableFigure, TablePoint};
//!
//! let figure = TableFigure {
//!     fault: "leak to atmosphere".to_owned(),
//!     quantity: Quantity::new("leak area", "mm²"),
//!     points: vec![
//!         TablePoint { severity: 0.0, close_time_s: Some(1.04), open_time_s: Some(2.13) },
//!         TablePoint { severity: 0.3, close_time_s: Some(1.60), open_time_s: Some(1.30) },
//!     ],
//!     interpolated: Vec::new(),
//!     close_limit_s: None,
//!     open_limit_s: None,
//!     severity_at_limit: None,
//! }
//! .figure();
//! assert!(figure.to_svg().starts_with("<svg"));
//! ```

pub mod figures;
pub mod html;

pub use chart::Figure;
