//! A recording tells what the run did.

use std::{sync::Arc, time::Duration};

use ratelab::{
    experiment::Config,
    runtime::{ClockKind, Snapshot, Time, telemetry::Distribution},
};

use super::{Dice, cases, folder, read, record, recording, verify};
use crate::recording::Replay;

/// All figures in a snapshot, as text.
fn figures(snapshot: &Snapshot) -> String {
    let distribution = |d: &Distribution| {
        let quantiles = [0.1, 0.5, 0.9, 0.99].map(|q| d.quantile(q));
        format!("{} {:?} {:?} {quantiles:?}", d.count(), d.sum(), d.max())
    };
    let mut text = format!("{} {:?}\n", snapshot.now, snapshot.status);
    for node in &snapshot.nodes {
        let meters = node.meters.iter();
        let meters: Vec<_> = meters.map(|m| distribution(&m.distribution)).collect();
        text += &format!(
            "{} {} {} {} {} {} {meters:?}\n",
            node.name,
            node.hz,
            node.ticks,
            node.overruns,
            distribution(&node.lateness),
            distribution(&node.tick_time),
        );
    }
    for topic in &snapshot.topics {
        let readers = topic.subscriptions.iter();
        let readers: Vec<_> = readers
            .map(|s| (s.dropped, s.dropped_lately, distribution(&s.ages)))
            .collect();
        text += &format!(
            "{} {} {} {} {:?} {readers:?}\n",
            topic.name, topic.depth, topic.published, topic.per_second, topic.newest,
        );
    }
    text
}

#[test]
fn a_run_told_again_shows_the_figures_that_the_run_showed() {
    let (folder, mut dice) = (folder(), Dice(3));
    for number in 0..cases(8) {
        let config = Config {
            knobs: (0..3).map(|_| dice.knob()).collect(),
            ..dice.config()
        };
        let whole = folder.path().join(format!("{number}.rrd"));
        record(&config, &whole).0.expect("no fault");
        let mut replay = Replay::new(Arc::new(read(&whole)));
        // As far as the run came, and at two moments on the way.
        let last = replay.recording().until.as_nanos();
        for until in [last / 3, last / 2, last].map(Time::from_nanos) {
            let end = until.min(config.end);
            let part = folder.path().join(format!("{number}-{until}.rrd"));
            let (_, snapshot) = record(
                &Config {
                    end,
                    ..config.clone()
                },
                &part,
            );
            replay.advance_to(until);
            assert_eq!(
                figures(&replay.observer().snapshot()),
                figures(&snapshot),
                "{config:?} at {until}"
            );
        }
    }
}

#[test]
fn a_replay_from_the_beginning_is_the_same() {
    let folder = folder();
    let mut replay = Replay::new(Arc::new(recording(&folder)));
    let until = Time::from_nanos(2_500_000_000);
    let steps = replay.advance_to(until);
    let first = figures(&replay.observer().snapshot());
    replay.advance_to(Time::MAX);
    replay.rewind();
    assert_eq!(replay.advance_to(until), steps);
    assert_eq!(figures(&replay.observer().snapshot()), first);
}

#[test]
fn a_real_clock_run_is_told_and_not_verified() {
    let folder = folder();
    let path = folder.path().join("real.rrd");
    let config = Config {
        clock: ClockKind::Real,
        end: Time::from_nanos(1_200_000_000),
        // Too long for its rate: it overruns.
        think: Duration::from_millis(50),
        ..Config::default()
    };
    let (outcome, snapshot) = record(&config, &path);
    let recording = read(&path);
    let error = verify(&recording).expect_err("no two are the same");
    assert!(
        error.to_string().contains("under the real clock"),
        "{error}"
    );
    let mut replay = Replay::new(Arc::new(recording));
    replay.advance_to(Time::MAX);
    let replayed = replay.summary();
    let summary = outcome.expect("no fault");
    assert_eq!(replayed.end(), summary.end());
    assert_eq!(
        (replayed.obs, replayed.action),
        (summary.obs, summary.action)
    );
    assert!(snapshot.nodes[1].overruns > 5, "no overruns to tell of");
    for (replayed, node) in replayed.nodes.iter().zip(&snapshot.nodes) {
        assert_eq!(
            (replayed.ticks, replayed.overruns),
            (node.ticks, node.overruns)
        );
        assert_eq!(replayed.lateness.sum(), node.lateness.sum());
        assert_eq!(replayed.tick_time.sum(), node.tick_time.sum());
    }
}
