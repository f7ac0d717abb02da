//! Measurements: reading never costs a sample.

use std::time::Duration;

use ratelab::{Graph, Hz, Tick};
use ratelab_metrics::Observer;
use shuttle::thread;

use crate::{MANY, explore};

fn check_meter(samples: u64, reads: usize) {
    let (mut graph, mut meter) = (Graph::new(), None);
    let node = graph.node("node", Hz::MAX, 0, |wiring| {
        meter = Some(wiring.meter("wait"));
        |_: &mut Tick| {}
    });
    node.expect("a node");
    let (observer, mut meter) = (Observer::new(&graph), meter.expect("a meter"));
    let reading = observer.clone();
    let read = |observer: &Observer| {
        let snapshot = observer.snapshot();
        snapshot.meter("node", "wait").expect("a meter").clone()
    };
    let reader = thread::spawn(move || {
        let counts: Vec<u64> = (0..reads).map(|_| read(&reading).count()).collect();
        assert!(counts.is_sorted(), "{counts:?}");
    });
    (0..samples).for_each(|sample| meter.record(Duration::from_nanos(sample / 2)));
    reader.join().expect("reader");
    let figures = read(&observer);
    assert_eq!(figures.count(), samples);
    let sum = (0..samples).map(|sample| sample / 2).sum();
    assert_eq!(figures.sum(), Duration::from_nanos(sum));
}

#[test]
fn no_sample_is_lost_to_a_reader() {
    shuttle::check_dfs(|| check_meter(1, 1), Some(10_000));
    explore(MANY, || check_meter(4, 3));
}
