//! Threads in the hands of a clock of another crate, which knows what their clocks answered.

use super::{
    crews::{CrewNodes, Crews, Done, Outcome, supervise},
    obey::Obeyed,
};
use crate::{
    command::Command,
    graph::{ControlPlane, Graph},
    job::JobKind,
    journal::LateLook,
    scheduling::{Assignment, Moment, Stage},
    sync::Arc,
    time::Time,
    trigger::{Arrival, Wake},
    turns::Turn,
};

/// The crews of a graph, out of it until [`CrewHands::put_back`].
#[must_use = "the graph has no nodes until they are put back"]
pub struct CrewHands(Crews);

/// A thread of a crew: what a thread of the real clock does, by the same rules.
pub struct ThreadHand<'g> {
    crew: &'g CrewNodes,
    /// The messages that it has heard of since its last look.
    arrivals: Vec<Arrival>,
    /// The work of its last look, which is not yet over.
    done: Option<Done>,
}

/// What is left of a graph without its nodes, for one thread.
pub struct SupervisorHand<'g>(&'g mut ControlPlane);

/// Nobody waits for messages: the clock knows when nodes hear of them.
struct Unheard;

impl Wake for Unheard {
    fn wake(&self, _: Arrival) {}
}

impl Graph {
    /// Takes the nodes into the hands of the caller.
    pub fn take_in_hand(&mut self) -> CrewHands {
        CrewHands(Crews::of(self, Arc::new(Unheard)))
    }

    /// What is left without the nodes.
    pub fn supervisor_hand(&mut self) -> SupervisorHand<'_> {
        SupervisorHand(&mut self.control)
    }
}

impl CrewHands {
    /// The threads that nodes have, each with the index of the node that it is numbered by.
    pub fn threads(&self) -> impl Iterator<Item = (usize, ThreadHand<'_>)> {
        let here = self.0.all.iter().filter(|crew| crew.threads > 0);
        here.flat_map(|crew| {
            let nodes = crew.nodes().iter().take(crew.threads);
            nodes.map(move |node| {
                let (arrivals, done) = (Vec::new(), None);
                let hand = ThreadHand {
                    crew,
                    arrivals,
                    done,
                };
                (*node, hand)
            })
        })
    }

    /// Puts the nodes back.
    pub fn put_back(self, graph: &mut Graph) {
        self.0.put_back(graph);
    }
}

impl SupervisorHand<'_> {
    /// Carries out, at run time `at`, a command that no node can.
    pub fn obey(&mut self, command: &Command, at: Time) -> Obeyed {
        supervise(self.0, command, at)
    }
}

impl<'g> ThreadHand<'g> {
    /// Hears that a message arrives for a node of the crew, by its number there.
    pub fn arrive(&mut self, arrival: Arrival) {
        if self.crew.has_input(arrival.node, arrival.input) {
            self.arrivals.push(arrival);
        }
    }

    /// Looks for work at run time `at`, and does it; returns the index of the node that did
    /// some.
    pub fn look(&mut self, at: Time, late: Option<LateLook>) -> Option<usize> {
        self.crew.state.advance_to(at);
        let mut stage = self.stage();
        let work = stage.look(Moment::of(at, late));
        drop(stage);
        self.work(work?, at)
    }

    /// The schedule, which has heard of the messages that arrive.
    fn stage(&mut self) -> Turn<'g, Stage> {
        let mut stage = self.crew.stage();
        let arrivals = self.arrivals.drain(..);
        arrivals.for_each(|arrival| stage.add_arrival(arrival));
        stage
    }

    /// Ends the running tick at run time `at`, if there is one: it has had its time on a core.
    pub fn finish(&mut self, at: Time) -> Option<usize> {
        self.crew.aside().state(0, at).remaining?;
        self.work(Assignment::end_of_only(), at)
    }

    fn work(&mut self, work: Assignment, at: Time) -> Option<usize> {
        if work.job.kind == JobKind::Take {
            return None;
        }
        self.done = Some(self.crew.work(work, at));
        Some(self.crew.nodes()[work.place])
    }

    /// That work is over at run time `at`; ticks due before `passed` are missed.
    pub fn done(&mut self, at: Time, passed: Time) -> Outcome {
        self.crew.done(self.done.take()?, at, passed)
    }

    /// Has a node of the crew carry out its command at run time `at`; returns the position of
    /// the event, or `None` if the node is not in the crew.
    pub fn obey(&mut self, command: &Command, at: Time) -> Option<usize> {
        let place = self.crew.place_of(command.node()?)?;
        let stage = &mut *self.stage();
        Some(self.crew.obey(stage, place, command, at))
    }

    /// Refuses such a command for this `reason`.
    pub fn refuse(&mut self, command: &Command, at: Time, reason: &str) -> usize {
        let _stage = self.stage();
        self.crew.state.advance_to(at);
        self.crew.state.refused(at, command, reason)
    }

    /// Ends the thread: ticks due before `before` are missed.
    pub fn leave(&mut self, before: Time) {
        self.crew.stage().close(before, before);
    }
}
