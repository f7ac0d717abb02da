//! Examples at the end of each help text and manual page.

use clap::Command;

use crate::program;

/// Heading of the examples.
pub const EXAMPLES: &str = "Examples:\n";

/// The examples of all commands.
const OF_COMMANDS: &str = include_str!("examples.txt");

/// Returns the lines of the command called `name`; empty for the program itself.
fn lines_for(name: &str) -> impl Iterator<Item = &'static str> {
    let heading = format!("[{name}]");
    OF_COMMANDS
        .lines()
        .skip_while(move |line| *line != heading)
        .skip(1)
        .take_while(|line| !line.starts_with('['))
        .filter(|line| !line.is_empty())
}

/// Adds to `command` the examples whose options it has.
pub fn add(command: Command) -> Command {
    let program = program::name();
    let name = command.get_name();
    let name = if name == program { "" } else { name };
    let known = |option: &str| {
        let mut options = command.get_arguments().filter_map(|arg| arg.get_long());
        option == "help" || options.any(|known| known == option)
    };
    let lines: Vec<String> = lines_for(name)
        .filter(|line| {
            line.split_whitespace()
                .all(|word| word.strip_prefix("--").is_none_or(known))
        })
        .map(|line| format!("  {}", line.replace("ratelab", &program)))
        .collect();
    if lines.is_empty() {
        return command;
    }
    command.after_help(format!("{EXAMPLES}{}", lines.join("\n")))
}
