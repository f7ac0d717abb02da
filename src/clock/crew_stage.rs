//! A crew with a stage of its own, which its threads share.

use crate::{
    command::ClockKind,
    scheduling::{Assignment, Crew, Seat, Stage, Threads},
    shared::{Shared, Turn},
    state::RunState,
    sync::{Arc, Mutex},
    time::Time,
};

/// A crew with a stage of its own.
pub(crate) struct CrewStage<'g> {
    stage: Shared<Stage>,
    /// Those of all nodes of the graph.
    seats: &'g [Mutex<Seat>],
    pub(crate) state: Arc<RunState>,
    /// Index of its first node.
    pub(crate) first: usize,
    /// Number of threads; none if all nodes run in other processes.
    pub(crate) threads: usize,
}

impl<'g> CrewStage<'g> {
    pub(crate) fn new(crew: Crew, seats: &'g [Mutex<Seat>], state: Arc<RunState>) -> Self {
        let dispatch = crew.dispatch.as_ref();
        let threads = match dispatch.map(|dispatch| dispatch.threads()) {
            Some(Threads::Shared(threads)) => threads,
            _ => 1,
        };
        let here = crew.members.iter().filter(|member| !member.remote).count();
        let first = crew.members.first();
        let name = first.map_or("", |member| &*member.name);
        Self {
            // A node ticks once at a time: more threads would have nothing to do.
            threads: threads.min(here),
            first: first.map_or(0, |member| member.node),
            seats,
            state,
            stage: Shared::after(
                crew.turns,
                format!("the executor of {name}"),
                Stage::of_crew(ClockKind::Real, crew),
            ),
        }
    }

    /// Its crew, with the turns of its threads.
    pub(crate) fn into_crews(self) -> Vec<Crew> {
        let turns = self.stage.turns();
        let crews = self.stage.aside().take_crews().into_iter();
        crews.map(|crew| Crew { turns, ..crew }).collect()
    }

    /// Name of its first node.
    pub(crate) fn name(&self) -> Arc<str> {
        let stage = self.aside();
        let mut names = stage.members().map(|member| member.name.clone());
        names.next().unwrap_or_else(|| "".into())
    }

    pub(crate) fn seat(&self, node: usize) -> &Mutex<Seat> {
        &self.seats[node]
    }

    /// The end of the running tick of its first node, if there is one.
    pub(crate) fn end_of_first(&self, now: Time) -> Option<Assignment> {
        self.aside().end_of(self.first, now)
    }

    /// Whether several threads share the schedule, in turns.
    pub(crate) fn is_shared(&self) -> bool {
        self.threads > 1
    }

    /// The schedule, for a turn of a thread.
    pub(crate) fn stage(&self) -> Turn<'_, Stage> {
        match self.is_shared() {
            true => self.stage.lock(),
            false => self.stage.aside(),
        }
    }

    /// The schedule, for a look.
    pub(crate) fn aside(&self) -> Turn<'_, Stage> {
        self.stage.aside()
    }
}
