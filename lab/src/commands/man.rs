//! `ratelab man`: manual pages, generated from the definition of the command line.

use std::{fs, io, path::Path};

use clap::Command;
use clap_mangen::{
    Man,
    roff::{Roff, bold, roman},
};

use crate::{
    cli::{self, EXAMPLES},
    error::Error,
    output::{OutputFile, print_data},
    program::{self, Program},
    version,
};

/// Additional sections on the page of the program itself.
const SECTIONS: [Section; 3] = [
    (
        "EXIT STATUS",
        &[
            ("0", "Success. A lost run is a result, too."),
            (
                "1",
                "An unfinished command: a node failed, a file could not be written, or a \
                 recording differs from a repetition of its run.",
            ),
            ("2", "Bad input: an invalid option, value or file."),
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
                "../lib/ratelab/",
                "Seen from the folder of the program: where it looks for MuJoCo's library when \
                 the clone that it was built in has moved or is gone.",
            ),
        ],
    ),
];

/// An additional section for a course.
const COURSE: Section = (
    "PREDICTIONS",
    &[
        (
            "exercises/answers.toml",
            "Predictions made in a clone of ratelab.",
        ),
        (
            "~/.local/share/ratelab/answers.toml",
            "A file such as this keeps predictions made elsewhere, by the customs of the system; \
             on Linux the variable XDG_DATA_HOME names another folder than ~/.local/share. \
             ratelab exercise names the file.",
        ),
    ],
);

/// Prints the page of the program, or writes those of all commands into `folder`.
pub fn man(program: &Program, folder: Option<&Path>) -> Result<(), Error> {
    let mut command = cli::command(program).disable_help_subcommand(true);
    command.build();
    let mut sections = SECTIONS.to_vec();
    sections.extend(program.course.then_some(COURSE));
    let Some(folder) = folder else {
        let page = page(&command, &sections)?;
        return print_data(String::from_utf8_lossy(&page).trim_end());
    };
    fs::create_dir_all(folder).map_err(|why| Error::unwritable("man", folder, &why))?;
    write(&command, &sections, folder)?;
    for command in command.get_subcommands() {
        write(command, &[], folder)?;
    }
    Ok(())
}

/// A heading with its entries: a name and an explanation each.
type Section = (&'static str, &'static [(&'static str, &'static str)]);

fn write(command: &Command, sections: &[Section], folder: &Path) -> Result<(), Error> {
    let file = folder.join(manual(command).get_filename());
    let page = page(command, sections)?;
    OutputFile::open("man", &file)?.write(&page)
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

/// Renders the page of one command.
fn page(command: &Command, sections: &[Section]) -> Result<Vec<u8>, Error> {
    render(command, sections).map_err(|why| Error::Write {
        what: "the page".to_owned(),
        why,
    })
}

fn render(command: &Command, sections: &[Section]) -> io::Result<Vec<u8>> {
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
        more.text([bold(program::name()), roman("(1)")]);
    }
    more.to_writer(&mut page)?;
    Ok(page)
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
