//! The linear map of each event of a loop.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Matrix5, RowVector4};

use super::{
    control_loop::Loop,
    error::StabilityError,
    schedule::{LoopSchedule, ScheduleEvent, readings},
    span::{Noise, Span, Weights},
};

/// Row of the action in force, below the plant's state.
pub(super) const ACTION: usize = 4;

/// Row of the action for the newest reading; the rows below belong to older readings.
pub(super) const NEWEST: usize = 5;

/// A sequence of events with their effects on the loop's whole state: the plant's state,
/// the action in force and the policy's answers to the last few readings.
#[derive(Clone, Debug)]
pub(super) struct Passage {
    pub events: Vec<ScheduleEvent>,
    gains: RowVector4<f64>,
    /// The motion of each length of advance.
    motions: BTreeMap<u64, Matrix5<f64>>,
}

/// The disturbances of a passage and its costs, which take several times as long to compute as
/// its motion.
pub(super) struct Disturbances {
    /// Noise and cost of each length of advance.
    pub spans: BTreeMap<u64, Span>,
    /// Variance that the errors of a reading add to its action.
    pub reading: f64,
}

impl Passage {
    /// Returns the passage of one hyper-period of `control`.
    ///
    /// # Errors
    /// [`StabilityError::Aperiodic`] if it is too long.
    pub fn new(control: &Loop) -> Result<(Self, LoopSchedule), StabilityError> {
        let schedule = LoopSchedule::new(control.timing, control.world)?;
        let passage = Self::through(control, schedule.events.clone());
        Ok((passage, schedule))
    }

    /// Creates the passage of these events in `control`'s world.
    pub fn through(control: &Loop, events: Vec<ScheduleEvent>) -> Self {
        let motion = |units| control.world.motion(&control.dynamics, units);
        Self {
            motions: per_length(&events, motion),
            events,
            gains: control.gains.into(),
        }
    }

    /// Returns the size of the loop's state.
    pub fn size(&self) -> usize {
        NEWEST + readings(&self.events)
    }

    /// Applies `event` to each column of `states`.
    pub fn happen(&self, event: ScheduleEvent, states: &mut DMatrix<f64>) {
        match event {
            ScheduleEvent::Advance(units) => {
                let moved = self.motions[&units] * states.fixed_rows::<NEWEST>(0);
                states.fixed_rows_mut::<NEWEST>(0).copy_from(&moved);
            }
            ScheduleEvent::Sense => {
                for row in (NEWEST + 1..states.nrows()).rev() {
                    let younger = states.row(row - 1).clone_owned();
                    states.set_row(row, &younger);
                }
                let answer = self.gains * states.fixed_rows::<ACTION>(0);
                states.set_row(NEWEST, &answer);
            }
            ScheduleEvent::Apply(ago) => {
                let action = states.row(NEWEST + ago).clone_owned();
                states.set_row(ACTION, &action);
            }
        }
    }
}

impl Disturbances {
    /// Creates the disturbances of `passage` in `control`'s world.
    pub fn new(passage: &Passage, control: &Loop, noise: &Noise, weights: &Weights) -> Self {
        let span = |units| control.world.span(&control.dynamics, units, noise, weights);
        let errors = control.gains.iter().zip(noise.reading);
        Self {
            spans: per_length(&passage.events, span),
            reading: errors.map(|(gain, error)| gain * gain * error).sum(),
        }
    }
}

/// Returns `of` each length of advance among `events`.
fn per_length<T>(events: &[ScheduleEvent], of: impl Fn(u64) -> T) -> BTreeMap<u64, T> {
    let mut known = BTreeMap::new();
    for event in events {
        if let ScheduleEvent::Advance(units) = *event {
            known.entry(units).or_insert_with(|| of(units));
        }
    }
    known
}
