//! Tick costs in virtual time: a camera, a detector that works for 60 to 110 ms, a
//! planner and a controller, under both clocks.
//!
//! The nodes contain no timing: knobs set the costs of the target machine.

use std::{error::Error, sync::Arc};

use ratelab::{ClockKind, Tick, Topic};
use ratelab_experiment::{Config, Experiment};
use ratelab_system::{About, BuildError, Builder, System};

/// Four nodes in a row.
pub struct FourNodes;

impl System for FourNodes {
    fn name(&self) -> &str {
        "robot"
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let topics = ["/frames", "/objects", "/plans"].map(|name| builder.internal_topic(name));
        let [frames, objects, plans] = &topics;
        let captured = frames.clone();
        builder.node("camera", 30.0, 0, move |wiring| {
            let frames = wiring.publisher(&captured);
            move |tick: &mut Tick| {
                tick.publish(&frames, tick.now().as_secs_f64());
            }
        })?;
        relay(builder, "detector", 12.0, frames, objects)?;
        relay(builder, "planner", 10.0, objects, plans)?;
        let planned = plans.clone();
        builder.node("controller", 100.0, 3, move |wiring| {
            let mut plans = wiring.subscription(&planned);
            let mut sense_to_act = wiring.meter("sense→act");
            // It takes no time itself; a node that does measures in `Node::apply`.
            move |tick: &mut Tick| {
                if let Some(plan) = tick.read(&mut plans) {
                    sense_to_act.record(tick.now() - plan.sensed());
                }
            }
        })
    }

    fn about(&self) -> About<'_> {
        About {
            latency: Some(("controller", "sense→act")),
            ..About::default()
        }
    }
}

/// Returns a node that passes on its input.
fn relay(
    builder: &mut Builder<'_>,
    name: &str,
    hz: f64,
    from: &Topic<f64>,
    to: &Topic<f64>,
) -> Result<(), BuildError> {
    let (from, to) = (from.clone(), to.clone());
    builder.node(name, hz, 1, move |wiring| {
        let (mut from, to) = (wiring.subscription(&from), wiring.publisher(&to));
        move |tick: &mut Tick| {
            if let Some(reading) = tick.read(&mut from) {
                tick.publish(&to, reading.data);
            }
        }
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    for (clock, cost) in [
        (ClockKind::Virtual, "none"),
        (ClockKind::Virtual, "60..110"),
        (ClockKind::Real, "60..110"),
    ] {
        let mut config = Config {
            clock,
            ..Config::default()
        };
        config.setup.set(format!("takes detector {cost}").parse()?);
        let summary = Experiment::new(Arc::new(FourNodes), &config)?.run()?;
        let median = summary.latency.quantile(0.5).unwrap_or_default();
        let detector = summary.node("detector").map_or(0, |node| node.overruns);
        println!(
            "{clock} clock, a detector that takes {cost} ms: sense→act p50 {} ms, {detector} overruns",
            median.as_millis()
        );
    }
    Ok(())
}
