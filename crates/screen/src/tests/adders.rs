//! A system whose ticks overlap.

use std::{
    sync::{Arc, Mutex},
    thread,
    time::Duration,
};

use ratelab::{Shared, Tick};
use ratelab_system::{BuildError, Builder, System};

/// How long a node is between its two operations, so that those of the other come between.
const BETWEEN: Duration = Duration::from_micros(300);

/// Two nodes that add to a number, and publish it: two operations each, in which they cross.
#[derive(Default)]
pub struct Adders(Mutex<Vec<Arc<Shared<f64>>>>);

impl Adders {
    /// Adds to the numbers of all its graphs, from outside of them.
    pub fn add(&self, more: f64) {
        let numbers = self.0.lock().expect("open");
        numbers.iter().for_each(|number| *number.lock() += more);
    }
}

impl System for Adders {
    fn name(&self) -> &str {
        "adders"
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let number = Arc::new(Shared::new("the number", 0.0));
        self.0.lock().expect("open").push(number.clone());
        let sum = builder.internal_topic::<f64>("/sum");
        for name in ["one", "other"] {
            let (number, sum) = (number.clone(), sum.clone());
            builder.node(name, 1_000.0, 0, move |wiring| {
                let (number, sum) = (number.clone(), wiring.publisher(&sum));
                move |tick: &mut Tick| {
                    let added = {
                        let mut number = number.lock();
                        *number += 1.0;
                        *number
                    };
                    thread::sleep(BETWEEN);
                    tick.publish(&sum, added);
                }
            })?;
        }
        Ok(())
    }
}
