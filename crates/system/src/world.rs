//! Whether the world waits for the robot.

use std::sync::Arc;

use ratelab::{Knob, KnobKind, Shared, SharedGuard, Time};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// How time passes for a plant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WorldKind {
    /// The plant moves when the actuator ticks: a late actuator costs no physics.
    #[default]
    Course,
    /// The plant moves by itself, independently of the robot.
    Own {
        /// Time step.
        step_ms: StepMs,
    },
}

impl WorldKind {
    /// Parses a kind of world: `course`, or `own` with a step (ms).
    ///
    /// # Errors
    /// [`WorldError`] for an unknown world or an invalid step.
    pub fn parse(name: &str, step_ms: Option<u64>) -> Result<Self, WorldError> {
        match (name, step_ms) {
            ("course", None) => Ok(Self::Course),
            ("course", Some(_)) => Err(WorldError::Step),
            ("own", None) => Ok(Self::OWN),
            ("own", Some(step_ms)) => Ok(Self::Own {
                step_ms: step_ms.try_into()?,
            }),
            _ => Err(WorldError::Name(name.to_owned())),
        }
    }

    /// A plant that moves by itself in steps of one millisecond.
    pub const OWN: Self = Self::Own { step_ms: StepMs(1) };

    /// Returns the name of the kind.
    pub fn name(self) -> &'static str {
        match self {
            Self::Course => "course",
            Self::Own { .. } => "own",
        }
    }

    /// Returns whether the plant waits for the actuator.
    pub fn is_course(&self) -> bool {
        *self == Self::Course
    }
}

/// Returns whether the effect of `knob` depends on the world: a cost, a link or a fault has less
/// effect in a world that waits.
pub fn depends_on_the_world(knob: &Knob) -> bool {
    use KnobKind::{Depth, Rate, Read, Send};
    !matches!(knob.kind(), Rate | Depth | Send | Read)
}

/// A step of physics that divides 20 ms (ms): 1, 2, 5 or 10.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u64", into = "u64")]
pub struct StepMs(u8);

impl StepMs {
    /// All valid steps.
    pub const ALL: [Self; 4] = [Self(1), Self(2), Self(5), Self(10)];

    /// The longest step: that of the course.
    pub const LONGEST: Self = Self(10);

    /// Returns the number of milliseconds.
    pub fn get(self) -> u64 {
        u64::from(self.0)
    }
}

impl TryFrom<u64> for StepMs {
    type Error = WorldError;

    fn try_from(ms: u64) -> Result<Self, WorldError> {
        Self::ALL
            .into_iter()
            .find(|step| step.get() == ms)
            .ok_or(WorldError::StepMs(ms))
    }
}

impl From<StepMs> for u64 {
    fn from(step: StepMs) -> Self {
        step.get()
    }
}

/// An invalid world.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WorldError {
    /// An unknown name.
    #[error("{0:?} is no world: expected course or own")]
    Name(String),
    /// An invalid step.
    #[error("{0} ms is no step of physics: expected 1, 2, 5 or 10 ms")]
    StepMs(u64),
    /// A step with the course's world.
    #[error("the course's world has its own step: leave it out, or ask for the world \"own\"")]
    Step,
}

/// A plant that moves by itself, up to a given run time.
pub trait World: Send + 'static {
    /// Its name in errors.
    const NAME: &'static str = "the world";

    /// Advances the plant to run time `now`. Does nothing for a time that has passed.
    fn advance_to(&mut self, now: Time);
}

/// An input of a plant that moves in steps of physics. A step keeps the input that it begins with.
#[derive(Clone, Copy, Debug)]
pub struct StepInput<T> {
    /// Input of the next step.
    next: T,
    /// Input of the steps after it, if it was set after the next step had begun.
    later: Option<T>,
}

impl<T> StepInput<T> {
    /// Creates an input that is `input` until another one is set.
    pub fn new(input: T) -> Self {
        let (next, later) = (input, None);
        Self { next, later }
    }

    /// Returns the input of the next step.
    pub fn next(&self) -> &T {
        &self.next
    }

    /// Returns the input that was set last.
    pub fn last_set(&self) -> &T {
        self.later.as_ref().unwrap_or(&self.next)
    }

    /// Sets the input of every step that begins at run time `now` or later. `begin` is the begin of
    /// the next step.
    pub fn set(&mut self, input: T, now: Time, begin: Time) {
        if begin >= now {
            (self.next, self.later) = (input, None);
        } else {
            self.later = Some(input);
        }
    }

    /// Returns whether the input changes after the next step.
    pub fn changes(&self) -> bool {
        self.later.is_some()
    }

    /// Goes on to the input of the steps after the next one.
    pub fn go_on(&mut self) {
        if let Some(later) = self.later.take() {
            self.next = later;
        }
    }
}

/// A world that nodes share. Every access first advances it to the current run time.
#[derive(Debug)]
pub struct SharedWorld<W>(Arc<Shared<W>>);

impl<W: World> SharedWorld<W> {
    /// Shares `world`.
    pub fn new(world: W) -> Self {
        Self(Arc::new(Shared::new(W::NAME, world)))
    }

    /// Advances the world to run time `now` and locks it until the guard is dropped.
    pub fn at(&self, now: Time) -> SharedGuard<'_, W> {
        let mut world = self.0.lock();
        world.advance_to(now);
        world
    }
}

impl<W> Clone for SharedWorld<W> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_world_has_a_name_and_only_one_that_moves_by_itself_has_a_step() {
        let own = |ms: u64| StepMs::try_from(ms).map(|step_ms| WorldKind::Own { step_ms });
        for (name, step, expected) in [
            ("course", None, Ok(WorldKind::Course)),
            ("course", Some(2), Err(WorldError::Step)),
            ("own", None, Ok(WorldKind::OWN)),
            ("own", Some(5), own(5)),
            ("own", Some(3), Err(WorldError::StepMs(3))),
            ("moon", None, Err(WorldError::Name("moon".to_owned()))),
        ] {
            assert_eq!(WorldKind::parse(name, step), expected, "{name} {step:?}");
        }
    }

    #[test]
    fn a_step_of_physics_keeps_the_input_that_it_begins_with() {
        let at = Time::from_nanos;
        let mut input = StepInput::new('a');
        // Set before the next step begins, it is the input of that step.
        input.set('b', at(10), at(10));
        assert_eq!((*input.next(), input.changes()), ('b', false));
        // Set within a step, it is the input of the step after it.
        input.set('c', at(15), at(10));
        assert_eq!((*input.next(), *input.last_set()), ('b', 'c'));
        input.go_on();
        assert_eq!((*input.next(), input.changes()), ('c', false));
    }
}
