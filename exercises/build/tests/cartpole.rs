//! The cart-pole on the types of this crate, as in the lab to the bit.

use std::sync::Arc;

use build_it::cartpole::{Run, Settings, run};
use ratelab::{ClockExit, EventKind, Push, Time};
use ratelab_cart_pole::CartPole;
use ratelab_experiment::Experiment;
use ratelab_metrics::TickRecord;

/// More messages or ticks than a run of ten seconds has.
const ALL: usize = 10_000;

/// This run in the lab.
fn in_the_lab(settings: &Settings) -> Run {
    let config = settings.config().expect("settings");
    let experiment = Experiment::new(Arc::new(CartPole::default()), &config).expect("a run");
    let (taps, graph) = (experiment.taps(), experiment.observer().topology());
    let names = graph.nodes.into_iter().map(|node| node.name);
    let ticks: Vec<_> = names.zip(taps.ticks(ALL)).collect();
    let names = taps.topics().iter().map(|topic| topic.name().to_owned());
    let topics = names.map(|name| (taps.rows(&name, ALL).expect("a topic"), name));
    let topics: Vec<_> = topics.collect();
    let events = experiment.run().expect("it ran").events;
    let ended = events.into_iter().find_map(|event| match event.what {
        EventKind::Ended { node } => Some(ClockExit::Ended { node, at: event.at }),
        _ => None,
    });
    let topics = topics.into_iter().map(|(tap, name)| {
        let mut rows = tap.rows();
        tap.take(&mut rows);
        (name, rows)
    });
    let ticks = ticks.into_iter();
    Run {
        topics: topics.collect(),
        ticks: ticks
            .map(|(name, tap)| (name, tap.items().try_iter().collect()))
            .collect(),
        exit: ended.unwrap_or(ClockExit::Completed),
    }
}

/// A tick without its duration, which is wall time.
fn timeless(tick: &TickRecord) -> (u64, Time, Option<Push>) {
    (tick.number, tick.at, tick.push)
}

#[test]
fn the_cart_pole_runs_on_them_as_in_the_lab_to_the_byte() {
    for (seed, control_hz, depth) in [
        (0, 50, 1),
        (1, 25, 1),
        (2, 10, 3),
        (0, 5, 1),
        (0, 5, 100),
        (3, 7, 1),
        (4, 30, 2),
        (5, 120, 1),
    ] {
        let settings = Settings {
            seed,
            control_hz,
            depth,
            seconds: 10,
        };
        let (own, lab) = (run(&settings).expect("a plant"), in_the_lab(&settings));
        let (rows, expected) = (own.csv(), lab.csv());
        let mut lines = rows.lines().zip(expected.lines());
        let differs = lines.find(|(own, lab)| own != lab);
        assert_eq!(differs, None, "{settings:?}: the first row that differs");
        assert!(rows == expected, "{settings:?}: one of them is shorter");
        for (topic, messages) in &lab.topics {
            let own = own.topics.get(topic).expect("messages");
            let mut pairs = own.iter().zip(messages.iter());
            let differs = pairs.find(|(own, lab)| own != lab);
            assert_eq!(differs, None, "{settings:?}: the first message of {topic}");
            assert_eq!(
                own.len(),
                messages.len(),
                "{settings:?}: messages of {topic}"
            );
        }
        for (node, ticks) in &lab.ticks {
            let own = own.ticks.get(node).expect("ticks").iter().map(timeless);
            assert!(own.eq(ticks.iter().map(timeless)), "{settings:?}: {node}");
        }
        assert_eq!(own.exit, lab.exit, "{settings:?}");
    }
}
