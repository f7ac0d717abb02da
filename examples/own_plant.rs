//! A plant of your own, with the whole command: a drone that hovers if its pilot reacts
//! often enough.

use std::process::ExitCode;

use ratelab::{
    ClockExit, Flow, Message, MeterRecorder, Node, Publisher, Subscription, Tick, TickResult, Time,
};
use ratelab_metrics::fields;
use ratelab_system::{
    About, BuildError, Builder, Judge, Picture, RobotInfo, Shape, Signal, SignalValue, Style,
    System, Verdict, VerdictKind,
};

/// Height and climb of a drone of one kilogram.
#[derive(Clone, Copy)]
struct State {
    height: f64,
    climb: f64,
}
fields!(State {
    height: "height (m)",
    climb: "climb (m/s)"
});

/// Thrust of its rotors.
#[derive(Clone, Copy)]
struct Thrust {
    newton: f64,
}
fields!(Thrust {
    newton: "thrust (N)"
});

const DOWN: VerdictKind = VerdictKind::lost("down", "DOWN at {at}");

/// The node that acts on the world: it flies the drone.
struct Rotors {
    thrusts: Subscription<Thrust>,
    states: Publisher<State>,
    latency: MeterRecorder,
    command: Option<Message<Thrust>>,
    state: State,
}

impl Node for Rotors {
    /// Reads when the tick starts. The last thrust is held until the next one arrives.
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        self.command = tick.read(&mut self.thrusts);
        Ok(Flow::Continue)
    }

    /// Acts on the world when the tick is over, and measures the age of what it acts on.
    fn apply(&mut self, tick: &mut Tick) -> TickResult {
        tick.act();
        if let Some(age) = tick.age() {
            self.latency.record(age);
        }
        let newton = self.command.map_or(0.0, |thrust| thrust.data.newton);
        // 20 N at most.
        self.state.climb += (newton.clamp(0.0, 20.0) - 9.81) / 100.0;
        self.state.height += self.state.climb / 100.0;
        // Sensed anew, not derived from the thrust.
        tick.publish_new(&self.states, self.state);
        let flies = self.state.height > 0.0;
        Ok(if flies { Flow::Continue } else { Flow::End })
    }
}

struct Drone;

impl System for Drone {
    fn name(&self) -> &str {
        "drone"
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let states = builder.topic::<State>("/state");
        let thrusts = builder.topic::<Thrust>("/thrust");
        let (height, climb) = (1.0 + (builder.seed() % 10) as f64 / 10.0, 0.0);
        let (seen, wanted) = (states.clone(), thrusts.clone());
        builder.node("drone", 100.0, 0, move |wiring| Rotors {
            thrusts: wiring.subscription(&thrusts),
            states: wiring.publisher(&states),
            latency: wiring.meter("sense→act"),
            command: None,
            state: State { height, climb },
        })?;
        builder.node("pilot", 10.0, 1, move |wiring| {
            let (mut states, thrusts) = (wiring.subscription(&seen), wiring.publisher(&wanted));
            move |tick: &mut Tick| {
                if let Some(seen) = tick.read(&mut states) {
                    let State { height, climb } = seen.data;
                    let newton = 9.81 + 8.0 * (2.0 - height) - 4.0 * climb;
                    tick.publish(&thrusts, Thrust { newton });
                }
            }
        })
    }

    fn about(&self) -> About<'_> {
        About {
            state: Some("/state"),
            latency: Some(("drone", "sense→act")),
            ..About::default()
        }
    }

    fn signals(&self) -> Vec<Signal> {
        vec![Signal {
            name: "height".into(),
            unit: "m".into(),
            topic: "/state".into(),
            value: SignalValue::new(|state| state[0]),
            limits: Some([0.0, f64::INFINITY]),
            range: [0.0, 3.0],
        }]
    }

    fn judge(&self) -> &dyn Judge {
        self
    }

    fn robot(&self) -> &dyn RobotInfo {
        self
    }
}

impl Judge for Drone {
    fn verdict(&self, exit: &ClockExit, at: Time, state: Option<&[f64]>) -> Verdict {
        match state {
            Some([height, _]) if *height <= 0.0 => Verdict::new(DOWN, at),
            _ => Verdict::from_exit(exit, at),
        }
    }

    fn verdicts(&self) -> Vec<VerdictKind> {
        vec![VerdictKind::COMPLETED, VerdictKind::STOPPED, DOWN]
    }
}

impl RobotInfo for Drone {
    fn picture(&self, state: &[f64]) -> Option<Picture> {
        let (centre, half, angle) = ([0.0, *state.first()?], [0.3, 0.05], 0.0);
        let (from, to) = ([-2.0, 0.0], [2.0, 0.0]);
        Some(Picture {
            shapes: vec![
                (Style::Limit, Shape::Segment { from, to }),
                (
                    Style::Subject,
                    Shape::Box {
                        centre,
                        half,
                        angle,
                    },
                ),
            ],
            view: [-2.0, 0.0, 2.0, 3.0],
            focus: centre,
            captions: vec![format!("height {:.2} m", centre[1])],
        })
    }
}

fn main() -> ExitCode {
    ratelab_lab::main(Drone)
}
