//! Graph files for tests, their runs and the figures of their chains.

use std::fs;

use ratelab_system::graph_file::{GraphFile, GraphFileError};

use super::*;
use crate::clone::root;

/// The text of a graph file in `graphs/` or among the fixtures, or of several together, such as
/// `middle+blink`, with changes such as `rate = 10 → rate = 20; …`.
pub fn graph_text(name: &str, changes: &str) -> String {
    let texts = name.split('+').map(|name| {
        let folders = ["tests/fixtures/graphs", "graphs"];
        let mut files = folders
            .map(|at| root().join(format!("{at}/{name}.toml")))
            .into_iter();
        let text = files.find_map(|file| fs::read_to_string(file).ok());
        text.expect(name)
    });
    changes
        .split(';')
        .filter_map(|change| change.split_once('→'))
        .fold(texts.collect(), |text: String, (before, after)| {
            let (before, after) = (before.trim(), after.trim());
            assert!(text.contains(before), "{name} has no {before}");
            text.replace(before, after)
        })
}

/// The system of a graph file, which may have the cart-pole in its middle.
pub fn graph_system(text: &str) -> Result<Arc<dyn System>, GraphFileError> {
    let known: Arc<dyn System> = cart_pole();
    let system = GraphFile::parse(text)?.system(&[known])?;
    Ok(Arc::new(system))
}

/// So many seconds of it, with knobs such as `takes camera 5; 2 crash control`.
pub fn run_graph(text: &str, seconds: f64, list: &str) -> Summary {
    let config = config(&format!("until {seconds}; {list}"));
    run_of(graph_system(text).expect("a graph"), &config)
}

/// The lines about chains at the end of a run.
pub fn chain_lines(text: &str, summary: &Summary) -> Vec<String> {
    let system = graph_system(text).expect("a graph");
    let chains = system.about().chains.iter();
    let lines =
        chains.map(|chain| chain.line(summary.sim_time, &summary.chains, &summary.silence()));
    lines.collect()
}

/// Checks the run of a graph file in each row: its name, its changes, the seconds, the knobs, and
/// the figures, to which those of its chains belong, such as `see_greatest_age 160` (ms).
pub fn check_graphs(table: &str) {
    for [name, changes, seconds, list, figures] in crate::table::rows(table) {
        let case = format!("{name} {changes} {list}");
        let text = graph_text(&name, &changes);
        let summary = run_graph(&text, seconds.parse().expect(&case), &list);
        let system = graph_system(&text).expect("a graph");
        let ages = system.judge().finals_at(summary.sim_time, &summary.state);
        let (of_chains, others): (Vec<_>, Vec<_>) = figures
            .split(';')
            .map(str::trim)
            .partition(|figure| figure.contains("_age "));
        for expected in of_chains {
            let name = expected.split(' ').next().unwrap_or_default();
            let age = ages
                .iter()
                .find(|figure| figure.name == name)
                .unwrap_or_else(|| panic!("{case}: no {name}"));
            assert_eq!(format!("{name} {:.1}", age.value), expected, "{case}");
        }
        check(&case, &summary, &others.join("; "));
    }
}
