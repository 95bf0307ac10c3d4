//! Commands about the command itself.

use crate::cli::arguments::command::Arguments;
use crate::cli::console::{Console, print};
use crate::cli::output::schema_page::schema_page;
use crate::cli::work::output_place::make_folder;
use crate::cli::{completion::Completion, failure::Failure};
use crate::formats::write_atomic;
use clap::CommandFactory;
use std::path::Path;

/// Prints a completion script for a shell on stdout.
pub(crate) fn completions(shell: clap_complete::Shell) -> Result<Completion, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "lampyris", &mut script);
    print(&String::from_utf8_lossy(&script))?;
    Ok(Completion::Complete)
}

/// Prints the schema of a scene as JSON, or as a page of Markdown.
pub(crate) fn schema(as_text: bool) -> Result<Completion, Failure> {
    let schema = crate::simulate::Scene::schema();
    print(&if as_text { schema_page(&schema) } else { format!("{schema:#}\n") })?;
    Ok(Completion::Complete)
}

/// Prints the manual page, or writes one page for each command into the folder, which is made.
pub(crate) fn man(folder: Option<&Path>, console: &Console) -> Result<Completion, Failure> {
    let mut command = Arguments::command();
    // Built, so that options of every command stand in every page.
    command.build();
    let render = |command: clap::Command| -> std::io::Result<Vec<u8>> {
        let mut page = Vec::new();
        clap_mangen::Man::new(command).render(&mut page)?;
        Ok(page)
    };
    let Some(folder) = folder else {
        print(&String::from_utf8_lossy(&render(command)?))?;
        return Ok(Completion::Complete);
    };
    make_folder(folder)?;
    let subcommands: Vec<clap::Command> =
        // `help` is clap's own and has no arguments of ours.
        command.get_subcommands().filter(|c| c.get_name() != "help").cloned().collect();
    let mut pages = vec![("lampyris".to_owned(), command)];
    for subcommand in subcommands {
        pages.push((format!("lampyris-{}", subcommand.get_name()), subcommand));
    }
    for (name, command) in pages {
        let path = folder.join(format!("{name}.1"));
        let page = render(command)?;
        write_atomic(&path, |w| w.write_all(&page))?;
        console.say(format_args!("wrote {}", path.display()));
    }
    Ok(Completion::Complete)
}
