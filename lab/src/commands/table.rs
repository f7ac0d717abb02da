//! `ratelab table`: a recording as tables.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    sync::Arc,
};

use ratelab_system::names::key;

use crate::{
    cli::TableArgs,
    error::Error,
    output::{NewFolders, OutputFile, OutputKind, print_line},
    printable::shown,
    program::Program,
    reading,
    table::{RunTables, TableSubject},
};

/// The option for the folder.
const OUTPUT: &str = "--output";

/// Writes a table for each topic and node of a recording, one for its ages and one for its events;
/// of a damaged one the intact part.
pub fn table(program: &Program, args: &TableArgs) -> Result<(), Error> {
    let recording = Arc::new(reading::read(&args.file)?);
    let tables = RunTables::new(&recording, &program.for_recording(&recording).system);
    let folder = args
        .output
        .clone()
        .unwrap_or_else(|| args.file.with_extension(""));
    let made = NewFolders::leading_to(&folder);
    let _empty = made.map_err(|why| Error::unwritable(OUTPUT, &folder, &why))?;
    let subjects = tables.subjects();
    let paths = paths(&folder, &tables, &subjects);
    // All are opened before the first is written.
    let open = |(subject, path): (&TableSubject, &PathBuf)| {
        OutputKind::Rows(&tables.header(*subject)).open(OUTPUT, path)
    };
    let files = subjects.iter().zip(&paths).map(open);
    let files: Vec<OutputFile> = files.collect::<Result<_, _>>()?;
    for (file, subject) in files.into_iter().zip(&subjects) {
        file.write(tables.text(*subject).as_bytes())?;
    }
    print_line(&format!("{}: {} tables", shown(&folder), paths.len()))?;
    Error::if_damaged(&recording)
}

/// Returns the files of the tables in `folder`, each with another name.
fn paths(folder: &Path, tables: &RunTables, subjects: &[TableSubject]) -> Vec<PathBuf> {
    let mut taken = BTreeSet::new();
    let paths = subjects.iter().map(|subject| {
        let name = key(&tables.name(*subject));
        let others = (2..).map(|number| format!("{name}_{number}"));
        let mut names = [name.clone()].into_iter().chain(others);
        // File systems may not tell capitals from small letters.
        let name = names.find(|name| taken.insert(name.to_lowercase()));
        folder.join(format!("{}.csv", name.unwrap_or_default()))
    });
    paths.collect()
}
