//! Meters: reading never costs a sample.

use std::time::Duration;

use ratelab_account::Meter;
use shuttle::thread;

use crate::{MANY, explore};

fn check_meter(samples: u64, reads: usize) {
    let meter = Meter::default();
    let reading = meter.clone();
    let reader = thread::spawn(move || {
        let counts: Vec<u64> = (0..reads).map(|_| reading.read().count()).collect();
        assert!(counts.is_sorted(), "{counts:?}");
    });
    (0..samples).for_each(|sample| meter.record(Duration::from_nanos(sample / 2)));
    reader.join().expect("reader");
    let figures = meter.read();
    assert_eq!(figures.count(), samples);
    let sum = (0..samples).map(|sample| sample / 2).sum();
    assert_eq!(figures.sum(), Duration::from_nanos(sum));
}

#[test]
fn no_sample_is_lost_to_a_reader() {
    shuttle::check_dfs(|| check_meter(1, 1), Some(10_000));
    explore(MANY, || check_meter(4, 3));
}
