//! Physics-based prognosis of pneumatic valves from their stroke times.
//!
//! The program only reads, calls and writes: the physics, the tables and the
//! estimates are in the crates of the workspace.

mod cli;
mod commands;
mod failure;
mod output;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let cli = cli::Cli::parse();
    output::set_manner(cli.manner.quiet, cli.manner.verbose, cli.manner.color);
    match commands::run(&cli.verb, cli.manner.units.as_ref()) {
        Ok(answer) => answer.exit_code(),
        Err(error) => failure::report(&error, output::laid_out_for_stderr),
    }
}
