//! The files of a graph of a bag: the graph file, the folder of its tables, and its knobs.

use std::{
    fs,
    path::{Path, PathBuf},
};

use ratelab_bag::{Analysis, Bag, BagError, NamedEdge};
use ratelab_system::graph_file::GraphFile;

use super::{
    GraphOfBag, graph,
    sheet::{node_name, number},
};
use crate::{
    bag_file,
    error::Error,
    output::{NewFolders, OutputFile, print_line, refuse_existing},
    printable::shown,
    program,
};

/// Writes the graph of the bag at `from` into `path`, which ends in .toml. `edges` are what the user
/// knows of it.
pub fn write(path: &Path, from: &Path, edges: &[String]) -> Result<(), Error> {
    let [folder, knobs] = ["data", "knobs"].map(|ending| path.with_extension(ending));
    for new in [path, &folder, &knobs] {
        refuse_existing("new", new)?;
    }
    let bag = bag_file::read(from)?;
    let analysis = Analysis::with_edges(&bag, &edges_of(&bag, edges)?);
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let graph = graph(
        &bag,
        &analysis,
        &node_name(&name),
        &folder.to_string_lossy(),
    );
    if !graph.text.contains("\n[node.") {
        let why = "no node can be made of this bag: its topics need header stamps and a rate";
        return Err(Error::BadInput(format!("--from {}: {why}", from.display())));
    }
    GraphFile::parse(&graph.text).map_err(|why| {
        let from = from.display();
        Error::BadInput(format!(
            "--from {from}: no graph file can be made of this bag: {why}"
        ))
    })?;
    write_all(path, &folder, &knobs, &graph)?;
    print_line(&said(path, &knobs, &graph))?;
    bag_file::if_damaged(&bag)
}

/// The edges that the user named, by topic.
fn edges_of(bag: &Bag, edges: &[String]) -> Result<Vec<NamedEdge>, Error> {
    let edge = |text: &String| {
        let edge: Result<NamedEdge, BagError> = NamedEdge::parse(bag, text);
        edge.map_err(|why| Error::BadInput(format!("--edge {text:?}: {why}")))
    };
    edges.iter().map(edge).collect()
}

fn write_all(path: &Path, folder: &Path, knobs: &Path, graph: &GraphOfBag) -> Result<(), Error> {
    let open = |path: &Path| OutputFile::open("new", path);
    let mut files: Vec<(PathBuf, &str)> = Vec::new();
    let unwritable = |why| Error::unwritable("new", folder, &why);
    let mut made = NewFolders::default();
    if !graph.tables.is_empty() {
        made = NewFolders::leading_to(folder).map_err(unwritable)?;
    }
    for table in &graph.tables {
        files.push((folder.join(&table.file), &table.text));
    }
    if !graph.knobs.is_empty() {
        files.push((knobs.to_owned(), &graph.knobs));
    }
    files.push((path.to_owned(), &graph.text));
    for (path, text) in files {
        let written = open(&path)?.write(text.as_bytes());
        if written.is_err() {
            // No part of a graph stays behind.
            let _ = fs::remove_dir_all(folder);
        }
        written?;
    }
    drop(made);
    Ok(())
}

/// How the graph is run.
fn said(path: &Path, knobs: &Path, graph: &GraphOfBag) -> String {
    let (file, program) = (shown(path), program::name());
    let with = if graph.knobs.is_empty() {
        String::new()
    } else {
        format!(" --knobs {}", shown(knobs))
    };
    let seconds = number(graph.seconds);
    format!(
        "{file}: {program} run {file} --clock virtual --duration-s {seconds}{with} repeats the bag; read its \
         comments first"
    )
}
