//! Rust as the community writes it: few idioms of our own, counted over all code that is no test.

use std::path::Path;

use crate::architecture::{code, rust_files, without_tests};

/// The folders with code.
const FOLDERS: [&str; 6] = ["src", "crates", "examples", "exercises", "lab", "xtask"];

/// An idiom, how often a text has it, and how often a thousand lines may have it.
struct Idiom {
    name: &'static str,
    count: fn(&str) -> usize,
    most: f64,
}

const IDIOMS: [Idiom; 4] = [
    Idiom {
        name: "match on a bool: write if",
        count: bool_arms,
        most: 0.4, // Two arms each.
    },
    Idiom {
        name: "Result<_, String>: write an enum of errors",
        count: string_errors,
        most: 0.32,
    },
    Idiom {
        name: "let x = x.y(): write one chain",
        count: rebindings,
        most: 2.5,
    },
    Idiom {
        name: "fn of: write new, or what it returns",
        count: named_of,
        most: 0.16,
    },
];

/// The arms of a `match` on a bool.
fn bool_arms(code: &str) -> usize {
    let is_arm = |line: &&str| {
        let line = line.trim_start();
        let rest = line.strip_prefix("true").or(line.strip_prefix("false"));
        rest.is_some_and(|rest| rest.starts_with(" =>") || rest.starts_with(" if "))
    };
    code.lines().filter(is_arm).count()
}

/// Results whose error is a text.
fn string_errors(code: &str) -> usize {
    let is_text = |rest: &&str| {
        let end = rest.find([';', '{']).unwrap_or(rest.len());
        let words: String = rest[..end].split_whitespace().collect();
        words.contains(",String>")
    };
    code.split("Result<").skip(1).filter(is_text).count()
}

/// The longest word at the beginning of `text`.
fn word(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_');
    &text[..end.unwrap_or(text.len())]
}

/// Variables that are bound again to what their last value makes.
fn rebindings(code: &str) -> usize {
    let is_again = |rest: &&str| {
        let rest = rest.strip_prefix("mut ").unwrap_or(rest);
        let name = word(rest);
        let value = rest[name.len()..].strip_prefix(" = ");
        let value = value.and_then(|value| value.strip_prefix(name));
        !name.is_empty() && value.is_some_and(|value| value.starts_with(['.', '\n']))
    };
    code.split("let ").skip(1).filter(is_again).count()
}

/// Functions whose names begin with `of`.
fn named_of(code: &str) -> usize {
    let names = code.split("fn ").skip(1).map(word);
    names
        .filter(|name| *name == "of" || name.starts_with("of_"))
        .count()
}

/// Whether the file at `path` within the clone is a test or a benchmark.
fn is_test(path: &Path) -> bool {
    let mut parts = path.iter();
    parts.any(|part| part == "tests" || part == "tests.rs" || part == "benches")
}

#[test]
fn idioms_of_our_own_are_rare() {
    let root = crate::clone::root();
    let mut codes = Vec::new();
    for folder in FOLDERS {
        for file in rust_files(&root.join(folder)) {
            if !is_test(file.strip_prefix(&root).expect("below")) {
                codes.push(without_tests(&code(&file)).to_owned());
            }
        }
    }
    let lines = codes.iter().flat_map(|code| code.lines());
    let lines = lines.filter(|line| !line.trim().is_empty()).count();
    assert!(lines > 50_000, "only {lines} lines were read");
    for Idiom { name, count, most } in IDIOMS {
        let found: usize = codes.iter().map(|code| count(code)).sum();
        let share = found as f64 / (lines as f64 / 1e3);
        assert!(
            share <= most,
            "{name}: {share:.2} in 1,000 lines, {most} allowed"
        );
    }
}

#[test]
fn each_idiom_is_found() {
    let code = "
        match flag {
            true if late => 1,
            false => 2,
        }
        fn of(a: A) -> Result<Vec<(A, B)>, String> { a }
        fn of_node() -> Result<String, Error>;
        fn offset() {}
        let mut names = names.iter();
        let names = names
            .map(f);
        let name = names.len();
    ";
    let counts = IDIOMS.map(|idiom| (idiom.count)(code));
    assert_eq!(counts, [2, 1, 2, 2]);
}
