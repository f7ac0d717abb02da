//! A plant of your own, with the whole command: a drone that hovers if its pilot reacts
//! often enough.

use std::process::ExitCode;

use ratelab::{ClockExit, END, GO_ON, Time};
use ratelab_account::fields;
use ratelab_study::system::{
    BuildError, Builder, Picture, Shape, Signal, Style, System, Verdict, VerdictKind,
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

const DOWN: VerdictKind = VerdictKind {
    name: "down",
    lost: true,
    text: "DOWN at {at}",
};

struct Drone;

impl System for Drone {
    fn name(&self) -> &'static str {
        "drone"
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let states = builder.topic::<State>("/state");
        let thrusts = builder.topic::<Thrust>("/thrust");
        let (height, climb) = (1.0 + (builder.seed() % 10) as f64 / 10.0, 0.0);
        let (seen, wanted) = (states.clone(), thrusts.clone());
        builder.node("drone", 100.0, 0, move |wiring| {
            let (states, mut thrusts) = (wiring.publisher(&states), wiring.subscription(&thrusts));
            // It acts on the world, so the age of what it acts on is measured here.
            let (age, mut latency) = (wiring.push_age(), wiring.meter("sense→act"));
            let mut state = State { height, climb };
            move |now| {
                // The last thrust is held until the next one arrives; 20 N at most.
                let newest = thrusts.latest(now);
                let sensed = newest.as_ref().map(|thrust| thrust.sensed());
                if let Some(sensed) = sensed {
                    age.push(now, sensed);
                    latency.record(now.since(sensed));
                }
                let thrust = newest.map_or(0.0, |thrust| thrust.data.newton);
                state.climb += (thrust.clamp(0.0, 20.0) - 9.81) / 100.0;
                state.height += state.climb / 100.0;
                states.publish(state, now, sensed);
                if state.height > 0.0 { GO_ON } else { END }
            }
        })?;
        builder.node("pilot", 10.0, 1, move |wiring| {
            let (mut states, thrusts) = (wiring.subscription(&seen), wiring.publisher(&wanted));
            move |now| {
                if let Some(seen) = states.latest(now) {
                    let State { height, climb } = seen.data;
                    let newton = 9.81 + 8.0 * (2.0 - height) - 4.0 * climb;
                    thrusts.publish(Thrust { newton }, now, Some(seen.stamp));
                }
                GO_ON
            }
        })
    }

    fn state(&self) -> Option<&'static str> {
        Some("/state")
    }

    fn latency(&self) -> Option<(&'static str, &'static str)> {
        Some(("drone", "sense→act"))
    }

    fn signals(&self) -> &'static [Signal] {
        &[Signal {
            name: "height",
            unit: "m",
            topic: "/state",
            value: |state| state[0],
            limits: Some([0.0, f64::INFINITY]),
            range: [0.0, 3.0],
        }]
    }

    fn verdict(&self, exit: &ClockExit, at: Time, state: Option<&[f64]>) -> Verdict {
        match state {
            Some([height, _]) if *height <= 0.0 => Verdict::new(&DOWN, at),
            _ => Verdict::of_exit(exit, at),
        }
    }

    fn verdicts(&self) -> &'static [&'static VerdictKind] {
        &[&VerdictKind::COMPLETED, &VerdictKind::STOPPED, &DOWN]
    }

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
