//! `ratelab new`: an example of a graph file, the graph of a bag, the schema of such files, and programs for policies.

mod from_bag;
mod policy;

use std::path::Path;

use crate::{
    cli::{NewArgs, is_graph_file},
    error::Error,
    graph_schema::schema,
    output::{OutputFile, print_data, print_line, refuse_existing},
    printable::shown,
    program,
};

/// The example: a graph that misses its limit.
const EXAMPLE: &str = include_str!("../../../../graphs/robot.toml");

/// Writes the example or a program, or prints the schema.
pub fn new(args: &NewArgs) -> Result<(), Error> {
    match (&args.file, args.policy) {
        (Some(file), Some(kind)) => policy::write(file, kind),
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
