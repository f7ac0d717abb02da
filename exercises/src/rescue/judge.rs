//! The judgement of a rescue, from the recording of a session.
//!
//! # The rule
//!
//! 1. **Slowed**: at some moment the policy's rate was 5 Hz or less, which no start
//!    survives. From there until the rate is above 5 Hz again is a *slow phase*.
//! 2. **In danger**: after the slow phase began, and no later than a second after it
//!    ended, the pole went from within 4° to beyond 4°. A run at 50 Hz stays within 3°, so
//!    the slow phase was the cause. If it went there during the slow phase, it still was beyond 4°
//!    when that ended: a pole that came back by itself needed no rescue.
//! 3. **Brought back**: the slow phase ended with a higher rate of the policy.
//! 4. **Held**: after both, the pole stayed within 4° for five consecutive seconds,
//!    before the next slow phase and with no control step missing from the record.
//!
//! Later events leave a rescue valid. If a session has several slow phases, one that was
//! survived is enough.

use std::{fmt, time::Duration};

use ratelab::{Event, Hz, Knob, Message, Time};
use ratelab_cart_pole::{BROKEN_HZ, ControlStep, POLICY};
use ratelab_system::Verdict;

use crate::framework::{angle_deg, widest_deg};

/// The pole is in danger beyond this angle from upright (degrees). In 200 runs at 50 Hz
/// it never reached 3°; beyond 12° it has fallen.
pub const DANGER_DEG: f64 = 4.0;

/// Time after a slow phase during which danger still counts as its effect.
const AFTERMATH: Duration = Duration::from_secs(1);

/// Time out of danger after which the pole counts as rescued.
pub const HELD: Duration = Duration::from_secs(5);

/// The data of a recorded session.
#[derive(Clone, Debug)]
pub struct RescueSession<'a> {
    /// The policy's initial rate, from the run's configuration.
    pub control_hz: Hz,
    /// Commands that took effect, in order.
    pub events: &'a [Event],
    /// Control steps, in order.
    pub steps: &'a [Message<ControlStep>],
    /// Verdict on the run.
    pub verdict: Verdict,
}

/// A successful rescue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rescued {
    /// Run time at which the policy was slowed.
    pub slowed: Time,
    /// Duration of the slow phase.
    pub slow_phase: Duration,
    /// The largest angle of the pole (degrees).
    pub worst_deg: f64,
    /// Run time at which the pole was last beyond [`DANGER_DEG`].
    pub safe: Time,
}

/// Why a session is not a rescue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RescueFailure {
    /// The policy was not slow enough.
    Slowness,
    /// The pole never left the safe range because of it.
    Danger {
        /// The largest angle of the pole (degrees).
        worst_deg: f64,
    },
    /// The pole came back by itself, before the policy was fast again.
    Recovered {
        /// The largest angle of the pole from then on (degrees).
        then_deg: f64,
    },
    /// The policy stayed slow.
    Return,
    /// The pole fell.
    Survival {
        /// Run time of the fall.
        at: Time,
    },
    /// The session ended too soon, or the pole did not calm down.
    Calm {
        /// The longest continuous time out of danger.
        held: Duration,
    },
    /// Control steps are missing from the record.
    Steps,
}

/// Judges a session: returns its first rescue, or the reason why the last attempt is
/// none.
///
/// # Errors
/// [`RescueFailure`] with the part of [the rule](self) that is not fulfilled.
pub fn judge(session: &RescueSession<'_>) -> Result<Rescued, RescueFailure> {
    let slow_phases = slow_phases(session);
    let mut verdict = Err(RescueFailure::Slowness);
    for (index, slow_phase) in slow_phases.iter().enumerate() {
        let next = slow_phases
            .get(index + 1)
            .map_or(Time::MAX, |next| next.from);
        verdict = Attempt::new(session, *slow_phase, next).judge();
        if verdict.is_ok() {
            break;
        }
    }
    verdict
}

/// A time with a policy that is too slow; without an end if it stays so.
#[derive(Clone, Copy)]
struct SlowPhase {
    from: Time,
    until: Option<Time>,
}

fn slow_phases(session: &RescueSession<'_>) -> Vec<SlowPhase> {
    let mut slow_phases: Vec<SlowPhase> = Vec::new();
    for (at, hz) in control_rates(session.control_hz, session.events) {
        let open = slow_phases
            .last_mut()
            .filter(|slow_phase| slow_phase.until.is_none());
        match (open, hz.get() <= BROKEN_HZ) {
            (None, true) => slow_phases.push(SlowPhase {
                from: at,
                until: None,
            }),
            (Some(slow_phase), false) => slow_phase.until = Some(at),
            (Some(_), true) | (None, false) => {}
        }
    }
    slow_phases
}

/// Returns the rates of the policy, each with the run time from which it is in force: `first`, and
/// the rates that `events` brought.
pub(super) fn control_rates(first: Hz, events: &[Event]) -> impl Iterator<Item = (Time, Hz)> {
    let changes = events
        .iter()
        .filter_map(Event::knob)
        .filter_map(|timed| match timed.knob {
            Knob::Rate { node, hz } if node == POLICY => Some((timed.at, hz)),
            _ => None,
        });
    std::iter::once((Time::ZERO, first)).chain(changes)
}

/// One slow phase and the time after it, up to the next.
struct Attempt<'a> {
    slow_phase: SlowPhase,
    steps: &'a [Message<ControlStep>],
    /// Run time of the fall, if the pole fell in this attempt.
    fell: Option<Time>,
}

impl<'a> Attempt<'a> {
    fn new(session: &RescueSession<'a>, slow_phase: SlowPhase, next: Time) -> Self {
        let first = session
            .steps
            .partition_point(|step| step.stamp < slow_phase.from);
        let last = session.steps.partition_point(|step| step.stamp < next);
        let Verdict { kind, at } = &session.verdict;
        Self {
            slow_phase,
            steps: session.steps.get(first..last).unwrap_or_default(),
            fell: (kind.lost && *at < next).then_some(*at),
        }
    }

    fn judge(&self) -> Result<Rescued, RescueFailure> {
        let worst_deg = widest_deg(self.steps);
        let danger = self.danger().ok_or(RescueFailure::Danger { worst_deg })?;
        let back = self
            .slow_phase
            .until
            .ok_or(self.fell_or(RescueFailure::Return))?;
        let then = self.from(back);
        let is_back = then.first().is_none_or(is_safe);
        if danger < back && is_back {
            let then_deg = widest_deg(then);
            return Err(self.fell_or(RescueFailure::Recovered { then_deg }));
        }
        if !self.is_gapless() {
            return Err(RescueFailure::Steps);
        }
        let safe = self.held_since(danger.max(back))?;
        let before = self.steps.iter().filter(|step| step.stamp <= safe);
        Ok(Rescued {
            slowed: self.slow_phase.from,
            slow_phase: back.since(self.slow_phase.from),
            worst_deg: widest_deg(before),
            safe,
        })
    }

    /// Returns the first transition of the pole from safety into danger.
    fn danger(&self) -> Option<Time> {
        let latest = self
            .slow_phase
            .until
            .map_or(Time::MAX, |until| until + AFTERMATH);
        let crossing = self
            .steps
            .windows(2)
            .find(|pair| is_safe(&pair[0]) && !is_safe(&pair[1]))?;
        Some(crossing[1].stamp).filter(|at| *at <= latest)
    }

    /// Returns the steps from the last one before `back` on.
    fn from(&self, back: Time) -> &'a [Message<ControlStep>] {
        let later = self.steps.partition_point(|step| step.stamp < back);
        self.steps
            .get(later.saturating_sub(1)..)
            .unwrap_or_default()
    }

    fn is_gapless(&self) -> bool {
        self.steps
            .windows(2)
            .all(|pair| pair[1].data.step == pair[0].data.step + 1)
    }

    /// Returns the first moment after `from` with the required time out of danger after it.
    fn held_since(&self, from: Time) -> Result<Time, RescueFailure> {
        let mut longest = Duration::ZERO;
        let mut since = from;
        for step in self.steps.iter().filter(|step| step.stamp >= from) {
            if !is_safe(step) {
                since = step.stamp;
            }
            longest = longest.max(step.stamp.since(since));
            if longest >= HELD {
                return Ok(since);
            }
        }
        Err(self.fell_or(RescueFailure::Calm { held: longest }))
    }

    /// Returns the fall of the pole, or else `failure`.
    fn fell_or(&self, failure: RescueFailure) -> RescueFailure {
        self.fell
            .map(|at| RescueFailure::Survival { at })
            .unwrap_or(failure)
    }
}

/// Returns whether the pole is out of danger.
pub(super) fn is_safe(step: &Message<ControlStep>) -> bool {
    angle_deg(step) <= DANGER_DEG
}

impl fmt::Display for Rescued {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "rescued: slowed at {} for {:.2} s, as far as {:.1}°, out of danger since {}",
            self.slowed,
            self.slow_phase.as_secs_f64(),
            self.worst_deg,
            self.safe,
        )
    }
}

impl fmt::Display for RescueFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Slowness => write!(f, "the policy was never slowed to {BROKEN_HZ} Hz or less"),
            Self::Danger { worst_deg } => write!(
                f,
                "the pole reached {worst_deg:.1}° and must go from within {DANGER_DEG}° to \
                 beyond: leave the policy slow for longer"
            ),
            Self::Recovered { then_deg } => write!(
                f,
                "the pole had come back within {DANGER_DEG}° by itself when the rate went up, and \
                 its widest angle from then on was {then_deg:.1}°: raise the rate while it is beyond"
            ),
            Self::Return => f.write_str("the policy was left slow: speed it up before it is late"),
            Self::Survival { at } => write!(f, "it fell at {at}: speed the policy up sooner"),
            Self::Calm { held } => write!(
                f,
                "the pole was out of danger for {:.1} s without a break: {} s are required",
                held.as_secs_f64(),
                HELD.as_secs(),
            ),
            Self::Steps => f.write_str("plant steps are missing from the record: try it again"),
        }
    }
}
