//! `valve watch`: how the valves of growing logs stand, on a page, live.

use lab::WatchOptions;
use prognoser::Method;

use super::lab::address;
use crate::cli::WatchArgs;
use crate::failure::Answer;

/// Serves the page until the process ends.
pub fn run(args: &WatchArgs) -> anyhow::Result<Answer> {
    lab::watch(WatchOptions {
        logs: args.logs.clone(),
        tables: args.tables.clone(),
        method: Method::default(),
        address: address(&args.page),
        open: !args.page.no_open,
    })?;
    Ok(Answer::Fine)
}
