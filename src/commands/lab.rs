//! `valve lab`: the model beside its measurements on a page, live.

use answers::InputError;
use lab::{Address, LabError, LabOptions, LifeTeller, Output};

use serde_json::json;

use super::adopt_life::Lives;
use super::log_input::LogInput;
use crate::cli::{LabArgs, PageArgs};
use crate::failure::{Answer, Hinted};
use crate::output::{self, Outputs};

/// Serves the page until the process ends.
pub fn run(args: &LabArgs) -> anyhow::Result<Answer> {
    // Whether the log can be read is known before a page is served.
    let mut log = args.log.as_deref().map(|log| LogInput::open(log, &args.columns, false)).transpose()?;
    log.iter_mut().for_each(LogInput::announce);
    let options = LabOptions {
        valve: args.valve.clone(),
        campaign: args.campaign.clone(),
        address: address(&args.page),
        open: !args.page.no_open,
        lives: args.log.clone().map(|log| -> Box<LifeTeller> {
            let columns = args.columns.clone();
            Box::new(move |models| {
                let told = Lives::read(&log, &columns, models);
                told.map(|lives| json!(lives.document())).map_err(|error| format!("{error:#}"))
            })
        }),
        writer: Box::new(|output| write(output).map_err(|error| format!("{error:#}"))),
    };
    lab::lab(options, &|doubt| output::note(&format!("warning: {doubt}"))).map_err(|error| match &error {
        LabError::Input(input) => match InputError::hint(input) {
            Some(hint) => Hinted::error(error.to_string(), hint),
            None => error.into(),
        },
        LabError::Serve(_) => error.into(),
    })?;
    Ok(Answer::Fine)
}

fn write(output: &Output<'_>) -> anyhow::Result<()> {
    let mut outputs = Outputs::new(output.replace).reads(output.keep);
    outputs.file(output.path)?.write_whole(output.bytes)
}

/// Where a page is served.
pub fn address(args: &PageArgs) -> Address {
    Address { host: args.host, port: args.port, token: args.token.clone() }
}
