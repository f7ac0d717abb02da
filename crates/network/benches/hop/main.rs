//! One hop over zenoh between two processes, beside a bare UDP datagram between them and
//! beside a topic within one process: `cargo bench --package ratelab-network`.
//!
//! A node publishes at a rate, and a thread waits for its messages: a hop lasts from the
//! publication until that thread has the message. All ways carry as many bytes at the same
//! rate, seconds apart and in turn, so that other load on the machine slows all of them. The
//! sender between processes is a process of its own, so each has a CPU time.

mod graph;
mod ways;

use std::env;

use ways::{Hops, SENDER, Way};

/// Rounds in which each way is measured once.
const ROUNDS: usize = 5;

/// Rates (Hz).
const RATES: [u32; 2] = [50, 1_000];

fn main() {
    if let Ok(task) = env::var(SENDER) {
        return ways::send(&task);
    }
    println!("{TITLES}");
    for hz in RATES {
        let mut hops: [Hops; Way::ALL.len()] = Default::default();
        for _ in 0..ROUNDS {
            for (way, hops) in Way::ALL.into_iter().zip(&mut hops) {
                ways::measure(way, hz, hops);
            }
        }
        print(hz, &mut hops);
    }
}

const TITLES: &str =
    "   rate  way      hop p50    hop p99  p50, p99 beside UDP  CPU of sender, receiver";

fn print(hz: u32, hops: &mut [Hops; Way::ALL.len()]) {
    let quantiles = hops
        .each_mut()
        .map(|hops| [0.5, 0.99].map(|share| quantile(&mut hops.lasted, share)));
    let [_, udp, _] = quantiles;
    for ((way, hops), [p50, p99]) in Way::ALL.into_iter().zip(hops).zip(quantiles) {
        let [sender, receiver] = [&hops.sender, &hops.receiver].map(|shares| mean(shares) * 100.0);
        let cpu = match way {
            Way::Topic => format!("{receiver:.1} % in one process"),
            Way::Udp | Way::Zenoh => format!("{sender:.1} %, {receiver:.1} %"),
        };
        println!(
            "{hz:>4} Hz  {:<6} {:>6.0} µs  {:>6.0} µs  {:>12.2}, {:>5.2}  {cpu}",
            way.name(),
            p50 / 1e3,
            p99 / 1e3,
            p50 / udp[0],
            p99 / udp[1],
        );
    }
}

/// Returns the least value that a `share` of all does not exceed.
fn quantile(values: &mut [i64], share: f64) -> f64 {
    values.sort_unstable();
    let rank = (values.len() as f64 * share).ceil() as usize;
    values[rank.saturating_sub(1)] as f64
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
