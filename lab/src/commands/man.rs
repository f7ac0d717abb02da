//! `ratelab man`: manual pages, of the same definition as the command line.

use std::{fs, io, path::Path};

use clap::{Command, CommandFactory};
use clap_mangen::{
    Man,
    roff::{Roff, bold, roman},
};

use crate::{
    cli::{Cli, EXAMPLES},
    error::Error,
    output::print_line,
    version,
};

/// What the page of ratelab itself says beside its options: headings, and what
/// each is about.
const SECTIONS: [(&str, &[(&str, &str)]); 3] = [
    (
        "EXIT STATUS",
        &[
            (
                "0",
                "What was asked for was done. A pole that falls is a result.",
            ),
            (
                "1",
                "It could not be finished: a node failed, a file could not be written, or a \
                 recording is not what comes of running it again.",
            ),
            (
                "2",
                "The input is bad: an option, a value, or a file that is not what it should be.",
            ),
            (
                "128 + n",
                "Signal n ended it: 130 for Ctrl-C (SIGINT), 143 for SIGTERM, 129 for SIGHUP. At \
                 the first a run, a sweep and the lab end in order and write what was done so \
                 far; a second Ctrl-C or SIGTERM ends them at once. In the lab Ctrl-C is the \
                 key q.",
            ),
        ],
    ),
    (
        "ENVIRONMENT",
        &[
            ("NO_COLOR", "Draw without colours, if it is not empty."),
            (
                "ORT_DYLIB_PATH",
                "The library of the ONNX Runtime, which runs policies in .onnx files.",
            ),
            (
                "XDG_DATA_HOME",
                "On Linux, where the folder ratelab with the predictions is; ~/.local/share if \
                 it is not set.",
            ),
        ],
    ),
    (
        "FILES",
        &[
            (
                "recordings/",
                "Where recordings without a name go: a folder of the folder ratelab runs in.",
            ),
            (
                "exercises/answers.toml",
                "Predictions made in a clone of ratelab.",
            ),
            (
                "~/.local/share/ratelab/answers.toml",
                "A file such as this keeps predictions made elsewhere, by the customs of the \
                 system. ratelab exercise says which file it is.",
            ),
            (
                "../lib/ratelab/",
                "Seen from the folder of the program: where it looks for MuJoCo's library when \
                 the clone that it was built in has moved or is gone.",
            ),
        ],
    ),
];

/// Prints the page of ratelab, or writes those of all commands into `folder`.
pub fn man(folder: Option<&Path>) -> Result<(), Error> {
    let mut command = Cli::command().disable_help_subcommand(true);
    command.build();
    let Some(folder) = folder else {
        let page = page(&command, &SECTIONS)?;
        return print_line(String::from_utf8_lossy(&page).trim_end());
    };
    fs::create_dir_all(folder).map_err(|why| Error::unwritable("man", folder, &why))?;
    write(&command, &SECTIONS, folder)?;
    for command in command.get_subcommands() {
        write(command, &[], folder)?;
    }
    Ok(())
}

/// Headings, and below each what is explained: a name, and what it is.
type Sections<'a> = &'a [(&'a str, &'a [(&'a str, &'a str)])];

fn write(command: &Command, sections: Sections, folder: &Path) -> Result<(), Error> {
    let file = folder.join(manual(command).get_filename());
    let page = page(command, sections)?;
    fs::write(&file, page).map_err(|why| Error::unwritable("man", &file, &why))
}

fn manual(command: &Command) -> Man {
    let name = command.get_display_name();
    let name = name.unwrap_or_else(|| command.get_name());
    Man::new(command.clone())
        .title(name.to_uppercase())
        .manual("ratelab")
        .source(concat!("ratelab ", env!("CARGO_PKG_VERSION")))
        .date(version::DATE.unwrap_or_default())
}

/// The page of one command.
fn page(command: &Command, sections: Sections) -> Result<Vec<u8>, Error> {
    render(command, sections).map_err(|why| Error::Write {
        what: "the page".to_owned(),
        why,
    })
}

fn render(command: &Command, sections: Sections) -> io::Result<Vec<u8>> {
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
    for (heading, entries) in sections {
        more.control("SH", [*heading]);
        for (name, what) in *entries {
            more.control("TP", []);
            more.text([bold(*name)]).text([roman(*what)]);
        }
    }
    if !command.has_subcommands() {
        more.control("SH", ["SEE ALSO"]);
        more.text([bold("ratelab"), roman("(1)")]);
    }
    more.to_writer(&mut page)?;
    Ok(page)
}

/// The examples of `command`, line by line as they are.
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
