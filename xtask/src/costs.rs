//! Measures on this machine what each step costs, beginning with a fresh clone.

mod fresh;
mod machine;

use std::{
    collections::BTreeSet,
    fs,
    path::Path,
    process::{Command, ExitCode, Stdio},
    time::Instant,
};

use fresh::Fresh;

/// Where the figures go, in the clone that is measured.
const TABLE: &str = "docs/costs.csv";

/// Prints when the lab, started in a terminal, had drawn its first picture.
const FIRST_PICTURE: &str = include_str!("costs/first_picture.py");

/// A step: what it is, and the command that takes it.
type Step = (&'static str, &'static str);

/// What comes first. It and [`PICTURE`] are timed in ways of their own.
const CLONE: Step = ("a clone", "git clone");

/// From the clone to programs that can be run.
const BUILDS: [Step; 2] = [
    ("MuJoCo's library", "cargo xtask setup"),
    ("build of the lab", "cargo build"),
];

/// Of the lab that is built already.
const PICTURE: Step = ("the first picture", "cargo run");

/// Built after the lab, and next to it.
const TESTS: [Step; 2] = [
    ("build of the tests", "cargo test --no-run"),
    ("the tests", "cargo test"),
];

/// What the built lab does. No argument has a space or a comma in it, so that a
/// line is both what is run and what is written.
const RUNS: [Step; 9] = [
    ("10 s on the real clock", "ratelab run"),
    ("10 s on the virtual clock", "ratelab run --clock virtual"),
    (
        "10 s recorded",
        "ratelab run --clock virtual --record ten.rrd",
    ),
    ("an hour", "ratelab run --clock virtual --duration-s 3600"),
    (
        "an hour recorded",
        "ratelab run --clock virtual --duration-s 3600 --record hour.rrd",
    ),
    ("what is in that hour", "ratelab info hour.rrd"),
    ("that hour verified", "ratelab verify hour.rrd"),
    ("exercise 1 measured", "ratelab exercise check 1"),
    (
        "30 control rates of 200 seeds",
        "ratelab sweep --control-hz 1..30 --seeds 0..199",
    ),
];

/// How many crates the lab is made of.
const CRATES: &str = "crates";

/// What takes room on the disk after the builds, after the tests and after the
/// runs: what it is called, and where it is.
const BUILT: [(&str, &str); 1] = [("target after the build", "target")];
const TESTED: [(&str, &str); 1] = [("target after the tests", "target")];
const RECORDED: [(&str, &str); 2] = [
    ("10 s recorded", "ten.rrd"),
    ("an hour recorded", "hour.rrd"),
];

/// What the columns are.
const HEAD: &str = "what,command,seconds";

/// Measures a fresh clone of what is committed at `root`.
pub fn measure(root: &Path) -> ExitCode {
    let done = table(root).and_then(|table| write(&root.join(TABLE), &table));
    match done {
        Ok(()) => {
            println!("Written to {TABLE}.");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Facts in lines that begin with `#`, then a row for each step.
fn table(root: &Path) -> Result<String, String> {
    let fresh = Fresh::of(root);
    let facts = machine::facts()?.into_iter();
    let mut facts: Vec<_> = facts
        .map(|(name, fact)| format!("{name}: {fact}"))
        .collect();
    let mut rows = vec![HEAD.to_owned()];

    rows.push(cloned(root, &fresh)?);
    // What the crates cost depends on the network and not on this repository.
    timed(fresh.command("cargo").args(["fetch", "--locked"]))?;
    facts.push(format!("{CRATES}: {}", crates(&fresh)?));
    take(&fresh, &BUILDS, &mut rows)?;
    weigh(&fresh, &BUILT, &mut facts)?;
    rows.push(first_picture(&fresh)?);
    take(&fresh, &TESTS, &mut rows)?;
    weigh(&fresh, &TESTED, &mut facts)?;
    take(&fresh, &RUNS, &mut rows)?;
    weigh(&fresh, &RECORDED, &mut facts)?;

    let facts = facts.iter().map(|fact| format!("# {fact}\n"));
    let rows = rows.iter().map(|row| format!("{row}\n"));
    Ok(facts.chain(rows).collect())
}

/// Adds a row for each step.
fn take(fresh: &Fresh, steps: &[Step], rows: &mut Vec<String>) -> Result<(), String> {
    for step in steps {
        rows.push(row(fresh, *step)?);
    }
    Ok(())
}

/// Adds a fact for each place: what it takes on the disk.
fn weigh(fresh: &Fresh, places: &[(&str, &str)], facts: &mut Vec<String>) -> Result<(), String> {
    for (name, place) in places {
        facts.push(format!("{name}: {}", size(fresh, place)?));
    }
    Ok(())
}

fn cloned(root: &Path, fresh: &Fresh) -> Result<String, String> {
    let mut clone = Command::new("git");
    clone
        .args(["clone", "--quiet"])
        .arg(root)
        .arg(fresh.folder());
    Ok(line(CLONE, timed(&mut clone)?))
}

fn row(fresh: &Fresh, step: Step) -> Result<String, String> {
    let (_, command) = step;
    let mut words = command.split(' ');
    let program = words.next().unwrap_or_default();
    let seconds = timed(fresh.command(program).args(words).stdout(Stdio::null()))
        .map_err(|error| format!("{command}: {error}"))?;
    Ok(line(step, seconds))
}

fn first_picture(fresh: &Fresh) -> Result<String, String> {
    let mut python = fresh.command("python3");
    let said = output(python.args(["-c", FIRST_PICTURE, "cargo", "run"]))?;
    let seconds = said.parse().map_err(|_| "no picture was timed")?;
    Ok(line(PICTURE, seconds))
}

fn crates(fresh: &Fresh) -> Result<usize, String> {
    let mut tree = fresh.command("cargo");
    tree.args([
        "tree",
        "--package",
        "ratelab-lab",
        "--edges",
        "normal,build",
    ])
    .args(["--prefix", "none", "--format", "{p}"]);
    let names = output(&mut tree)?;
    let name_and_version = |line: &str| line.split(' ').take(2).collect::<String>();
    let distinct: BTreeSet<_> = names.lines().map(name_and_version).collect();
    Ok(distinct.len())
}

/// What it takes on the disk.
fn size(fresh: &Fresh, place: &str) -> Result<String, String> {
    let du = output(fresh.command("du").args(["-sk", place]))?;
    let kibibytes: f64 = du
        .split_whitespace()
        .next()
        .and_then(|number| number.parse().ok())
        .ok_or_else(|| format!("du said {du}"))?;
    Ok(format!("{:.1} MB", kibibytes * 1024.0 / 1e6))
}

/// Shows the row and returns it.
fn line((what, command): Step, seconds: f64) -> String {
    println!("{seconds:8.2} s  {what} ({command})");
    format!("{what},{command},{seconds:.3}")
}

fn timed(command: &mut Command) -> Result<f64, String> {
    let start = Instant::now();
    let status = command.status().map_err(|error| error.to_string())?;
    match status.success() {
        true => Ok(start.elapsed().as_secs_f64()),
        false => Err(status.to_string()),
    }
}

fn said(program: &str, arguments: &[&str]) -> Result<String, String> {
    output(Command::new(program).args(arguments))
}

fn output(command: &mut Command) -> Result<String, String> {
    let program = command.get_program().to_string_lossy().into_owned();
    let output = command
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| format!("{program}: {error}"))?;
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).trim().into()),
        false => Err(format!("{program}: {}", output.status)),
    }
}

fn write(file: &Path, text: &str) -> Result<(), String> {
    let folder = file.parent().unwrap_or(file);
    fs::create_dir_all(folder)
        .and_then(|()| fs::write(file, text))
        .map_err(|error| format!("{TABLE}: {error}"))
}

#[cfg(test)]
mod tests {
    use std::{fs, path::Path};

    use super::*;

    /// The table in this clone: its lines of facts, and its rows.
    fn kept() -> (Vec<String>, Vec<String>) {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let table = fs::read_to_string(root.join(TABLE)).expect(TABLE);
        let lines = table.lines().map(str::to_owned);
        lines.partition(|line| line.starts_with("# "))
    }

    #[test]
    fn the_table_that_is_kept_has_the_facts_that_are_written() {
        let machine = machine::facts().expect("facts");
        let sizes = BUILT.into_iter().chain(TESTED).chain(RECORDED);
        let names = machine.into_iter().map(|(name, _)| name).chain([CRATES]);
        let names: Vec<_> = names.chain(sizes.map(|(name, _)| name)).collect();
        let (facts, _) = kept();
        let kept = facts.iter().map(|line| line.trim_start_matches("# "));
        let kept = kept.map(|fact| fact.split_once(": ").expect("a fact").0);
        assert_eq!(kept.collect::<Vec<_>>(), names);
    }

    #[test]
    fn the_table_that_is_kept_has_the_rows_that_are_written() {
        let (builds, tests) = (BUILDS.into_iter(), TESTS.into_iter());
        let steps = [CLONE].into_iter().chain(builds).chain([PICTURE]);
        let steps = steps.chain(tests).chain(RUNS);
        let steps: Vec<_> = steps.map(|(what, command)| [what, command]).collect();
        let (_, rows) = kept();
        let (head, rows) = rows.split_first().expect("a head");
        assert_eq!(head, HEAD);
        let cells = rows.iter().map(|row| row.split(',').collect());
        let cells: Vec<Vec<&str>> = cells.collect();
        let kept: Vec<_> = cells.iter().map(|row| &row[..row.len() - 1]).collect();
        assert_eq!(kept, steps);
        for row in cells {
            let seconds: f64 = row[2].parse().expect("seconds");
            assert!(seconds > 0.0, "{row:?}");
        }
    }
}
