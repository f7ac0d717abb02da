//! The commands for help: completions, keys and manual pages.

use std::{fs, io, path::Path};

use clap::Command;
use clap_complete::{Shell, generate};
use clap_mangen::{
    Man,
    roff::{Roff, bold, roman},
};
use ratelab_experiment::{Config, own_world};
use ratelab_screen::keys::{self, Need};

use crate::{
    cli::{self, EXAMPLES},
    error::Error,
    output::{OutputKind, print_data, print_line, write_error},
    program::{self, Program},
};

/// Prints the script for `shell`.
pub fn completions(program: &Program, shell: Shell) -> Result<(), Error> {
    let mut command = cli::command(program);
    let name = command.get_name().to_owned();
    // Generated in memory first, because the generator panics when it writes to a closed
    // pipe.
    let mut script = Vec::new();
    generate(shell, &mut command, name, &mut script);
    print_data(String::from_utf8_lossy(&script).trim_end())
}

/// Prints the keys of the lab that have an effect for the system.
pub fn print_keys(program: &Program) -> Result<(), Error> {
    let own_world = own_world(&program.system, &Config::default()).is_some();
    let has = |need| match need {
        Need::Course => program.course,
        Need::Breakable => program.system.knobs().broken().is_some(),
        Need::OwnWorld => own_world,
        Need::Nothing | Need::Choices | Need::SecondRate | Need::Sides => true,
    };
    print_line(&format!(
        "{}\nwhile the cliff map is open:\n{}\nwhile a recording plays:\n{}",
        keys::LAB.text(has),
        keys::MAP.text(|_| true),
        keys::REPLAY.text(|_| true).trim_end()
    ))
}

/// Additional sections on the page of the program itself: headings, and entries of a name with
/// an indented explanation each.
const SECTIONS: &str = include_str!("man/sections.txt");

/// An additional section for a course.
const COURSE: &str = include_str!("man/course.txt");

/// Prints the page of the program, or writes the pages of all commands into `folder`.
pub fn man(program: &Program, folder: Option<&Path>) -> Result<(), Error> {
    let mut command = cli::command(program).disable_help_subcommand(true);
    command.build();
    let course = if program.course { COURSE } else { "" };
    let sections = [SECTIONS, course].concat();
    let Some(folder) = folder else {
        let page = page(&command, &sections)?;
        return print_data(String::from_utf8_lossy(&page).trim_end());
    };
    fs::create_dir_all(folder).map_err(|why| Error::unwritable("man", folder, &why))?;
    let pages = [(&command, &*sections)]
        .into_iter()
        .chain(command.get_subcommands().map(|command| (command, "")));
    let files = pages.map(|(command, sections)| {
        let file = folder.join(manual(command).get_filename());
        let file = OutputKind::Manual.open("man", &file)?;
        Ok((file, page(command, sections)?))
    });
    // All are checked before the first is written.
    let files = files.collect::<Result<Vec<_>, Error>>()?;
    files
        .into_iter()
        .try_for_each(|(file, page)| file.write(&page))
}

fn manual(command: &Command) -> Man {
    let name = command
        .get_display_name()
        .unwrap_or_else(|| command.get_name());
    Man::new(command.clone())
        .title(name.to_uppercase())
        .manual("ratelab")
        .source(concat!("ratelab ", env!("CARGO_PKG_VERSION")))
        .date(program::DATE.unwrap_or_default())
}

/// Renders the page of one command.
fn page(command: &Command, sections: &str) -> Result<Vec<u8>, Error> {
    render(command, sections).map_err(|why| write_error(Path::new("the page"), why))
}

fn render(command: &Command, sections: &str) -> io::Result<Vec<u8>> {
    let manual = manual(command);
    let mut page = Vec::new();
    manual.render_title(&mut page)?;
    manual.render_name_section(&mut page)?;
    manual.render_synopsis_section(&mut page)?;
    manual.render_description_section(&mut page)?;
    manual.render_options_section(&mut page)?;
    if command.has_subcommands() {
        manual.render_subcommands_section(&mut page)?;
    }
    let mut more = Roff::new();
    examples(&mut more, command);
    add(&mut more, sections);
    if !command.has_subcommands() {
        more.control("SH", ["SEE ALSO"]);
        more.text([bold(program::name()), roman("(1)")]);
    }
    more.to_writer(&mut page)?;
    Ok(page)
}

/// Adds further `sections`.
fn add(page: &mut Roff, sections: &str) {
    let mut lines = sections.lines().peekable();
    while let Some(line) = lines.next() {
        if let Some(heading) = line.strip_prefix("# ") {
            page.control("SH", [heading]);
        } else if !line.is_empty() {
            let text: Vec<&str> =
                std::iter::from_fn(|| lines.next_if(|line| line.starts_with(' ')))
                    .map(str::trim)
                    .collect();
            page.control("TP", []);
            page.text([bold(line)]).text([roman(text.join(" "))]);
        }
    }
}

/// Adds the examples of `command`, one per line.
fn examples(page: &mut Roff, command: &Command) {
    let text = command.get_after_help().map(ToString::to_string);
    let Some(examples) = text.as_deref().and_then(|text| text.strip_prefix(EXAMPLES)) else {
        return;
    };
    page.control("SH", ["EXAMPLES"]).control("nf", []);
    for example in examples.lines() {
        page.text([roman(example.trim_start())]);
    }
    page.control("fi", []);
}
