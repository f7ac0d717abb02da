//! Whether the world waits for the robot.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::runtime::Time;

/// How the time of a plant passes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WorldKind {
    /// The plant moves when the actuator ticks: a late actuator costs no physics.
    #[default]
    Course,
    /// The plant moves by itself, whatever the robot does.
    Own {
        /// Its step.
        step_ms: StepMs,
    },
}

impl WorldKind {
    /// The world called `name`: `course` or `own`, which takes a step (ms).
    ///
    /// # Errors
    /// [`WorldError`] if there is no such world, or it does not take the step.
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

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Course => "course",
            Self::Own { .. } => "own",
        }
    }

    /// Whether the plant waits for the actuator.
    pub fn is_course(&self) -> bool {
        *self == Self::Course
    }
}

/// A step of physics that divides 20 ms (ms): 1, 2, 5 or 10.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u64", into = "u64")]
pub struct StepMs(u8);

impl StepMs {
    /// All there are.
    pub const ALL: [Self; 4] = [Self(1), Self(2), Self(5), Self(10)];

    /// The longest: that of the course.
    pub const LONGEST: Self = Self(10);

    /// The number of milliseconds.
    pub fn get(self) -> u64 {
        u64::from(self.0)
    }
}

impl TryFrom<u64> for StepMs {
    type Error = WorldError;

    fn try_from(ms: u64) -> Result<Self, WorldError> {
        let mut all = Self::ALL.into_iter();
        all.find(|step| step.get() == ms)
            .ok_or(WorldError::StepMs(ms))
    }
}

impl From<StepMs> for u64 {
    fn from(step: StepMs) -> Self {
        step.get()
    }
}

/// A world that there is not.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WorldError {
    /// The name of none.
    #[error("{0:?} is no world: expected course or own")]
    Name(String),
    /// A step that is none.
    #[error("{0} ms is no step of physics: expected 1, 2, 5 or 10 ms")]
    StepMs(u64),
    /// A step for the course's world.
    #[error("the course's world has its own step: leave it out, or ask for the world \"own\"")]
    Step,
}

/// A plant that moves by itself: one that can be brought to a run time.
pub trait World: Send + 'static {
    /// Moves on to run time `now`. Never turns back: for a time that has passed it
    /// does nothing.
    fn advance_to(&mut self, now: Time);
}

/// A world as nodes share it. Whoever looks at it first brings it to the time of
/// looking.
#[derive(Debug)]
pub struct SharedWorld<W>(Arc<Mutex<W>>);

impl<W: World> SharedWorld<W> {
    /// Shares `world`.
    pub fn new(world: W) -> Self {
        Self(Arc::new(Mutex::new(world)))
    }

    /// The world at run time `now`, for as long as the guard lives.
    pub fn at(&self, now: Time) -> MutexGuard<'_, W> {
        // A panic elsewhere is reported as that node's fault.
        let mut world = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        world.advance_to(now);
        world
    }
}

impl<W> Clone for SharedWorld<W> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}
