//! The lateness of a node under the real clock, compared with a loop that only sleeps to
//! absolute deadlines.

use std::{thread, time::Duration};

use nix::{
    sys::{prctl, time::TimeSpec},
    time::{ClockId, ClockNanosleepFlags, clock_gettime, clock_nanosleep},
};
use ratelab::{Clock, Graph, Hz, Inbox, Tick, Time};
use ratelab_metrics::Observer;
use ratelab_real_clock::RealClock;

use super::table::{Table, text};

/// Number of stretches per side, which alternate.
const STRETCHES: usize = 20;

/// Fills in the rows about waking on time.
pub fn measure(table: &mut Table) {
    table.heading("Lateness under the real clock, beside a bare absolute sleep");
    row(table, 50, Duration::from_millis(400));
    row(table, 1_000, Duration::from_millis(200));
}

fn row(table: &mut Table, hz: u32, stretch: Duration) {
    let (mut ours, mut bare) = (Vec::new(), Vec::new());
    for _ in 0..STRETCHES {
        ours.extend(node(hz, stretch));
        bare.extend(in_thread(|| sleep_loop(hz, stretch)));
    }
    for (name, quantile, goal) in [("p50", 0.5, Some(1.1)), ("p99", 0.99, None)] {
        let [ours, bare] = [&mut ours, &mut bare].map(|samples| nearest(samples, quantile));
        let cells = [ours, bare].map(|sample| text(sample as f64));
        let what = format!("{hz} Hz, {name}");
        table.cells(&what, cells, ours as f64 / bare as f64, goal);
    }
}

/// The smallest sample that a share `quantile` of all does not exceed.
fn nearest(samples: &mut [u64], quantile: f64) -> u64 {
    samples.sort_unstable();
    let rank = (samples.len() as f64 * quantile).ceil() as usize;
    samples[rank.saturating_sub(1)]
}

/// Lateness of every tick of a node in a graph, as measured by the graph.
fn node(hz: u32, stretch: Duration) -> Vec<u64> {
    let mut graph = Graph::new();
    let rate = Hz::new(f64::from(hz)).expect("rate");
    graph
        .node("node", rate, 0, |_| |_: &mut Tick| {})
        .expect("one node");
    let (observer, inbox) = (Observer::new(&graph), &mut Inbox::default());
    let run = RealClock::default().run(&mut graph, inbox, Time::ZERO + stretch);
    run.expect("no node fails");
    let snapshot = observer.snapshot();
    let lateness = snapshot.nodes[0].lateness.bars();
    lateness
        .flat_map(|(late, count)| std::iter::repeat_n(late.as_nanos() as u64, count as usize))
        .collect()
}

/// Lateness of every wake of a thread with the smallest timer slack.
fn sleep_loop(hz: u32, stretch: Duration) -> Vec<u64> {
    let period = TimeSpec::from(Duration::from_secs(1) / hz);
    let ticks = stretch.as_nanos() / Duration::from(period).as_nanos();
    let mut due = now() + period;
    let wakes = (0..ticks).map(|_| {
        clock_nanosleep(
            ClockId::CLOCK_MONOTONIC,
            ClockNanosleepFlags::TIMER_ABSTIME,
            &due,
        )
        .expect("slept");
        let late = now() - due;
        due = due + period;
        Duration::from(late).as_nanos() as u64
    });
    wakes.collect()
}

fn now() -> TimeSpec {
    clock_gettime(ClockId::CLOCK_MONOTONIC).expect("a clock")
}

/// Runs each stretch in a new thread, like the graph's nodes.
fn in_thread(work: impl FnOnce() -> Vec<u64> + Send) -> Vec<u64> {
    thread::scope(|scope| {
        let thread = scope.spawn(|| {
            prctl::set_timerslack(1).expect("timer slack");
            work()
        });
        thread.join().expect("no panic")
    })
}
