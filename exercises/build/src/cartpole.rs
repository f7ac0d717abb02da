//! The cart-pole of the lab, on your three types.

use std::{cell::RefCell, sync::Arc};

use ratelab::{
    cartpole::{Action, CartPole, ControlStep, Observation, Plant, PlantError},
    policy::{Policy, Scripted},
    runtime::{Fields, Time},
    system::System,
};

use crate::{Node, Topic, clock};

/// The settings of a run.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Seed of the start.
    pub seed: u64,
    /// Rate of the policy (Hz).
    pub control_hz: u64,
    /// Depth of both topics.
    pub depth: usize,
    /// Duration (s).
    pub seconds: u64,
}

/// Rate of sensor and actuator (Hz).
const PLANT_HZ: u64 = 50;

/// Runs the cart-pole with the scripted policy on your runtime. Returns the run as the lab
/// writes it (`ratelab run --clock virtual --csv FILE`): a row for each control step.
///
/// # Errors
/// [`PlantError`] if MuJoCo is out of memory.
pub fn run(settings: &Settings) -> Result<String, PlantError> {
    let plant = RefCell::new(Plant::new(settings.seed)?);
    let observations = Arc::new(Topic::<Observation>::new("/obs", settings.depth));
    let actions = Arc::new(Topic::<Action>::new("/action", settings.depth));
    let mut policy = Scripted;
    let mut rows = Rows::new();
    clock::run(
        &mut [
            Node::new("sensor", PLANT_HZ, 0, |now| {
                observations.publish(plant.borrow().observe(), now, None);
                true
            }),
            Node::new("policy", settings.control_hz, 1, |now| {
                if let Some(sensed) = observations.latest() {
                    actions.publish(policy.act(&sensed.data), now, Some(sensed.stamp));
                }
                true
            }),
            Node::new("actuator", PLANT_HZ, 2, |now| {
                let command = actions.latest();
                let action = command
                    .as_ref()
                    .map_or(Action::ZERO, |command| command.data);
                let sensed = command.and_then(|command| command.origin);
                let mut plant = plant.borrow_mut();
                let fall = plant.step(action);
                rows.add(now, sensed, &plant, action);
                fall.is_none()
            }),
        ],
        settings.seconds * 1_000_000_000,
    );
    Ok(rows.text)
}

/// The run as text.
struct Rows {
    text: String,
}

impl Rows {
    fn new() -> Self {
        let table = CartPole::default().table();
        let header = table.map_or("", |table| table.header);
        Self {
            text: format!("{header}\n"),
        }
    }

    /// Adds the control step that ends at `now`, by an action derived from what was
    /// `sensed` then.
    fn add(&mut self, now: u64, sensed: Option<u64>, plant: &Plant, action: Action) {
        let at = Time::from_nanos(now);
        let step = ControlStep {
            step: plant.steps(),
            action: action.clipped(),
            latency: sensed.map(|sensed| at.since(Time::from_nanos(sensed))),
            observation: plant.observe(),
            qpos: plant.qpos(),
            qvel: plant.qvel(),
        };
        let mut state = Vec::new();
        step.append_to(&mut state);
        if let Some(table) = CartPole::default().table() {
            self.text += &(table.row)(at, &state);
            self.text.push('\n');
        }
    }
}
