//! The frequency response of the continuous loop.

use std::{collections::BTreeMap, f64::consts::TAU, time::Duration};

use nalgebra::{Complex, ComplexField, DMatrix, Matrix4, Matrix5, RowVector4};

use super::{
    control_loop::{Loop, StabilityError},
    schedule::{LoopSchedule, ScheduleEvent, readings},
    span::{Dynamics, Noise, Span, Weights},
};

/// Tested frequencies (rad/s): the range, and their number per decade.
const LOWEST: f64 = 1e-3;
const DECADES: u32 = 8;
const PER_DECADE: u32 = 2_000;

/// Bisection steps within an interval of frequencies.
const HALVINGS: u32 = 60;

/// The margins of a loop in continuous time, where policy and motor act at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContinuousMargins {
    /// The frequency at which the loop oscillates with its longest stable delay (rad/s):
    /// there its gain is 1.
    pub crossover: f64,
    /// The distance of the phase from that oscillation, without a delay (rad).
    pub phase_margin: f64,
    /// The shortest constant delay at which small deviations do not shrink.
    pub delay: Duration,
}

/// Frequencies from the lowest to the highest, evenly on a logarithmic scale
/// (rad/s).
pub(super) fn frequencies() -> impl Iterator<Item = f64> {
    let steps = 0..=DECADES * PER_DECADE;
    steps.map(|step| LOWEST * 10.0_f64.powf(f64::from(step) / f64::from(PER_DECADE)))
}

/// Returns a real number as a complex one.
pub(super) fn complex(real: f64) -> Complex<f64> {
    Complex::new(real, 0.0)
}

impl Loop {
    /// Returns whether deviations shrink in continuous time without delays.
    pub(super) fn shrinks_without_delay(&self) -> bool {
        let Dynamics { f, g } = self.dynamics;
        let closed = f + g * RowVector4::from(self.gains);
        closed
            .complex_eigenvalues()
            .iter()
            .all(|pole| pole.re < 0.0)
    }

    /// Returns the response of the open loop to `s`: `−K·(s − F)⁻¹·G`. `None` at its poles.
    pub(super) fn open_loop(&self, s: Complex<f64>) -> Option<Complex<f64>> {
        let resolvent = Matrix4::identity() * s - self.dynamics.f.map(complex);
        let state = resolvent.try_inverse()? * self.dynamics.g.map(complex);
        Some(-(RowVector4::from(self.gains).map(complex) * state)[0])
    }

    /// Returns the margins of the loop in continuous time without delays. `None` if deviations grow
    /// without any delay, or shrink with any.
    ///
    /// A delay `τ` turns the phase of the loop at the frequency `ω` by `ωτ` and leaves
    /// its gain unchanged. The loop oscillates where the gain is 1 and this turn uses up
    /// the phase margin: the shortest such delay is the result. Åström and Murray,
    /// *Feedback Systems*, section 10.3.
    pub fn continuous_margins(&self) -> Option<ContinuousMargins> {
        if !self.shrinks_without_delay() {
            return None;
        }
        let response = |frequency| self.open_loop(Complex::new(0.0, frequency));
        let louder = |frequency| response(frequency).is_none_or(|open| open.modulus() > 1.0);
        let margins = frequencies()
            .zip(frequencies().skip(1))
            .filter(|(low, high)| louder(*low) != louder(*high))
            .filter_map(|(low, high)| {
                let crossover = edge(low, high, louder);
                let phase_margin = (-response(crossover)?).argument().rem_euclid(TAU);
                let delay = Duration::try_from_secs_f64(phase_margin / crossover).ok()?;
                Some(ContinuousMargins {
                    crossover,
                    phase_margin,
                    delay,
                })
            });
        margins.min_by_key(|margins| margins.delay)
    }
}

/// Returns the frequency between two at which `louder` changes.
fn edge(mut low: f64, mut high: f64, louder: impl Fn(f64) -> bool) -> f64 {
    let below = louder(low);
    for _ in 0..HALVINGS {
        let middle = (low * high).sqrt();
        if louder(middle) == below {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

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
