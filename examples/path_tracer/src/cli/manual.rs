//! `path-tracer completions` and `path-tracer man`: what shells and `man` know of the command line, from the command line itself.

use std::io::{self, Write as _};

use clap::CommandFactory as _;

use super::{Arguments, Failure};

#[derive(Debug, clap::Args)]
pub(crate) struct CompletionsArguments {
    /// The shell.
    shell: clap_complete::Shell,
}

#[derive(Debug, clap::Args)]
pub(crate) struct ManArguments {
    /// The page of one command; without it, that of path-tracer as a whole.
    command: Option<String>,
}

pub(crate) fn completions(arguments: &CompletionsArguments) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::command(), "path-tracer", &mut script);
    print(&script);
    Ok(())
}

pub(crate) fn man(arguments: &ManArguments) -> Result<(), Failure> {
    let mut whole = Arguments::command();
    // Tells every command its full name, which its page shows.
    whole.build();
    let command = match &arguments.command {
        None => whole,
        Some(name) => whole.find_subcommand(name).cloned().ok_or_else(|| {
            let names: Vec<&str> = whole.get_subcommands().map(clap::Command::get_name).collect();
            Failure::Usage(format!("man {name}: no such command; these are {}", names.join(", ")))
        })?,
    };
    let mut page = Vec::new();
    clap_mangen::Man::new(command).render(&mut page).map_err(|error| Failure::Runtime(error.to_string()))?;
    print(&page);
    Ok(())
}

/// A reader that has gone away is no error.
fn print(text: &[u8]) {
    let _ = io::stdout().write_all(text);
}
