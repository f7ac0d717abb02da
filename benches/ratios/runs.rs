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
use ratelab_cart_pole::{
    ACTION, CartPole, ControlStep, OBS, Plant, STATE, SUBSTEPS,
    policy::{Policy, Scripted},
};
use ratelab_experiment::{
    Config, Experiment, Summary,
    sweep::{Sweep, all_cores},
};
use ratelab_system::WorldKind;

use super::{
    paired::{Nanos, nanos, paired, time},
    table::Table,
};

/// Rounds of two runs of a millisecond each.
const ROUNDS: usize = 500;

/// Rounds of two runs of ten milliseconds each.
const OWN_ROUNDS: usize = 100;

/// Capacity for every message of a run, so that no publisher waits.
const TAP: usize = 1024;

/// Rounds of two runs of ten milliseconds each.
const LINKED_ROUNDS: usize = 60;

/// Duration of each round of a throughput measurement.
const STRETCH: Duration = Duration::from_millis(400);

/// Fills in the rows about whole runs.
pub fn measure(table: &mut Table) {
    let floor = Floor::new(WorldKind::Course);
    table.heading(format!(
        "A virtual run of 10 s, beside its {} bare physics steps",
        floor.steps()
    ));
    let stepping = || {
        let mut data = floor.start();
        time(|| floor.step(&mut data))
    };
    let plain_loop = || robot(floor.actions.len());
    let work = paired(ROUNDS, plain_loop, stepping);
    table.row("sense, think and act in a plain loop", &work, None);
    let run = paired(ROUNDS, || time_run(experiment()), stepping);
    table.row("run, all statistics on", &run, Some(1.05));
    let plain = paired(ROUNDS, || time_run(experiment()), plain_loop);
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
    throughput(table, &floor, "runs/s on one core", 1);
    throughput(table, &floor, "runs/s on all cores", all_cores().get());
    sweep(table);
    own_world(table);
    links(table);
}

/// Fills in the rows about runs in a world that moves by itself, in ten times as many steps.
fn own_world(table: &mut Table) {
    let floor = Floor::new(WorldKind::OWN);
    table.heading(format!(
        "A run of 10 s in a world of its own, beside its {} bare physics steps",
        floor.steps()
    ));
    // A cost below what makes the policy miss a tick: the same physics.
    for (what, knobs) in [
        ("run", &[][..]),
        ("run whose policy takes 3 ms", &["takes policy 3"]),
        (
            "run whose three nodes take time and wake late",
            &[
                "takes sensor 0.1..0.3",
                "takes policy lognormal:2,4",
                "takes actuator 0.1..0.3",
                "wakes sensor 0..0.1",
                "wakes policy 0..0.1",
                "wakes actuator 0..0.1",
            ],
        ),
    ] {
        let ours = || time_run(experiment_with(WorldKind::OWN, knobs));
        let bare = || {
            let mut data = floor.start();
            time(|| floor.step(&mut data))
        };
        table.row(what, &paired(OWN_ROUNDS, ours, bare), Some(1.1));
    }
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
    build(&Config {
        seed,
        ..Config::default()
    })
}

fn build(config: &Config) -> Experiment {
    Experiment::new(cart_pole(), config).expect("experiment")
}

/// A run in `world` that `knobs` set up.
fn experiment_with(world: WorldKind, knobs: &[&str]) -> Experiment {
    build(&Config {
        world,
        setup: knobs
            .iter()
            .map(|knob| knob.parse().expect("a knob"))
            .collect(),
        ..Config::default()
    })
}

/// A run that had a link on every topic, and has none any more.
fn unlinked_experiment() -> Experiment {
    let mut config = CartPole::config("link /obs delay:5, link /action loss:0.5");
    let config = config.as_mut().expect("knobs");
    let off = CartPole::KNOBS.parse_list("0 link /obs none\n0 link /action none");
    config.knobs = off.expect("knobs");
    build(config)
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

/// Whole runs per second, compared with floors per second.
fn throughput(table: &mut Table, floor: &Floor, what: &str, threads: usize) {
    let rates = paired(
        3,
        || time_of_one(threads, || drop(execute(experiment()))),
        || time_of_one(threads, || floor.step(&mut floor.start())),
    );
    table.rates(what, &rates, None);
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
        ..Sweep::new(cart_pole(), Config::default())
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
    let what = format!("sweep on all cores, beside {cores} × one core alone");
    table.rates(&what, &paired(7, swept, alone), SHARE);
    let what = "sweep on all cores, beside lone runs on all";
    table.rates(what, &paired(7, swept, together), SHARE);
}

/// A share of 0.90 of the cores' capacity, as a goal.
const SHARE: Option<f64> = Some(1.11);

/// Every kind of link, on both topics.
const LINKS: [&str; 2] = [
    "link /obs delay:0..10,in-order,loss:0.05",
    "link /action delay:lognormal:3,10,burst:0.01,2,reliable:10",
];

/// Fills in the row about links, in a world that does not wait.
fn links(table: &mut Table) {
    table.heading("A virtual run of 10 s in its own world".to_owned());
    let run = |links: &[&str]| {
        let experiment = experiment_with(WorldKind::OWN, links);
        time(|| assert!(!execute(experiment).verdict.is_lost()))
    };
    let linked = paired(LINKED_ROUNDS, || run(&LINKS), || run(&[]));
    table.row("every kind of link, beside none", &linked, Some(1.1));
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

/// The physics of the default run in one of the worlds alone: same model, same start, same
/// actions, so the same numbers pass through the same instructions.
struct Floor {
    model: MjModel,
    qpos: [f64; 2],
    qvel: [f64; 2],
    actions: Vec<f64>,
    /// Steps of physics with each action.
    substeps: usize,
    /// The final state, which proves that the work was done.
    end: [f64; 2],
}

impl Floor {
    fn new(world: WorldKind) -> Self {
        let model = include_str!("../../crates/cart-pole/src/cartpole.xml");
        let mut model = MjModel::from_xml_string(model).expect("model");
        let substeps = match world {
            WorldKind::Course => SUBSTEPS as usize,
            WorldKind::Own { step_ms } => {
                model.opt_mut().timestep = step_ms.get() as f64 / 1e3;
                20 / step_ms.get() as usize
            }
        };
        let plant = Plant::new(Config::default().seed).expect("plant");
        let experiment = experiment_with(world, &[]);
        let tap = experiment
            .taps()
            .messages::<ControlStep>(STATE, TAP)
            .expect(STATE);
        execute(experiment);
        let steps: Vec<_> = tap.items().iter().map(|step| step.message.data).collect();
        Self {
            model,
            qpos: plant.qpos(),
            qvel: plant.qvel(),
            actions: steps.iter().map(|s| f64::from(s.action.0)).collect(),
            substeps,
            end: steps.last().expect("steps").qpos,
        }
    }

    fn steps(&self) -> usize {
        self.actions.len() * self.substeps
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
            for _ in 0..self.substeps {
                data.step();
            }
        }
        assert_eq!(data.qpos(), self.end, "the floor did other work");
    }
}
