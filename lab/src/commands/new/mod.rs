//! `ratelab new`: files to begin with.

mod from_bag;

use std::{
    fs::{self, Permissions},
    os::unix::fs::PermissionsExt,
    path::Path,
};

use ratelab_cart_pole::policy::ProgramKind;
use ratelab_recording::printable::shown;

use crate::{
    cli::{NewArgs, is_graph_file},
    error::Error,
    graph_file::schema,
    output::{OutputFile, print_data, print_line, refuse_existing, write_error},
    program,
};

/// The example: a graph that misses its limit.
const EXAMPLE: &str = include_str!("../../../../graphs/robot.toml");

/// Writes the example or a program, or prints the schema.
pub fn new(args: &NewArgs) -> Result<(), Error> {
    match (&args.file, args.policy) {
        (Some(file), Some(kind)) => write_policy(file, kind),
        (Some(file), None) => write(file, args),
        (None, _) => print_data(&format!("{:#}", schema())),
    }
}

fn write(path: &Path, args: &NewArgs) -> Result<(), Error> {
    let file = shown(path);
    if !is_graph_file(path.as_os_str()) {
        let why = format!(
            "new {file}: a graph file ends in .toml: choose another name (a policy: with --policy)"
        );
        return Err(Error::BadInput(why));
    }
    if let Some(bag) = &args.from {
        return from_bag::write(path, bag, &args.edge);
    }
    refuse_existing("new", path)?;
    OutputFile::open("new", path)?.write(EXAMPLE.as_bytes())?;
    let program = program::name();
    print_line(&format!("{file}: {program} {file} opens the lab on it"))
}

/// What all such programs have in common, with places for the rest.
const FRAME: &str = include_str!("frame.py");

/// Between the imports of a program and how it asks the policy.
const RULE: &str = "---\n";

/// What is special about a program of some kind.
struct ProgramPart {
    title: &'static str,
    /// The usual name of the file with the policy.
    name: &'static str,
    /// Imports, and how the policy is loaded and asked.
    code: &'static str,
}

impl ProgramPart {
    fn new(kind: ProgramKind) -> Self {
        let (title, name, code) = match kind {
            ProgramKind::Sb3 => (
                "A model of Stable-Baselines3",
                "model.zip",
                include_str!("sb3.py"),
            ),
            ProgramKind::TorchScript => (
                "A TorchScript file",
                "policy.pt",
                include_str!("torchscript.py"),
            ),
            ProgramKind::Onnx => ("An ONNX file", "policy.onnx", include_str!("onnx.py")),
            ProgramKind::Module => (
                "A network of PyTorch and its state_dict",
                "policy.pt",
                include_str!("module.py"),
            ),
        };
        Self { title, name, code }
    }

    /// Returns the whole program.
    fn program(&self) -> String {
        let (imports, ask) = self.code.split_once(RULE).unwrap_or_default();
        FRAME
            .replacen("TITLE", self.title, 1)
            .replacen("IMPORTS", imports.trim_end(), 1)
            .replacen("NAME", self.name, 1)
            .replacen("ASK", ask.trim_end(), 1)
    }
}

/// Writes the program for policies of this kind.
pub fn write_policy(path: &Path, kind: ProgramKind) -> Result<(), Error> {
    let file = shown(path);
    if path.extension().is_none_or(|ending| ending != "py") {
        let why = format!("new {file}: a program in Python ends in .py: choose another name");
        return Err(Error::BadInput(why));
    }
    refuse_existing("new", path)?;
    OutputFile::open("new", path)?.write(ProgramPart::new(kind).program().as_bytes())?;
    make_executable(path).map_err(|why| write_error(path, why))?;
    let program = program::name();
    print_line(&format!(
        "{file}: check MODEL, observation and action in it, then {program} run --policy {}",
        command(path)
    ))
}

/// Lets everybody who may read the file at `path` start it.
fn make_executable(path: &Path) -> std::io::Result<()> {
    let mode = fs::metadata(path)?.permissions().mode();
    fs::set_permissions(path, Permissions::from_mode(mode | (mode & 0o444) >> 2))
}

/// Returns the file as an argument: with a folder in front, so that it is seen to be a file.
fn command(path: &Path) -> String {
    match path.components().count() {
        1 => format!("./{}", shown(path)),
        _ => shown(path),
    }
}
