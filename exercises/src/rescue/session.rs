//! A rescue by hand: the next step while it runs, and its judgement from the recording.

use std::{path::Path, time::Duration};

use ratelab::{Event, Message, Time, TimedKnob};
use ratelab_cart_pole::{BROKEN_HZ, CartPole, ControlStep, POLICY, STATE, actuator_hz, verdict};
use ratelab_metrics::Rows;
use ratelab_recording::{ReadError, Recording};
use ratelab_system::Verdict;

use super::judge::{
    DANGER_DEG, HELD, RescueFailure, RescueSession, Rescued, control_rates, is_safe, judge,
};

/// Number of the exercise with a rescue by hand.
pub const RESCUE: u32 = 5;

/// The commands of the rescue included with ratelab, `recordings/rescued.rrd`.
const SHIPPED: &str = include_str!("../../../recordings/rescue.knobs");

/// Returns whether `recording` is the rescue included with ratelab, or one by the same commands at
/// nearly the same times: a copy in another file, a part of it and a repetition of it are all
/// recognized.
pub fn is_shipped(recording: &Recording) -> bool {
    let shipped = CartPole::KNOBS.parse_list(SHIPPED).unwrap_or_default();
    let commands: Vec<TimedKnob> = recording.events.iter().filter_map(Event::knob).collect();
    let given = |command: &TimedKnob| commands.iter().any(|given| is_near(command, given));
    let later: Vec<TimedKnob> = commands
        .iter()
        .filter(|command| command.at > Time::ZERO)
        .cloned()
        .collect();
    !shipped.is_empty() && (shipped.iter().all(given) || alike(&shipped, &later))
}

/// Two hands do not turn the same knobs this near to each other, twice.
const NEAR: Duration = Duration::from_millis(1);

/// Nor with the same time between two of them, to this precision.
const STEADY: Duration = Duration::from_micros(1);

/// Returns whether one list of commands is a copy of the other: the same knobs, at nearly the same
/// times or all later by the same time. A copy may be cut short. Lists without commands are the
/// same for everyone.
pub fn alike(one: &[TimedKnob], other: &[TimedKnob]) -> bool {
    let pairs = || one.iter().zip(other);
    let later = |(one, other): (&TimedKnob, &TimedKnob)| {
        i128::from(one.at.as_nanos()) - i128::from(other.at.as_nanos())
    };
    let Some(first) = pairs().next().map(later) else {
        return false;
    };
    let same = pairs().all(|(one, other)| one.knob == other.knob);
    if pairs().count() == 1 {
        return same && first == 0;
    }
    let shifted = pairs().all(|pair| later(pair).abs_diff(first) <= STEADY.as_nanos());
    same && (shifted || pairs().all(|(one, other)| is_near(one, other)))
}

fn is_near(one: &TimedKnob, other: &TimedKnob) -> bool {
    let apart = one.at.as_nanos().abs_diff(other.at.as_nanos());
    one.knob == other.knob && u128::from(apart) <= NEAR.as_nanos()
}

/// Judges the session in `file`; returns whether it is a rescue, with a text.
///
/// # Errors
/// [`ReadError`] if the file is not a recording.
pub fn judge_file(file: &Path) -> Result<(bool, String), ReadError> {
    let recording = Recording::read(file)?;
    Ok(accept(&recording))
}

/// Returns whether `recording` is a rescue of the learner's own, with a text.
pub fn accept(recording: &Recording) -> (bool, String) {
    match judge_recording(recording) {
        Ok(rescued) if is_shipped(recording) => (
            false,
            format!("comes with ratelab, record your own ({rescued})"),
        ),
        Ok(rescued) => (true, rescued.to_string()),
        Err(failure) => (false, format!("not a rescue yet: {failure}")),
    }
}

/// Judges the session in `recording`.
///
/// # Errors
/// [`RescueFailure`] if it is not a rescue.
pub fn judge_recording(recording: &Recording) -> Result<Rescued, RescueFailure> {
    let steps: Vec<Message<ControlStep>> = recording.messages(STATE);
    let system = CartPole::default();
    let verdict = match recording.result() {
        Some(result) => result.verdict.verdict(&system),
        None => Verdict::new(verdict::STOPPED, recording.until),
    };
    let control_hz = recording.origin.config.setup.rate(POLICY);
    judge(&RescueSession {
        control_hz: control_hz.unwrap_or(actuator_hz()),
        events: &recording.events,
        steps: &steps,
        verdict,
    })
}

/// A rescue by hand that is running.
#[derive(Debug, Default)]
pub struct RescueTry {
    steps: Vec<Message<ControlStep>>,
}

/// How far a rescue has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RescueStage {
    /// The policy is to be slowed.
    Begin,
    /// The policy is slow, and the pole is still safe.
    Lean,
    /// The policy was fast again before the pole was in danger.
    TooSoon,
    /// The pole came back by itself before the policy was fast again.
    ByItself,
    /// The pole is in danger, and the policy is slow.
    Danger,
    /// The policy is fast again, and the pole is to stay safe for this much longer.
    Hold(Duration),
    /// It is a rescue.
    Done,
    /// It cannot become a rescue any more.
    Over,
}

impl RescueTry {
    /// The pole is safe between these angles (degrees).
    pub const SAFE_DEG: [f64; 2] = [-DANGER_DEG, DANGER_DEG];

    /// Adds control steps, the messages of [`STATE`].
    pub fn add(&mut self, rows: &Rows) {
        let steps = (0..rows.len()).filter_map(|index| rows.message(index));
        self.steps.extend(steps);
    }

    /// Returns how far it has come, after `events`; `verdict` is that of a lost run.
    pub fn stage(&self, events: &[Event], verdict: Option<Verdict>) -> RescueStage {
        let now = self.steps.last().map_or(Time::ZERO, |step| step.stamp);
        let is_over = verdict.is_some();
        let session = RescueSession {
            control_hz: actuator_hz(),
            events,
            steps: &self.steps,
            verdict: verdict.unwrap_or_else(|| Verdict::new(verdict::STOPPED, now)),
        };
        let rates = control_rates(session.control_hz, events);
        let (since, hz) = rates.last().unwrap_or((Time::ZERO, session.control_hz));
        match judge(&session) {
            Ok(_) => RescueStage::Done,
            _ if is_over => RescueStage::Over,
            Err(RescueFailure::Slowness) => RescueStage::Begin,
            Err(RescueFailure::Danger { .. }) if hz.get() <= BROKEN_HZ => RescueStage::Lean,
            Err(RescueFailure::Danger { .. }) => RescueStage::TooSoon,
            Err(RescueFailure::Recovered { .. }) => RescueStage::ByItself,
            Err(RescueFailure::Return) => RescueStage::Danger,
            Err(RescueFailure::Calm { .. }) => {
                let held = now.since(self.last_danger().max(since));
                RescueStage::Hold(HELD.saturating_sub(held))
            }
            Err(RescueFailure::Survival { .. } | RescueFailure::Steps) => RescueStage::Over,
        }
    }

    /// Returns the run time at which the pole was last out of the safe range.
    fn last_danger(&self) -> Time {
        let last = self.steps.iter().rev().find(|step| !is_safe(step));
        last.map_or(Time::ZERO, |step| step.stamp)
    }
}

impl RescueStage {
    /// Returns whether there is a result to judge.
    pub fn is_over(self) -> bool {
        matches!(self, Self::Done | Self::Over)
    }

    /// Returns the next step, in a line.
    pub fn advice(self) -> String {
        match self {
            Self::Begin => format!("rescue: b slows the policy to {BROKEN_HZ} Hz"),
            Self::Lean => format!("rescue: wait until the pole is beyond ±{DANGER_DEG}°"),
            Self::TooSoon => format!("rescue: too soon, it stayed within ±{DANGER_DEG}°: b again"),
            Self::ByItself => "rescue: too late, it came back by itself: b again".to_owned(),
            Self::Danger => "rescue: now! ] ] ] brings 50 Hz back".to_owned(),
            Self::Hold(left) => format!(
                "rescue: it must stay within ±{DANGER_DEG}° for {:.1} s more",
                left.as_secs_f64()
            ),
            Self::Done => "rescued! e judges it".to_owned(),
            Self::Over => "no rescue: e says why, r tries again".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn commands(text: &str) -> Vec<TimedKnob> {
        CartPole::KNOBS
            .parse_list(&text.replace(", ", "\n"))
            .expect(text)
    }

    #[test]
    fn a_copy_of_commands_is_told_from_other_hands() {
        let one = commands("1 control-hz 5, 2 control-hz 25");
        for (other, copied) in [
            ("1 control-hz 5, 2 control-hz 25", true),
            ("1.000000004 control-hz 5, 1.999999996 control-hz 25", true),
            ("1.001 control-hz 5, 2.0009 control-hz 25", true),
            // All of it later, and cut short.
            ("1.3 control-hz 5, 2.3 control-hz 25", true),
            ("1 control-hz 5, 2 control-hz 25, 9 control-hz 50", true),
            ("1 control-hz 5", true),
            ("1.000000001 control-hz 5", false),
            ("1.0011 control-hz 5, 2.0009 control-hz 25", false),
            ("1.3 control-hz 5, 2.30001 control-hz 25", false),
            ("1 control-hz 5, 2 control-hz 20", false),
            ("1 control-hz 4, 2 control-hz 25", false),
        ] {
            assert_eq!(alike(&one, &commands(other)), copied, "{other}");
            assert_eq!(alike(&commands(other), &one), copied, "{other}");
        }
        assert!(!alike(&one, &[]) && !alike(&[], &[]));
    }
}
