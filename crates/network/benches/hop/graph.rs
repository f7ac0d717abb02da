//! A graph of one topic, for hops: a node that publishes when it ticks.

use ratelab::Tick;
use ratelab_metrics::fields;
use ratelab_network::machine;
use ratelab_system::{BuildError, Builder, System};

pub const TOPIC: &str = "/hop";
pub const SOURCE: &str = "source";
pub const READER: &str = "reader";

/// A message.
#[derive(Clone, Copy)]
pub struct Sent {
    /// When it was sent (ns of the machine's clock): exact for the first hundred days.
    at: f64,
}

fields!(Sent { at: "sent (ns)" });

/// A message a tick at this rate (Hz), and a node that hardly reads it.
pub struct Hop(pub u32);

impl System for Hop {
    fn name(&self) -> &str {
        "hop"
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let topic = builder.topic::<Sent>(TOPIC);
        let published = topic.clone();
        builder.node(SOURCE, f64::from(self.0), 0, move |wiring| {
            let topic = wiring.publisher(&published);
            move |tick: &mut Tick| {
                let at = machine::now() as f64;
                tick.publish(&topic, Sent { at });
            }
        })?;
        builder.node(READER, 1.0, 1, move |wiring| {
            let mut topic = wiring.subscription(&topic);
            move |tick: &mut Tick| {
                tick.read(&mut topic);
            }
        })
    }
}
