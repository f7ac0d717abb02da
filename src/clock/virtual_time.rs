//! Discrete-event time: one thread, bit-for-bit reproducible.

use thiserror::Error;

use super::{Clock, ClockExit, note_end, obey::obey_at_rest, wall::Pacer};
use crate::{
    control::{
        command::{ClockKind, Command},
        inbox::{Inbox, Wait},
    },
    graph::Graph,
    journal::AfterEnd,
    node::{Fault, Flow, JobKind, WorkTimes},
    scheduling::Assignment,
    sync::{Instant, get_mut},
    time::{Time, TimeError},
};

/// Runs all nodes on the calling thread, in the order of their due times.
///
/// Virtual time jumps from one instant to the next, at the set
/// [`Speed`](crate::Speed), and stands still while the graph is paused. Speed
/// and pauses leave the results unchanged: the same graph with the same commands at the
/// same run times is the same run, bit for bit.
///
/// A command that changes the graph takes effect between two instants. When an instant is
/// only partly done, the rest of it runs first. Single steps can leave a partly done
/// instant; so can the real clock, whose late nodes all tick at the run time of the
/// handover.
///
/// ```
/// use ratelab::{Clock, ClockExit, Graph, Hz, Inbox, Tick, Time, VirtualClock};
///
/// let mut graph = Graph::new();
/// graph.node("slow", Hz::new(10.0)?, 0, |_| |_: &mut Tick| {})?;
/// graph.node("fast", Hz::new(1_000.0)?, 1, |_| |_: &mut Tick| {})?;
/// // An hour of run time, in a moment, to its end: an instant is part of the run.
/// let hour = Time::from_secs_f64(3600.0)?;
/// let exit = VirtualClock.run(&mut graph, &mut Inbox::default(), hour)?;
/// assert_eq!((exit, graph.now()), (ClockExit::Completed, hour));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct VirtualClock;

impl Clock for VirtualClock {
    fn run(
        &mut self,
        graph: &mut Graph,
        inbox: &mut Inbox,
        until: Time,
    ) -> Result<ClockExit, Fault> {
        graph.set_clock(ClockKind::Virtual);
        let end = VirtualStretch::new(graph, inbox, until).run();
        note_end(graph, &end);
        end
    }
}

impl Graph {
    /// Begins all task sets at run time `now`.
    fn open(&mut self, now: Time) {
        let arrivals = if self.schedule.is_behind() {
            self.in_flight(now)
        } else {
            let mut published = self.arrivals.take();
            published.retain(|arrival| arrival.at >= now);
            published
        };
        self.schedule.open(now, arrivals);
    }

    /// Plans the arrivals of the messages that were published since the last look.
    #[inline]
    fn plan_arrivals(&mut self) {
        self.schedule.add_arrivals(self.arrivals.take());
    }

    /// Runs the graph in virtual time, as fast as it can, until the run time `end` (s): no duration,
    /// a second run goes on where the first one ended.
    ///
    /// # Errors
    /// [`RunError`] for a number that is not a run time or is over, and if a node failed.
    pub fn run_virtual(&mut self, end: f64) -> Result<ClockExit, RunError> {
        let (end, now) = (Time::from_secs_f64(end)?, self.now());
        if end < now {
            return Err(RunError::Past { end, now });
        }
        Ok(VirtualClock.run(self, &mut Inbox::default(), end)?)
    }
}

/// Why a run did not come to its end.
#[derive(Debug, Error)]
pub enum RunError {
    /// A number of seconds that is not a run time.
    #[error(transparent)]
    Time(#[from] TimeError),
    /// An end that is over.
    #[error("the run is at {now}, after {end}: give it a later end, counted from its start")]
    Past {
        /// The run time at which it was to end.
        end: Time,
        /// The run time that it has reached.
        now: Time,
    },
    /// A node failed.
    #[error(transparent)]
    Fault(#[from] Fault),
}

/// One stretch of virtual time.
///
/// | so far | [`mid_instant`](Self::mid_instant) | [`is_over`](Self::is_over) | what comes next |
/// |---|---|---|---|
/// | nothing has happened | no | no | commands, then the first instant |
/// | some events of an instant | yes | no | its other events |
/// | all events of an instant | no | no | commands, then the next one |
/// | all events of the last instant | no | yes | the end: a command would take effect after it |
struct VirtualStretch<'a> {
    graph: &'a mut Graph,
    inbox: &'a mut Inbox,
    until: Time,
    pacer: Pacer,
    /// The instant of the last event, if there was one.
    last_event: Option<Time>,
    /// Requested single ticks that are still to run.
    steps: u32,
}

/// What to do next.
enum NextStep {
    Obey(Command),
    Proceed,
    Stop,
}

impl<'a> VirtualStretch<'a> {
    fn new(graph: &'a mut Graph, inbox: &'a mut Inbox, until: Time) -> Self {
        let now = graph.now();
        let states = || graph.schedule.states(now);
        let is_late = states().any(|task| task.due < now && task.has_own_timer);
        let last_due = states().filter_map(|task| task.last_due).max();
        // Late nodes tick now, so this instant is partly done.
        let last_event = if is_late { Some(now) } else { last_due };
        graph.open(now);
        Self {
            pacer: Pacer::new(graph.control.status.speed, now),
            last_event: last_event.map(|last| last.min(now)),
            graph,
            inbox,
            until,
            steps: 0,
        }
    }

    fn run(mut self) -> Result<ClockExit, Fault> {
        loop {
            let exit = match self.next_step() {
                NextStep::Obey(command) => self.receive(command)?,
                NextStep::Proceed => self.proceed()?,
                NextStep::Stop => Some(ClockExit::Stopped),
            };
            if let Some(exit) = exit {
                return Ok(exit);
            }
        }
    }

    /// Waits until the next event is due or a command arrives.
    fn next_step(&mut self) -> NextStep {
        if self.is_over() {
            return NextStep::Proceed;
        }
        let wait = if self.graph.control.status.paused {
            if self.steps > 0 {
                Wait::None
            } else {
                Wait::Forever
            }
        } else if self.mid_instant() {
            return NextStep::Proceed;
        } else {
            let next = self.next_event();
            self.pacer.wait_for(next).map_or(Wait::None, Wait::Until)
        };
        match self.inbox.receive(wait) {
            Some(command) => NextStep::Obey(command),
            // All senders are gone, so nothing can end the pause.
            None if matches!(wait, Wait::Forever) => NextStep::Stop,
            None => NextStep::Proceed,
        }
    }

    /// Returns whether something is left of the instant of the last event.
    fn mid_instant(&self) -> bool {
        let next = self.graph.schedule.next_at();
        next <= self.until && self.last_event.is_some_and(|last| next <= last)
    }

    /// Returns whether the last instant has run. A command that arrives now would take effect
    /// after the end, which a replay does not reach.
    fn is_over(&self) -> bool {
        self.last_event.is_some_and(|last| last >= self.until) && !self.mid_instant()
    }

    /// Returns the time of the next event or timed command, or the end.
    fn next_event(&self) -> Time {
        let next = self.graph.schedule.next_at();
        next.min(self.inbox.next_timed(self.until)).min(self.until)
    }

    /// Carries out a live command.
    fn receive(&mut self, command: Command) -> Result<Option<ClockExit>, Fault> {
        if command.changes_graph() {
            while self.mid_instant() {
                if let Some(exit) = self.advance()? {
                    return Ok(Some(exit));
                }
            }
        }
        let at = self.moment();
        Ok(self.obey(&command, at))
    }

    /// Returns the run time now: after all past events, before all later ones. Within an instant
    /// it is that instant, because its other nodes tick at it too.
    fn moment(&self) -> Time {
        let now = self.graph.now();
        if self.mid_instant() {
            return now;
        }
        let done = self
            .last_event
            .map_or(Time::ZERO, |last| last + Time::RESOLUTION);
        let earliest = now.max(done);
        match self.pacer.now() {
            Some(paced) if !self.graph.control.status.paused => {
                paced.min(self.next_event()).max(earliest)
            }
            _ => earliest,
        }
    }

    fn obey(&mut self, command: &Command, at: Time) -> Option<ClockExit> {
        self.graph.control.state.set_now(at);
        if *command == Command::Step {
            self.graph.control.update(|status| status.paused = true);
            self.steps += 1;
        }
        let exit = obey_at_rest(self.graph, command, at).exit;
        // A node may have published as it obeyed.
        self.graph.plan_arrivals();
        if let Command::Speed(_) | Command::Resume = command {
            self.pacer = Pacer::new(self.graph.control.status.speed, at);
        }
        exit
    }

    /// Processes the next event: a timed command, a tick, or the end.
    fn proceed(&mut self) -> Result<Option<ClockExit>, Fault> {
        let next = self.graph.schedule.next_at();
        // The real clock may have handed over after the end: no command takes effect there.
        if self.inbox.next_timed(self.until) <= next
            && !self.mid_instant()
            && self.graph.now() <= self.until
            && let Some(timed) = self.inbox.take_timed(self.until)
        {
            let at = timed.at.max(self.graph.now());
            return Ok(self.obey(&timed.command, at));
        }
        if next > self.until || next == Time::MAX {
            self.graph.control.state.set_now(self.until);
            return Ok(Some(ClockExit::Completed));
        }
        self.advance()
    }

    /// Moves on to the next instant with an event, unless something is left of this one, and
    /// does its work: during a pause only the next tick.
    fn advance(&mut self) -> Result<Option<ClockExit>, Fault> {
        // A node that is late from the real clock must not turn time back.
        let now = self.graph.schedule.next_at().max(self.graph.now());
        self.last_event = Some(now);
        self.graph.control.state.set_now(now);
        let (until, over) = (self.until, false);
        let after = (now > until).then_some(AfterEnd { until, over });
        while let Some(work) = self.graph.schedule.next_job(now, after) {
            let outcome = self.work(work, now);
            self.graph.plan_arrivals();
            if outcome? == Flow::End {
                let node = self.graph.control.name(work.node).to_owned();
                return Ok(Some(ClockExit::Ended { node, at: now }));
            }
            if self.graph.control.status.paused {
                break;
            }
        }
        Ok(None)
    }

    /// Does the work of a node.
    #[inline]
    fn work(&mut self, work: Assignment, now: Time) -> Result<Flow, Fault> {
        let Graph {
            slots,
            schedule,
            control,
            ..
        } = &mut *self.graph;
        let (slot, job) = (get_mut(&mut slots[work.node]), work.job);
        if job.kind != JobKind::End {
            self.steps = self.steps.saturating_sub(1);
        }
        let measured = self.pacer.is_paced().then(Instant::now);
        let outcome = slot.work(job, now, false);
        let times = WorkTimes {
            began: now,
            ended: now,
            missed_before: now,
            took: measured.map(|began| began.elapsed()),
        };
        schedule.done(slot, work, times, outcome, &control.state)
    }
}
