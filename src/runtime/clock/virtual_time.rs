//! Discrete-event time: one thread, bit-for-bit reproducible.

mod dispatch;

use std::ops::ControlFlow;

use super::{Clock, ClockExit, due_queue::DueQueue, note_end, obey::obey_at_rest, pacer::Pacer};
use crate::runtime::{
    command::{ClockKind, Command},
    graph::Graph,
    inbox::{Inbox, Wait},
    node::{Fault, GO_ON, Tick},
    sync::Instant,
    time::Time,
};

/// Runs all nodes on the calling thread, in the order of their due times.
///
/// Virtual time jumps from one instant to the next, at the set
/// [`Speed`](crate::runtime::Speed), and stands still while the graph is paused. Speed
/// and pauses leave the results unchanged: the same graph with the same commands at the
/// same run times is the same run, bit for bit.
///
/// A command that changes the graph takes effect between two instants. When an instant is
/// only partly done, the rest of it runs first. Single steps can leave a partly done
/// instant; so can the real clock, whose late nodes all tick at the run time of the
/// handover.
///
/// ```
/// use ratelab::runtime::{Clock, ClockExit, GO_ON, Graph, Hz, Inbox, Time, VirtualClock};
///
/// let mut graph = Graph::new();
/// graph.node("slow", Hz::new(10.0)?, 0, |_| |_| GO_ON)?;
/// graph.node("fast", Hz::new(1_000.0)?, 1, |_| |_| GO_ON)?;
/// // An hour of run time, in a moment, to its end: an instant is part of the run.
/// let exit = VirtualClock.run(&mut graph, &mut Inbox::default(), Time::from_secs_f64(3600.0)?)?;
/// assert_eq!(exit, ClockExit::Completed);
/// let ticks = graph.observer().snapshot().nodes.iter().map(|node| node.ticks).collect::<Vec<_>>();
/// assert_eq!(ticks, [36_001, 3_600_001]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct VirtualClock;

impl Clock for VirtualClock {
    fn kind(&self) -> ClockKind {
        ClockKind::Virtual
    }

    fn run(
        &mut self,
        graph: &mut Graph,
        inbox: &mut Inbox,
        until: Time,
    ) -> Result<ClockExit, Fault> {
        graph.set_clock(ClockKind::Virtual);
        let end = Scheduler::new(graph, inbox, until).run();
        note_end(graph, &end);
        end
    }
}

/// One stretch of virtual time.
struct Scheduler<'a> {
    graph: &'a mut Graph,
    inbox: &'a mut Inbox,
    until: Time,
    queue: DueQueue,
    pacer: Pacer,
    /// The instant of the last tick, if there was one.
    last_tick: Option<Time>,
    /// Requested single ticks that are still to run.
    steps: u32,
    /// Number of ticks started.
    started: u64,
}

/// What to do next.
enum NextStep {
    Obey(Command),
    Proceed,
    Stop,
}

impl<'a> Scheduler<'a> {
    fn new(graph: &'a mut Graph, inbox: &'a mut Inbox, until: Time) -> Self {
        let now = graph.now();
        let mut nodes = graph.nodes.iter();
        let late = nodes.any(|node| node.due() < now && node.skips_ticks());
        let last_due = graph.nodes.iter().filter_map(|s| s.rate.last_due()).max();
        // Late nodes tick now, so this instant is partly done.
        let last_tick = if late { Some(now) } else { last_due };
        let in_flight = || graph.control.arrivals_after(now);
        graph.dispatcher.prepare(now, &mut graph.nodes, in_flight);
        Self {
            queue: DueQueue::new(&graph.nodes),
            pacer: Pacer::new(graph.control.status.speed, now),
            last_tick: last_tick.map(|last| last.min(now)),
            graph,
            inbox,
            until,
            steps: 0,
            started: 0,
        }
    }

    fn run(mut self) -> Result<ClockExit, Fault> {
        loop {
            let exit = match self.take_turn() {
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
    fn take_turn(&mut self) -> NextStep {
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

    /// Time of the next event of a node.
    fn next_at(&self) -> Time {
        let next = self.graph.dispatcher.next();
        next.map_or(Time::MAX, |place| place.at)
            .min(self.queue.next_at())
    }

    /// Whether nodes have yet to tick in the instant of the last tick.
    fn mid_instant(&self) -> bool {
        self.last_tick.is_some_and(|last| self.next_at() <= last)
    }

    /// Whether the last instant has run. A command that arrives now would take effect
    /// after the end, which a replay does not reach.
    fn is_over(&self) -> bool {
        self.last_tick.is_some_and(|last| last >= self.until) && !self.mid_instant()
    }

    /// Time of the next tick or timed command, or the end.
    fn next_event(&self) -> Time {
        let next = self.next_at();
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

    /// The run time now: after all past events, before all later ones. Within an instant
    /// it is that instant, because its other nodes tick at it too.
    fn moment(&self) -> Time {
        let now = self.graph.now();
        if self.mid_instant() {
            return now;
        }
        let done = self.last_tick.map_or(Time::ZERO, |last| last + Time::TICK);
        let now = now.max(done);
        match self.pacer.now() {
            Some(paced) if !self.graph.control.status.paused => {
                paced.min(self.next_event()).max(now)
            }
            _ => now,
        }
    }

    fn obey(&mut self, command: &Command, at: Time) -> Option<ClockExit> {
        self.graph.control.set_now(at);
        if *command == Command::Step {
            self.graph.control.update(|status| status.paused = true);
            self.steps += 1;
        }
        let exit = obey_at_rest(self.graph, ClockKind::Virtual, command, at).exit;
        self.tell_dispatcher(command, at);
        match command {
            Command::Set(knob) if knob.crashes().is_some() => {
                self.queue = DueQueue::new(&self.graph.nodes);
            }
            Command::Speed(_) | Command::Resume => {
                self.pacer = Pacer::new(self.graph.control.status.speed, at);
            }
            _ => {}
        }
        exit
    }

    /// Processes the next event: a timed command, a tick, or the end.
    fn proceed(&mut self) -> Result<Option<ClockExit>, Fault> {
        let next = self.next_at();
        if self.inbox.next_timed(self.until) <= next
            && !self.mid_instant()
            && let Some(timed) = self.inbox.take_timed(self.until)
        {
            let at = timed.at.max(self.graph.now());
            return Ok(self.obey(&timed.command, at));
        }
        if next > self.until || next == Time::MAX {
            self.graph.control.set_now(self.until);
            return Ok(Some(ClockExit::Completed));
        }
        let started = self.started;
        let exit = self.advance()?;
        if self.started > started {
            self.steps = self.steps.saturating_sub(1);
        }
        Ok(exit)
    }

    /// Processes the next event of a node: a tick that is due, starts late, or ends.
    fn advance(&mut self) -> Result<Option<ClockExit>, Fault> {
        if let Some(place) = self.dispatched() {
            return self.dispatch(place);
        }
        let Some(node) = self.queue.next() else {
            return Ok(None);
        };
        // A node that is late from the real clock must not turn time back.
        let now = self.queue.next_at().max(self.graph.now());
        self.last_tick = Some(now);
        self.graph.control.set_now(now);
        let outcome = self.due(node, now);
        self.conclude(node, now, outcome)
    }

    /// What an event of a node at `now` means for the run.
    fn conclude(
        &mut self,
        node: usize,
        now: Time,
        outcome: Tick,
    ) -> Result<Option<ClockExit>, Fault> {
        self.graph.dispatcher.collect();
        let node = &self.graph.nodes[node];
        match outcome {
            Ok(ControlFlow::Continue(())) => Ok(None),
            Ok(ControlFlow::Break(())) => Ok(Some(ClockExit::Ended {
                node: node.entry.name.to_string(),
                at: now,
            })),
            Err(cause) => Err(node.fault(now, cause)),
        }
    }

    /// Handles a due tick: starts it, unless it is late or another tick is unfinished.
    fn due(&mut self, index: usize, now: Time) -> Tick {
        let node = &mut self.graph.nodes[index];
        let (due, occupied) = (node.rate.due(), node.is_occupied());
        if occupied {
            node.overrun(now);
        } else if due < now {
            // The node is late from the real clock: it ticks once, without a burst.
            node.advance_past(now);
        } else {
            node.rate.advance();
        }
        self.queue.ticked(node.rate.due());
        if occupied {
            return GO_ON;
        }
        match node.wait(due, now) {
            Some(starts) => {
                let graph = &mut *self.graph;
                graph.dispatcher.plan_start(index, starts, &graph.nodes);
                GO_ON
            }
            None => self.start(index, due, now),
        }
    }

    /// Starts a tick, which ends at once unless it takes time.
    fn start(&mut self, index: usize, due: Time, now: Time) -> Tick {
        self.started += 1;
        let node = &mut self.graph.nodes[index];
        let (lateness, cost) = (node.lateness(due, now), node.cost());
        if let Some(duration) = node.duration(now, cost) {
            let ends = node.start(now, duration, lateness)?;
            let graph = &mut *self.graph;
            graph.dispatcher.began(index, ends, now, &mut graph.nodes);
            return GO_ON;
        }
        let began = self.pacer.is_paced().then(Instant::now);
        let outcome = node.tick(now);
        let took = cost.or_else(|| began.map(|began| began.elapsed()));
        node.note_tick(now, lateness, took, Some(now));
        outcome
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use crossbeam_channel::Sender;

    use super::*;
    use crate::runtime::{
        command::TimedCommand,
        depth::Depth,
        executor::{Callback, Executor},
        knob::Knob,
        node::GO_ON,
        telemetry::Event,
        time::Hz,
        topic::Topic,
        trigger::{Arrival, Match, Wake},
    };

    type Ticks = Vec<(&'static str, Time)>;

    const UNTIL: Time = Time::from_nanos(500_000_000);

    fn hz(hz: f64) -> Hz {
        Hz::new(hz).expect("a rate")
    }

    /// The moment at which node `b` is slowed down.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Given {
        Never,
        /// Before any late node has ticked.
        First,
        /// While the first of them ticks.
        Amid,
    }

    /// A graph as the real clock may hand it over: run time is past the due times of `a`
    /// and `b`, and at that of `c`.
    fn late(given: Given, commander: Sender<Command>) -> (Graph, Arc<Mutex<Ticks>>) {
        let slower = Command::Set(Knob::Rate {
            node: "b".to_owned(),
            hz: hz(7.0),
        });
        if given == Given::First {
            commander.send(slower.clone()).expect("open");
        }
        let mut amid = (given == Given::Amid).then_some(slower);
        let (mut graph, log) = (Graph::new(), Arc::<Mutex<Ticks>>::default());
        for (name, rate) in [("a", 100.0), ("b", 50.0), ("c", 40.0)] {
            let (log, commander, mut amid) = (log.clone(), commander.clone(), amid.take());
            let node = move |now| {
                log.lock().expect("log").push((name, now));
                if let Some(slower) = amid.take() {
                    commander.send(slower)?;
                }
                GO_ON
            };
            graph.node(name, hz(rate), 0, |_| node).expect("a node");
        }
        graph.nodes.iter_mut().for_each(|node| node.rate.advance());
        graph.control.set_now(graph.nodes[2].rate.due());
        (graph, log)
    }

    fn run(given: Given, timed: Vec<TimedCommand>) -> (Ticks, Vec<Event>) {
        let (commander, mut inbox) = Inbox::new(timed);
        let (mut graph, log) = late(given, commander);
        let exit = VirtualClock.run(&mut graph, &mut inbox, UNTIL);
        assert_eq!(exit.expect("no fault"), ClockExit::Completed);
        let ticks = log.lock().expect("log").clone();
        (ticks, graph.observer().events(0))
    }

    #[test]
    fn a_live_command_and_the_same_as_a_timed_one_follow_the_ticks_of_late_nodes() {
        for given in [Given::First, Given::Amid] {
            let (ticks, events) = run(given, Vec::new());
            let now = Time::from_nanos(25_000_000);
            assert_eq!(
                ticks[..3],
                ["a", "b", "c"].map(|node| (node, now)),
                "{given:?}"
            );
            assert_eq!(events[0].at, now + Time::TICK, "{given:?}");
            let timed = events.iter().filter_map(Event::replayable).collect();
            assert_eq!(run(Given::Never, timed), (ticks, events), "{given:?}");
        }
    }

    /// Hears of arrivals and does nothing, as threads that are stopped.
    struct Stopped;

    impl Wake for Stopped {
        fn wake(&self, _: Arrival) {}
    }

    #[test]
    fn messages_in_flight_at_a_hand_over_trigger_their_nodes() {
        for executor in [None, Some(Executor::Single)] {
            let (mut graph, far) = (Graph::new(), Topic::new("/far", Depth::ONE));
            let log = Arc::<Mutex<Ticks>>::default();
            let seen = log.clone();
            graph
                .node("reader", Match::Each, 0, |wiring| {
                    let _ = wiring.trigger(&far);
                    move |now| {
                        seen.lock().expect("log").push(("reader", now));
                        GO_ON
                    }
                })
                .expect("a node");
            if let Some(executor) = executor {
                let reader = [Callback::of("reader")];
                graph.executor(executor, reader).expect("a node");
            }
            far.set_link("delay:30".parse().expect("a link"), 0, Time::ZERO);
            graph.dispatcher.leave(Arc::new(Stopped));
            far.publisher().publish(1, Time::ZERO, None);
            VirtualClock
                .run(&mut graph, &mut Inbox::default(), UNTIL)
                .expect("no fault");
            let arrives = Time::from_nanos(30_000_000);
            assert_eq!(*log.lock().expect("log"), [("reader", arrives)]);
        }
    }
}
