//! `valve lab`: the model beside its measurements on a page, live.

use answers::InputError;
use lab::{Address, LabError, LabOptions, Output};

use crate::cli::{LabArgs, PageArgs};
use crate::failure::{Answer, Hinted};
use crate::output::{self, Outputs};

/// Serves the page until the process ends.
pub fn run(args: &LabArgs) -> anyhow::Result<Answer> {
    let options = LabOptions {
        valve: args.valve.clone(),
        campaign: args.campaign.clone(),
        address: address(&args.page),
        open: !args.page.no_open,
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
