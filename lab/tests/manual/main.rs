//! The manual is correct: README, `docs/` and the other pages.
//!
//! Every command on a page is run and must print the output on the page; every generated
//! part is generated again; links have targets, options exist, and the first five minutes
//! are played in a real terminal.
//!
//! `cargo test manual -- --include-ignored` checks everything, including the pictures; with
//! `RATELAB_UPDATE=1` it writes the current output of commands into the pages.
#![cfg(all(target_os = "linux", target_arch = "x86_64"))] // Whose figures the pages show.

mod page;
mod shell;
mod steps;
#[path = "../support/mod.rs"]
mod support;
mod tour;
mod words;

use std::{env, fs, path::Path};

use page::ManualPage;
use shell::Shell;

/// Folders that may contain pages, beside the README.
const ROOMS: [&str; 10] = [
    "benches",
    "crates",
    "docs",
    "examples",
    "exercises",
    "lab",
    "policies",
    "recordings",
    "src",
    "tests",
];

/// The pictures drawn by tests of the dashboard.
const PICTURES: [&str; 2] = ["lab/picture.svg", "lab/moving.svg"];

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// Checks a page, or updates it.
fn check(name: &str) {
    let page = ManualPage::read(root(), name);
    let shell = Shell::new(root());
    let (mut faults, mut edits) = (Vec::new(), Vec::new());
    for step in &page.steps {
        match steps::perform(&page, step, &shell) {
            Ok(edit) => edits.extend(edit),
            Err(fault) => faults.push(fault),
        }
    }
    if !edits.is_empty() && env::var_os("RATELAB_UPDATE").is_some() {
        steps::update(&page, edits);
    } else {
        let differ = edits.into_iter();
        faults.extend(differ.map(|(place, now)| steps::differs(&page, place, &now)));
    }
    let unknown = page.unknown.iter();
    faults.extend(unknown.map(|part| format!("nobody checks {part}")));
    let is_drawn = |picture: &&String| PICTURES.iter().any(|drawn| picture.ends_with(drawn));
    let undrawn = page.pictures.iter().filter(|picture| !is_drawn(picture));
    faults.extend(undrawn.map(|picture| format!("no test draws {picture}")));
    faults.extend(words::dead_links(&page));
    faults.extend(words::unknown(&page, &shell));
    assert!(
        faults.is_empty(),
        "{name} is not true:\n\n{}\n\nRATELAB_UPDATE=1 cargo test manual \
         writes what commands print now into the page.",
        faults.join("\n\n")
    );
}

/// Creates a test for each page. Those of the second list compute for long.
macro_rules! manual {
    ($($test:ident: $page:literal),*; $($long:ident: $long_page:literal),*) => {
        /// The pages of the manual.
        const PAGES: &[&str] = &[$($page,)* $($long_page),*];

        mod manual {
            $(
                #[test]
                fn $test() {
                    crate::check($page);
                }
            )*
            $(
                #[test]
                #[ignore = "computes for a minute: cargo test manual -- --include-ignored"]
                fn $long() {
                    crate::check($long_page);
                }
            )*
        }
    };
}

manual! {
    readme: "README.md",
    contributing: "CONTRIBUTING.md",
    changelog: "CHANGELOG.md",
    architecture: "docs/architecture.md",
    concepts: "docs/concepts.md",
    commands: "docs/commands.md",
    install: "docs/install.md",
    recordings: "docs/recordings.md",
    docs_policies: "docs/policies.md",
    graphs: "docs/graphs.md",
    plants: "docs/plants.md",
    your_own: "docs/your-own.md",
    your_robot: "docs/your-robot.md",
    hunt: "docs/hunt.md",
    slow_policies: "docs/slow-policies.md",
    theory: "docs/theory.md",
    time: "docs/time.md",
    executors: "docs/executors.md",
    faults: "docs/faults.md",
    dependencies: "docs/dependencies.md",
    network: "docs/network.md",
    ros2: "docs/ros2.md",
    chapter: "docs/chapter.md",
    teaching: "docs/teaching.md",
    throughput: "docs/throughput.md",
    worksheet: "docs/worksheet.md",
    exercises: "exercises/README.md",
    reference_recordings: "recordings/README.md",
    policies: "policies/README.md",
    golden: "tests/golden/README.md",
    fuzzers: "tests/fuzz/README.md";
    age: "docs/age.md",
    answers: "docs/answers.md"
}

/// The pages in `folder` and below.
fn pages_in(folder: &str) -> Vec<String> {
    let entries = fs::read_dir(root().join(folder)).expect(folder);
    let names = entries.map(|entry| entry.expect(folder).file_name());
    let paths = names.map(|name| format!("{folder}/{}", name.display()));
    paths
        .flat_map(|path| {
            if root().join(&path).is_dir() {
                pages_in(&path)
            } else if path.ends_with(".md") {
                vec![path]
            } else {
                Vec::new()
            }
        })
        .collect()
}

/// The code of an example on a page and the output of the program must match.
#[test]
fn examples_of_the_manual_are_built_from_what_it_shows() {
    shell::check_examples(root());
}

#[test]
fn every_page_of_the_manual_has_a_test() {
    let pages: Vec<_> = ROOMS.iter().flat_map(|room| pages_in(room)).collect();
    assert!(pages.len() > 10, "only {} pages were found", pages.len());
    for page in pages {
        let known = PAGES.contains(&page.as_str());
        assert!(known, "{page} is not checked: name it in {}", file!());
    }
}
