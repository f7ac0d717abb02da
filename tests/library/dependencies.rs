//! Dependencies in the manifests: every crate has its reason in `docs/dependencies.md`,
//! the crates below the command need no terminal and no recorder, and the network changes
//! no crate that is built without it.

use std::{collections::BTreeSet, env, fs, process::Command};

use toml::{Table, Value};

fn read(file: &str) -> String {
    fs::read_to_string(crate::clone::root().join(file)).expect(file)
}

/// The crates of this workspace that others depend on.
const OURS: &str = "exercises mend-it ratelab ratelab-account ratelab-cart-pole ratelab-effects \
    ratelab-real-clock ratelab-recording ratelab-replay ratelab-screen ratelab-study ratelab-wire xtask";

fn is_ours(name: &str) -> bool {
    OURS.split(' ').any(|known| known == name)
}

/// The crates in the sections called `kinds` of the manifest in `folder`, for all platforms:
/// `ours`, or the external ones.
fn crates(folder: &str, kinds: &[&str], ours: bool) -> BTreeSet<String> {
    let manifest: Table = read(&format!("{folder}Cargo.toml")).parse().expect("TOML");
    let platforms = manifest.get("target").and_then(Value::as_table);
    let platforms = platforms.into_iter().flat_map(Table::values);
    let parts = platforms.filter_map(Value::as_table).chain([&manifest]);
    let sections = parts.flat_map(|part| kinds.iter().filter_map(|kind| part.get(*kind)));
    let names = sections.filter_map(Value::as_table).flat_map(Table::keys);
    names
        .filter(|name| is_ours(name) == ours)
        .cloned()
        .collect()
}

#[test]
fn every_crate_that_a_manifest_names_has_its_reason_in_the_manual_and_no_other() {
    let kinds = ["dependencies", "dev-dependencies", "build-dependencies"];
    let folders = "|crates/account/|crates/cart-pole/|crates/effects/|crates/real-clock/|crates/recording/|crates/replay/|\
        crates/screen/|crates/study/|crates/wire/|exercises/|lab/|tests/|xtask/|xtask/dist/";
    let named = folders.split('|').flat_map(|at| crates(at, &kinds, false));
    let named: BTreeSet<_> = named.collect();
    let page = read("docs/dependencies.md");
    let (_, table) = page.split_once("## Crates\n").expect("the table");
    let rows = table.lines().filter_map(|line| line.strip_prefix("| `"));
    let rows = rows.filter_map(|row| row.split_once("` | ").filter(|(_, why)| why.len() > 10));
    let reasons: BTreeSet<_> = rows.map(|(name, _)| name.to_owned()).collect();
    let missing: Vec<_> = named.difference(&reasons).collect();
    let stale: Vec<_> = reasons.difference(&named).collect();
    assert!(
        missing.is_empty() && stale.is_empty(),
        "docs/dependencies.md: no row with a reason for {missing:?}; rows for nothing: {stale:?}"
    );
}

#[test]
fn the_core_stands_on_nothing_and_every_other_crate_on_those_below() {
    for (folder, below) in [
        ("", ""),
        ("crates/effects/", "ratelab"),
        ("crates/account/", "ratelab ratelab-effects"),
        ("crates/real-clock/", "ratelab"),
        ("crates/replay/", "ratelab"),
        (
            "crates/study/",
            "ratelab ratelab-account ratelab-effects ratelab-real-clock ratelab-replay",
        ),
        (
            "crates/cart-pole/",
            "ratelab ratelab-account ratelab-effects ratelab-study",
        ),
        (
            "crates/recording/",
            "ratelab ratelab-account ratelab-cart-pole ratelab-effects ratelab-real-clock ratelab-replay ratelab-study",
        ),
        (
            "crates/screen/",
            "exercises ratelab ratelab-account ratelab-cart-pole ratelab-effects ratelab-real-clock \
             ratelab-recording ratelab-replay ratelab-study",
        ),
    ] {
        let ours: Vec<_> = crates(folder, &["dependencies"], true)
            .into_iter()
            .collect();
        assert_eq!(ours.join(" "), below, "{folder}");
    }
}

#[test]
fn neither_core_nor_study_nor_robot_depends_on_a_terminal_a_command_line_or_a_recorder() {
    let crates_below = ["account", "effects", "replay", "study", "cart-pole"];
    let folders = crates_below.map(|name| format!("crates/{name}/"));
    for folder in folders.into_iter().chain([String::new()]) {
        let crates = crates(&folder, &["dependencies"], false);
        assert!(!crates.is_empty(), "nothing was read");
        for foreign in ["ratatui", "crossterm", "clap", "rerun"] {
            assert!(!crates.contains(foreign), "{folder} depends on {foreign}");
        }
    }
    let core = crates("", &["dependencies"], false);
    assert!(!core.contains("mujoco-rs"), "the core knows a plant");
}

/// Each crate that cargo builds with these `options`, with its features, and each crate that
/// it is built on; `None` where they were not all fetched.
fn built(options: &[&str]) -> Option<BTreeSet<(String, String)>> {
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut tree = Command::new(cargo);
    tree.args(["tree", "--offline", "--edges", "normal,build,dev"]);
    tree.args(["--prefix", "depth", "--format", " {p} [{f}]"]);
    let output = tree
        .args(options)
        .current_dir(crate::clone::root())
        .output();
    let output = output.expect("cargo");
    if !output.status.success() {
        return None;
    }
    let printed = String::from_utf8(output.stdout).expect("UTF-8");
    let (mut above, mut built) = (Vec::<String>::new(), BTreeSet::new());
    for line in printed.lines().filter(|line| !line.is_empty()) {
        let (depth, name) = line.split_once(' ').expect("a depth");
        let name = name.trim_end_matches(" (*)").replace(" (proc-macro)", "");
        above.truncate(depth.parse().expect("a number"));
        if let Some(user) = above.last() {
            built.insert((user.clone(), name.clone()));
        }
        above.push(name);
    }
    Some(built)
}

#[test]
fn with_the_network_no_crate_is_built_again() {
    let plain = built(&[]).expect("cargo tree");
    let users: BTreeSet<&String> = plain.iter().map(|(user, _)| user).collect();
    assert!(users.len() > 100, "nothing was read");
    for feature in ["ratelab-lab/network", "ratelab-lab/tls"] {
        let Some(other) = built(&["--features", feature]) else {
            eprintln!("skipped for {feature}: `cargo fetch` first");
            continue;
        };
        let changed: Vec<_> = plain
            .symmetric_difference(&other)
            .filter(|(user, _)| users.contains(user) && !user.starts_with("ratelab-lab "))
            .collect();
        assert!(
            changed.is_empty(),
            "built with other features for {feature}: ask for them in lab/Cargo.toml: \
             {changed:#?}"
        );
    }
}
