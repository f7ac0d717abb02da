//! What each control step came to, as lines over time.

use std::{collections::VecDeque, ops::Range, time::Duration};

use ratelab::{
    cartpole::{ControlStep, POLE_LIMIT_RAD, POLICY, Pose},
    runtime::{
        Command, Knob, Message, Time,
        telemetry::{Event, EventKind},
    },
};
use rerun::{RecordingStream, RecordingStreamResult};

use super::{
    lines::{self, Line},
    palette::{BLUE, ORANGE},
};
use crate::recording::timeline::Stamps;

/// All of them.
pub const STEPS: &str = "plot/steps";

/// Pole angle and the limits of a fall (°).
pub const POLE: Range<usize> = 0..3;

/// Cart position (m), and the share of the motor's force that was applied.
pub const CART: Range<usize> = 3..5;

/// Sense→act latency and control period (ms).
pub const LATENCY: Range<usize> = 5..LINES;

/// How many lines there are.
pub const LINES: usize = 7;

/// Names and looks.
pub fn begin(rec: &RecordingStream) -> RecordingStreamResult<()> {
    let limit = POLE_LIMIT_RAD.to_degrees();
    let lines: [Line; LINES] = [
        Line::new("pole angle (°)", BLUE, 2.0),
        Line::new(format!("fall limit +{limit:.0}°"), ORANGE, 1.0),
        Line::new(format!("fall limit −{limit:.0}°"), ORANGE, 1.0),
        Line::new("cart position (m)", BLUE, 2.0),
        Line::new("action (share of 10 N)", ORANGE, 1.0),
        Line::new("sense→act latency (ms)", BLUE, 1.0),
        Line::new("control period (ms)", ORANGE, 2.0),
    ];
    lines::begin(rec, STEPS, &lines)
}

/// What `steps` came to, beside the control period that was in force.
pub fn add(
    rec: &RecordingStream,
    stamps: &Stamps,
    steps: &[Message<ControlStep>],
    period: &mut ControlPeriod,
) -> RecordingStreamResult<()> {
    let rows = steps
        .iter()
        .flat_map(|step| row(&step.data, period.at(step.stamp)));
    lines::send(rec, STEPS, stamps, rows, LINES)
}

fn row(step: &ControlStep, period: Duration) -> [f64; LINES] {
    let limit = POLE_LIMIT_RAD.to_degrees();
    [
        Pose::of(step.qpos).pole_angle.to_degrees(),
        limit,
        -limit,
        step.qpos[0],
        f64::from(step.action.0),
        // A gap where there was no action yet.
        step.latency.map_or(f64::NAN, ms),
        ms(period),
    ]
}

fn ms(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

/// The control period in force, as events change it.
pub struct ControlPeriod {
    now: Duration,
    /// Changes not reached yet, earliest first.
    ahead: VecDeque<(Time, Duration)>,
}

impl ControlPeriod {
    /// The period to begin with.
    pub fn new(first: Duration) -> Self {
        Self {
            now: first,
            ahead: VecDeque::new(),
        }
    }

    /// Learns of the changes among `events`.
    pub fn learn(&mut self, events: &[Event]) {
        self.ahead.extend(events.iter().filter_map(change));
    }

    /// The period for a tick at `time`, which is not before the last one asked
    /// for. A change takes effect before any tick that is due with it.
    pub fn at(&mut self, time: Time) -> Duration {
        while let Some(&(at, period)) = self.ahead.front()
            && at <= time
        {
            self.now = period;
            self.ahead.pop_front();
        }
        self.now
    }
}

fn change(event: &Event) -> Option<(Time, Duration)> {
    match &event.what {
        EventKind::Applied {
            command: Command::Set(Knob::Rate { node, hz }),
            ..
        } if node == POLICY => Some((event.at, hz.period())),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use ratelab::{
        cartpole::{POLICY, SENSOR},
        runtime::{
            Command, Hz, Time,
            telemetry::{Event, EventKind},
        },
    };

    use super::ControlPeriod;

    fn ms(ms: u64) -> Time {
        Time::from_nanos(ms * 1_000_000)
    }

    fn turned(at: Time, node: &str, hz: f64) -> Event {
        let command = Command::Set(Knob::Rate {
            node: node.to_owned(),
            hz: Hz::new(hz).expect("a rate"),
        });
        let was = None;
        let what = EventKind::Applied { command, was };
        Event { at, what }
    }

    #[test]
    fn the_period_steps_with_the_first_tick_that_is_due_then() {
        let mut period = ControlPeriod::new(Duration::from_millis(20));
        period.learn(&[
            turned(ms(20), SENSOR, 100.0),
            turned(ms(40), POLICY, 10.0),
            turned(ms(45), POLICY, 5.0),
        ]);
        let seen = [0, 20, 40, 60, 80].map(|at| period.at(ms(at)).as_millis());
        assert_eq!(seen, [20, 20, 100, 200, 200]);
    }
}
