//! Executes a run of the real clock again.

use std::collections::{BTreeSet, VecDeque};

use ratelab::{
    Clock, ClockExit, ClockKind, Command, Event, EventKind, Fault, Graph, Inbox, Time, Topology,
    clock::{Arrival, Obeyed, Wake, note_end, obey_at_rest},
    journal::{End, Entries, Entry},
    sync::Arc,
};

use super::{
    log::{Log, LogError},
    players::{Players, RunView, refuse_again},
    section::{Overlap, Section, SectionReader, Stretch},
    watch::Watch,
};
use crate::players::RecordedEvents;

/// Executes a run of the real clock again, in the recorded order and with the recorded times: on
/// the same build and kind of machine it is the same run, to the bit, as long as its nodes share
/// nothing but topics and [`Shared`](ratelab::Shared) values.
///
/// Whole ticks run one after the other on the calling thread, as fast as they can. Ticks
/// that overlapped, each waiting for the other, run on threads of their own.
///
/// ```
/// use ratelab::{Clock, Graph, Hz, Inbox, Tick, Time};
/// use ratelab_real_clock::RealClock;
/// use ratelab_re_execution::{ReExecution, RunLog};
///
/// let graph = || {
///     let mut graph = Graph::new();
///     graph.node("a", Hz::new(500.0)?, 0, |_| |_: &mut Tick| {})?;
///     Ok::<_, Box<dyn std::error::Error>>(graph)
/// };
/// let (mut first, end) = (graph()?, Time::from_secs_f64(0.05)?);
/// let log = RunLog::attach(&first.state());
/// RealClock::default().run(&mut first, &mut Inbox::default(), end)?;
///
/// let events = first.state().events(0);
/// let mut re_execution = ReExecution::new(&log.log(), &events, &first.topology())?;
/// let mut again = graph()?;
/// let log_again = RunLog::attach(&again.state());
/// re_execution.run(&mut again, &mut Inbox::default(), end)?;
/// assert_eq!(re_execution.difference(), None);
/// assert_eq!(log_again.log(), log.log());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct ReExecution {
    sections: VecDeque<Section>,
    events: RecordedEvents,
    /// Whether all of the recorded run is to come again.
    whole: bool,
    /// Whether the recorded run was left.
    left: bool,
    /// The number of overlaps up to the one to be held in, if any.
    hold: Option<usize>,
    watch: Arc<Watch>,
}

impl ReExecution {
    /// Prepares to execute the run with this `log` again, with its `events` and the
    /// `topology` of its graph.
    ///
    /// # Errors
    /// [`LogError`] if no run can have been like that, or if it cannot come back.
    pub fn new(log: &Log, events: &[Event], topology: &Topology) -> Result<Self, LogError> {
        Self::read(log, events, topology, true)
    }

    /// Prepares a run whose log may be cut off at any place: it is executed for as long as the log
    /// goes, and stopped then.
    ///
    /// # Errors
    /// As of [`ReExecution::new`].
    pub fn from_torn(log: &Log, events: &[Event], topology: &Topology) -> Result<Self, LogError> {
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
        let mut reader = SectionReader::new(log, events, &names, whole)?;
        Ok(Self {
            sections: reader.read()?.into(),
            events: RecordedEvents {
                all: events.to_vec(),
                known: reader.known,
                refused: BTreeSet::new(),
            },
            whole,
            left: false,
            hold: None,
            watch: Arc::new(Watch::new(names)),
        })
    }

    /// Returns whether the event at this position of the event log happened under the real clock:
    /// the log of the threads has it. All others have to be given again.
    pub fn knows(&self, event: usize) -> bool {
        self.events.known.contains(&event)
    }

    /// Returns the commands under the real clock that have yet to be carried out, to be loaded with
    /// what they need.
    pub fn commands_mut(&mut self) -> impl Iterator<Item = &mut Command> {
        let known = &self.events.known;
        self.events
            .all
            .iter_mut()
            .enumerate()
            .filter(|(index, _)| known.contains(index))
            .filter_map(|(_, event)| match &mut event.what {
                EventKind::Applied { command, .. } | EventKind::Refused { command, .. } => {
                    Some(command)
                }
                _ => None,
            })
    }

    /// Refuses the refused commands that `of` selects again, for the recorded reason: a file
    /// that was missing may be there now.
    pub fn expect_refusals(&mut self, of: impl Fn(&Command) -> bool) {
        let RecordedEvents { all, known, .. } = &self.events;
        let was_refused = |index: &&usize| match &all[**index].what {
            EventKind::Refused { command, .. } => of(command),
            _ => false,
        };
        self.events.refused = known.iter().filter(was_refused).copied().collect();
    }

    /// Gives every node a thread of its own, which pauses for a random time before each
    /// operation: the result is the same.
    pub fn perturb(&mut self) {
        self.watch.perturb();
    }

    /// Leaves the recorded run at the last rest at or before run time `at`, if it is under the
    /// real clock then: carries out `commands` there, and goes on under the virtual clock.
    pub fn branch(&mut self, at: Time, commands: Vec<Command>) {
        self.whole = false;
        let mut sections = self.sections.iter_mut();
        let cut = sections.position(|section| match section {
            Section::Stretch(stretch) => stretch.cut(at),
            _ => false,
        });
        let Some(cut) = cut else {
            return;
        };
        self.sections.truncate(cut + 1);
        self.sections.push_back(Section::Left);
        let on = Command::HandOver(ClockKind::Virtual);
        for command in commands.into_iter().chain([on]) {
            let event = self.events.add(at, command);
            self.sections.push_back(Section::Rest(event));
        }
    }

    /// Returns whether it has left the recorded run, to go on under the virtual clock.
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

    /// Returns the ticks that overlap, in order.
    pub fn overlaps(&self) -> Vec<Overlap> {
        let stretches = self.sections.iter().filter_map(|section| match section {
            Section::Stretch(stretch) => Some(stretch),
            _ => None,
        });
        stretches.flat_map(Stretch::overlaps).collect()
    }

    /// Returns the run times at which the graph rests between two ticks under the real clock, in
    /// order: where a run can be left.
    pub fn rests(&self) -> Vec<Time> {
        let rests = self
            .rests_from(ClockKind::Real)
            .into_iter()
            .filter(|(_, clock)| *clock == ClockKind::Real);
        let mut rests: Vec<Time> = rests.map(|(at, _)| at).collect();
        rests.dedup();
        rests
    }

    /// Returns the last of these at or before `at`; `None` if the run, which began under the clock
    /// `first`, was under the virtual clock then.
    pub fn rest_before(&self, at: Time, first: ClockKind) -> Option<Time> {
        let rests = self.rests_from(first).into_iter();
        let (rest, clock) = rests.take_while(|(rest, _)| *rest <= at).last()?;
        (clock == ClockKind::Real).then_some(rest)
    }

    /// Returns the rests of a run that began under the clock `first`, each with the clock after it.
    fn rests_from(&self, first: ClockKind) -> Vec<(Time, ClockKind)> {
        let (mut now, mut rests) = (Time::ZERO, vec![(Time::ZERO, first)]);
        for section in &self.sections {
            match section {
                Section::Rest(event) => {
                    let event = self.events.all.get(*event);
                    if let Some(Command::HandOver(clock)) = event.and_then(Event::applied) {
                        rests.push((now, *clock));
                    }
                }
                Section::Stretch(stretch) => {
                    for part in &stretch.plan.parts {
                        now = now.max(part.at);
                        rests.extend(part.rests.then_some((now, ClockKind::Real)));
                    }
                    if stretch.end == Some(End::HandedOver) {
                        rests.push((now, ClockKind::Virtual));
                    }
                }
                Section::Abandoned | Section::Left => {}
            }
        }
        rests
    }

    /// Watches the run from another thread.
    pub fn watch(&self) -> Arc<Watch> {
        self.watch.clone()
    }

    /// Returns what was different first, beside messages and events; `None` if nothing was.
    pub fn difference(&self) -> Option<String> {
        let more = self.whole && !self.sections.is_empty();
        self.watch
            .difference()
            .or(more.then(|| "the recorded run went on under the real clock".to_owned()))
    }
}

impl Clock for ReExecution {
    /// It needs none: the order is recorded.
    fn cores(&self) -> Option<usize> {
        Some(usize::MAX)
    }

    /// As recorded; the live commands in `inbox` are not read.
    fn run(&mut self, graph: &mut Graph, _: &mut Inbox, _: Time) -> Result<ClockExit, Fault> {
        graph.set_cores(self.cores());
        graph.set_clock(ClockKind::Real);
        // The run does not keep up with a wall clock, so observers lose nothing.
        graph.run_writer().set_waits(true);
        let end = loop {
            let end = self.section(graph);
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

impl ReExecution {
    /// Executes the next section; `None` if the run goes on after it. What is executed again is
    /// logged as it was, so that a branch can be executed again, too.
    fn section(&mut self, graph: &mut Graph) -> Result<Option<ClockExit>, Fault> {
        let log = graph.run_writer().entries_of(0);
        match self.sections.pop_front() {
            Some(Section::Stretch(stretch)) => return self.stretch(graph, &stretch),
            Some(Section::Rest(event)) => return Ok(self.rest(graph, &log, event)),
            Some(Section::Left) => {
                self.left = true;
                log.note_alone(Entry::End(End::Left));
                return Ok(None);
            }
            Some(Section::Abandoned) => log.note_alone(Entry::Abandoned),
            None if self.whole => {
                let reason = "it is under the real clock, and the recorded run was not";
                self.watch.differs(reason.to_owned());
            }
            None => {}
        }
        Ok(Some(ClockExit::Stopped))
    }

    /// Carries out a command between two ticks.
    fn rest(&self, graph: &mut Graph, log: &Entries, event: usize) -> Option<ClockExit> {
        let (command, refusal) = self.events.command(event)?;
        let (now, state) = (graph.now(), graph.run_writer());
        let Obeyed { event, exit } = match refusal {
            Some(reason) => refuse_again(&state, command, now, reason),
            None => obey_at_rest(graph, command, now),
        };
        let event = event as u64;
        log.note_alone(Entry::Rest { event });
        exit
    }

    fn stretch(
        &mut self,
        graph: &mut Graph,
        stretch: &Stretch,
    ) -> Result<Option<ClockExit>, Fault> {
        if stretch.threads.len() != graph.node_count() + 1 {
            self.watch.differs("the graph has other nodes".to_owned());
            return Ok(Some(ClockExit::Stopped));
        }
        let state = graph.run_writer();
        let (task_sets, supervision) = graph.apart();
        task_sets.wake_by(Arc::new(Unheard));
        let run = RunView {
            events: &self.events,
            watch: &self.watch,
            state: &state,
        };
        let mut players = Players::new(run, &stretch.threads, &task_sets, supervision);
        let plan = &stretch.plan;
        if self.watch.is_perturbed() {
            players.together(&plan.steps);
            return players.end(stretch.end);
        }
        for part in &plan.parts {
            let steps = &plan.steps[part.steps.clone()];
            if !part.overlaps {
                players.alone(steps);
            } else if self.watch.is_over() {
                break;
            } else if self.hold == Some(0) {
                players.held(steps);
            } else {
                self.hold = self.hold.and_then(|before| before.checked_sub(1));
                players.together(steps);
            }
        }
        players.end(stretch.end)
    }
}

/// Nobody waits for messages: the log knows when nodes hear of them.
struct Unheard;

impl Wake for Unheard {
    fn wake(&self, _: Arrival) {}
}
