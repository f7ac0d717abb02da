//! Error messages for invalid command lines: one line, with a remedy.

use clap::error::ErrorKind;

use crate::{error::Error, output::printed};

/// Prints requested output, such as help, or turns an error into one line.
pub fn explain(error: &clap::Error) -> Result<(), Error> {
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => printed(error.print()),
        kind => Err(Error::BadInput(one_line(kind, &error.to_string()))),
    }
}

/// Joins clap's lines into one, with the tip at the end. Without a tip for something
/// unknown or missing, refers to the help.
fn one_line(kind: ErrorKind, message: &str) -> String {
    let lines = message.lines().map(str::trim);
    let mut usage = None;
    let (mut said, mut tip) = (Vec::new(), None);
    for line in lines.filter(|line| !line.is_empty()) {
        if let Some(line) = line.strip_prefix("Usage: ") {
            usage = Some(line);
            break;
        }
        match line.strip_prefix("tip: ") {
            // No option here takes values that look like options.
            Some(line) if line.contains("as a value, use '--") => {}
            // What has underscores is an alias of an option with hyphens.
            Some(line) if line.starts_with("a similar argument") => {
                tip = Some(line.replace('_', "-"));
            }
            Some(line) => tip = Some(line.to_owned()),
            None if line.starts_with("For more information") => {}
            None => said.push(line),
        }
    }
    let said = said.join(" ");
    let said = said.strip_prefix("error: ").unwrap_or(&said);
    let unknown = matches!(
        kind,
        ErrorKind::UnknownArgument
            | ErrorKind::InvalidSubcommand
            | ErrorKind::MissingRequiredArgument
    );
    let help = || usage.map(|usage| format!("see {} --help", command(usage)));
    match tip.or_else(|| unknown.then(help).flatten()) {
        Some(tip) => format!("{said}; {tip}"),
        None => said.to_owned(),
    }
}

/// Returns the command at the start of a usage line, such as `ratelab run`.
fn command(usage: &str) -> String {
    let mut words = usage.split_whitespace();
    let program = words.next().into_iter();
    let names = words.take_while(|word| word.chars().all(|c| c.is_ascii_lowercase()));
    program.chain(names).collect::<Vec<_>>().join(" ")
}
