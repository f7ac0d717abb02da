//! One hop between two processes over zenoh, beside a bare UDP datagram between them and
//! beside a topic within one process: `cargo bench -p ratelab-wire`.
//!
//! A node publishes at a rate, a thread waits for its messages: a hop lasts from the
//! publishing tick until that thread is awake. All ways carry the same bytes at the same
//! rates, seconds apart and in turn, so that other load on the machine slows all of them.
//! The sender is a process of its own, so each end knows its CPU time.

use std::{
    env,
    io::Read,
    net::{TcpListener, UdpSocket},
    process::{Child, Command, Stdio},
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use ratelab::{
    experiment::{Config, Experiment},
    runtime::{Clock, Fields, GO_ON, Graph, Hz, Inbox, RealClock, Time},
    system::{BuildError, Builder, System},
};
use ratelab_wire::{Bridge, End, Settings, clock};
use rustix::time::{ClockId, clock_gettime};

/// Time for which each way is measured in a round.
const LASTS: Duration = Duration::from_secs(2);

const ROUNDS: usize = 5;

/// Bytes of a message of five numbers between processes.
const BYTES: usize = 96;

/// Has the sender's part of a bench: way, address and rate.
const SENDER: &str = "RATELAB_HOP";

/// The topic.
const HOP: &str = "/hop";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Topic,
    Udp,
    Zenoh,
}

const WAYS: [Way; 3] = [Way::Topic, Way::Udp, Way::Zenoh];

/// What was measured of a way.
#[derive(Default)]
struct Measured {
    /// Durations of hops (ns).
    hops: Vec<i64>,
    /// CPU time by wall time, of the sending and of the receiving process.
    sender: Vec<f64>,
    receiver: Vec<f64>,
}

fn main() {
    if let Ok(part) = env::var(SENDER) {
        let part: Vec<&str> = part.split(' ').collect();
        let hz = part[2].parse().expect("a rate");
        let way = WAYS.into_iter().find(|way| format!("{way:?}") == part[0]);
        println!("{}", send(way.expect("a way"), part[1], hz));
        return;
    }
    println!("rate     way      hop p50    hop p99    p50 beside UDP   CPU of sender, receiver");
    for hz in [50, 1_000] {
        let mut all: [Measured; 3] = Default::default();
        for _ in 0..ROUNDS {
            for (way, measured) in WAYS.into_iter().zip(&mut all) {
                measure(way, hz, measured);
            }
        }
        let udp = quantile(&mut all[1].hops, 0.5);
        for (way, measured) in WAYS.into_iter().zip(&mut all) {
            row(way, hz, measured, udp);
        }
    }
}

fn row(way: Way, hz: u32, measured: &mut Measured, udp: f64) {
    let [p50, p99] = [0.5, 0.99].map(|share| quantile(&mut measured.hops, share));
    let cpu = match way {
        Way::Topic => format!("{:.1} % both", mean(&measured.receiver)),
        _ => format!(
            "{:.1} %, {:.1} %",
            mean(&measured.sender),
            mean(&measured.receiver)
        ),
    };
    println!(
        "{hz:>4} Hz  {:<6} {:>6.0} µs  {:>6.0} µs   {:>14.2}   {cpu}",
        format!("{way:?}").to_lowercase(),
        p50 / 1e3,
        p99 / 1e3,
        p50 / udp,
    );
}

/// The smallest value that a share of all does not exceed.
fn quantile(values: &mut [i64], share: f64) -> f64 {
    values.sort_unstable();
    let rank = (values.len() as f64 * share).ceil() as usize;
    values[rank.saturating_sub(1)] as f64
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64 * 100.0
}

/// Sends by `way` for the time of a round; returns the CPU time used by wall time.
fn send(way: Way, address: &str, hz: u32) -> f64 {
    if way == Way::Udp {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
        socket.connect(address).expect("an address");
        let mut bytes = [0; BYTES];
        let mut graph = Graph::new();
        let rate = Hz::new(f64::from(hz)).expect("a rate");
        let node = move |_: &mut _| {
            move |_| {
                bytes[..8].copy_from_slice(&clock::now().to_le_bytes());
                let _ = socket.send(&bytes);
                GO_ON
            }
        };
        graph.node("source", rate, 0, node).expect("one node");
        return with_cpu(|| {
            let run = RealClock::default().run(&mut graph, &mut Inbox::default(), end());
            run.expect("no panic");
        });
    }
    let here = [SOURCE.to_owned()];
    let part = Experiment::part(Arc::new(Hop(hz)), &config(), &here).expect("a part");
    let bridge = bridge(End::Connect(vec![address.to_owned()]), &part, &here);
    with_cpu(|| drop(part.run().expect("a run")))
}

/// Measures `way` for a round.
fn measure(way: Way, hz: u32, measured: &mut Measured) {
    match way {
        Way::Topic => {
            let whole = Experiment::new(Arc::new(Hop(hz)), &config()).expect("a graph");
            receive(whole, None, measured);
        }
        Way::Udp => {
            let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
            let address = socket.local_addr().expect("bound").to_string();
            let wait = Some(Duration::from_millis(200));
            socket.set_read_timeout(wait).expect("a time");
            let mut sender = sender(way, &address, hz);
            let mut bytes = [0; BYTES];
            let used = with_cpu(|| {
                while sender.try_wait().expect("a child").is_none() {
                    while socket.recv(&mut bytes).is_ok() {
                        let sent = i64::from_le_bytes(bytes[..8].try_into().expect("8 bytes"));
                        measured.hops.push(clock::now() - sent);
                    }
                }
            });
            measured.receiver.push(used);
            measured.sender.push(printed(&mut sender));
        }
        Way::Zenoh => {
            let free = TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr());
            let address = format!("tcp/{}", free.expect("a free port"));
            let here = [READER.to_owned()];
            let part = Experiment::part(Arc::new(Hop(hz)), &config(), &here).expect("a part");
            let mut sender = sender(way, &address, hz);
            let bridge = bridge(End::Listen(vec![address]), &part, &here);
            receive(part, Some(bridge), measured);
            measured.sender.push(printed(&mut sender));
        }
    }
}

/// Runs `experiment` and times the hops of its topic.
fn receive(experiment: Experiment, bridge: Option<Bridge>, measured: &mut Measured) {
    let tap = experiment.taps().rows(HOP, 4096).expect("a topic");
    let run = thread::spawn(move || {
        let used = with_cpu(|| drop(experiment.run().expect("a run")));
        // The tap ends with what publishes into the topic.
        drop(bridge);
        used
    });
    let mut rows = tap.rows();
    while tap.wait(&mut rows) {
        let now = clock::now();
        let sent = rows.iter().map(|(_, row)| row[0] as i64);
        measured.hops.extend(sent.map(|sent| now - sent));
        rows.clear();
    }
    measured.receiver.push(run.join().expect("a run"));
}

fn sender(way: Way, address: &str, hz: u32) -> Child {
    let mut command = Command::new(env::current_exe().expect("this program"));
    command.env(SENDER, format!("{way:?} {address} {hz}"));
    command.stdout(Stdio::piped()).spawn().expect("a sender")
}

fn printed(sender: &mut Child) -> f64 {
    let mut text = String::new();
    let mut output = sender.stdout.take().expect("piped");
    output.read_to_string(&mut text).expect("text");
    sender.wait().expect("ended");
    text.trim().parse().expect("a number")
}

/// The connection, once the other end is there.
fn bridge(end: End, part: &Experiment, here: &[String]) -> Bridge {
    let settings = Settings {
        end,
        insecure: false,
        file: None,
    };
    let bridge = Bridge::start(&settings, part, here, None).expect("a connection");
    while bridge.others().is_empty() {
        thread::sleep(Duration::from_millis(1));
    }
    bridge
}

/// The CPU time of this process that `work` takes, by its wall time.
fn with_cpu(work: impl FnOnce()) -> f64 {
    let cpu = || {
        let used = clock_gettime(ClockId::ProcessCPUTime);
        used.tv_sec as f64 + used.tv_nsec as f64 / 1e9
    };
    let (began, before) = (Instant::now(), cpu());
    work();
    (cpu() - before) / began.elapsed().as_secs_f64()
}

fn end() -> Time {
    Time::ZERO + LASTS
}

fn config() -> Config {
    Config {
        clock: ratelab::runtime::ClockKind::Real,
        end: end(),
        ..Config::default()
    }
}

const SOURCE: &str = "source";
const READER: &str = "reader";

/// A message a tick at this rate (Hz), and a node that hardly reads it.
struct Hop(u32);

/// When it was sent (ns of the machine's clock), and what else an observation has.
#[derive(Clone, Copy)]
struct Sent([f64; 5]);

impl Fields for Sent {
    const FIELDS: &'static [&'static str] = &["sent", "b", "c", "d", "e"];

    fn append_to(&self, row: &mut Vec<f64>) {
        row.extend(self.0);
    }

    fn from_row(row: &[f64]) -> Option<Self> {
        row.try_into().ok().map(Self)
    }
}

impl System for Hop {
    fn name(&self) -> &'static str {
        "hop"
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let topic = builder.topic::<Sent>(HOP);
        let published = topic.clone();
        builder.node(SOURCE, f64::from(self.0), 0, move |wiring| {
            let topic = wiring.publisher(&published);
            move |now: Time| {
                // Exact as a double for the first hundred days of a machine.
                let sent = Sent([clock::now() as f64, 0.0, 0.0, 0.0, 0.0]);
                topic.publish(sent, now, None);
                GO_ON
            }
        })?;
        builder.node(READER, 1.0, 1, move |wiring| {
            let mut topic = wiring.subscription(&topic);
            move |now| {
                topic.latest(now);
                GO_ON
            }
        })
    }
}
