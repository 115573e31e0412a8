//! The same views without a server, for a page that is one file: what they show, their script and their style.

mod campaign;
mod fleet;

pub use campaign::{NamedModel, campaign};
pub use fleet::FrozenFleet;

use crate::assets::{REPORT_SCRIPT, REPORT_STYLE, UPLOT, UPLOT_STYLE};

/// The style of the page.
pub fn style() -> String {
    [UPLOT_STYLE, REPORT_STYLE].concat()
}

/// The script that turns what the page holds into views.
pub fn script() -> String {
    [UPLOT, REPORT_SCRIPT].concat()
}
