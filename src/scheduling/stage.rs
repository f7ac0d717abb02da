//! What happens to the nodes of some crews next, whatever the clock.

use std::{collections::BTreeSet, mem::take, time::Duration};

use super::{
    agenda::{Agenda, AgendaItem, Phase},
    crew::Crew,
    dispatch::Dispatch,
    job::{Job, JobKind},
    member::Member,
    scheduler::{Scheduler, SchedulerEvent, TaskState, Timetable},
    seat::Seat,
};
use crate::{
    command::ClockKind,
    journal::LateLook,
    knob::Knob,
    node::Tick,
    record::NodeRecord,
    sync::Arc,
    time::Time,
    trigger::{Arrival, Arrivals, Wake},
};

/// Crews with their alarms: all of a graph in virtual time, one under the real clock. It decides
/// what is to be done; whoever asks does it.
pub(crate) struct Stage {
    crews: Vec<Crew>,
    /// Index of its first node.
    first: usize,
    /// The crew of each node from that one on, and its number there; without a meaning for a
    /// node that is not here.
    of: Vec<(usize, usize)>,
    agenda: Agenda,
    arrivals: Arc<Arrivals>,
    /// Crews that look for something to do when all else of the instant has happened.
    looking: BTreeSet<usize>,
    /// The run time of their last event.
    noticed: Time,
    clock: ClockKind,
    /// Whether the nodes have run elsewhere since it was opened.
    behind: bool,
    /// Whether something has happened since [`Stage::has_moved`].
    moved: bool,
}

/// A moment of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    /// Run time.
    pub(crate) now: Time,
    /// The end of the run: later events do not happen.
    pub(crate) until: Time,
    /// Whether the end has passed, so that only those nodes tick that were due before.
    pub(crate) over: bool,
}

impl Moment {
    /// Run time `now`, perhaps after the end of the run.
    pub(crate) fn of(now: Time, late: Option<LateLook>) -> Self {
        Self {
            now,
            until: late.map_or(Time::MAX, |late| late.until),
            over: late.is_some_and(|late| late.over),
        }
    }
}

/// A job for a node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Assignment {
    pub(crate) crew: usize,
    /// Index of the node.
    pub(crate) node: usize,
    pub(crate) job: Job,
}

/// When a job was done.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WorkTimes {
    /// Run time of its begin and its end.
    pub(crate) began: Time,
    pub(crate) ended: Time,
    /// Due times before this have passed.
    pub(crate) passed: Time,
    /// Its duration, if that was measured.
    pub(crate) took: Option<Duration>,
}

impl Default for Stage {
    fn default() -> Self {
        Self::new(ClockKind::Virtual)
    }
}

/// Its crews.
impl Stage {
    /// A stage without crews.
    pub(crate) fn new(clock: ClockKind) -> Self {
        Self {
            crews: Vec::new(),
            first: 0,
            of: Vec::new(),
            agenda: Agenda::default(),
            arrivals: Arc::default(),
            looking: BTreeSet::new(),
            noticed: Time::ZERO,
            clock,
            behind: true,
            moved: false,
        }
    }

    /// A stage for one crew.
    pub(crate) fn of_crew(clock: ClockKind, crew: Crew) -> Self {
        let mut stage = Self::new(clock);
        stage.set_crews(vec![crew]);
        stage
    }

    pub(crate) fn crews(&self) -> &[Crew] {
        &self.crews
    }

    /// Takes the crews away.
    pub(crate) fn take_crews(&mut self) -> Vec<Crew> {
        take(&mut self.crews)
    }

    /// Sets the crews.
    pub(crate) fn set_crews(&mut self, crews: Vec<Crew>) {
        self.crews = crews;
        let nodes = || self.members().map(|member| member.node);
        let (first, last) = (nodes().min().unwrap_or(0), nodes().max());
        let count = last.map_or(0, |last| last + 1 - first);
        (self.first, self.of) = (first, vec![(0, 0); count]);
        for (number, crew) in self.crews.iter().enumerate() {
            for (member, known) in crew.members.iter().enumerate() {
                self.of[known.node - first] = (number, member);
            }
        }
    }

    /// Its nodes.
    pub(crate) fn members(&self) -> impl Iterator<Item = &Member> {
        self.crews.iter().flat_map(|crew| &crew.members)
    }

    /// Adds the crew of a node that is new in the graph.
    pub(crate) fn add(&mut self, crew: Crew) {
        self.of.push((self.crews.len(), 0));
        self.crews.push(crew);
    }

    /// Crew and number of a node.
    #[inline(always)]
    fn of(&self, node: usize) -> (usize, usize) {
        self.of[node - self.first]
    }

    /// Whether an executor can have this node, which is on its own.
    pub(crate) fn is_joinable(&self, node: usize, dispatch: &dyn Dispatch) -> bool {
        dispatch.can_join(&*self.crews[self.of(node).0].scheduler)
    }

    /// Where a node is in its schedule at run time `now`.
    pub(crate) fn state(&self, node: usize, now: Time) -> TaskState {
        let (crew, member) = self.of(node);
        self.crews[crew].scheduler.state(member, now)
    }

    /// The end of the running tick of a node, if there is one.
    pub(crate) fn end_of(&self, node: usize, now: Time) -> Option<Assignment> {
        self.state(node, now).remaining?;
        let (crew, member) = self.of(node);
        let job = Job::new(member, JobKind::End);
        Some(Assignment { crew, node, job })
    }

    /// Whether one of its nodes has this input.
    pub(crate) fn hears(&self, arrival: Arrival) -> bool {
        let mut members = self.members();
        members.any(|member| member.node == arrival.node && arrival.input < member.inputs)
    }

    /// Index of the node called `name`, if it is here.
    pub(crate) fn node_called(&self, name: &str) -> Option<usize> {
        let mut members = self.members();
        let known = members.find(|member| *member.name == *name);
        known.map(|member| member.node)
    }

    /// The states of all nodes.
    pub(crate) fn states(&self, now: Time) -> impl Iterator<Item = TaskState> {
        self.members()
            .map(move |member| self.state(member.node, now))
    }

    /// The list of arrivals that nobody has looked at.
    pub(crate) fn arrivals(&self) -> &Arc<Arrivals> {
        &self.arrivals
    }
}

/// Its time.
impl Stage {
    /// Forgets all that is planned: the nodes run elsewhere, and `wake` gets the arrivals from
    /// now on.
    pub(crate) fn leave(&mut self, wake: Arc<dyn Wake>) {
        self.behind = true;
        self.arrivals.forward_to(Some(wake));
        self.agenda = Agenda::default();
        self.looking.clear();
    }

    /// Has the crews begin at run time `now`; those that have run elsewhere with messages
    /// `in_flight`.
    pub(crate) fn open(&mut self, now: Time, in_flight: impl FnOnce() -> Vec<Arrival>) {
        let anew = take(&mut self.behind);
        let arrivals = match anew {
            true => {
                self.arrivals.forward_to(None);
                in_flight()
            }
            false => {
                let mut published = self.arrivals.take();
                published.retain(|arrival| arrival.at >= now);
                published
            }
        };
        self.plan_arrivals(arrivals);
        self.send_all(SchedulerEvent::Opened { anew }, now);
    }

    /// Has the crews end, at run time `now`: ticks due before `before` are missed.
    pub(crate) fn close(&mut self, before: Time, now: Time) {
        self.send_all(SchedulerEvent::Closed { before }, now);
    }

    fn send_all(&mut self, event: SchedulerEvent, now: Time) {
        for crew in 0..self.crews.len() {
            self.send(crew, event, now, false);
        }
    }

    /// Run time of the next event; [`Time::MAX`] without one.
    pub(crate) fn next_at(&self) -> Time {
        let next = self.agenda.next_at();
        match self.looking.is_empty() {
            true => next,
            false => next.min(self.noticed),
        }
    }

    /// Whether something has happened since the last call.
    pub(crate) fn has_moved(&mut self) -> bool {
        take(&mut self.moved)
    }

    /// The next job at a moment. This and what it calls are one function, because every tick is
    /// handed through all of them: a quarter less a tick.
    #[inline(always)]
    pub(crate) fn look(&mut self, moment: Moment) -> Option<Assignment> {
        let Moment { now, until, over } = moment;
        loop {
            let next = self.agenda.next_at();
            let job = if next <= now && next <= until {
                let item = self.agenda.pop()?;
                self.moved = true;
                self.happen(item, moment)
            } else if over {
                return None;
            } else {
                let crew = self.looking.pop_first()?;
                self.moved = true;
                self.send(crew, SchedulerEvent::Look, now, false)
            };
            if job.is_some() {
                return job;
            }
        }
    }

    /// Has an event happen.
    #[inline(always)]
    fn happen(&mut self, item: AgendaItem, moment: Moment) -> Option<Assignment> {
        let (crew, member) = self.of(item.node as usize);
        let event = match item.phase() {
            Phase::Arrive => {
                let input = item.input as usize;
                SchedulerEvent::Arrived { member, input }
            }
            phase => {
                let at = item.at;
                SchedulerEvent::Alarm { member, at, phase }
            }
        };
        self.send(crew, event, moment.now, moment.over)
    }

    /// A job is done: the scheduler hears of it, unless it was the begin of a tick that failed,
    /// and the tick is recorded. Returns whether it ends the run.
    #[inline(always)]
    pub(crate) fn done(
        &mut self,
        seat: &mut Seat,
        work: Assignment,
        times: WorkTimes,
        outcome: Tick,
    ) -> Tick {
        let (job, passed) = (work.job, times.passed);
        if outcome.is_ok() || job.kind != JobKind::Begin {
            let done = SchedulerEvent::Done { job, passed };
            self.send(work.crew, done, times.ended, false);
        }
        seat.done(job, times.began, times.took, outcome)
    }

    #[inline(always)]
    fn send(
        &mut self,
        number: usize,
        event: SchedulerEvent,
        now: Time,
        over: bool,
    ) -> Option<Assignment> {
        self.with(number, now, over, |crew, plan| {
            let job = crew.on(event, plan)?;
            let node = plan.members[job.member()].node;
            let crew = number;
            Some(Assignment { crew, node, job })
        })
    }

    #[inline(always)]
    fn with<R>(
        &mut self,
        number: usize,
        now: Time,
        over: bool,
        ask: impl FnOnce(&mut dyn Scheduler, &mut Timetable<'_>) -> R,
    ) -> R {
        let crew = &mut self.crews[number];
        let mut looks = false;
        let mut plan = Timetable {
            now,
            clock: self.clock,
            over,
            members: &crew.members,
            agenda: &mut self.agenda,
            looks: &mut looks,
        };
        let answer = ask(&mut *crew.scheduler, &mut plan);
        if looks {
            self.noticed = now;
            self.looking.insert(number);
        }
        answer
    }

    /// Adds the arrival of a message.
    pub(crate) fn add_arrival(&mut self, arrival: Arrival) {
        let Arrival { at, node, input } = arrival;
        self.agenda.add_arrival(at, node, input);
    }

    /// Plans the arrivals of the messages that were published since the last look.
    #[inline]
    pub(crate) fn collect(&mut self) {
        let arrivals = self.arrivals.take();
        self.plan_arrivals(arrivals);
    }

    fn plan_arrivals(&mut self, arrivals: Vec<Arrival>) {
        let arrivals = arrivals.into_iter();
        arrivals.for_each(|arrival| self.add_arrival(arrival));
    }
}

/// Knobs of its nodes.
impl Stage {
    /// Checks that a node has this knob.
    ///
    /// # Errors
    /// The reason, with a remedy.
    pub(crate) fn check(&self, node: usize, seat: &Seat, knob: &Knob) -> Result<(), String> {
        seat.check(knob)?;
        match knob {
            Knob::Send { .. } | Knob::Crash { .. } | Knob::Restart { .. } => Ok(()),
            knob => {
                let (crew, member) = self.of(node);
                self.crews[crew].scheduler.check(member, knob)
            }
        }
    }

    /// Turns a knob of a node at run time `now`; returns the value before.
    ///
    /// # Errors
    /// The reason and a remedy.
    pub(crate) fn turn(
        &mut self,
        node: usize,
        seat: &mut Seat,
        knob: &Knob,
        now: Time,
    ) -> Result<String, String> {
        self.check(node, seat, knob)?;
        let (crew, member) = self.of(node);
        match knob {
            Knob::Send { text, .. } => seat.send(text),
            Knob::Crash { .. } => {
                let was = self.crashed(node);
                self.crash(node, seat, now);
                Ok(was)
            }
            Knob::Restart { .. } => self.restart(node, seat, now),
            knob => self.with(crew, now, false, |scheduler, plan| {
                scheduler.turn(member, knob, plan)
            }),
        }
    }

    /// Stops the node's ticks. Messages it has not released are lost.
    fn crash(&mut self, node: usize, seat: &mut Seat, now: Time) {
        let (crew, member) = self.of(node);
        self.send(crew, SchedulerEvent::Crashed { member }, now, false);
        seat.abort();
        self.record(node, NodeRecord::Crashed);
    }

    fn restart(&mut self, node: usize, seat: &mut Seat, now: Time) -> Result<String, String> {
        let (crew, member) = self.of(node);
        let was = self.crashed(node);
        if seat.again.is_some() {
            self.crash(node, seat, now);
        }
        seat.begin_anew()?;
        if !self.state(node, Time::ZERO).crashed {
            self.crash(node, seat, now);
        }
        self.record(node, NodeRecord::Restarted);
        self.send(crew, SchedulerEvent::Restarted { member }, now, false);
        Ok(was)
    }

    fn crashed(&self, node: usize) -> String {
        let crashed = self.state(node, Time::ZERO).crashed;
        if crashed { "crashed" } else { "running" }.to_owned()
    }

    fn record(&self, node: usize, record: NodeRecord) {
        let (crew, member) = self.of(node);
        self.crews[crew].members[member].records.node(|| record);
    }
}
