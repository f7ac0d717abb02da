//! The cost of the log of a run under the real clock, and the speed of its re-execution.

use std::{
    hint::black_box,
    sync::{Arc, Mutex, PoisonError},
};

use ratelab::{
    Clock, ClockKind, Depth, Event, Graph, Hz, Inbox, Tick, Time, Topic, Topology, VirtualClock,
};
use ratelab_cart_pole::CartPole;
use ratelab_experiment::{Config, Experiment};
use ratelab_re_execution::{Log, ReExecution, RunLog};
use ratelab_real_clock::RealClock;

use super::{
    paired::{Nanos, paired, time},
    table::Table,
};

const ROUNDS: usize = 100;

/// Messages per round.
const MESSAGES: u64 = 10_000;

/// Duration of the run that is executed again.
const RUN: Time = Time::from_nanos(1_000_000_000);

/// Fills in the rows about runs that come again.
pub fn measure(table: &mut Table) {
    table.heading("A run of the real clock that can be executed again");
    let noted = || messages_in_a_tick(&mut RealClock::default());
    let plain = || messages_in_a_tick(&mut VirtualClock);
    let cost = paired(ROUNDS, noted, plain);
    table.row(
        "a message with its turns noted, beside one without",
        &cost,
        None,
    );
    let recorded = Recorded::new();
    let virtual_run = || {
        time(|| {
            black_box(experiment(ClockKind::Virtual).run().expect("run"));
        })
    };
    let speed = paired(ROUNDS, || recorded.again(), virtual_run);
    table.row(
        "1 s executed again, beside 1 s of virtual time",
        &speed,
        None,
    );
}

/// Time to publish and read a message in a tick under `clock`.
fn messages_in_a_tick(clock: &mut dyn Clock) -> Nanos {
    let (took, result) = (Arc::new(Mutex::new(0.0)), Inbox::default());
    let (mut graph, mut inbox) = (Graph::new(), result);
    let topic = Topic::new("/number", Depth::ONE);
    let kept = took.clone();
    let added = graph.node("node", Hz::new(1.0).expect("a rate"), 0, |wiring| {
        let (publisher, mut subscription) = (wiring.publisher(&topic), wiring.subscription(&topic));
        move |tick: &mut Tick| {
            let nanos = time(|| {
                for number in 0..MESSAGES {
                    tick.publish(&publisher, black_box(number));
                    black_box(tick.read(&mut subscription));
                }
            });
            *kept.lock().unwrap_or_else(PoisonError::into_inner) = nanos / MESSAGES as f64;
        }
    });
    added.expect("a node");
    // The real clock notes turns for a log.
    RunLog::attach(&graph.state());
    clock
        .run(&mut graph, &mut inbox, Time::ZERO)
        .expect("no fault");
    *took.lock().unwrap_or_else(PoisonError::into_inner)
}

fn experiment(clock: ClockKind) -> Experiment {
    let config = Config {
        clock,
        end: RUN,
        ..Config::default()
    };
    Experiment::new(Arc::new(CartPole::default()), &config).expect("experiment")
}

/// A run that was under the real clock.
struct Recorded {
    log: Log,
    events: Vec<Event>,
    topology: Topology,
}

impl Recorded {
    fn new() -> Self {
        let experiment = experiment(ClockKind::Real);
        let observer = experiment.observer();
        let topology = observer.topology();
        experiment.run().expect("run");
        Self {
            log: RunLog::attach(&observer).log(),
            events: observer.events(0),
            topology,
        }
    }

    fn again(&self) -> Nanos {
        time(|| {
            let re_execution = ReExecution::new(&self.log, &self.events, &self.topology);
            let summary = experiment(ClockKind::Real).run_with(&mut re_execution.expect("a log"));
            black_box(summary.expect("run"));
        })
    }
}
