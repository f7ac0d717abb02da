//! A plant of your own: a drone that hovers if it is told often enough how.
//!
//! The runtime knows no robot. Here one node is altimeter and rotors and owns the
//! plant; where two share one, it is behind a lock (`cartpole::SharedPlant`).

use std::error::Error;

use ratelab::runtime::{Clock, ClockExit, Depth, END, GO_ON, Graph, Hz, Inbox};
use ratelab::runtime::{Time, Topic, VirtualClock};

/// Height (m) and climb (m/s) of a drone of one kilogram.
#[derive(Clone, Copy)]
struct Drone(f64, f64);

impl Drone {
    /// A hundredth of a second under `thrust` (N), which is 20 N at most.
    fn step(&mut self, thrust: f64) {
        self.1 += (thrust.clamp(0.0, 20.0) - 9.81) / 100.0;
        self.0 += self.1 / 100.0;
    }
}

fn hover(control_hz: f64) -> Result<ClockExit, Box<dyn Error>> {
    let state = Topic::new("/state", Depth::ONE);
    let thrust = Topic::new("/thrust", Depth::ONE);
    let mut graph = Graph::new();
    graph.node("drone", Hz::new(100.0)?, 0, |wiring| {
        let (state, mut thrust) = (wiring.publisher(&state), wiring.subscription(&thrust));
        let mut drone = Drone(1.0, 0.0);
        move |now| {
            // Until the next thrust comes, the last one is held.
            drone.step(thrust.latest(now).map_or(0.0, |newest| newest.data));
            state.publish(drone, now, None);
            if drone.0 > 0.0 { GO_ON } else { END }
        }
    })?;
    graph.node("pilot", Hz::new(control_hz)?, 1, |wiring| {
        let (mut state, thrust) = (wiring.subscription(&state), wiring.publisher(&thrust));
        move |now| {
            if let Some(seen) = state.latest(now) {
                let Drone(height, climb) = seen.data;
                let wanted = 9.81 + 8.0 * (2.0 - height) - 4.0 * climb;
                thrust.publish(wanted, now, Some(seen.stamp));
            }
            GO_ON
        }
    })?;
    let end = Time::from_secs_f64(20.0)?;
    Ok(VirtualClock.run(&mut graph, &mut Inbox::default(), end)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    for hz in [100.0, 10.0, 4.0, 2.0, 1.0] {
        match hover(hz)? {
            ClockExit::Ended { at, .. } => println!("{hz} Hz: down at {at}"),
            _ => println!("{hz} Hz: up in the air"),
        }
    }
    Ok(())
}
