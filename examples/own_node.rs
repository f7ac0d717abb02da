//! A node of your own: it smooths the readings of a noisy sonar.
//!
//! A node is any type with a `tick`. It receives the ends of its topics while the graph
//! is being built, and depends on nothing else.

use std::error::Error;

use ratelab::{Flow, Graph, Node, Publisher, Subscription, Tick, TickResult};
use ratelab_metrics::Observer;

/// A low-pass filter: each tick moves a quarter of the way to the newest reading.
struct Smooth {
    input: Subscription<f64>,
    output: Publisher<f64>,
    value: f64,
}

impl Node for Smooth {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        if let Some(reading) = tick.read(&mut self.input) {
            self.value += (reading.data - self.value) / 4.0;
            tick.publish(&self.output, self.value);
        }
        Ok(Flow::Continue)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut graph = Graph::new();
    let (raw, smooth) = (graph.topic("/raw"), graph.topic("/smooth"));
    graph.node("sonar", 50.0, 0, |wiring| {
        let raw = wiring.publisher(&raw);
        let mut readings = [2.2, 1.9, 2.1, 1.8].into_iter().cycle();
        move |tick: &mut Tick| {
            tick.publish(&raw, readings.next().unwrap_or(2.0));
        }
    })?;
    graph.node("smooth", 20.0, 1, |wiring| Smooth {
        input: wiring.subscription(&raw),
        output: wiring.publisher(&smooth),
        value: 2.0,
    })?;
    let observer = Observer::new(&graph);
    graph.run_virtual(1.0)?;

    for topic in observer.snapshot().topics {
        let (name, published) = (&topic.name, topic.published);
        println!("{name}: {published} messages, {} dropped", topic.dropped());
    }
    let (last, head) = smooth.peek().ok_or("nothing came")?;
    println!("{last} m at {}", head.stamp);
    Ok(())
}
