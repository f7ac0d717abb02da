//! Accuracy of figures: counts, means and maxima are exact, quantiles are accurate to 0.1
//! %, and reading changes nothing.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    thread,
};

use proptest::prelude::*;

use crate::support::*;

fn recorded(samples: &[u64]) -> Distribution {
    let mut distribution = Distribution::default();
    for nanos in samples {
        distribution.add(Duration::from_nanos(*nanos));
    }
    distribution
}

/// So many samples (ns) or more, sorted.
fn samples(least: usize) -> impl Strategy<Value = Vec<u64>> {
    let sample = prop_oneof![0..1u64 << 20, 0..1u64 << 40];
    proptest::collection::vec(sample, least..200).prop_map(|mut samples| {
        samples.sort_unstable();
        samples
    })
}

/// Whether a figure is that of the sample `exact` (ns), to 0.1 %.
fn is_near(figure: Duration, exact: u64) -> bool {
    (figure.as_nanos() as f64 - exact as f64).abs() <= exact as f64 / 1e3
}

proptest! {
    #[test]
    fn count_sum_mean_and_maximum_are_exact(samples in samples(0)) {
        let distribution = recorded(&samples);
        let (sum, count) = (samples.iter().sum::<u64>(), samples.len());
        prop_assert_eq!(distribution.count(), count as u64);
        prop_assert_eq!(distribution.sum(), Duration::from_nanos(sum));
        let mean = (count > 0).then(|| sum as f64 / count as f64 / 1e9);
        prop_assert_eq!(distribution.mean_s(), mean);
        let max = samples.last().copied().map(Duration::from_nanos);
        prop_assert_eq!(distribution.max(), max);
        prop_assert_eq!(distribution.quantile(1.0), max);
    }

    #[test]
    fn quantiles_are_true_to_a_tenth_of_a_percent_and_rise(
        samples in samples(1), quantile in 0.01..=1.0f64,
    ) {
        let distribution = recorded(&samples);
        let quantile_at = |share| distribution.quantile(share).expect("samples");
        let rank = (quantile * samples.len() as f64).ceil() as usize;
        let (measured, exact) = (quantile_at(quantile), samples[rank - 1]);
        prop_assert!(is_near(measured, exact), "{measured:?} for {exact} ns");
        let all = (0..=100).map(|percent| quantile_at(f64::from(percent) / 100.0));
        let all: Vec<_> = all.collect();
        prop_assert!(all.is_sorted() && all[0] >= Duration::from_nanos(samples[0]), "{all:?}");
    }

    #[test]
    fn bars_count_every_sample_once_within_a_tenth_of_a_percent(samples in samples(1)) {
        let bars: Vec<(Duration, u64)> = recorded(&samples).bars().collect();
        prop_assert!(bars.is_sorted_by(|a, b| a.0 < b.0), "{bars:?}");
        let counted = bars.iter().flat_map(|(at, count)| vec![*at; *count as usize]);
        let counted: Vec<_> = counted.collect();
        prop_assert_eq!(counted.len(), samples.len());
        prop_assert!(counted.iter().zip(samples).all(|(bar, exact)| is_near(*bar, exact)));
    }
}

#[test]
fn quantiles_of_durations_on_a_grid_are_these_durations() {
    for exact in [140.0, 19.99, 40.0, 100.0, 180.0, 0.02, 3_600_000.0] {
        let exact = Duration::from_secs_f64(exact / 1e3);
        // And the longest, so that none of them is the maximum.
        let samples = [vec![exact.as_nanos() as u64; 7], vec![u64::MAX]].concat();
        let distribution = recorded(&samples);
        for quantile in [0.0, 0.01, 0.5, 0.8] {
            assert_eq!(distribution.quantile(quantile), Some(exact));
        }
        let longest = Some(Duration::from_nanos(u64::MAX));
        assert_eq!((distribution.count(), distribution.max()), (8, longest));
    }
}

#[test]
fn the_snapshot_of_a_finished_run_is_its_summary() {
    let experiment = experiment(&config("control-hz 15"));
    let observer = experiment.observer();
    let summary = experiment.run().expect("run");
    let snapshot = observer.snapshot();
    assert_eq!(snapshot.now, summary.sim_time);
    let [topics, known] = [&snapshot.topics, &summary.topics].map(|topics| format!("{topics:?}"));
    assert_eq!(topics, known);
    let [nodes, known] = [&snapshot.nodes, &summary.nodes].map(|nodes| {
        let figures = |node: &NodeAccount| (node.name.clone(), node.hz, node.ticks, node.overruns);
        nodes.iter().map(figures).collect::<Vec<_>>()
    });
    assert_eq!(nodes, known);
    let (_, latency) = &snapshot.nodes[2].meters[0];
    assert_eq!(latency.count(), summary.latency.count());
    assert_eq!(latency.sum(), summary.latency.sum());
    assert_eq!(observer.events(0), summary.events);
}

#[test]
fn a_replay_ends_at_the_end_of_the_run_even_after_a_later_tick() {
    let mut graph = Graph::new();
    worker(&mut graph, "late", 50.0, 0, |_: &mut Tick| {});
    let observer = Observer::new(&graph);
    let mut replay = ReplayAccounts::new(&observer.topology(), observer.status());
    let late = TickRecord {
        number: 50,
        at: secs(1.000_25),
        ends: None,
        lateness: None,
        took: None,
        overruns: 0,
        push: None,
        causes: TickCauses::default(),
    };
    replay.tick(0, &late);
    replay.set_now(secs(1.0));
    assert_eq!(replay.observer().now(), secs(1.0));
}

#[test]
fn neither_taps_nor_an_observer_change_a_run() {
    let config = config("control-hz 15");
    let experiment = experiment(&config);
    let (observer, done) = (experiment.observer(), AtomicBool::new(false));
    let watched = thread::scope(|scope| {
        scope.spawn(|| {
            while !done.load(Ordering::Relaxed) {
                observer.snapshot();
            }
        });
        let watched = collect(experiment);
        done.store(true, Ordering::Relaxed);
        watched
    });
    let (bare, tapped) = (run(&config), run_bytes(&config));
    assert!(watched.bytes() == tapped.bytes());
    let seen = |run: &Summary| format!("{:?} {:?} {:?}", run.state, run.topics, run.latency);
    assert_eq!(seen(&bare), seen(&tapped.summary));
}

/// The rate at run time `now` (s) of a topic with a message every 20 ms from zero until `end`.
fn fifty_hertz(end: f64, now: f64) -> f64 {
    let (mut graph, topic) = (Graph::new(), Topic::new("/steady", Depth::ONE));
    talker(&mut graph, "steady", 50.0, 0, &topic, |_| None);
    let (observer, publisher) = (Observer::new(&graph), topic.publisher());
    for message in 0..(end * 50.0) as u64 {
        Tick::at(Time::from_nanos(message * 20_000_000)).publish(&publisher, ());
    }
    graph.run_writer().set_now(secs(now));
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
        (now < secs(0.6)).then_some(())
    });
    // It reads the first message, and no other.
    reader(&mut graph, "idle", 0.001, 1, &topic);
    run_virtual(&mut graph, "3 depth /count 1", secs(3.5));
    let snapshot = snapshot(&graph);
    let topic = &snapshot.topics[0];
    let lately = topic.dropped_lately(snapshot.now);
    assert_eq!((topic.dropped(), lately), (4, 4));
}
