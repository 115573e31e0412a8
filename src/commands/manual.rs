//! `valve help`, `valve completions` and `valve man`: made from the definition of the command line.

use std::io::Write;
use std::path::Path;

use anyhow::Context;
use clap::CommandFactory;
use clap_complete::Shell;

use crate::cli::Cli;
use crate::failure::{Answer, Hinted};
use crate::output::{self, Outputs};

/// Pages beside the help of verbs: about all files, and about all results.
const PAGES: [(&str, &str); 2] =
    [("formats", include_str!("../../docs/formats.md")), ("results", include_str!("../../docs/results.md"))];

/// Prints the help of the program or of a verb, or one of the pages.
pub fn help(topic: &[String]) -> anyhow::Result<Answer> {
    if let [name] = topic
        && let Some((_, page)) = PAGES.iter().find(|(page, _)| page == name)
    {
        return write_out(page.as_bytes());
    }
    let mut command = Cli::command();
    command.build();
    for word in topic {
        let names = command
            .get_subcommands()
            .map(|verb| verb.get_name().to_owned())
            .chain(PAGES.map(|(name, _)| name.to_owned()));
        let names: Vec<String> = names.collect();
        command = command.find_subcommand(word).cloned().ok_or_else(|| {
            let nearest = quantity::suggest::did_you_mean(word, names.iter().map(String::as_str));
            Hinted::error(format!("there is no help about \"{word}\"{nearest}"), format!("one of {}", names.join(", ")))
        })?;
    }
    write_out(command.render_long_help().to_string().as_bytes())
}

/// Prints the completions for a shell.
pub fn completions(shell: Shell) -> anyhow::Result<Answer> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "valve", &mut script);
    write_out(&script)
}

/// Prints the page of the program, or writes a page for each verb into a directory.
pub fn pages(dir: Option<&Path>, force: bool) -> anyhow::Result<Answer> {
    let Some(dir) = dir else {
        let mut page = Vec::new();
        clap_mangen::Man::new(Cli::command()).render(&mut page)?;
        return write_out(&page);
    };
    std::fs::create_dir_all(dir).with_context(|| format!("{}: cannot be made", dir.display()))?;
    let mut program = Cli::command();
    program.build();
    let mut commands = vec![program];
    let mut outputs = Outputs::new(force);
    let mut pages = Vec::new();
    while let Some(command) = commands.pop() {
        commands.extend(command.get_subcommands().filter(|verb| !verb.is_hide_set()).cloned());
        let man = clap_mangen::Man::new(command);
        let mut page = Vec::new();
        man.render(&mut page)?;
        pages.push((outputs.file(&dir.join(man.get_filename()))?, page));
    }
    for (file, page) in pages {
        file.write_whole(&page)?;
    }
    Ok(Answer::Fine)
}

fn write_out(bytes: &[u8]) -> anyhow::Result<Answer> {
    let mut out = output::stdout();
    out.write_all(bytes)?;
    out.flush()?;
    Ok(Answer::Fine)
}
