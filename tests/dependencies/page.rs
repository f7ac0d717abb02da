//! `docs/dependencies.md` tells every crate that a manifest names, and why it is
//! there. The facts are cargo's; the reasons are written by hand.

use std::{
    collections::{BTreeMap, HashSet},
    fs,
};

use crate::{
    facts::facts,
    graph::{file, metadata},
    metadata::Metadata,
};

const PAGE: &str = "docs/dependencies.md";

/// What the facts are between.
const BEGIN: &str = "<!-- facts -->\n";
const END: &str = "<!-- end of facts -->\n";

const HEAD: &str = "\
| crate | version | licence | used by | why |
|---|---|---|---|---|
";

/// The page before the facts, the facts, and the page after them.
fn parts(page: &str) -> (&str, &str, &str) {
    let (before, rest) = page.split_once(BEGIN).expect("where the facts begin");
    let (told, after) = rest.split_once(END).expect("where the facts end");
    (before, told, after)
}

/// The reasons in the last column of the table, by crate.
fn reasons(told: &str) -> BTreeMap<&str, &str> {
    let rows = told.lines().filter(|line| line.starts_with("| `"));
    let rows = rows.map(|row| row.trim_matches('|').split('|').map(str::trim));
    rows.map(|mut cells| {
        let (name, why) = (cells.next(), cells.next_back());
        (
            name.unwrap_or_default().trim_matches('`'),
            why.unwrap_or_default(),
        )
    })
    .collect()
}

/// The facts as they are, with the reasons that are known.
fn facts_as_told(metadata: &Metadata, reasons: &BTreeMap<&str, &str>) -> String {
    let facts = facts(metadata);
    let rows = facts.iter().map(|(of, facts)| {
        let why = reasons.get(of.name.as_str()).copied().unwrap_or_default();
        let users = facts.users.iter().map(String::as_str).collect::<Vec<_>>();
        let (name, version, licence) = (&of.name, &of.version, &facts.licence);
        format!(
            "| `{name}` | {version} | {licence} | {} | {why} |\n",
            users.join(", ")
        )
    });
    let rows: String = rows.collect();
    let all = metadata
        .packages
        .iter()
        .filter(|it| it.source.is_some())
        .count();
    let rest = all - facts.len();
    format!(
        "{HEAD}{rows}\nAt most {all} crates in all, over all platforms and features: these {} \
         and {rest} that they bring.\n",
        facts.len()
    )
}

/// Lines of one text that are not in another.
fn only_in(one: &str, other: &str) -> String {
    let other: HashSet<_> = other.lines().collect();
    let lines = one.lines().filter(|line| !other.contains(line));
    lines.map(|line| format!("  {line}\n")).collect()
}

#[test]
fn the_page_of_the_manual_tells_every_crate_that_a_manifest_names_and_why() {
    let Some(metadata) = metadata() else { return };
    let mut page = fs::read_to_string(file(PAGE)).expect(PAGE);
    let (before, told, after) = parts(&page);
    let facts = facts_as_told(metadata, &reasons(told));
    if std::env::var_os("RATELAB_UPDATE").is_some() {
        page = format!("{before}{BEGIN}{facts}{END}{after}");
        fs::write(file(PAGE), &page).expect(PAGE);
    }
    let (_, told, _) = parts(&page);
    assert!(
        told == facts,
        "{PAGE} is out of date: RATELAB_UPDATE=1 cargo test --test dependencies\n\
         it tells\n{}and should tell\n{}",
        only_in(told, &facts),
        only_in(&facts, told)
    );
    let reasons = reasons(told).into_iter();
    let without: Vec<_> = reasons
        .filter(|(_, why)| why.is_empty())
        .map(|it| it.0)
        .collect();
    let names = without.join(", ");
    assert!(
        without.is_empty(),
        "{PAGE}: say in the last column why these are here: {names}"
    );
}

#[test]
fn the_page_of_the_manual_names_the_python_packages_in_the_versions_that_are_used() {
    let Some(metadata) = metadata() else { return };
    let page = fs::read_to_string(file(PAGE)).expect(PAGE);
    let pin = fs::read_to_string(file("xtask/mujoco/requirements.txt")).expect("the pin");
    let mujoco = pin
        .split_whitespace()
        .find(|word| word.starts_with("mujoco=="));
    let rerun = metadata.packages.iter().find(|it| it.name == "rerun");
    let rerun = rerun.map(|it| format!("rerun-sdk=={}", it.version));
    for pinned in [mujoco.expect("mujoco"), &rerun.expect("rerun")] {
        assert!(
            page.contains(&format!("`{pinned}`")),
            "{PAGE} does not name {pinned}"
        );
    }
}
