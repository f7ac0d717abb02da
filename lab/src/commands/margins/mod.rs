//! `ratelab margins`: how old, how rare and how unsure the data of a robot may be, measured, with
//! linear theory beside it.

mod axes;
mod report;
mod search;

use ratelab::Knob;
use ratelab_experiment::sweep::all_cores;
use ratelab_plant::{ACTUATOR, POLICY, RobotPlant};
use ratelab_system::{
    Setup,
    graph_file::{GraphFile, PLANT_POLICIES, PlantSpec},
};

use self::{
    axes::MarginAxis,
    report::{Margin, MarginReport},
    search::MarginRuns,
};
use crate::{
    cli::MarginsArgs,
    error::Error,
    options::{self, Defaults},
    output::{ProgressLine, print_result},
    program::Program,
    signals,
};

/// Defaults of the runs.
const DEFAULTS: Defaults =
    Defaults::virtual_only("margins are of runs on the virtual clock: leave --clock real out");

/// The seeds of the starts, unless others are given.
const SEEDS: std::ops::Range<u64> = 0..10;

/// The rate of the actuator (Hz), unless another one is given: an action counts as it arrives.
const ACTUATOR_HZ: f64 = 1000.0;

/// Looks for the greatest delay, jitter and loss and the lowest rate that the robot bears. Ctrl-C
/// keeps what was found.
pub fn margins(program: &Program, args: &MarginsArgs) -> Result<(), Error> {
    let (mut config, _) = options::graph(program, &args.graph, &DEFAULTS)?;
    let (plant, spec) = robot(program)?;
    if config.setup.rate(ACTUATOR).is_none() {
        let rate = format!("rate {ACTUATOR} {ACTUATOR_HZ}");
        config.setup.set(knob(&rate)?);
    }
    let config = config.resolved(&*program.system)?;
    let seeds = args.seeds.as_ref().map(|seeds| seeds.values().to_vec());
    let seeds = seeds.unwrap_or_else(|| SEEDS.collect());
    let trials = MarginRuns {
        system: &program.system,
        config: &config,
        seeds: &seeds,
        share: args.share,
        threads: args.threads.unwrap_or_else(all_cores),
        interrupt: &signals::interrupt(),
    };
    let hz = config.setup.rate(POLICY).unwrap_or(spec.rate);
    let policy = config.setup.message(POLICY).unwrap_or(&spec.policy);
    let has_theory = PLANT_POLICIES.contains(&policy);
    let axes = MarginAxis::all(hz.get(), spec.inner.is_some());
    let steps = axes.iter().map(MarginAxis::tries).sum::<u64>() + 1;
    let bar = ProgressLine::new(steps * seeds.len() as u64, "the runs at most".to_owned());
    let ran = || bar.advance();
    // The robot gets the controls of its pose for ever.
    let hold = knob(&format!("send {POLICY} hold"))?;
    let held = trials.run(&[hold], &ran)?;
    let mut stopped = None;
    let mut margins = Vec::new();
    for axis in axes {
        match trials.last_borne(&axis, &ran) {
            Ok(bears) => margins.push(Margin {
                // Nothing is known of a policy in a file.
                theory: has_theory
                    .then(|| theory(&plant, &axis, &config.setup))
                    .flatten(),
                axis,
                bears,
            }),
            Err(why) => {
                stopped = Some(why);
                break;
            }
        }
    }
    drop(bar);
    let report = MarginReport {
        name: program.system.name(),
        spec: &spec,
        trials: &trials,
        other_limit: plant.other_limit(),
        pole: plant.poles().first().copied(),
        touches: plant.is_touching(),
        held: held.stood,
        margins,
    };
    print_result(args.json, &report.json(), &report.text())?;
    stopped.map_or(Ok(()), Err)
}

/// Returns the robot in the graph file of `program`.
fn robot(program: &Program) -> Result<(RobotPlant, PlantSpec), Error> {
    let about = program.system.about();
    let file = about
        .graph_file
        .and_then(|text| GraphFile::parse(text).ok());
    let spec = file.as_ref().and_then(GraphFile::plant);
    let robot = about.plant.zip(spec).and_then(|(record, spec)| {
        let plant = RobotPlant::recorded(record, spec).ok()?;
        Some((plant, spec.clone()))
    });
    let what = "margins are of a robot: name a graph file with a section [plant], such as \
                ratelab margins robot.toml";
    robot.ok_or_else(|| Error::BadInput(what.to_owned()))
}

/// Returns what linear theory says of `axis`, in its unit.
fn theory(plant: &RobotPlant, axis: &MarginAxis, setup: &Setup) -> Option<f64> {
    match (axis.late, axis.name) {
        (Some(topic), _) => plant.bearable_delay_of(topic, setup)?.ms(),
        (None, "rate") => plant.lowest_rate(setup),
        _ => None,
    }
}

/// Parses a knob.
fn knob(text: &str) -> Result<Knob, Error> {
    let knob = text.parse::<Knob>();
    knob.map_err(|why| Error::BadInput(format!("{text}: {why}")))
}
