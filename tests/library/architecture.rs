//! Allowed imports: a system is independent of experiments and graph files, and screen and sweeps
//! import the cart-pole in a named file only. No files or folders import each other in a circle.
//! The direction between crates is tested in `dependencies.rs`.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::imports::{Imports, Module, Sources, circles, imports, named};

/// The Rust files below `folder`.
pub fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("folder") {
        let path = entry.expect("entry").path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}

/// A source file without its comments, which may mention anything.
pub fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("source");
    let lines = text
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"));
    lines.collect::<Vec<_>>().join("\n")
}

/// The code before the first module within the file that is for tests only.
pub fn without_tests(code: &str) -> &str {
    const ATTRIBUTE: &str = "#[cfg(test)]\n";
    let mut marked = code.match_indices(ATTRIBUTE);
    let first = marked.find(|(at, _)| {
        let item = code[at + ATTRIBUTE.len()..].lines().next();
        let item = item.unwrap_or_default();
        item.trim_start_matches("pub ").starts_with("mod ") && item.ends_with('{')
    });
    first.map_or(code, |(at, _)| &code[..at])
}

/// The modules of the crate in `folder`, without tests.
fn sources(folder: &str) -> Sources {
    let root = crate::clone::root().join(folder);
    let files = rust_files(&root).into_iter().map(|path| {
        let inside = path.with_extension("");
        let names = inside.strip_prefix(&root).expect("below").iter();
        let names = names.map(|name| name.to_string_lossy().into_owned());
        let names = names.filter(|name| !["mod", "lib"].contains(&name.as_str()));
        let module = std::iter::once(folder.to_owned()).chain(names).collect();
        (module, without_tests(&code(&path)).to_owned())
    });
    let mut files: Sources = files.collect();
    // Programs are no part of the crate that they use.
    let other = ["tests", "main"];
    files.retain(|module, _| !module.iter().any(|name| other.contains(&&**name)));
    files
}

/// Every crate of the program by the folder of its sources, from the ground up.
pub const CRATES: [&str; 15] = [
    "src",
    "crates/bag/src",
    "crates/metrics/src",
    "crates/real-clock/src",
    "crates/re-execution/src",
    "crates/system/src",
    "crates/policy/src",
    "crates/experiment/src",
    "crates/cart-pole/src",
    "crates/plant/src",
    "crates/recording/src",
    "crates/screen/src",
    "crates/network/src",
    "exercises/src",
    "lab/src",
];

#[test]
fn a_library_that_is_not_built_for_its_own_tests_has_none() {
    let mut without = Vec::new();
    for folder in CRATES {
        let root = crate::clone::root().join(folder);
        let manifest = root.parent().expect("a crate").join("Cargo.toml");
        if code(&manifest).contains("[lib]\ntest = false") {
            without.push(folder);
            let tested = |path: &PathBuf| code(path).contains("#[test]");
            let tested = rust_files(&root).into_iter().find(tested);
            assert_eq!(tested, None, "cargo test does not run it: see {manifest:?}");
        }
    }
    let mut known = ["crates/recording/src"].iter();
    assert!(known.all(|folder| without.contains(folder)), "{without:?}");
}

/// The crate of the cart-pole.
const CART_POLE: &str = "ratelab_cart_pole";

/// Files of screen and sweeps for the cart-pole: linear theory, for the table of a sweep.
const ABOUT_THE_CART_POLE: [&str; 1] = ["lab/src/sweep/theory"];

#[test]
fn the_screen_and_sweeps_import_the_cart_pole_in_the_named_files_only() {
    let sources = [sources("lab/src"), sources("crates/screen/src")];
    let named = sources.iter().flatten().filter_map(|(module, code)| {
        let path = module.join("/");
        let is_generic = path.starts_with("lab/src/sweep/") || path.starts_with("crates/screen/");
        (is_generic && code.contains(CART_POLE)).then_some(path)
    });
    let found: Vec<_> = named.collect();
    assert_eq!(found, ABOUT_THE_CART_POLE);
}

#[test]
fn rerun_is_known_in_the_folder_of_its_format_only() {
    let sources = sources("crates/recording/src");
    let knows = sources.iter().filter(|(_, code)| code.contains("rerun::"));
    let mut folders: Vec<&str> = knows.map(|(module, _)| &*module[1]).collect();
    folders.dedup();
    assert_eq!(folders, ["rrd"]);
}

#[test]
fn no_source_files_import_each_other_in_a_circle() {
    let mut found = Vec::new();
    for folder in CRATES {
        let mut imports = imports(&sources(folder));
        let count = imports.values().flatten().count();
        const SMALL: [&str; 3] = [
            "crates/metrics/src",
            "crates/re-execution/src",
            "crates/real-clock/src",
        ];
        let is_small = SMALL.contains(&folder);
        let least = if is_small { 7 } else { 10 };
        assert!(count > least, "only {count} imports were found in {folder}");
        // A part of a module may use the definitions of the module itself.
        for (from, to) in &mut imports {
            to.retain(|to| !from.starts_with(to));
        }
        for circle in circles(&imports) {
            for from in &circle {
                let to = imports[*from].iter().filter(|to| circle.contains(to));
                found.extend(to.map(|to| format!("{} -> {}", from.join("/"), to.join("/"))));
            }
            found.push(String::new());
        }
    }
    assert!(found.is_empty(), "circles:\n{}", found.join("\n"));
}

/// The room of `house`, a file or a folder at its top, that a module is in.
fn room(house: &str, module: &Module) -> Option<Module> {
    let inside = module.first().is_some_and(|name| name == house);
    let room = module.get(..2).filter(|_| inside);
    room.map(<[String]>::to_vec)
}

#[test]
fn no_folders_of_a_crate_import_each_other_in_a_circle() {
    let mut all = 0;
    for house in CRATES {
        let mut rooms = Imports::new();
        for (from, to) in &imports(&sources(house)) {
            let Some(from) = room(house, from) else {
                continue;
            };
            let to = to.iter().filter_map(|to| room(house, to));
            let to: Vec<Module> = to.filter(|to| *to != from).collect();
            for known in &to {
                rooms.entry(known.clone()).or_default();
            }
            rooms.entry(from).or_default().extend(to);
        }
        all += rooms.len();
        assert_eq!(circles(&rooms), [].into(), "{house}");
    }
    assert!(all > 100, "only {all} rooms");
}

#[test]
fn the_files_that_the_pages_about_the_code_name_are_there() {
    const PAGES: [&str; 3] = ["README.md", "CONTRIBUTING.md", "docs/architecture.md"];
    const ROOMS: &str = "benches/|crates/|docs/|examples/|exercises/|lab/|src/|tests/|xtask/";
    let (mut named, mut missing) = (0, Vec::new());
    for page in PAGES {
        let text = fs::read_to_string(crate::clone::root().join(page)).expect(page);
        let quoted = text.split('`').skip(1).step_by(2);
        let is_path = |name: &&str| !name.contains([' ', '*', '\n']);
        let in_room = |name: &&str| ROOMS.split('|').any(|room| name.starts_with(room));
        for name in quoted.filter(is_path).filter(in_room) {
            named += 1;
            if !crate::clone::root().join(name).exists() {
                missing.push(format!("{page}: {name}"));
            }
        }
    }
    assert!(named > 40, "only {named} paths were found");
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// The walks on the page about the architecture: each one's title and the files that it names.
fn walks(page: &str) -> Vec<(&str, Vec<&str>)> {
    let walks = page.split("\n### ").skip(1);
    let walks = walks.map(|walk| walk.split("\n## ").next().unwrap_or_default());
    let files = |walk| {
        let rows = str::lines(walk).filter_map(|line| line.strip_prefix("- `"));
        rows.filter_map(|row| row.split('`').next()).collect()
    };
    walks
        .map(|walk| (walk.lines().next().unwrap_or_default(), files(walk)))
        .collect()
}

/// The module in a file, such as `lab/src/commands/grade/rows.rs`.
fn module_of(file: &str) -> Module {
    let folder = CRATES.iter().find(|folder| {
        let inside = file.strip_prefix(*folder);
        inside.is_some_and(|rest| rest.starts_with('/'))
    });
    let folder = folder.unwrap_or_else(|| panic!("{file} is in no crate"));
    let inside = file[folder.len()..].trim_end_matches(".rs").split('/');
    let inside = inside.filter(|name| !["", "mod", "lib"].contains(name));
    [*folder]
        .into_iter()
        .chain(inside)
        .map(str::to_owned)
        .collect()
}

#[test]
fn each_file_of_a_walk_imports_or_names_the_next_one_or_is_imported_by_it() {
    let page = crate::clone::root().join("docs/architecture.md");
    let page = fs::read_to_string(page).expect("the page");
    let walks = walks(&page);
    assert_eq!(walks.len(), 3);
    let sources: Sources = CRATES.into_iter().flat_map(sources).collect();
    let imports = imports(&sources);
    let knows = |one: &Module, other: &Module| {
        imports[one].contains(other) || named(&sources, one).contains(other)
    };
    let mut apart = Vec::new();
    for (title, files) in walks {
        assert!((6..=12).contains(&files.len()), "{title}: {files:?}");
        for pair in files.windows(2) {
            let [one, other] = [pair[0], pair[1]].map(module_of);
            if !knows(&one, &other) && !knows(&other, &one) {
                apart.push(format!("{title}: {} and {}", pair[0], pair[1]));
            }
        }
    }
    assert!(apart.is_empty(), "{}", apart.join("\n"));
}
