//! A node on its own, at a rate.

use super::{
    agenda::Phase,
    kit::{Kit, TaskSpec},
    scheduler::{Scheduler, SchedulerEvent, TaskState, Timetable},
};
use crate::{
    control::{
        command::ClockKind,
        knob::{Knob, KnobKind},
    },
    node::{Job, JobKind},
    time::Time,
    topic::Channel,
};

/// Runs a node at a rate as soon as it is due; what is due while it is busy is skipped.
pub struct Periodic {
    spec: TaskSpec,
    crashed: bool,
}

impl Periodic {
    /// The scheduler of a node.
    pub fn new(spec: TaskSpec) -> Self {
        let crashed = false;
        Self { spec, crashed }
    }

    /// The node, for another scheduler.
    pub fn into_spec(self) -> TaskSpec {
        self.spec
    }

    #[inline]
    fn arm(&self, timetable: &mut Timetable<'_>) {
        if !self.crashed {
            timetable.alarm(self.spec.rate.due(), Phase::Start, 0);
        }
    }

    #[inline]
    fn skip_before(&mut self, time: Time, timetable: &Timetable<'_>) {
        if self.spec.rate.due() < time {
            timetable.skipped(0, self.spec.rate.advance_past(time) + 1);
        }
    }
}

impl Scheduler for Periodic {
    #[inline]
    fn on(&mut self, event: SchedulerEvent, timetable: &mut Timetable<'_>) -> Option<Job> {
        let now = timetable.now();
        match event {
            SchedulerEvent::Alarm { .. } if !self.crashed && self.spec.rate.due() <= now => {
                let lateness = match timetable.clock() {
                    ClockKind::Virtual => None,
                    ClockKind::Real => Some(now.since(self.spec.rate.due())),
                };
                self.spec.rate.advance();
                let kind = JobKind::Tick { is_instant: false };
                return Some(Job::new(0, kind).late(lateness));
            }
            SchedulerEvent::Done { missed_before, .. } => {
                self.skip_before(missed_before, timetable);
                self.arm(timetable);
            }
            SchedulerEvent::Opened { .. } => self.arm(timetable),
            SchedulerEvent::Crashed { .. } => self.crashed = true,
            SchedulerEvent::Restarted { .. } => {
                self.spec.rate.resume(now);
                self.crashed = false;
                self.arm(timetable);
            }
            SchedulerEvent::Alarm { .. } | SchedulerEvent::Arrived { .. } => {}
            SchedulerEvent::Choose | SchedulerEvent::Closed { .. } => {}
        }
        None
    }

    fn state(&self, _: usize, _: Time) -> TaskState {
        TaskState {
            hz: self.spec.rate.hz(),
            due: if self.crashed {
                Time::MAX
            } else {
                self.spec.rate.due()
            },
            last_due: self.spec.rate.last_due(),
            skips: true,
            crashed: self.crashed,
            remaining: None,
            deadline: None,
            busy: false,
        }
    }

    fn check(&self, _: usize, knob: &Knob) -> Result<(), String> {
        match knob.kind() {
            KnobKind::Rate => Ok(()),
            _ => Err(knob.not_in_kit()),
        }
    }

    fn set(
        &mut self,
        _: usize,
        knob: &Knob,
        timetable: &mut Timetable<'_>,
    ) -> Result<String, String> {
        let Knob::Rate { hz, .. } = knob else {
            return Err(format!("{knob} is not for a node at a rate"));
        };
        let before = self.spec.rate.hz();
        self.spec.rate.set_hz(*hz, timetable.now());
        timetable.rated(0, *hz);
        self.arm(timetable);
        Ok(before.to_string())
    }
}

/// Nodes tick at their rates.
pub(crate) struct Plain;

impl Kit for Plain {
    fn scheduler(&self, spec: TaskSpec) -> Box<dyn Scheduler> {
        Box::new(Periodic::new(spec))
    }

    fn channel(&self, _: &str, _: u64) -> Option<Box<dyn Channel>> {
        None
    }
}
