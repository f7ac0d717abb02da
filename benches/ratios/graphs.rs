//! The cost of a node's tick in graphs of three and of a thousand nodes.

use std::time::Duration;

use ratelab::{
    Clock, Depth, Graph, Hz, Inbox, Node, Publisher, Subscription, Tick, Topic, VirtualClock,
    Wiring,
};

use super::{
    paired::{Nanos, paired, time},
    table::Table,
};

const ROUNDS: usize = 60;

const FEW: usize = 3;
const MANY: usize = 1_000;

/// Ticks per round, in either graph.
const TICKS: usize = 100_000;

/// The rate of a node, by its number.
type RateOfNode = fn(usize) -> f64;

/// Fills in the rows about large graphs.
pub fn measure(table: &mut Table) {
    table.heading(format!("A tick among {MANY} nodes, beside one among {FEW}"));
    let rates: [(&str, RateOfNode); 3] = [
        ("all at one rate", |_| 100.0),
        ("at three rates", |node| [100.0, 50.0, 30.0][node % 3]),
        ("no two at one rate", |node| 50.0 + node as f64 / 10.0),
    ];
    for (what, hz) in rates {
        let (mut many, mut few) = (Ring::new(MANY, hz), Ring::new(FEW, hz));
        let ticks = paired(ROUNDS, || many.round(), || few.round());
        table.row(what, &ticks, Some(2.0));
    }
}

/// A ring of nodes, each of which reads its neighbour's number and publishes the next
/// one.
struct Ring {
    graph: Graph,
    inbox: Inbox,
    topics: Vec<Topic<u64>>,
    round: Duration,
}

impl Ring {
    fn new(nodes: usize, hz: RateOfNode) -> Self {
        let topics: Vec<Topic<u64>> = (0..nodes)
            .map(|node| Topic::new(format!("/{node}"), Depth::ONE))
            .collect();
        let mut graph = Graph::new();
        for node in 0..nodes {
            let rate = Hz::new(hz(node)).expect("rate");
            let neighbour = &topics[(node + nodes - 1) % nodes];
            let build = |wiring: &mut Wiring<'_>| {
                counter(
                    wiring.subscription(neighbour),
                    wiring.publisher(&topics[node]),
                )
            };
            graph
                .node(&node.to_string(), rate, 0, build)
                .expect("names differ");
        }
        let per_second: f64 = (0..nodes).map(hz).sum();
        let inbox = Inbox::default();
        Self {
            graph,
            inbox,
            topics,
            round: Duration::from_secs_f64(TICKS as f64 / per_second),
        }
    }

    /// Time per tick over the next stretch of virtual time.
    fn round(&mut self) -> Nanos {
        let before = self.ticks();
        let until = self.graph.now() + self.round;
        let time = time(|| {
            let exit = VirtualClock.run(&mut self.graph, &mut self.inbox, until);
            exit.expect("no node fails");
        });
        time / (self.ticks() - before) as f64
    }

    fn ticks(&self) -> u64 {
        // Each tick publishes one message, and counting these disturbs no cache.
        self.topics.iter().map(Topic::published).sum()
    }
}

fn counter(mut input: Subscription<u64>, output: Publisher<u64>) -> impl Node {
    move |tick: &mut Tick| {
        let number = tick.read(&mut input).map_or(0, |message| message.data);
        tick.publish(&output, number + 1);
    }
}
