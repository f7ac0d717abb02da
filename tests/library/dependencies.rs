//! Dependencies in the manifests: every crate has its reason in `docs/dependencies.md`, and stands on
//! those that its first page names; the crates up to the robot need no terminal and no recorder, and
//! the network changes no crate that is built without it.

use std::{
    collections::{BTreeMap, BTreeSet},
    env, fs,
    process::Command,
    sync::LazyLock,
};

use toml::{Table, Value};

use crate::architecture::CRATES;

fn read(file: &str) -> String {
    fs::read_to_string(crate::clone::root().join(file)).expect(file)
}

/// A manifest.
fn manifest(file: &str) -> Table {
    read(file).parse().expect("TOML")
}

/// The crates of this workspace that others depend on.
static OURS: LazyLock<BTreeSet<String>> = LazyLock::new(|| {
    let known = manifest("Cargo.toml")["workspace"]["dependencies"].clone();
    let known = known.as_table().expect("a table").iter();
    let ours = known.filter(|(_, asked)| asked.get("path").is_some());
    ours.map(|(name, _)| name.clone()).collect()
});

/// The crates in the sections called `kinds` of the manifest in `folder`, for all platforms:
/// `ours`, or the external ones.
fn crates(folder: &str, kinds: &[&str], ours: bool) -> BTreeSet<String> {
    let manifest = manifest(&format!("{folder}Cargo.toml"));
    let platforms = manifest.get("target").and_then(Value::as_table);
    let platforms = platforms.into_iter().flat_map(Table::values);
    let parts = platforms.filter_map(Value::as_table).chain([&manifest]);
    let sections = parts.flat_map(|part| kinds.iter().filter_map(|kind| part.get(*kind)));
    let names = sections.filter_map(Value::as_table).flat_map(Table::keys);
    names
        .filter(|name| OURS.contains(*name) == ours)
        .cloned()
        .collect()
}

/// The crates with work for learners.
const LEARNERS: [&str; 2] = ["exercises/build/", "exercises/mend/"];

#[test]
fn every_crate_that_a_manifest_names_has_its_reason_in_the_manual_and_no_other() {
    let kinds = ["dependencies", "dev-dependencies", "build-dependencies"];
    let members = manifest("Cargo.toml")["workspace"]["members"].clone();
    let members = members.as_array().expect("a list").iter();
    let members = members.map(|member| format!("{}/", member.as_str().expect("a folder")));
    let folders = members.filter(|folder| !LEARNERS.contains(&folder.as_str()));
    let named = folders
        .chain([String::new()])
        .flat_map(|at| crates(&at, &kinds, false));
    let named: BTreeSet<_> = named.collect();
    let page = read("docs/dependencies.md");
    let (_, table) = page.split_once("## Crates\n").expect("the table");
    // A line has the names of crates and a reason; a long one goes on below.
    let lines = table.split("\n- ").skip(1);
    let reasons = lines.filter_map(|line| line.split_once("`: "));
    let reasons = reasons.filter(|(_, why)| why.trim().len() > 5);
    let reasons: BTreeSet<_> = reasons
        .flat_map(|(names, _)| names.split('`').skip(1).step_by(2).map(str::to_owned))
        .collect();
    let missing: Vec<_> = named.difference(&reasons).collect();
    let stale: Vec<_> = reasons.difference(&named).collect();
    assert!(
        missing.is_empty() && stale.is_empty(),
        "docs/dependencies.md: no line with a reason for {missing:?}; lines for nothing: {stale:?}"
    );
}

/// The folder of a crate, from that of its sources.
fn crate_of(sources: &str) -> &str {
    sources.strip_suffix("src").expect("a crate")
}

#[test]
fn every_crate_stands_on_those_below_it_and_its_first_page_names_them() {
    let mut below = BTreeSet::new();
    for sources in CRATES {
        let folder = crate_of(sources);
        let mut stands_on = crates(folder, &["dependencies"], true);
        stands_on.remove("mend-it");
        assert!(stands_on.is_subset(&below), "{folder}: {stands_on:?}");
        if sources == "lab/src" {
            continue; // It stands on all.
        }
        let page = read(&format!("{sources}/lib.rs"));
        let head = page.lines().map_while(|line| line.strip_prefix("//!"));
        let head = head.collect::<String>();
        let sentence = head.split_once("Stands on ").map_or("", |(_, rest)| rest);
        let sentence = sentence.split([';', '.', ':']).next().unwrap_or_default();
        let named = sentence.split('`').skip(1).step_by(2).map(str::to_owned);
        assert_eq!(
            named.collect::<BTreeSet<_>>(),
            stands_on,
            "{sources}/lib.rs"
        );
        let package = manifest(&format!("{folder}Cargo.toml"))["package"]["name"].clone();
        below.insert(package.as_str().expect("a name").to_owned());
    }
}

#[test]
fn neither_core_nor_system_nor_robot_depends_on_a_terminal_a_command_line_or_a_recorder() {
    let robot = CRATES
        .iter()
        .position(|sources| *sources == "crates/cart-pole/src");
    for sources in &CRATES[..=robot.expect("the robot")] {
        let crates = crates(crate_of(sources), &["dependencies"], false);
        assert!(!crates.is_empty(), "nothing was read");
        for foreign in ["ratatui", "crossterm", "clap", "rerun"] {
            assert!(!crates.contains(foreign), "{sources} depends on {foreign}");
        }
    }
    let users_of = |name: &str| {
        let uses =
            |sources: &&str| crates(crate_of(sources), &["dependencies"], false).contains(name);
        CRATES
            .into_iter()
            .filter(|sources| uses(sources))
            .collect::<Vec<_>>()
    };
    assert_eq!(users_of("rerun"), ["crates/recording/src"]);
    assert_eq!(
        users_of("mujoco-rs"),
        ["crates/cart-pole/src", "crates/plant/src"]
    );
}

/// The packages of the resolved graph, each with those that it is built from: dependencies and build
/// scripts, without tests; `None` where they were not all fetched.
fn resolved() -> Option<BTreeMap<String, BTreeSet<String>>> {
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut metadata = Command::new(cargo);
    metadata.args([
        "metadata",
        "--offline",
        "--format-version",
        "1",
        "--all-features",
    ]);
    let output = metadata.current_dir(crate::clone::root()).output();
    let output = output.expect("cargo");
    if !output.status.success() {
        return None;
    }
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let list = |value: &serde_json::Value| value.as_array().cloned().expect("a list");
    let text = |value: &serde_json::Value| value.as_str().expect("a text").to_owned();
    let names: BTreeMap<String, String> = list(&metadata["packages"])
        .iter()
        .map(|package| (text(&package["id"]), text(&package["name"])))
        .collect();
    let mut graph = BTreeMap::<String, BTreeSet<String>>::new();
    for node in list(&metadata["resolve"]["nodes"]) {
        let built_from = list(&node["deps"]).into_iter().filter(|dep| {
            let kinds = list(&dep["dep_kinds"]);
            kinds.iter().any(|kind| kind["kind"] != "dev")
        });
        let built_from = built_from.map(|dep| names[&text(&dep["pkg"])].clone());
        let package = graph.entry(names[&text(&node["id"])].clone());
        package.or_default().extend(built_from);
    }
    Some(graph)
}

#[test]
fn robots_and_the_course_are_the_only_crates_below_the_command_that_need_mujoco() {
    let Some(graph) = resolved() else {
        eprintln!("skipped: `cargo fetch` first");
        return;
    };
    let needs_mujoco = |package: &String| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![package]);
        while let Some(next) = open.pop() {
            if seen.insert(next) {
                open.extend(&graph[next]);
            }
        }
        seen.contains(&"mujoco-rs".to_owned())
    };
    let ours = CRATES.map(|sources| manifest(&format!("{}Cargo.toml", crate_of(sources))));
    let ours = ours
        .iter()
        .map(|manifest| manifest["package"]["name"].as_str());
    let ours = ours.map(|name| name.expect("a name").to_owned());
    let need: Vec<String> = ours.filter(needs_mujoco).collect();
    let expected = [
        "ratelab-cart-pole",
        "ratelab-plant",
        "exercises",
        "ratelab-lab",
    ];
    assert_eq!(need, expected);
}

#[test]
fn the_version_of_the_program_is_that_of_all_its_sources() {
    let script = read("lab/build.rs");
    for sources in CRATES {
        let folder = crate_of(sources).trim_end_matches('/');
        let watched = [sources, folder].map(|watched| format!("\"{watched}\","));
        assert!(
            watched.iter().any(|watched| script.contains(watched)),
            "{sources}"
        );
    }
}

/// The crates of the clone that no crate of a user stands on.
const ONLY_HERE: [&str; 4] = ["dist", "ratelab-tests", "shuttle-engine", "shuttle-std"];

#[test]
fn a_crate_of_a_user_is_built_as_the_clone_so_that_they_share_dependencies() {
    let [mut clone, own] = ["Cargo.toml", "docs/own-crate/Cargo.toml"]
        .map(|file| manifest(file)["profile"]["dev"].clone());
    let packages = clone["package"].as_table_mut().expect("packages");
    for name in ONLY_HERE {
        assert!(
            packages.remove(name).is_some(),
            "{name} has no profile any more"
        );
    }
    assert_eq!(
        own, clone,
        "the profile in docs/own-crate/Cargo.toml is not that of the clone"
    );
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
