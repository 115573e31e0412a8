//! What the browser loads, inside the program. `web/build.sh` builds these files from the sources in `web/`.

use axum::Router;
use axum::http::header;
use axum::routing::get;

use crate::site::Site;

/// A page with its script.
pub struct Page {
    /// The document.
    pub html: &'static str,
    /// Its script.
    pub script: &'static str,
}

/// The lab.
pub const LAB: Page = Page { html: include_str!("../assets/lab.html"), script: include_str!("../assets/lab.js") };

/// The watch.
pub const WATCH: Page = Page { html: include_str!("../assets/watch.html"), script: include_str!("../assets/watch.js") };

/// The script of a page without a server.
pub const REPORT_SCRIPT: &str = include_str!("../assets/report.js");
/// Its style.
pub const REPORT_STYLE: &str = include_str!("../assets/report.css");
/// The library of charts.
pub const UPLOT: &str = include_str!("../assets/uPlot.iife.min.js");
const STYLE: &str = include_str!("../assets/style.css");
/// The style of the charts.
pub const UPLOT_STYLE: &str = include_str!("../assets/uPlot.min.css");

/// The files of a page, at the site's paths.
pub fn routes<S: Clone + Send + Sync + 'static>(site: &Site, page: &'static Page) -> Router<S> {
    const HTML: &str = "text/html; charset=utf-8";
    const SCRIPT: &str = "text/javascript; charset=utf-8";
    const CSS: &str = "text/css; charset=utf-8";
    let files = [
        ("/", HTML, page.html),
        ("/page.js", SCRIPT, page.script),
        ("/style.css", CSS, STYLE),
        ("/uPlot.iife.min.js", SCRIPT, UPLOT),
        ("/uPlot.min.css", CSS, UPLOT_STYLE),
    ];
    files.into_iter().fold(Router::new(), |router, (path, kind, text)| {
        router.route(&site.path(path), get(move || async move { ([(header::CONTENT_TYPE, kind)], text) }))
    })
}
