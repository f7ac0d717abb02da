//! Two parts of a graph, connected over loopback.

use std::{net::TcpListener, sync::Arc, thread};

use ratelab::{
    cartpole::CartPole,
    experiment::{Config, Experiment, Summary},
    runtime::{Fields, GO_ON, RealClock, Snapshot, Time},
    system::{BuildError, Builder, System},
};
use ratelab_wire::{Bridge, End, Settings};

/// A port that is free.
fn address() -> String {
    let free = TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr());
    format!("tcp/{}", free.expect("a free port"))
}

fn settings(end: End) -> Settings {
    Settings {
        end,
        insecure: false,
        file: None,
    }
}

/// The results of both parts of a run: that which listens, and the other.
struct Both {
    summaries: [Summary; 2],
    snapshots: [Snapshot; 2],
    lost: [u64; 2],
    hostile: [u64; 2],
}

/// Runs `system` for `seconds` in two parts.
fn run(system: Arc<dyn System>, config: &Config, parts: [&[&str]; 2], seconds: f64) -> Both {
    let address = address();
    let ends = [
        End::Listen(vec![address.clone()]),
        End::Connect(vec![address]),
    ];
    let config = Config {
        end: Time::from_secs_f64(seconds).expect("seconds"),
        ..config.clone()
    };
    let connected = ends.into_iter().zip(parts).map(|(end, nodes)| {
        let here: Vec<String> = nodes.iter().map(|&node| node.to_owned()).collect();
        let part = Experiment::part(system.clone(), &config, &here).expect("a part");
        let bridge = Bridge::start(&settings(end), &part, &here, None).expect("connected");
        (part, bridge)
    });
    let connected: Vec<(Experiment, Bridge)> = connected.collect();
    // Until each part knows the other, nothing could arrive.
    while connected
        .iter()
        .any(|(_, bridge)| bridge.others().is_empty())
    {
        thread::yield_now();
    }
    let (parts, bridges): (Vec<_>, Vec<_>) = connected.into_iter().unzip();
    let observers: Vec<_> = parts.iter().map(Experiment::observer).collect();
    let summaries: Vec<Summary> = thread::scope(|scope| {
        let runs = parts.into_iter().map(|part| {
            scope.spawn(move || part.run_with(&mut RealClock::default()).expect("a run"))
        });
        let runs: Vec<_> = runs.collect();
        runs.into_iter()
            .map(|run| run.join().expect("a thread"))
            .collect()
    });
    let of_both = |count: &dyn Fn(&Bridge) -> u64| [count(&bridges[0]), count(&bridges[1])];
    Both {
        lost: of_both(&|bridge| bridge.inlets().iter().map(|i| i.sender().lost).sum()),
        hostile: of_both(&|bridge| bridge.inlets().iter().map(|i| i.refused.hostile()).sum()),
        snapshots: [observers[0].snapshot(), observers[1].snapshot()],
        summaries: summaries.try_into().unwrap_or_else(|_| panic!("two runs")),
    }
}

#[test]
fn a_policy_in_another_process_balances_and_nothing_is_lost() {
    let system = Arc::new(CartPole::default());
    let parts: [&[&str]; 2] = [&["sensor", "actuator"], &["policy"]];
    let both = run(system, &Config::default(), parts, 2.0);
    let [plant, policy] = &both.summaries;
    assert_eq!(plant.verdict.name(), "balanced");
    assert_eq!((both.lost, both.hostile), ([0; 2], [0; 2]));
    assert!(plant.topic("/action").published > 50);
    assert!(policy.topic("/obs").published > 50);
    // The age of the sensing goes around through both.
    assert!(plant.latency.count() > 50, "{:?}", plant.latency);
}

/// A number a thousand times a second, and a reader that takes five times as long.
struct Flood;

#[derive(Clone, Copy)]
struct Number(f64);

impl Fields for Number {
    const FIELDS: &'static [&'static str] = &["number"];

    fn append_to(&self, row: &mut Vec<f64>) {
        row.push(self.0);
    }

    fn from_row(row: &[f64]) -> Option<Self> {
        match *row {
            [number] => Some(Self(number)),
            _ => None,
        }
    }
}

impl System for Flood {
    fn name(&self) -> &'static str {
        "flood"
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let numbers = builder.topic::<Number>("/numbers");
        let published = numbers.clone();
        builder.node("source", 1000.0, 0, move |wiring| {
            let numbers = wiring.publisher(&published);
            move |now: Time| {
                numbers.publish(Number(now.as_secs_f64()), now, None);
                GO_ON
            }
        })?;
        builder.node("slow", 200.0, 1, move |wiring| {
            let mut numbers = wiring.subscription(&numbers);
            move |now| {
                numbers.latest(now);
                GO_ON
            }
        })
    }
}

#[test]
fn a_reader_that_is_too_slow_reads_fresh_messages_and_counts_the_others() {
    let parts: [&[&str]; 2] = [&["source"], &["slow"]];
    let both = run(Arc::new(Flood), &Config::default(), parts, 2.0);
    let numbers = both.snapshots[1].topic("/numbers").expect("read there");
    let (published, dropped) = (numbers.published, numbers.dropped());
    assert!(dropped > published / 2, "{dropped} of {published}");
    // In a queue it would be seconds. Two periods of the reader are 10 ms.
    let p50 = numbers.subscriptions[0].ages.quantile(0.5);
    let p50 = p50.expect("messages were read");
    assert!(p50.as_millis() < 10, "{p50:?}");
}
