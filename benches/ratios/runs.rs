//! The time of a virtual run relative to its physics alone.

use std::{
    hint::black_box,
    ops::ControlFlow,
    sync::{
        Arc, LazyLock,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use mujoco_rs::prelude::{MjData, MjModel};
use ratelab::{
    cartpole::{ACTION, CartPole, ControlStep, OBS, Plant, STATE, SUBSTEPS},
    experiment::{
        Config, Experiment, Summary,
        sweep::{Sweep, all_cores},
    },
    policy::{Policy, Scripted},
};

use super::{
    paired::{Nanos, Paired, nanos, paired, time},
    table::Table,
};

/// Rounds of two runs of a millisecond each.
const ROUNDS: usize = 500;

/// Capacity for every message of a run, so that no publisher waits.
const TAP: usize = 1024;

/// Duration of each round of a throughput measurement.
const STRETCH: Duration = Duration::from_millis(400);

/// Fills in the rows about whole runs.
pub fn measure(table: &mut Table) {
    let floor = Floor::new();
    table.heading(format!(
        "A virtual run of 10 s, beside its {} bare physics steps",
        floor.actions.len() * SUBSTEPS as usize
    ));
    let stepping = || {
        let mut data = floor.start();
        time(|| floor.step(&mut data))
    };
    let work = paired(ROUNDS, || robot(floor.actions.len()), stepping);
    table.row("sense, think and act in a plain loop", &work, None);
    let run = paired(ROUNDS, || time_run(experiment()), stepping);
    table.row("run, all statistics on", &run, Some(1.05));
    let plain = paired(
        ROUNDS,
        || time_run(experiment()),
        || robot(floor.actions.len()),
    );
    table.row("run, beside that plain loop", &plain, None);
    let unlinked = paired(
        ROUNDS,
        || time_run(unlinked_experiment()),
        || time_run(experiment()),
    );
    table.row(
        "run, its links taken away at the start",
        &unlinked,
        Some(1.02),
    );
    let tapped = paired(ROUNDS, time_tapped_run, stepping);
    table.row("run with a tap on every topic", &tapped, Some(1.05));
    let whole = paired(
        ROUNDS,
        || time(|| drop(execute(experiment()))),
        || time(|| floor.step(&mut floor.start())),
    );
    table.row("run and making graph and plant", &whole, None);
    let cores = thread::available_parallelism().map_or(1, usize::from);
    for (what, threads) in [("runs/s on one core", 1), ("runs/s on all cores", cores)] {
        throughput(table, &floor, what, threads);
    }
    sweep(table);
}

/// The work of the three nodes, without nodes, topics and a clock: the minimum for any
/// runtime.
fn robot(steps: usize) -> Nanos {
    let mut plant = Plant::new(Config::default().seed).expect("plant");
    time(|| {
        for _ in 0..steps {
            let action = Scripted.act(&plant.observe());
            black_box(plant.step(action));
            black_box((plant.observe(), plant.qpos(), plant.qvel()));
        }
    })
}

/// The cart-pole, shared by all runs, as in a sweep.
fn cart_pole() -> Arc<CartPole> {
    static CART_POLE: LazyLock<Arc<CartPole>> = LazyLock::new(Arc::default);
    CART_POLE.clone()
}

fn experiment() -> Experiment {
    experiment_of(Config::default().seed)
}

fn experiment_of(seed: u64) -> Experiment {
    let config = Config {
        seed,
        ..Config::default()
    };
    Experiment::new(cart_pole(), &config).expect("experiment")
}

/// A run that had a link on every topic, and has none any more.
fn unlinked_experiment() -> Experiment {
    let mut config = CartPole::config("link /obs delay:5, link /action loss:0.5");
    let config = config.as_mut().expect("knobs");
    let off = CartPole::KNOBS.parse_list("0 link /obs none\n0 link /action none");
    config.knobs = off.expect("knobs");
    Experiment::new(cart_pole(), config).expect("experiment")
}

fn execute(experiment: Experiment) -> Summary {
    experiment.run().expect("run")
}

fn time_run(experiment: Experiment) -> Nanos {
    time(|| drop(execute(experiment)))
}

fn time_tapped_run() -> Nanos {
    let experiment = experiment();
    let taps = [OBS, ACTION, STATE].map(|topic| experiment.taps().rows(topic, TAP).expect(topic));
    let time = time_run(experiment);
    let mut rows = taps[0].rows();
    assert_eq!(taps[0].take(&mut rows), 501, "the tap missed messages");
    time
}

/// Whole runs per second, compared with floors per second. The ratio is one of times, as
/// elsewhere.
fn throughput(table: &mut Table, floor: &Floor, what: &str, threads: usize) {
    let rates = paired(
        3,
        || time_of_one(threads, || drop(execute(experiment()))),
        || time_of_one(threads, || floor.step(&mut floor.start())),
    );
    let per_second = |time: Nanos| format!("{:.0}/s", 1e9 / time);
    let cells = [per_second(rates.ours), per_second(rates.floor)];
    table.cells(what, cells, rates.ratio, None);
}

/// Number of seeds of the timed sweep, per core: about half a second.
const SWEPT: u64 = 400;

/// A sweep on all cores, compared with the rate of separate runs on one core times the
/// number of cores. Both make the same runs, so the ratio is one of times.
fn sweep(table: &mut Table) {
    let cores = all_cores().get();
    let seeds = SWEPT * cores as u64;
    let sweep = Sweep {
        seeds: (0..seeds).collect(),
        ..Sweep::of(cart_pole(), Config::default())
    };
    let swept = || {
        let whole = time(|| {
            let swept = sweep.run(all_cores(), |_, _| ControlFlow::Continue(()));
            assert!(swept.expect("swept").is_complete());
        });
        whole / seeds as f64
    };
    let alone = || {
        let lone = time(|| (0..SWEPT).for_each(|seed| drop(execute(experiment_of(seed)))));
        lone / SWEPT as f64 / cores as f64
    };
    let together = || time_of_one(cores, || drop(execute(experiment())));
    let per_second = |time: Nanos| format!("{:.0}/s", 1e9 / time);
    let mut row = |what: String, rates: Paired| {
        let cells = [per_second(rates.ours), per_second(rates.floor)];
        // A share of 0.90 of the cores' capacity.
        table.cells(&what, cells, rates.ratio, Some(1.11));
    };
    let what = format!("sweep on all cores, beside {cores} × one core alone");
    row(what, paired(7, swept, alone));
    let what = "sweep on all cores, beside lone runs on all".to_owned();
    row(what, paired(7, swept, together));
}

/// Wall time per piece of `work` while `threads` threads run it.
fn time_of_one(threads: usize, work: impl Fn() + Sync) -> Nanos {
    let (done, over) = (AtomicU64::new(0), AtomicBool::new(false));
    let began = Instant::now();
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while !over.load(Ordering::Relaxed) {
                    work();
                    done.fetch_add(1, Ordering::Relaxed);
                }
            });
        }
        thread::sleep(STRETCH);
        over.store(true, Ordering::Relaxed);
    });
    nanos(began.elapsed()) / done.into_inner() as f64
}

/// The physics of the default run alone: same model, same start, same actions, so the
/// same numbers pass through the same instructions.
struct Floor {
    model: MjModel,
    qpos: [f64; 2],
    qvel: [f64; 2],
    actions: Vec<f64>,
    /// The final state, which proves that the work was done.
    end: [f64; 2],
}

impl Floor {
    fn new() -> Self {
        let model = include_str!("../../src/cartpole/cartpole.xml");
        let plant = Plant::new(Config::default().seed).expect("plant");
        let experiment = experiment();
        let tap = experiment.taps().messages::<ControlStep>(STATE, TAP);
        let tap = tap.expect(STATE);
        execute(experiment);
        let steps: Vec<_> = tap.items().iter().map(|step| step.message.data).collect();
        Self {
            model: MjModel::from_xml_string(model).expect("model"),
            qpos: plant.qpos(),
            qvel: plant.qvel(),
            actions: steps.iter().map(|s| f64::from(s.action.0)).collect(),
            end: steps.last().expect("steps").qpos,
        }
    }

    fn start(&self) -> MjData<&MjModel> {
        let mut data = MjData::new(&self.model);
        data.qpos_mut().copy_from_slice(&self.qpos);
        data.qvel_mut().copy_from_slice(&self.qvel);
        data.forward();
        data
    }

    fn step(&self, data: &mut MjData<&MjModel>) {
        for &action in &self.actions {
            data.ctrl_mut()[0] = action;
            for _ in 0..SUBSTEPS {
                data.step();
            }
        }
        assert_eq!(data.qpos(), self.end, "the floor did other work");
    }
}
