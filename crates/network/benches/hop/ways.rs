//! The ways of a message, each with a sender and a receiver.

use std::{
    env,
    io::Read,
    net::{TcpListener, UdpSocket},
    process::{Child, Command, Stdio},
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use ratelab::{Clock, ClockKind, Graph, Hz, Inbox, Tick, Time, Wiring};
use ratelab_experiment::{Config, Experiment};
use ratelab_network::{Bridge, SessionEnd, Settings, machine};
use ratelab_real_clock::RealClock;
use rustix::time::{ClockId, clock_gettime};

use super::graph::{Hop, READER, SOURCE, TOPIC};

/// Time for which a way is measured in a round.
const LASTS: Duration = Duration::from_secs(2);

/// Bytes of a message of one number between processes.
const BYTES: usize = 64;

/// Silence after which a receiver of datagrams looks whether the sender has ended.
const SILENCE: Duration = Duration::from_millis(200);

/// Does the task of a sender: way, address and rate.
pub const SENDER: &str = "RATELAB_HOP";

#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Way {
    Topic,
    Udp,
    Zenoh,
}

impl Way {
    pub const ALL: [Self; 3] = [Self::Topic, Self::Udp, Self::Zenoh];

    pub fn name(self) -> &'static str {
        match self {
            Self::Topic => "topic",
            Self::Udp => "udp",
            Self::Zenoh => "zenoh",
        }
    }
}

/// The hops of a way.
#[derive(Default)]
pub struct Hops {
    /// Durations (ns).
    pub lasted: Vec<i64>,
    /// CPU time by wall time, of the sending and of the receiving process, by round.
    pub sender: Vec<f64>,
    pub receiver: Vec<f64>,
}

/// Measures `way` for a round.
pub fn measure(way: Way, hz: u32, hops: &mut Hops) {
    match way {
        Way::Topic => {
            let whole = Experiment::new(Arc::new(Hop(hz)), &config()).expect("a graph");
            receive(whole, None, hops);
        }
        Way::Udp => receive_datagrams(hz, hops),
        Way::Zenoh => {
            let free = TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr());
            let address = format!("tcp/{}", free.expect("a free port"));
            let sender = start(way, &address, hz);
            let (part, bridge) = part(hz, READER, SessionEnd::Listen(vec![address]));
            receive(part, Some(bridge), hops);
            hops.sender.push(cpu_of(sender));
        }
    }
}

/// Sends as `task` demands for the time of a round; prints the CPU time by wall time.
pub fn send(task: &str) {
    let task: Vec<&str> = task.split(' ').collect();
    let &[way, address, hz] = &*task else {
        panic!("{SENDER}: a way, an address and a rate");
    };
    let hz = hz.parse().expect("a rate");
    let cpu = if way == Way::Udp.name() {
        send_datagrams(address, hz)
    } else {
        let (part, _bridge) = part(hz, SOURCE, SessionEnd::Connect(vec![address.to_owned()]));
        with_cpu(|| drop(part.run().expect("a run")))
    };
    println!("{cpu}");
}

fn send_datagrams(address: &str, hz: u32) -> f64 {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    socket.connect(address).expect("an address");
    let mut bytes = [0; BYTES];
    let mut graph = Graph::new();
    let rate = Hz::new(f64::from(hz)).expect("a rate");
    let node = move |_: &mut Wiring<'_>| {
        move |_: &mut Tick| {
            bytes[..8].copy_from_slice(&machine::now().to_le_bytes());
            let _ = socket.send(&bytes);
        }
    };
    graph.node(SOURCE, rate, 0, node).expect("one node");
    with_cpu(|| {
        let run = RealClock::default().run(&mut graph, &mut Inbox::default(), config().end);
        run.expect("no panic");
    })
}

fn receive_datagrams(hz: u32, hops: &mut Hops) {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    let address = socket.local_addr().expect("bound").to_string();
    socket.set_read_timeout(Some(SILENCE)).expect("a time");
    let mut sender = start(Way::Udp, &address, hz);
    let mut bytes = [0; BYTES];
    let used = with_cpu(|| {
        while sender.try_wait().expect("a child").is_none() {
            while socket.recv(&mut bytes).is_ok() {
                let sent = bytes.first_chunk().copied().map(i64::from_le_bytes);
                hops.lasted.extend(sent.map(|sent| machine::now() - sent));
            }
        }
    });
    hops.receiver.push(used);
    hops.sender.push(cpu_of(sender));
}

/// Runs `experiment` and times the hops of its topic.
fn receive(experiment: Experiment, bridge: Option<Bridge>, hops: &mut Hops) {
    let tap = experiment.taps().rows(TOPIC, 4096).expect("a topic");
    let run = thread::spawn(move || {
        let used = with_cpu(|| drop(experiment.run().expect("a run")));
        // The tap ends with what publishes into the topic.
        drop(bridge);
        used
    });
    let mut rows = tap.rows();
    while tap.wait(&mut rows) {
        let now = machine::now();
        let sent = rows.iter().map(|(_, row)| row[0] as i64);
        hops.lasted.extend(sent.map(|sent| now - sent));
        rows.clear();
    }
    hops.receiver.push(run.join().expect("a run"));
}

/// Returns the part of the graph with one `node`, once the other is there.
fn part(hz: u32, node: &str, end: SessionEnd) -> (Experiment, Bridge) {
    let here = [node.to_owned()];
    let part = Experiment::part(Arc::new(Hop(hz)), &config(), &here).expect("a part");
    let settings = Settings::new(end, |_| ());
    let bridge = Bridge::start(&settings, &part, &here, None).expect("a connection");
    while bridge.others().is_empty() {
        thread::sleep(Duration::from_millis(1));
    }
    (part, bridge)
}

fn config() -> Config {
    Config {
        clock: ClockKind::Real,
        end: Time::ZERO + LASTS,
        ..Config::default()
    }
}

/// Starts a process that sends.
fn start(way: Way, address: &str, hz: u32) -> Child {
    let mut command = Command::new(env::current_exe().expect("this program"));
    command.env(SENDER, format!("{} {address} {hz}", way.name()));
    command.stdout(Stdio::piped()).spawn().expect("a sender")
}

/// Returns the CPU time that a sender prints at its end.
fn cpu_of(mut sender: Child) -> f64 {
    let mut text = String::new();
    let mut output = sender.stdout.take().expect("piped");
    output.read_to_string(&mut text).expect("text");
    sender.wait().expect("ended");
    text.trim().parse().expect("a number")
}

/// Returns the CPU time of this process during `work`, by wall time.
fn with_cpu(work: impl FnOnce()) -> f64 {
    let cpu = || {
        let used = clock_gettime(ClockId::ProcessCPUTime);
        used.tv_sec as f64 + used.tv_nsec as f64 / 1e9
    };
    let (began, before) = (Instant::now(), cpu());
    work();
    (cpu() - before) / began.elapsed().as_secs_f64()
}
