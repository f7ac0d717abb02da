//! The prediction of linear theory for a run, from its setup.

use std::time::Duration;

use ratelab::{Draw, Knob, Link, ReadOrder};
use ratelab_policy::chunk::{CHUNK, Merge, PlayKind};
use ratelab_system::{Setup, WorldKind};

use super::{
    control_loop::{Loop, StabilityError, WorldModel, gains},
    covariance::{Loss, Lost},
    planned::PlannedOutlook,
    timing::{Cadence, Timing},
};
use crate::{
    ACTION, ACTUATOR, DISTURB, MOTOR_N, OBS, OnStale, POLICY, SENSOR, actuator_hz,
    chunk::CartChunks,
    policy::{PolicyKind, PolicySpec},
};

/// The prediction of theory for a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Expected {
    /// The rate at which small deviations grow (1/s), negative if they shrink: exact, for
    /// a run without randomness.
    Growth(f64),
    /// The rate at which their root mean square grows (1/s), with random loss of messages
    /// of `/action`: exact.
    MeanSquare(f64),
    /// Whether deviations shrink for any pattern of random, bounded delays. If false,
    /// they may still shrink.
    Any(bool),
    /// For a policy that answers with chunks.
    Planned(PlannedOutlook),
}

/// Returns the prediction of linear theory for a run of the cart-pole with `setup` in `world`.
///
/// # Errors
/// [`StabilityError`] with the reason, if there is none.
pub fn expected(setup: &Setup, world: WorldKind) -> Result<Expected, StabilityError> {
    let mut read = Reading::new(world);
    read.chunks =
        CartChunks::from_setup(setup).map_err(|error| StabilityError::Knob(error.to_string()))?;
    for knob in setup.iter() {
        if read.take(knob).is_none() {
            return Err(StabilityError::Knob(knob.to_string()));
        }
    }
    read.expected()
}

/// The loop described by a setup.
struct Reading {
    policy: PolicySpec,
    world: WorldModel,
    timing: Timing,
    /// Maximum additional time of readings, decisions and actions.
    spread: [Duration; 3],
    loss: f64,
    stale: OnStale,
    chunks: Option<CartChunks>,
    /// Standard deviation of the random force (N).
    disturbance: f64,
}

/// Returns the minimum of a draw, and its range above that; `None` if it is unbounded.
fn bounds(draw: &Draw) -> Option<(Duration, Duration)> {
    match draw {
        Draw::Constant(duration) => Some((*duration, Duration::ZERO)),
        Draw::Uniform(from, to) => Some((*from, *to - *from)),
        Draw::Lognormal { .. } | Draw::Measured(_) => None,
    }
}

impl Reading {
    fn new(world: WorldKind) -> Self {
        let usual = Cadence::new(actuator_hz());
        Self {
            policy: PolicySpec::BuiltIn(PolicyKind::Scripted),
            world: match world {
                WorldKind::Course => WorldModel::Course,
                WorldKind::Own { step_ms } => WorldModel::Own(Duration::from_millis(step_ms.get())),
            },
            timing: Timing {
                actuator: Some(usual),
                ..Timing::direct(usual.hz)
            },
            spread: [Duration::ZERO; 3],
            loss: 0.0,
            stale: OnStale::Hold,
            chunks: None,
            disturbance: 0.0,
        }
    }

    fn cadence(&mut self, node: &str) -> Option<&mut Cadence> {
        match node {
            SENSOR => Some(&mut self.timing.sensor),
            POLICY => Some(&mut self.timing.policy),
            ACTUATOR => self.timing.actuator.as_mut(),
            _ => None,
        }
    }

    /// Applies a knob to the loop; `None` if it is beyond the theory.
    fn take(&mut self, knob: &Knob) -> Option<()> {
        match knob {
            Knob::Rate { node, hz } => self.cadence(node)?.hz = *hz,
            Knob::Offset { node, offset } => self.cadence(node)?.offset = *offset,
            Knob::Send { node, text } if node == POLICY => self.policy = text.parse().ok()?,
            Knob::Send { node, text } if node == ACTUATOR => self.stale = text.parse().ok()?,
            Knob::Takes { node, cost } if node == POLICY => {
                (self.timing.policy_takes, self.spread[1]) = bounds(&cost.draw)?;
            }
            Knob::Takes { .. } | Knob::Wakes { .. } => {
                knob.draw().filter(|draw| draw.is_none())?;
            }
            Knob::Link { topic, link } => self.link(topic, link)?,
            Knob::Read { order, .. } if *order != ReadOrder::Newest => return None,
            Knob::Parameter { name, value, .. } if name == DISTURB => {
                self.disturbance = value.parse().ok()?;
            }
            Knob::Parameter { node, value, .. }
                if node == SENSOR || (self.chunks.is_none() && value != "none") =>
            {
                return None;
            }
            // A single message or tick has no effect in the long run, and the newest
            // message is read from a queue of any depth.
            Knob::Lose { .. } | Knob::Postpone { .. } | Knob::Hang { .. } => {}
            Knob::Depth { .. } | Knob::Read { .. } | Knob::Parameter { .. } => {}
            _ => return None,
        }
        Some(())
    }

    fn link(&mut self, topic: &str, link: &Link) -> Option<()> {
        let delay = bounds(&link.delay)?;
        let lossless = link.loss == 0.0 && link.burst.is_none();
        match topic {
            CHUNK if lossless && self.chunks.is_some() => {
                (self.timing.action_delay, self.spread[2]) = delay;
            }
            ACTION if self.chunks.is_some() => return None,
            ACTION if lossless || (link.burst.is_none() && link.reliable.is_none()) => {
                (self.timing.action_delay, self.spread[2]) = delay;
                self.loss = link.loss;
            }
            OBS if lossless => (self.timing.obs_delay, self.spread[0]) = delay,
            _ => return None,
        }
        Some(())
    }

    fn expected(&self) -> Result<Expected, StabilityError> {
        if let Some(chunks) = &self.chunks {
            return self.planned(chunks);
        }
        let gains = gains(&self.policy, self.timing.policy.hz)?;
        let control = Loop::cart_pole(gains, self.world, self.timing)?;
        let changes = self.spread.iter().any(|spread| !spread.is_zero());
        match (changes, self.lost()?) {
            (false, None) => Ok(Expected::Growth(control.stability()?.growth())),
            (false, Some(loss)) => {
                let growth = control.mean_square_growth(loss)? / 2.0;
                Ok(Expected::MeanSquare(growth))
            }
            (true, None) => {
                let margin = control.jitter_margin()?;
                let oldest = self.oldest();
                Ok(Expected::Any(
                    margin.is_some_and(|margin| oldest <= margin.oldest),
                ))
            }
            (true, Some(_)) => Err(StabilityError::Knob("loss beside random delays".to_owned())),
        }
    }

    /// Returns what is expected of chunks that are played by time, the newest one.
    fn planned(&self, chunks: &CartChunks) -> Result<Expected, StabilityError> {
        let (usual, settings) = (Cadence::new(actuator_hz()), &chunks.settings);
        let known = [
            (self.timing.sensor == usual, "another sensor"),
            (self.timing.actuator == Some(usual), "another actuator"),
            (self.spread.iter().all(Duration::is_zero), "a random delay"),
            (self.stale == OnStale::Hold, "a stale action"),
            (settings.play == PlayKind::Time, "another play"),
            (settings.merge == Merge::Newest, "a merge"),
            (settings.refill.is_none(), "a request"),
        ];
        if let Some((_, what)) = known.iter().find(|(known, _)| !known) {
            return Err(StabilityError::Knob(format!("{what} of chunks")));
        }
        let control = Loop::cart_pole(gains(&self.policy, usual.hz)?, self.world, self.timing)?;
        Ok(Expected::Planned(
            control.planned(chunks, self.disturbance / MOTOR_N)?,
        ))
    }

    /// Returns the random loss, and the action after a loss.
    fn lost(&self) -> Result<Option<Loss>, StabilityError> {
        let lost = match self.stale {
            OnStale::Hold => Lost::Hold,
            OnStale::Zero(limit) if self.applies_once(limit) => Lost::Zero,
            OnStale::Zero(_) => {
                let knob = format!("send {ACTUATOR} {}", self.stale);
                return Err(StabilityError::Knob(knob));
            }
        };
        let probability = self.loss;
        Ok((probability > 0.0).then_some(Loss { probability, lost }))
    }

    /// Returns whether each action is applied once, immediately or never, where actions older than
    /// `limit` are not applied.
    fn applies_once(&self, limit: Duration) -> bool {
        let (timing, period) = (&self.timing, self.timing.policy.hz.period());
        let slow = timing
            .actuator
            .is_some_and(|actuator| actuator.hz.period() >= period);
        slow && limit < period && timing.constant().is_zero()
    }

    /// Returns the maximum age of an action in force: its delays and waits until it is applied, the
    /// time it is held, and one step of a world that is not continuous.
    fn oldest(&self) -> Duration {
        let timing = &self.timing;
        let spread: Duration = self.spread.iter().sum();
        let longest = timing.policy_takes + self.spread[1];
        let period = timing.policy.hz.period();
        let held = if longest <= period {
            period
        } else {
            // Ticks due meanwhile are skipped.
            longest + period
        };
        let at_once =
            timing.sensor == timing.policy && timing.obs_delay + self.spread[0] == Duration::ZERO;
        let for_policy = if at_once {
            Duration::ZERO
        } else {
            timing.sensor.hz.period()
        };
        let for_actuator = timing
            .actuator
            .map_or(Duration::ZERO, |actuator| actuator.hz.period());
        let step = match self.world {
            WorldModel::Own(step) => step,
            WorldModel::Course | WorldModel::Continuous => Duration::ZERO, // A tick of the actuator.
        };
        timing.constant() + spread + for_policy + for_actuator + held + step
    }
}
