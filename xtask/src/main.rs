//! `cargo xtask setup` brings MuJoCo's library into the clone, `cargo xtask
//! recordings` generates the reference recordings again, `cargo xtask dist` makes
//! packages.

mod recordings;

use std::env;
use std::path::Path;
use std::process::{Command, ExitCode};

use xtask::mujoco::{self, Platform, SetupResult, Source};

const USAGE: &str = "\
Usage: cargo xtask <setup | recordings | dist>

  setup        fetch MuJoCo's library into xtask/mujoco, if it is not there yet
               (the first build does the same; after it no network is needed)
  recordings   generate the reference recordings in recordings/ again
  dist         make packages for this platform in target/packages: a tarball and a
               Python wheel (cargo xtask dist --help)";

fn main() -> ExitCode {
    let arguments: Vec<_> = env::args_os().skip(1).collect();
    // Read at run time: the clone may have moved since compilation.
    let package = env::var_os("CARGO_MANIFEST_DIR");
    match (arguments.as_slice(), package) {
        ([command], Some(package)) if command == "setup" => {
            setup(&Path::new(&package).join("mujoco"))
        }
        ([command], Some(package)) if command == "recordings" => {
            recordings::make(&Path::new(&package).join(".."))
        }
        // A crate of its own, because it has dependencies, and set-up needs none; optimised,
        // because it compresses tens of megabytes.
        ([command, options @ ..], Some(_)) if command == "dist" => {
            run(cargo(&["--release", "--package", "dist"]).args(options))
        }
        _ => {
            eprintln!("{USAGE}");
            ExitCode::from(2)
        }
    }
}

/// Returns a program of the workspace, compiled and run by cargo with these options.
fn cargo(options: &[&str]) -> Command {
    let mut cargo = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(["run", "--quiet"]).args(options).arg("--");
    cargo
}

/// Runs `command` to its end; returns its exit code.
fn run(command: &mut Command) -> ExitCode {
    match command.status() {
        Ok(status) => status
            .code()
            .and_then(|code| u8::try_from(code).ok())
            .map_or(ExitCode::FAILURE, ExitCode::from),
        Err(error) => {
            eprintln!("error: cargo cannot be run: {error}");
            ExitCode::FAILURE
        }
    }
}

fn setup(folder: &Path) -> ExitCode {
    if let Source::Own(dir) = Source::from_env(folder) {
        println!("Nothing to fetch: builds link your own {}.", dir.display());
        return ExitCode::SUCCESS;
    }
    let platform = Platform::host();
    let verb = match platform.and_then(|platform| mujoco::ensure(folder, platform)) {
        Ok(SetupResult::Fetched) => "fetched into",
        Ok(SetupResult::InPlace) => "already in",
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::FAILURE;
        }
    };
    println!("MuJoCo {}: {verb} {}.", mujoco::VERSION, folder.display());
    ExitCode::SUCCESS
}
