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

/// From the clone to programs that can be run.
const BUILDS: [(&str, &str); 2] = [
    ("MuJoCo's library", "cargo xtask setup"),
    ("build of the lab", "cargo build"),
];

/// Built after the lab, and next to it.
const TESTS: [(&str, &str); 2] = [
    ("build of the tests", "cargo test --no-run"),
    ("the tests", "cargo test"),
];

/// What the built lab does. No argument has a space or a comma in it, so that a
/// line is both what is run and what is written.
const RUNS: [(&str, &str); 9] = [
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
    let mut facts = machine::facts()?;
    let mut rows = vec!["what,command,seconds".to_owned()];

    rows.push(cloned(root, &fresh)?);
    // What the crates cost depends on the network and not on this repository.
    timed(fresh.command("cargo").args(["fetch", "--locked"]))?;
    facts.push(format!("crates: {}", crates(&fresh)?));
    for step in BUILDS {
        rows.push(row(&fresh, step)?);
    }
    facts.push(format!(
        "target after the build: {}",
        size(&fresh, "target")?
    ));
    rows.push(first_picture(&fresh)?);
    for step in TESTS {
        rows.push(row(&fresh, step)?);
    }
    facts.push(format!(
        "target after the tests: {}",
        size(&fresh, "target")?
    ));
    for step in RUNS {
        rows.push(row(&fresh, step)?);
    }
    facts.push(format!("10 s recorded: {}", size(&fresh, "ten.rrd")?));
    facts.push(format!("an hour recorded: {}", size(&fresh, "hour.rrd")?));

    let facts = facts.iter().map(|fact| format!("# {fact}\n"));
    let rows = rows.iter().map(|row| format!("{row}\n"));
    Ok(facts.chain(rows).collect())
}

fn cloned(root: &Path, fresh: &Fresh) -> Result<String, String> {
    let mut clone = Command::new("git");
    clone
        .args(["clone", "--quiet"])
        .arg(root)
        .arg(fresh.folder());
    Ok(line("a clone", "git clone", timed(&mut clone)?))
}

fn row(fresh: &Fresh, (what, command): (&str, &str)) -> Result<String, String> {
    let mut words = command.split(' ');
    let program = words.next().unwrap_or_default();
    let seconds = timed(fresh.command(program).args(words).stdout(Stdio::null()))
        .map_err(|error| format!("{command}: {error}"))?;
    Ok(line(what, command, seconds))
}

/// Of the lab that is built already.
fn first_picture(fresh: &Fresh) -> Result<String, String> {
    let mut python = fresh.command("python3");
    let said = output(python.args(["-c", FIRST_PICTURE, "cargo", "run"]))?;
    let seconds = said.parse().map_err(|_| "no picture was timed")?;
    Ok(line("the first picture", "cargo run", seconds))
}

/// How many crates the lab is made of.
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
fn line(what: &str, command: &str, seconds: f64) -> String {
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
    use super::{BUILDS, RUNS, TESTS};

    #[test]
    fn no_step_breaks_its_row() {
        for (what, command) in BUILDS.into_iter().chain(TESTS).chain(RUNS) {
            assert!(!what.contains(',') && !command.contains(','), "{what}");
        }
    }
}
