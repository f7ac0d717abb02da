//! Scripts: commands of the shell, and what they must print.
//!
//! | in a script | meaning |
//! |---|---|
//! | `# title` | a section, played in a folder of its own; rows before the first one are played in each |
//! | `command => text => text` | it succeeds, prints these texts, and no word of an error |
//! | `2 command => text` | it is refused with status 2 and one error line with these texts, and prints nothing |
//! | `1 command => text` | it fails in the same way with status 1, and may have printed something |
//! | `=> text` | one more text for the command above |
//! | `!text`, `^text`, `text$` | it is not there; it begins a line; it ends one |
//! | `## comment` | the reason for the next row |
//!
//! Each command runs in a shell of its own, as the program that plays the script makes it.

use std::{
    path::Path,
    process::{Command, Output},
};

/// Plays a script in the shells that `shell` makes, of a folder and a line.
///
/// # Panics
/// If something is not as it says, with all that is not.
#[track_caller]
pub fn play(script: &str, shell: impl Fn(&Path, &str) -> Command) {
    let script = format!("\n{script}");
    let mut sections = script.split("\n# ");
    let first = sections.next().unwrap_or_default();
    let faults = sections.flat_map(|section| {
        let (title, rows) = section.split_once('\n').expect("a title");
        let folder = tempfile::tempdir().expect("a folder");
        let rows = format!("{first}\n{rows}");
        let faults = faults(&rows, |line| shell(folder.path(), line)).into_iter();
        faults.map(move |fault| format!("{title} {fault}"))
    });
    let faults: Vec<String> = faults.collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// What is not as `rows` say, played in these shells.
pub fn faults(rows: &str, shell: impl Fn(&str) -> Command) -> Vec<String> {
    let mut commands: Vec<String> = Vec::new();
    for line in rows.lines().map(str::trim) {
        match commands.last_mut() {
            Some(command) if line.starts_with("=> ") => *command = format!("{command} {line}"),
            _ if line.is_empty() || line.starts_with("## ") => {}
            _ => commands.push(line.to_owned()),
        }
    }
    let faults = commands.iter().filter_map(|row| fault(row, &shell));
    faults.collect()
}

/// What is not as this row says.
fn fault(row: &str, shell: impl Fn(&str) -> Command) -> Option<String> {
    let mut cells = row.split(" => ").map(str::trim);
    let command = cells.next()?;
    let (code, line) = match command.split_at_checked(2) {
        Some(("1 ", line)) => (1, line),
        Some(("2 ", line)) => (2, line),
        _ => (0, command),
    };
    let output = shell(line).output().expect("sh starts");
    let wrong: Vec<&str> = cells.filter(|text| !has(&output, text)).collect();
    let right = ended(&output, code) && wrong.is_empty();
    let [printed, errors] = [&output.stdout, &output.stderr].map(|bytes| text(bytes));
    let shown = format!("{}\n{printed}{errors}", output.status);
    (!right).then(|| format!("`{command}` => {wrong:?}: {shown}"))
}

/// Whether a command ended with this status, and printed as much as it should.
fn ended(output: &Output, code: i32) -> bool {
    let errors = text(&output.stderr).lines().count();
    let silent = code != 2 || output.stdout.is_empty();
    output.status.code() == Some(code) && errors == usize::from(code != 0) && silent
}

/// Whether it printed a text, in its error line if it failed.
fn has(output: &Output, wanted: &str) -> bool {
    let printed = if output.status.success() {
        &output.stdout
    } else {
        &output.stderr
    };
    let printed = format!("\n{}\n", text(printed));
    let present = wanted.trim_start_matches('!');
    let part = match present.strip_prefix('^') {
        Some(begins) => format!("\n{begins}"),
        None => present.to_owned(),
    };
    let part = match part.strip_suffix('$') {
        Some(ends) => format!("{ends}\n"),
        None => part,
    };
    printed.contains(&part) == (present == wanted)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}
