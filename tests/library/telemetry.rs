//! Accuracy of figures: counts, means and maxima are exact, quantiles are accurate to 0.1
//! %, and reading changes nothing.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::Duration,
};

use proptest::prelude::*;
use ratelab::{Depth, GO_ON, Graph, Time, Topic};
use ratelab_account::{Distribution, Observer, ReplayAccounts, TickRecord};

use crate::support::{at, depth, hz, run_virtual, secs, set_depth, talker};

fn recorded(samples: &[u64]) -> Distribution {
    let mut distribution = Distribution::empty();
    for nanos in samples {
        distribution.add(Duration::from_nanos(*nanos));
    }
    distribution
}

#[test]
fn a_distribution_without_samples_has_no_figures() {
    let empty = recorded(&[]);
    assert_eq!((empty.count(), empty.sum()), (0, Duration::ZERO));
    assert_eq!(empty.mean_s(), None);
    assert_eq!((empty.max(), empty.quantile(0.5)), (None, None));
}

proptest! {
    #[test]
    fn count_sum_mean_and_maximum_are_exact(
        samples in proptest::collection::vec(0..1u64 << 40, 1..200),
    ) {
        let distribution = recorded(&samples);
        let sum: u64 = samples.iter().sum();
        prop_assert_eq!(distribution.count(), samples.len() as u64);
        prop_assert_eq!(distribution.sum(), Duration::from_nanos(sum));
        let mean = sum as f64 / samples.len() as f64 / 1e9;
        prop_assert_eq!(distribution.mean_s(), Some(mean));
        let max = samples.iter().max().copied().map(Duration::from_nanos);
        prop_assert_eq!(distribution.max(), max);
    }

    #[test]
    fn quantiles_are_true_to_a_tenth_of_a_percent(
        mut samples in proptest::collection::vec(1..1u64 << 40, 1..200),
        quantile in 0.01..=1.0f64,
    ) {
        let measured = recorded(&samples).quantile(quantile).expect("samples");
        samples.sort_unstable();
        let rank = (quantile * samples.len() as f64).ceil() as usize;
        let exact = samples[rank - 1] as f64;
        let error = (measured.as_nanos() as f64 - exact).abs() / exact;
        prop_assert!(error <= 1e-3, "{measured:?} for {exact} ns");
    }
}

fn ms(milliseconds: f64) -> Duration {
    Duration::from_secs_f64(milliseconds / 1e3)
}

#[test]
fn quantiles_of_durations_on_a_grid_are_these_durations() {
    for exact in [140.0, 19.99, 40.0, 100.0, 180.0, 0.02, 3_600_000.0].map(ms) {
        let samples = vec![exact.as_nanos() as u64; 7];
        // One longer sample, so that none of them is the maximum.
        let distribution = recorded(&[samples, vec![1 << 45]].concat());
        for quantile in [0.0, 0.01, 0.5, 0.8] {
            assert_eq!(distribution.quantile(quantile), Some(exact));
        }
    }
}

proptest! {
    #[test]
    fn quantiles_rise_from_the_shortest_sample_to_the_longest(
        samples in proptest::collection::vec(0..1u64 << 20, 1..200),
    ) {
        let distribution = recorded(&samples);
        let quantiles = (0..=100).map(|percent| {
            let quantile = distribution.quantile(f64::from(percent) / 100.0);
            quantile.expect("samples").as_nanos() as u64
        });
        let quantiles: Vec<u64> = quantiles.collect();
        prop_assert!(quantiles.is_sorted(), "{quantiles:?}");
        prop_assert!(quantiles[0] >= samples.iter().copied().min().unwrap_or(0));
        prop_assert_eq!(Some(quantiles[100]), samples.iter().copied().max());
    }

    #[test]
    fn bars_count_every_sample_once_within_a_tenth_of_a_percent(
        mut samples in proptest::collection::vec(0..1u64 << 40, 1..200),
    ) {
        samples.sort_unstable();
        let bars: Vec<(Duration, u64)> = recorded(&samples).bars().collect();
        prop_assert!(bars.is_sorted_by(|a, b| a.0 < b.0), "{bars:?}");
        let repeated = |(at, count): &(Duration, u64)| {
            std::iter::repeat_n(at.as_nanos() as f64, *count as usize)
        };
        let counted: Vec<f64> = bars.iter().flat_map(repeated).collect();
        prop_assert_eq!(counted.len(), samples.len());
        for (counted, exact) in counted.iter().zip(samples) {
            prop_assert!((counted - exact as f64).abs() <= exact as f64 / 1e3);
        }
    }
}

#[test]
fn samples_of_any_length_are_counted() {
    let longest = u64::MAX;
    let distribution = recorded(&[0, 1, 1_000_000, longest]);
    assert_eq!(distribution.count(), 4);
    assert_eq!(distribution.max(), Some(Duration::from_nanos(longest)));
}

#[test]
fn all_samples_are_counted_during_continuous_reading() {
    const SAMPLES: u64 = 200_000;
    let (mut graph, mut meter) = (Graph::new(), None);
    let node = graph.node("steady", hz(50.0), 0, |wiring| {
        meter = Some(wiring.meter("wait"));
        |_| GO_ON
    });
    node.expect("a node");
    let (observer, mut meter) = (Observer::of(&graph), meter.expect("a meter"));
    let count = || {
        let snapshot = observer.snapshot();
        snapshot.meter("steady", "wait").expect("a meter").count()
    };
    let done = AtomicBool::new(false);
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                let mut seen = 0;
                while !done.load(Ordering::Relaxed) {
                    let before = std::mem::replace(&mut seen, count());
                    assert!(seen >= before, "a count went back");
                }
            });
        }
        for sample in 0..SAMPLES {
            meter.record(Duration::from_nanos(sample));
        }
        done.store(true, Ordering::Relaxed);
    });
    assert_eq!(count(), SAMPLES);
}

#[test]
fn the_snapshot_of_a_finished_run_is_its_summary() {
    let experiment = crate::support::experiment(&crate::support::config("control-hz 15"));
    let observer = experiment.observer();
    let summary = experiment.run().expect("run");
    let snapshot = observer.snapshot();
    assert_eq!(snapshot.now, summary.sim_time);
    for (topic, summary) in snapshot.topics.iter().zip(&summary.topics) {
        assert_eq!(topic.name, summary.name);
        assert_eq!(
            (topic.published, topic.dropped()),
            (summary.published, summary.dropped())
        );
    }
    for (node, summary) in snapshot.nodes.iter().zip(&summary.nodes) {
        assert_eq!((&*node.name, node.hz), (&*summary.name, summary.hz));
        assert_eq!(
            (node.ticks, node.overruns),
            (summary.ticks, summary.overruns)
        );
    }
    let (_, latency) = &snapshot.nodes[2].meters[0];
    assert_eq!(latency.count(), summary.latency.count());
    assert_eq!(latency.sum(), summary.latency.sum());
    assert_eq!(observer.events(0), summary.events);
}

#[test]
fn a_replay_ends_at_the_end_of_the_run_even_after_a_later_tick() {
    let mut graph = Graph::new();
    graph
        .node("late", hz(50.0), 0, |_| |_| GO_ON)
        .expect("a node");
    let observer = Observer::of(&graph);
    let mut replay = ReplayAccounts::new(&observer.topology(), observer.status());
    let late = TickRecord {
        number: 50,
        at: secs(1.000_25),
        ends: None,
        lateness: None,
        took: None,
        overruns: 0,
        push: None,
    };
    replay.tick(0, &late);
    replay.set_now(secs(1.0));
    assert_eq!(replay.observer().now(), secs(1.0));
}

#[test]
fn observing_a_run_leaves_it_unchanged() {
    let config = crate::support::config("control-hz 15");
    let experiment = crate::support::experiment(&config);
    let (observer, done) = (experiment.observer(), AtomicBool::new(false));
    let watched = thread::scope(|scope| {
        scope.spawn(|| {
            while !done.load(Ordering::Relaxed) {
                observer.snapshot();
            }
        });
        let watched = crate::support::collect(experiment);
        done.store(true, Ordering::Relaxed);
        watched
    });
    assert!(watched.bytes() == crate::support::run_bytes(&config).bytes());
}

/// The rate at run time `now` (s) of a topic with a message every 20 ms from zero until `end`.
fn fifty_hertz(end: f64, now: f64) -> f64 {
    let (mut graph, topic) = (Graph::new(), Topic::new("/steady", Depth::ONE));
    talker(&mut graph, "steady", 50.0, 0, &topic, |_| None);
    let (observer, publisher) = (Observer::of(&graph), topic.publisher());
    for message in 0..(end * 50.0) as u64 {
        publisher.publish((), Time::from_nanos(message * 20_000_000), None);
    }
    observer.set_now(secs(now));
    observer.snapshot().topics[0].per_second(secs(now))
}

#[test]
fn the_rate_of_a_steady_topic_is_its_rate_until_it_is_silent() {
    // In the first second as far as it goes.
    for end in [0.1, 0.2, 0.5, 0.9, 1.0, 1.7, 2.0, 3.3, 60.0] {
        assert_eq!(fifty_hertz(end, end), 50.0, "at {end} s");
    }
    assert_eq!(fifty_hertz(0.0, 0.0), 0.0);
    assert_eq!(fifty_hertz(5.0, 5.5), 25.0);
    for silent in [6.0, 6.6, 7.0, 60.0, 1e9] {
        assert_eq!(fifty_hertz(5.0, silent), 0.0, "at {silent} s");
    }
}

#[test]
fn what_a_shallower_queue_loses_is_lost_at_that_moment_however_old_it_is() {
    let (mut graph, topic) = (Graph::new(), Topic::new("/count", depth(10)));
    talker(&mut graph, "source", 10.0, 0, &topic, |now| {
        (now < secs(0.5)).then_some(())
    });
    let idle = graph.node("idle", 10.0, 1, |wiring| {
        let unread = wiring.subscription(&topic);
        move |_: Time| {
            let _ = &unread;
            GO_ON
        }
    });
    idle.expect("a node");
    let observer = Observer::of(&graph);
    run_virtual(&mut graph, vec![at(3.0, set_depth("/count", 1))], secs(3.5));
    let snapshot = observer.snapshot();
    let topic = &snapshot.topics[0];
    let lately = topic.dropped_lately(snapshot.now);
    assert_eq!((topic.dropped(), lately), (4, 4));
}
