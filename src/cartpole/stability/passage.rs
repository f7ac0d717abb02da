//! The linear map of each event of a loop.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, RowVector4};

use super::{
    control_loop::Loop,
    criterion::{Noise, Weights},
    schedule::{Schedule, ScheduleEvent, TooLong, readings},
    span::Span,
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
    pub gains: RowVector4<f64>,
    spans: BTreeMap<u64, Span>,
}

impl Passage {
    /// The passage of one hyper-period of `control`.
    pub fn of(
        control: &Loop,
        noise: &Noise,
        weights: &Weights,
    ) -> Result<(Self, Schedule), TooLong> {
        let schedule = Schedule::of(control.timing, control.world)?;
        let passage = Self::through(control, schedule.events.clone(), noise, weights);
        Ok((passage, schedule))
    }

    /// The passage of these events in `control`'s world.
    pub fn through(
        control: &Loop,
        events: Vec<ScheduleEvent>,
        noise: &Noise,
        weights: &Weights,
    ) -> Self {
        let mut spans = BTreeMap::new();
        for event in &events {
            if let ScheduleEvent::Advance(units) = *event {
                let span = || control.world.span(&control.dynamics, units, noise, weights);
                spans.entry(units).or_insert_with(span);
            }
        }
        Self {
            events,
            gains: control.gains.into(),
            spans,
        }
    }

    /// The size of the loop's state.
    pub fn size(&self) -> usize {
        NEWEST + readings(&self.events)
    }

    /// The effect of an advance by `units`, which must occur among the events.
    pub fn span(&self, units: u64) -> &Span {
        &self.spans[&units]
    }

    /// Applies `event` to each column of `states`.
    pub fn happen(&self, event: ScheduleEvent, states: &mut DMatrix<f64>) {
        match event {
            ScheduleEvent::Advance(units) => {
                let moved = self.span(units).motion * states.fixed_rows::<NEWEST>(0);
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
