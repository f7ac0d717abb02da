//! Performs the steps of a page and compares their output with the page.

use std::{fs, ops::Range};

use ratelab_recording::rrd::rerun_version;
use snapbox::{Assert, Data, IntoData};

use crate::{
    page::{ManualPage, ShownOutput, Step},
    root,
    shell::{Shell, takes_the_terminal},
};

/// A new text for a part of a page.
pub type Edit = (Range<usize>, String);

/// Performs a step; returns the necessary change of the page, if there is one.
pub fn perform(page: &ManualPage, step: &Step, shell: &Shell) -> Result<Option<Edit>, String> {
    let command = &step.command;
    if is_tried_elsewhere(command) {
        return Ok(None);
    }
    let failed = |why| format!("$ {command}\n{why}");
    if takes_the_terminal(command) {
        return shell.look(command).map(|()| None).map_err(failed);
    }
    let all = !matches!(step.shown, ShownOutput::Generated(_));
    let printed = shell.run(command, all).map_err(failed)?;
    Ok(match &step.shown {
        ShownOutput::Success => None,
        ShownOutput::Output(place) => {
            let (said, printed) = (page.text[place.clone()].trim_end(), printed.trim_end());
            let differs = compare(command, said, printed).is_err();
            differs.then(|| (place.clone(), masked(printed)))
        }
        ShownOutput::Generated(place) => generated(page, place, &printed),
    })
}

/// Compares the output of a command with the expected output; returns the difference as
/// an error.
fn compare(title: &str, said: &str, printed: &str) -> Result<(), String> {
    let compare = Assert::new().normalize_paths(false);
    let (printed, said) = (Data::text(printed), said.to_owned().into_data());
    let compared = compare.try_eq(Some(&title), printed, said);
    compared.map_err(|difference| difference.to_string())
}

/// Parts that differ from run to run: the text before and after each.
const OPEN: [(&str, &str); 3] = [
    (" s sim (", " s wall)"),
    (".rrd (", " kB"),
    ("kept in ", "/exercises/answers.toml"),
];

/// Output in the form for a page: wall times and file sizes are masked.
fn masked(printed: &str) -> String {
    let lines = printed.lines().map(|line| {
        OPEN.iter().fold(line.to_owned(), |line, (before, after)| {
            let start = line.find(before).map(|at| at + before.len());
            let end = start.and_then(|start| Some(start + line[start..].find(after)?));
            match (start, end) {
                (Some(start), Some(end)) => format!("{}[..]{}", &line[..start], &line[end..]),
                _ => line,
            }
        }) + "\n"
    });
    lines.collect()
}

/// The new text of a generated part, within its fence if it has one.
fn generated(page: &ManualPage, place: &Range<usize>, printed: &str) -> Option<Edit> {
    let said = &page.text[place.clone()];
    let first = said.find('\n').map_or(0, |end| end + 1);
    let fenced = said.starts_with("```");
    let printed = printed.trim_end();
    let now = match (fenced, said.trim_end().rfind('\n')) {
        (true, Some(last)) => format!("{}{printed}\n{}", &said[..first], &said[last + 1..]),
        _ => format!("{printed}\n"),
    };
    (said != now).then(|| (place.clone(), now))
}

/// Updates a page.
pub fn update(page: &ManualPage, edits: Vec<Edit>) {
    let mut text = page.text.clone();
    for (place, now) in edits.into_iter().rev() {
        text.replace_range(place, &now);
    }
    fs::write(root().join(&page.name), text).expect("written");
}

/// The difference between a part of a page and its expected text.
pub fn differs(page: &ManualPage, place: Range<usize>, now: &str) -> String {
    let title = format!("line {}", page.text[..place.start].lines().count() + 1);
    match compare(&title, &page.text[place], now) {
        Ok(()) => format!("{title}: white space differs"),
        Err(difference) => difference,
    }
}

/// Whether a command is tested elsewhere: by `.ci/run`, or not at all if it only names
/// the version of the recorder.
fn is_tried_elsewhere(command: &str) -> bool {
    let viewer = rerun_version();
    let checks = fs::read_to_string(root().join(".ci/run")).expect(".ci/run");
    let step = format!("step {command}");
    let mut steps = checks.lines().filter_map(|line| line.strip_prefix(&step));
    steps.any(|more| more.is_empty() || more.starts_with(' '))
        || command == format!("python3 -m pip install rerun-sdk=={viewer}")
}
