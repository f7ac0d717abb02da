//! Executes a run of the real clock again.

use std::collections::{BTreeSet, VecDeque};

use ratelab::{
    Arrival, Clock, ClockExit, ClockKind, Command, End, Entries, Entry, Event, Fault, Graph, Inbox,
    Obeyed, Time, Topology, Wake, note_end, obey_at_rest, sync::Arc,
};

use super::{
    events::RecordedEvents,
    hold::Hold,
    log::{Log, LogError},
    overlap::{Overlap, OverlapStep},
    plan::PlanPart,
    players::{Players, RunView, refuse_again},
    section::{Section, Sections, Stretch},
    watch::Watch,
};

/// Nobody waits for messages: the log knows when nodes hear of them.
struct Unheard;

impl Wake for Unheard {
    fn wake(&self, _: Arrival) {}
}

/// Executes a run of the real clock again, in the recorded order and with the recorded times: on the same build and kind of machine it is the same
/// run, to the bit, as long as its nodes share nothing but topics and
/// [`Shared`](ratelab::Shared) values.
///
/// Whole ticks run one after the other on the calling thread, as fast as they can. Ticks
/// that overlapped, each waiting for the other, run on threads of their own.
///
/// ```
/// use ratelab::{Clock, GO_ON, Graph, Hz, Inbox, Time};
/// use ratelab_real_clock::RealClock;
/// use ratelab_replay::{Rerun, RunLog};
///
/// let graph = || {
///     let mut graph = Graph::new();
///     graph.node("a", Hz::new(500.0)?, 0, |_| |_| GO_ON)?;
///     Ok::<_, Box<dyn std::error::Error>>(graph)
/// };
/// let (mut first, end) = (graph()?, Time::from_secs_f64(0.05)?);
/// let log = RunLog::of(&first.state());
/// RealClock::default().run(&mut first, &mut Inbox::default(), end)?;
///
/// let events = first.state().events(0);
/// let mut rerun = Rerun::new(&log.log(), &events, &first.topology())?;
/// let mut again = graph()?;
/// let log_again = RunLog::of(&again.state());
/// rerun.run(&mut again, &mut Inbox::default(), end)?;
/// assert_eq!(rerun.difference(), None);
/// assert_eq!(log_again.log(), log.log());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Rerun {
    sections: VecDeque<Section>,
    events: RecordedEvents,
    whole: bool,
    /// The moment at which to leave the recorded run.
    branch: Option<BranchPoint>,
    /// Whether the recorded run was left.
    left: bool,
    /// The number of overlaps up to the one to be held in, if there is one.
    hold: Option<usize>,
    watch: Arc<Watch>,
}

/// The end of what is executed again.
#[derive(Debug)]
struct BranchPoint {
    at: Time,
    /// Commands to carry out then, before the graph is handed to the virtual clock; `None`
    /// to stop.
    then: Option<Vec<Command>>,
}

impl Rerun {
    /// Prepares to execute the run with this `log` again, with its `events` and the
    /// `topology` of its graph.
    ///
    /// # Errors
    /// [`LogError`] if no run can have been like that, or if it cannot come back.
    pub fn new(log: &Log, events: &[Event], topology: &Topology) -> Result<Self, LogError> {
        Self::read(log, events, topology, true)
    }

    /// The same for a log that may be cut off at any place: the run is executed for as
    /// long as the log goes, and stopped then.
    ///
    /// # Errors
    /// As of [`Rerun::new`].
    pub fn of_torn(log: &Log, events: &[Event], topology: &Topology) -> Result<Self, LogError> {
        Self::read(log, events, topology, false)
    }

    fn read(
        log: &Log,
        events: &[Event],
        topology: &Topology,
        whole: bool,
    ) -> Result<Self, LogError> {
        let nodes = topology.nodes.iter().map(|node| Arc::from(&*node.name));
        let supervisor = std::iter::once(Arc::from("the supervisor"));
        let names: Vec<Arc<str>> = supervisor.chain(nodes).collect();
        let sections = Sections::read(log, events, &names, whole)?;
        Ok(Self {
            sections: sections.all.into(),
            events: RecordedEvents {
                all: events.to_vec(),
                known: sections.events,
                refused: BTreeSet::new(),
            },
            whole,
            branch: None,
            left: false,
            hold: None,
            watch: Arc::new(Watch::new(names)),
        })
    }

    /// Whether the event at this position of the event log happened under the real clock:
    /// the log of the threads has it. All others have to be given again.
    pub fn knows(&self, event: usize) -> bool {
        self.events.known.contains(&event)
    }

    /// The commands under the real clock that have yet to be carried out, to be loaded
    /// with what they need.
    pub fn commands_mut(&mut self) -> impl Iterator<Item = &mut Command> {
        self.events.commands_mut()
    }

    /// Refuses those commands again, for the recorded reason, that were refused and that
    /// `of` selects: a file that was missing may be there now.
    pub fn expect_refusals(&mut self, of: impl Fn(&Command) -> bool) {
        self.events.expect_refusals(of);
    }

    /// Gives every node a thread of its own, which pauses for a random time before each
    /// operation: the result is the same.
    pub fn perturb(&mut self) {
        self.watch.set_perturbed();
    }

    /// Stops the run at the last rest at or before run time `at`, if it is under the real
    /// clock then.
    pub fn until(&mut self, at: Time) {
        self.branch = Some(BranchPoint { at, then: None });
    }

    /// Leaves the recorded run at the last rest at or before run time `at`: carries out
    /// `commands` there, and goes on under the virtual clock.
    pub fn branch(&mut self, at: Time, commands: Vec<Command>) {
        let then = Some(commands);
        self.branch = Some(BranchPoint { at, then });
    }

    /// Whether it has left the recorded run, to stop or to go on under the virtual clock.
    pub fn has_left(&self) -> bool {
        self.left
    }

    /// Executes the run up to overlap number `overlap` of [`overlaps`](Self::overlaps) and the
    /// first `operations` of it, and holds it there until [`Watch::end`]; [`Watch::allow`] lets it
    /// go on. Where a node is held with a lock of another operation within its own, the rest
    /// of the overlap goes on at once.
    pub fn hold(&mut self, overlap: usize, operations: usize) {
        self.hold = Some(overlap);
        self.watch.allow(operations);
    }

    /// The ticks that overlap, in order.
    pub fn overlaps(&self) -> Vec<Overlap> {
        self.stretches().flat_map(Stretch::overlaps).collect()
    }

    fn stretches(&self) -> impl Iterator<Item = &Stretch> {
        self.sections.iter().filter_map(|section| match section {
            Section::Stretch(stretch) => Some(stretch),
            Section::Rest(_) | Section::Abandoned => None,
        })
    }

    /// The run times at which the graph rests between two ticks under the real clock, in
    /// order: where a run can be stopped, and left.
    pub fn rests(&self) -> Vec<Time> {
        let parts = self.stretches().flat_map(|stretch| stretch.plan.parts());
        let mut now = Time::ZERO;
        let rests = parts.filter_map(|planned| {
            now = now.max(planned.at);
            planned.rests.then_some(now)
        });
        let mut rests: Vec<Time> = std::iter::once(Time::ZERO).chain(rests).collect();
        rests.dedup();
        rests
    }

    /// The last of these at or before `at`; `None` if the run, which began under the clock
    /// `first`, was under the virtual clock then.
    pub fn rest_before(&self, at: Time, first: ClockKind) -> Option<Time> {
        let (mut now, mut clock) = (Time::ZERO, first);
        for section in &self.sections {
            match section {
                Section::Rest(event) => {
                    let event = self.events.all.get(*event);
                    if let Some(Command::HandOver(next)) = event.and_then(Event::applied) {
                        clock = *next;
                    }
                }
                Section::Abandoned => {}
                Section::Stretch(stretch) => {
                    let parts = stretch.plan.parts();
                    let rest = stretch.plan.rest_before(at);
                    for planned in &parts[..rest.unwrap_or(parts.len())] {
                        now = now.max(planned.at);
                        clock = ClockKind::Real;
                    }
                    if rest.is_some() {
                        break;
                    }
                    if stretch.end == Some(End::HandedOver) {
                        clock = ClockKind::Virtual;
                    }
                }
            }
        }
        (clock == ClockKind::Real).then_some(now)
    }

    /// Watches the run from another thread.
    pub fn watch(&self) -> Arc<Watch> {
        self.watch.clone()
    }

    /// What was different first, beside messages and events; `None` if nothing was.
    pub fn difference(&self) -> Option<String> {
        let more = self.whole && self.branch.is_none() && !self.sections.is_empty();
        let more = more.then(|| "the recorded run went on under the real clock".to_owned());
        self.watch.difference().or(more)
    }
}

impl Clock for Rerun {
    /// It needs none: the order is recorded.
    fn cores(&self) -> Option<usize> {
        Some(usize::MAX)
    }

    /// As recorded; the live commands in `inbox` are not read.
    fn run(&mut self, graph: &mut Graph, _: &mut Inbox, _: Time) -> Result<ClockExit, Fault> {
        graph.set_cores(self.cores());
        graph.set_clock(ClockKind::Real);
        // There is no wall to keep up with: those who look on lose nothing.
        graph.state().set_waits(true);
        let end = loop {
            let end = match self.sections.pop_front() {
                Some(Section::Stretch(stretch)) => self.stretch(graph, stretch),
                Some(Section::Rest(event)) => Ok(self.rest(graph, event)),
                Some(Section::Abandoned) => {
                    supervisor(graph).note_alone(Entry::Abandoned);
                    Ok(Some(ClockExit::Stopped))
                }
                None => Ok(Some(self.no_more())),
            };
            if let Some(end) = end.transpose() {
                break end;
            }
        };
        // Nobody is there to end a pause under the other clock.
        graph.set_paused(false);
        note_end(graph, &end);
        end
    }
}

impl Rerun {
    fn no_more(&self) -> ClockExit {
        if self.whole {
            let reason = "it is under the real clock, and the recorded run was not";
            self.watch.differs(reason.to_owned());
        }
        ClockExit::Stopped
    }

    fn rest(&self, graph: &mut Graph, event: usize) -> Option<ClockExit> {
        let (command, refusal) = self.events.command(event)?;
        let now = graph.now();
        let obeyed = match refusal {
            Some(reason) => refuse_again(&graph.state(), command, now, reason),
            None => at_rest(graph, command),
        };
        let event = obeyed.event as u64;
        supervisor(graph).note_alone(Entry::Rest { event });
        obeyed.exit
    }

    fn stretch(&mut self, graph: &mut Graph, stretch: Stretch) -> Result<Option<ClockExit>, Fault> {
        if stretch.threads.len() != graph.node_count() + 1 {
            self.watch.differs("the graph has other nodes".to_owned());
            return Ok(Some(ClockExit::Stopped));
        }
        let played = self.play(graph, &stretch);
        played.unwrap_or_else(|| Ok(Some(self.leave(graph))))
    }

    /// Plays a stretch; `None` where the recorded run is to be left.
    fn play(
        &mut self,
        graph: &mut Graph,
        stretch: &Stretch,
    ) -> Option<Result<Option<ClockExit>, Fault>> {
        let state = graph.state();
        let (task_sets, supervision) = graph.apart();
        task_sets.wake_by(Arc::new(Unheard));
        let run = RunView {
            events: &self.events,
            watch: &self.watch,
            state: &state,
        };
        let mut players = Players::new(run, &stretch.threads, &task_sets, supervision);
        if self.watch.is_perturbed() && self.branch.is_none() && stretch.end.is_some() {
            let all: Vec<usize> = stretch.threads.iter().map(Vec::len).collect();
            players.together(&all);
            return Some(players.end(stretch.end));
        }
        let branch = self.branch.as_ref();
        let leaves = branch.and_then(|branch| stretch.plan.rest_before(branch.at));
        for (index, planned) in stretch.plan.parts().iter().enumerate() {
            if leaves == Some(index) {
                return None;
            }
            if self.watch.is_over() {
                break;
            }
            match &planned.part {
                PlanPart::Entry(thread) => players.entry(*thread),
                PlanPart::Overlap(steps) => {
                    let hold = (self.hold == Some(0)).then(|| self.watch.hold());
                    self.hold = self.hold.and_then(|before| before.checked_sub(1));
                    play_overlap(&mut players, steps, hold);
                }
            }
        }
        Some(players.end(stretch.end))
    }

    /// Leaves the recorded run.
    fn leave(&mut self, graph: &mut Graph) -> ClockExit {
        self.left = true;
        let then = self.branch.as_mut().and_then(|branch| branch.then.take());
        let Some(commands) = then else {
            return ClockExit::Stopped;
        };
        let log = supervisor(graph);
        log.note_alone(Entry::End(End::Left));
        let on = Command::HandOver(ClockKind::Virtual);
        for command in commands.iter().chain([&on]) {
            let event = at_rest(graph, command).event as u64;
            log.note_alone(Entry::Rest { event });
        }
        ClockExit::HandedOver(ClockKind::Virtual)
    }
}

/// The log of the thread that supervises the nodes: what is executed again is logged as it
/// was, so that a branch can be executed again, too.
fn supervisor(graph: &Graph) -> Entries {
    graph.state().entries_of(0)
}

/// Carries out a command between two ticks.
fn at_rest(graph: &mut Graph, command: &Command) -> Obeyed {
    let now = graph.now();
    obey_at_rest(graph, ClockKind::Real, command, now)
}

/// Plays the overlap of these `steps`, and waits for the end of its `hold` if it has one.
fn play_overlap(players: &mut Players<'_>, steps: &[OverlapStep], hold: Option<&Hold>) {
    let ends = |thread: usize| {
        let ends = steps
            .iter()
            .filter(|step| step.thread == thread && step.ends);
        ends.count()
    };
    let counts: Vec<usize> = (0..players.len()).map(ends).collect();
    let Some(hold) = hold else {
        return players.together(&counts);
    };
    let takes = steps.iter().filter(|step| step.takes.is_some());
    let threads = counts.iter().filter(|count| **count > 0).count();
    hold.begin(takes.map(|step| step.thread).collect(), threads);
    players.together(&counts);
    hold.wait_for_end();
}
