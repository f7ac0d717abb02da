//! The manual is true: README, `docs/` and the pages beside them.
//!
//! Every command on a page is run and must print what the page shows; every part
//! that a command makes is made again; every figure in prose has a source in
//! `docs/figures.toml`, which is asked; links lead somewhere, options exist, and
//! the first five minutes are played in a real terminal, word for word.
//!
//! `cargo test manual` checks it all, the pictures too;
//! `RATELAB_UPDATE=1` before it writes what commands print now into the pages.
#![cfg(all(target_os = "linux", target_arch = "x86_64"))] // Whose figures the pages show.

mod figures;
mod page;
mod shell;
#[path = "../common/terminal.rs"]
mod terminal;
mod tour;

use std::{
    env, fs,
    ops::Range,
    path::{Path, PathBuf},
};

use snapbox::{Assert, Data, IntoData};

use figures::Figures;
use page::{Command, Page, Shown, Step};
use shell::{Shell, takes_the_terminal};

/// Whether a command is tried elsewhere: by `.ci/run`, or not at all, for there is
/// nothing to try but a version, which is that of the recorder.
fn is_tried_elsewhere(command: &str) -> bool {
    let viewer = rerun::build_info().version;
    let checks = fs::read_to_string(root().join(".ci/run")).expect(".ci/run");
    let step = format!("step {command}");
    let mut steps = checks.lines().filter_map(|line| line.strip_prefix(&step));
    steps.any(|more| more.is_empty() || more.starts_with(' '))
        || command == format!("python3 -m pip install rerun-sdk=={viewer}")
}

/// The picture that a test of the dashboard draws.
const PICTURE: &str = "lab/picture.svg";

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// Text to be put into a page, and where.
type Edit = (Range<usize>, String);

/// Checks a page, or brings it up to date.
fn check(name: &str) {
    let page = Page::read(root(), name);
    Shell::check_examples(root());
    let shell = Shell::new(root());
    let (mut faults, mut edits) = (Vec::new(), Vec::new());
    for step in &page.steps {
        match perform(&page, step, &shell) {
            Ok(edit) => edits.extend(edit),
            Err(fault) => faults.push(fault),
        }
    }
    if !edits.is_empty() && env::var_os("RATELAB_UPDATE").is_some() {
        update(&page, edits);
    } else {
        faults.extend(
            edits
                .into_iter()
                .map(|(place, now)| differs(&page, place, now)),
        );
    }
    faults.extend(Figures::read(root()).check(&page, root(), &tour::part(&page)));
    faults.extend(
        page.unknown
            .iter()
            .map(|part| format!("nobody checks {part}")),
    );
    faults.extend(dead_links(&page));
    let undrawn = page.pictures.iter().filter(|picture| *picture != PICTURE);
    faults.extend(undrawn.map(|picture| format!("no test draws {picture}")));
    faults.extend(unknown_words(&page, &shell));
    assert!(
        faults.is_empty(),
        "{name} is not true:\n\n{}\n\nRATELAB_UPDATE=1 cargo test manual \
         writes what commands print now into the page.",
        faults.join("\n\n")
    );
}

/// Does as a reader is told; what the page would have to say instead, if it does
/// not say so.
fn perform(page: &Page, step: &Step, shell: &Shell) -> Result<Option<Edit>, String> {
    let command = match &step.command {
        Command::Table(file) => return Ok(table(page, step, file)),
        Command::Shell(command) => command,
    };
    if is_tried_elsewhere(command) {
        return Ok(None);
    }
    let failed = |why| format!("$ {command}\n{why}");
    if takes_the_terminal(command) {
        return shell.look(command).map(|()| None).map_err(failed);
    }
    let all = !matches!(step.shown, Shown::Generated(_));
    let printed = shell.run(command, all).map_err(failed)?;
    Ok(match &step.shown {
        Shown::Success => None,
        Shown::Output(place) => {
            let same = agree(page.text[place.clone()].trim_end(), printed.trim_end());
            (!same).then(|| (place.clone(), masked(printed.trim_end())))
        }
        Shown::Generated(place) => generated(page, place, &printed),
    })
}

/// Whether a command printed what was to be seen.
fn agree(said: &str, printed: &str) -> bool {
    let compare = Assert::new().normalize_paths(false);
    let printed = Data::text(printed);
    compare.try_eq(None, printed, said.into_data()).is_ok()
}

/// Output as it goes into a page: wall times and file sizes are left open.
fn masked(printed: &str) -> String {
    let mut text = printed
        .lines()
        .fold(String::new(), |text, line| text + line + "\n");
    for (before, after) in [
        (" s sim (", " s wall)"),
        (".rrd (", " kB"),
        ("kept in ", "/exercises/answers.toml"),
    ] {
        let pieces: Vec<_> = text.split(before).map(str::to_owned).collect();
        text = pieces[0].clone();
        for piece in &pieces[1..] {
            let open = piece
                .find(after)
                .map_or(piece.clone(), |end| format!("[..]{}", &piece[end..]));
            text += &format!("{before}{open}");
        }
    }
    text
}

/// What is to stand between the comments of a part that a command makes; inside
/// of its fence, if it has one.
fn generated(page: &Page, place: &Range<usize>, printed: &str) -> Option<Edit> {
    let said = &page.text[place.clone()];
    let first = said.find('\n').map_or(0, |end| end + 1);
    let fenced = said.starts_with("```");
    let now = match (fenced, said.trim_end().rfind('\n')) {
        (true, Some(last)) => {
            format!(
                "{}{}\n{}",
                &said[..first],
                printed.trim_end(),
                &said[last + 1..]
            )
        }
        _ => format!("{}\n", printed.trim_end()),
    };
    (said != now).then(|| (place.clone(), now))
}

/// A CSV file as a page shows it: what its comments tell as a list, and its rows as
/// a table.
fn table(page: &Page, step: &Step, file: &str) -> Option<Edit> {
    let Shown::Generated(place) = &step.shown else {
        return None;
    };
    let text = fs::read_to_string(root().join(file)).expect(file);
    let (facts, rows): (Vec<_>, Vec<_>) = text.lines().partition(|line| line.starts_with('#'));
    let mut now = facts.join("\n").replace("# ", "- ") + "\n\n";
    for (number, row) in rows.iter().enumerate() {
        let cells: Vec<_> = row.split(',').collect();
        now += &format!("| {} |\n", cells.join(" | "));
        if number == 0 {
            now += &format!("|{}\n", "---|".repeat(cells.len()));
        }
    }
    generated(page, place, &now)
}

fn update(page: &Page, edits: Vec<Edit>) {
    let mut text = page.text.clone();
    for (place, now) in edits.into_iter().rev() {
        text.replace_range(place, &now);
    }
    fs::write(root().join(&page.name), text).expect("written");
}

fn differs(page: &Page, place: Range<usize>, now: String) -> String {
    let line = page.text[..place.start].lines().count() + 1;
    let compare = Assert::new().normalize_paths(false);
    let said = page.text[place].to_owned();
    match compare.try_eq(
        Some(&format!("line {line}")),
        Data::text(now),
        said.into_data(),
    ) {
        Ok(()) => format!("line {line}: white space differs"),
        Err(difference) => difference.to_string(),
    }
}

/// Links to files that are not there, and to headings that nobody wrote.
fn dead_links(page: &Page) -> Vec<String> {
    let folder = Path::new(&page.name).with_file_name("");
    let links = page.links.iter().filter(|link| !link.contains("://"));
    let dead = links.filter(|link| {
        let (file, heading) = link.split_once('#').unwrap_or((link, ""));
        let path = if file.is_empty() {
            PathBuf::from(&page.name)
        } else {
            folder.join(file)
        };
        let there = root().join(&path).exists();
        let wanted = there && !heading.is_empty();
        !there || wanted && !Page::read(root(), &path.display().to_string()).has(heading)
    });
    dead.map(|link| format!("{link} leads nowhere")).collect()
}

/// Commands and options in the text that ratelab does not know.
fn unknown_words(page: &Page, shell: &Shell) -> Vec<String> {
    let help = |of: &str| shell.run(&format!("ratelab {of} --help"), true).expect(of);
    let commands = help("");
    let known = ["", "run", "sweep", "exercise", "replay"]
        .map(help)
        .join("");
    let mut faults = Vec::new();
    for code in &page.code {
        let ours = code
            .strip_prefix("cargo run -- ")
            .or(code.strip_prefix("ratelab "));
        let command = ours.and_then(|ours| ours.split(' ').next());
        let command = command.filter(|word| word.chars().all(char::is_lowercase));
        if command.is_some_and(|command| !commands.contains(&format!("\n  {command} "))) {
            faults.push(format!("there is no such command: {code}"));
        }
        let options = ours
            .unwrap_or(code)
            .split(' ')
            .filter(|word| word.starts_with("--"));
        let foreign = ours.is_none() && !code.starts_with("--");
        let mut options = options.filter(|option| !foreign && !known.contains(option));
        if let Some(option) = options.next() {
            faults.push(format!("there is no option {option}: {code}"));
        }
    }
    faults
}

/// A test for each page.
macro_rules! manual {
    ($($test:ident: $page:literal),* $(,)?) => {
        /// The pages of the manual.
        const PAGES: &[&str] = &[$($page),*];

        mod manual {
            $(
                #[test]
                fn $test() {
                    crate::check($page);
                }
            )*
        }
    };
}

manual! {
    readme: "README.md",
    concepts: "docs/concepts.md",
    commands: "docs/commands.md",
    recordings: "docs/recordings.md",
    brains: "docs/brains.md",
    your_own: "docs/your-own.md",
    costs: "docs/costs.md",
    ros2: "docs/ros2.md",
    chapter: "docs/chapter.md",
    exercises: "exercises/README.md",
    reference_recordings: "recordings/README.md",
    policies: "policies/README.md",
    golden: "tests/golden/README.md",
}

/// The pages in `folder` and below, but for what cargo and git keep there.
fn pages_in(folder: &str) -> Vec<String> {
    let entries = fs::read_dir(root().join(folder)).expect("folder");
    let names = entries.map(|entry| entry.expect("an entry").file_name());
    let names = names.filter_map(|name| name.into_string().ok());
    let paths = names.filter(|name| !name.starts_with('.') && name != "target");
    let paths = paths.map(|name| format!("{folder}{name}"));
    paths
        .flat_map(|path| match root().join(&path).is_dir() {
            true => pages_in(&format!("{path}/")),
            false if path.ends_with(".md") => vec![path],
            false => Vec::new(),
        })
        .collect()
}

#[test]
fn no_page_of_the_manual_is_left_out() {
    // The list of dependencies is held against cargo by a test of its own.
    let elsewhere = "docs/dependencies.md";
    for page in pages_in("").iter().filter(|page| *page != elsewhere) {
        let known = PAGES.contains(&page.as_str());
        assert!(known, "{page} is not checked: name it in {}", file!());
    }
    for page in Figures::read(root()).pages() {
        assert!(
            PAGES.contains(&page),
            "docs/figures.toml: there is no page {page}"
        );
    }
}
