//! Graph files: altered ones run, or are refused with their place.

use std::sync::Arc;

use ratelab::Time;
use ratelab_cart_pole::CartPole;
use ratelab_experiment::{Config, Experiment};
use ratelab_system::{
    System,
    graph_file::{GraphFile, GraphFileError},
};

use crate::cases::{RandomSource, mutate, pick, run};

/// The files to alter.
const FILES: [&str; 5] = [
    include_str!("../../graphs/robot.toml"),
    include_str!("../../graphs/camera-pole.toml"),
    include_str!("../../graphs/autoware.toml"),
    include_str!("../../graphs/starving-subscription.toml"),
    include_str!("../../graphs/three-servos.toml"),
];

/// Characters that mean something in a graph file.
const SPICE: &[u8] = b"[]{}\"'=.,#/-_0159e \n\t\r\x00\xc3\xff";

fn system(text: &str) -> Result<Arc<dyn System>, GraphFileError> {
    let known: Arc<dyn System> = Arc::new(CartPole::default());
    Ok(Arc::new(GraphFile::parse(text)?.system(&[known])?))
}

fn case(random: &mut RandomSource, note: &mut String) {
    let mut content = pick(random, &FILES).as_bytes().to_vec();
    mutate(&mut content, SPICE, random);
    let text = String::from_utf8_lossy(&content).into_owned();
    note.clone_from(&text);
    let system = match system(&text) {
        Ok(system) => system,
        Err(error) => {
            let lines = 1 + text.matches('\n').count();
            assert!((1..=lines).contains(&error.line), "{error}");
            assert!(error.column > 0 && !error.what.is_empty(), "{error}");
            return;
        }
    };
    let config = Config {
        end: Time::from_nanos(50_000_000),
        ..Config::default()
    };
    // A link to a topic of the system that has no reader, for example, is known here.
    let Ok(experiment) = Experiment::new(system, &config) else {
        return;
    };
    experiment.run().expect("no node fails");
}

#[test]
fn altered_graph_files_run_or_are_refused_with_their_place() {
    run("graph files", 400, case);
}
