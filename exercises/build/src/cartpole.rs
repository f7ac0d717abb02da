//! The cart-pole of the lab, on your three types.

use std::{cell::RefCell, collections::BTreeMap, mem, sync::Arc};

use ratelab::{ClockExit, Derived, Head, MessageId, Push, TickId, Time};
use ratelab_cart_pole::{
    ACTION, Action, CartPole, ControlStep, OBS, Observation, Plant, PlantError, STATE,
    policy::{Policy, Scripted},
};
use ratelab_experiment::Config;
use ratelab_metrics::{Fields, Rows, TickCauses, TickRecord, TopicRead};
use ratelab_system::{KnobTextError, System};

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

impl Settings {
    /// These settings for the lab.
    ///
    /// # Errors
    /// [`KnobTextError`] if a setting is impossible there.
    pub fn config(&self) -> Result<Config, KnobTextError> {
        let (hz, depth) = (self.control_hz, self.depth);
        Ok(Config {
            seed: self.seed,
            end: Time::from_nanos(self.end()),
            ..CartPole::config(&format!("control-hz {hz}, queue-depth {depth}"))?
        })
    }

    /// Returns the run time at the end (ns).
    fn end(&self) -> u64 {
        self.seconds * 1_000_000_000
    }
}

/// The nodes, in the order of the lab.
const NODES: [&str; 3] = ["sensor", "policy", "actuator"];

/// Rate of sensor and actuator (Hz).
const PLANT_HZ: u64 = 50;

/// A run on your runtime: all that the lab records of its own.
#[derive(Debug)]
pub struct Run {
    /// The messages of each topic, by its name.
    pub topics: BTreeMap<String, Rows>,
    /// The ticks of each node, by its name.
    pub ticks: BTreeMap<String, Vec<TickRecord>>,
    /// The reason for its end.
    pub exit: ClockExit,
}

/// Runs the cart-pole with the scripted policy on your runtime.
///
/// # Errors
/// [`PlantError`] if MuJoCo is out of memory.
pub fn run(settings: &Settings) -> Result<Run, PlantError> {
    let plant = RefCell::new(Plant::new(settings.seed)?);
    let observations = Arc::new(Topic::<Observation>::new(OBS, settings.depth));
    let actions = Arc::new(Topic::<Action>::new(ACTION, settings.depth));
    let log = RefCell::new(Log::default());
    let mut policy = Scripted;
    let end = clock::run(
        &mut [
            Node::new("sensor", PLANT_HZ, 0, |now| {
                let mut log = log.borrow_mut();
                log.tick("sensor", now, None, None);
                log.publish(&observations, plant.borrow().observe(), now, None);
                true
            }),
            Node::new("policy", settings.control_hz, 1, |now| {
                let mut log = log.borrow_mut();
                let reading = observations.latest();
                let read = reading
                    .as_ref()
                    .map(|read| read_of(&observations, read.seq));
                log.tick("policy", now, None, read);
                if let Some(sensed) = reading {
                    let action = policy.act(&sensed.data);
                    log.publish(&actions, action, now, Some(sensed.stamp));
                }
                true
            }),
            Node::new("actuator", PLANT_HZ, 2, |now| {
                let command = actions.latest();
                let action = command
                    .as_ref()
                    .map_or(Action::ZERO, |command| command.data);
                let sensed = command.as_ref().and_then(|command| command.origin);
                let mut plant = plant.borrow_mut();
                let fall = plant.step(action);
                let mut log = log.borrow_mut();
                let read = command.as_ref().map(|read| read_of(&actions, read.seq));
                log.tick("actuator", now, sensed, read);
                log.step(now, sensed, &plant, action);
                fall.is_none()
            }),
        ],
        settings.end(),
    );
    let exit = end.map_or(ClockExit::Completed, |(node, at)| ClockExit::Ended {
        node,
        at: Time::from_nanos(at),
    });
    let Log { topics, ticks } = mem::take(&mut *log.borrow_mut());
    Ok(Run {
        topics,
        ticks,
        exit,
    })
}

impl Run {
    /// Returns the run as the lab writes it in the first columns
    /// (`ratelab run --clock virtual --csv FILE`): a row for each control step.
    pub fn csv(&self) -> String {
        let (Some(table), Some(steps)) =
            (CartPole::default().robot().table(), self.topics.get(STATE))
        else {
            return String::new();
        };
        let rows = steps.iter().map(|(head, step)| (table.row)(head.at, step));
        std::iter::once(table.header.to_owned())
            .chain(rows)
            .map(|line| line + "\n")
            .collect()
    }
}

/// The messages and ticks so far.
#[derive(Default)]
struct Log {
    topics: BTreeMap<String, Rows>,
    ticks: BTreeMap<String, Vec<TickRecord>>,
}

impl Log {
    /// Publishes `data` on your topic, and keeps the message with your counts.
    fn publish<T: Fields + Clone>(
        &mut self,
        topic: &Topic<T>,
        data: T,
        now: u64,
        origin: Option<u64>,
    ) {
        topic.publish(data.clone(), now, origin);
        let head = Head {
            dropped: topic.dropped(),
            ..head(now, topic.published().saturating_sub(1), origin)
        };
        self.add(topic.name(), head, &data);
    }

    /// Returns the newest tick of the node that publishes to a topic.
    fn publisher_of(&self, topic: &str) -> Option<TickId> {
        let node = match topic {
            OBS => 0,
            ACTION => 1,
            _ => 2,
        };
        let ticks = self.ticks.get(NODES[node])?.len() as u64;
        Some(TickId {
            node,
            number: ticks.checked_sub(1)?,
        })
    }

    /// Keeps the control step that ends at `now`, by an action derived from what was
    /// `sensed` then.
    fn step(&mut self, now: u64, sensed: Option<u64>, plant: &Plant, action: Action) {
        let at = Time::from_nanos(now);
        let step = ControlStep {
            step: plant.steps(),
            action: action.clipped(),
            latency: sensed.map(|sensed| at.since(Time::from_nanos(sensed))),
            observation: plant.observe(),
            qpos: plant.qpos(),
            qvel: plant.qvel(),
        };
        let number = self.topics.get(STATE).map_or(0, Rows::len);
        self.add(STATE, head(now, number as u64, sensed), &step);
    }

    fn add<T: Fields>(&mut self, topic: &str, head: Head, data: &T) {
        let (by, width) = (self.publisher_of(topic), T::FIELDS.len());
        let head = Head { by, ..head };
        let rows = self.topics.entry(topic.to_owned());
        let mut row = Vec::with_capacity(width);
        data.append_to(&mut row);
        let kept = rows.or_insert_with(|| Rows::new(width)).push(head, row);
        debug_assert!(kept, "a message of {topic} has {width} numbers");
    }

    /// Keeps a tick of `node` with what it read, and with a push derived from what was `sensed` then.
    fn tick(&mut self, node: &str, now: u64, sensed: Option<u64>, read: Option<TopicRead>) {
        let ticks = self.ticks.entry(node.to_owned()).or_default();
        let at = Time::from_nanos(now);
        ticks.push(TickRecord {
            number: ticks.len() as u64,
            at,
            ends: Some(at),
            lateness: None,
            took: None,
            overruns: 0,
            push: sensed.map(|sensed| Push {
                at,
                sensed: Time::from_nanos(sensed),
            }),
            causes: TickCauses {
                reads: read.into_iter().collect(),
                completed: None,
            },
        });
    }
}

/// Returns a read of message number `seq` of a topic.
fn read_of<T: Clone>(topic: &Topic<T>, seq: u64) -> TopicRead {
    let place = usize::from(topic.name() == ACTION);
    TopicRead {
        message: MessageId { topic: place, seq },
        reader: 0,
        newest: topic.published().saturating_sub(1),
    }
}

/// Returns the head of a message that arrives when it is published.
fn head(now: u64, seq: u64, origin: Option<u64>) -> Head {
    let at = Time::from_nanos(now);
    Head {
        at,
        by: None,
        stamp: at,
        seq,
        origin: origin.map(Time::from_nanos),
        from: Derived::Reads,
        arrives: Some(at),
        dropped: 0,
    }
}
