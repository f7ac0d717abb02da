//! A topic type of your own: the state of a drive with two wheels.
//!
//! A topic carries any type that can be cloned and sent to another thread. For a log,
//! implement [`Fields`] as well: then the log is independent of the type.

use std::error::Error;

use ratelab::{Graph, Tick};
use ratelab_metrics::{Fields, TapHandle};

/// The speed of the wheels.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wheels {
    /// Left wheel (rad/s).
    left: f64,
    /// Right wheel (rad/s).
    right: f64,
}

impl Fields for Wheels {
    const FIELDS: &'static [&'static str] = &["left (rad/s)", "right (rad/s)"];

    fn append_to(&self, row: &mut Vec<f64>) {
        row.extend([self.left, self.right]);
    }

    fn from_row(row: &[f64]) -> Option<Self> {
        let &[left, right] = row else { return None };
        Some(Self { left, right })
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut graph = Graph::new();
    let wheels = graph.topic("/wheels");
    graph.node("drive", 4.0, 0, |wiring| {
        let wheels = wiring.publisher(&wheels);
        move |tick: &mut Tick| {
            let (left, right) = (1.0 + tick.now().as_secs_f64(), 1.0);
            tick.publish(&wheels, Wheels { left, right });
        }
    })?;
    // A tap copies every message, whether or not a node reads it.
    let log = TapHandle::new(&graph).topic(&wheels, 16);
    graph.run_virtual(1.0)?;

    println!("time, {}", Wheels::FIELDS.join(", "));
    for tapped in log.items().try_iter() {
        let mut row = Vec::new();
        tapped.message.data.append_to(&mut row);
        assert_eq!(Wheels::from_row(&row), Some(tapped.message.data));
        println!("{}, {row:?}", tapped.message.stamp);
    }
    Ok(())
}
