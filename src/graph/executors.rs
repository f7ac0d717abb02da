//! Executors of a graph.

use super::{Graph, GraphError};
use crate::{
    command::ClockKind,
    placement::Placement,
    scheduling::{Dispatch, Member, Threads},
    seat::Seat,
    sync::Arc,
};

impl Graph {
    /// Has an executor run the nodes with these `names`, which were added before, in the order of
    /// their registration. Each executor has threads of its own, under the real clock as well.
    ///
    /// # Errors
    /// [`GraphError`] for a node that is unknown, that has an executor already, or that
    /// lacks the period that the executor needs.
    pub fn dispatch(
        &mut self,
        dispatch: Arc<dyn Dispatch>,
        names: &[String],
    ) -> Result<(), GraphError> {
        let mut members: Vec<Member> = Vec::new();
        for (number, name) in names.iter().enumerate() {
            let node = self.index_for(&*dispatch, number, name)?;
            if members.iter().any(|known| known.node == node) {
                return Err(GraphError::SecondExecutor(name.clone()));
            }
            members.push(Member { node, number });
        }
        let index = self.stage.executors().count();
        let queues = dispatch.queues_timers();
        let shared = self.stage.add_executor(dispatch.clone(), members.clone());
        let placement = match shared {
            true => Placement::Executor { index, queues },
            false => Placement::Let,
        };
        for Member { node, number } in members {
            let task = &mut self.stage.tasks[node];
            task.placement = placement;
            if dispatch.skips_first() {
                task.rate.skip_first();
            }
            let node = &mut self.control.nodes[node].topology;
            node.executor = Some(dispatch.name());
            node.executor_index = placement.executor();
            node.group = dispatch.group(number).map(Into::into);
        }
        Ok(())
    }

    /// The index of a member, if the executor can have it.
    fn index_for(
        &self,
        dispatch: &dyn Dispatch,
        number: usize,
        name: &str,
    ) -> Result<usize, GraphError> {
        let mut tasks = self.stage.tasks.iter();
        let known = tasks.position(|task| *task.name == *name);
        let unknown = || GraphError::UnknownCallback(name.to_owned(), dispatch.name());
        let index = known.ok_or_else(unknown)?;
        let task = &self.stage.tasks[index];
        if task.placement != Placement::Thread {
            return Err(GraphError::SecondExecutor(name.to_owned()));
        }
        let remedy = dispatch.period_remedy(number);
        match remedy.filter(|_| task.is_triggered()) {
            Some(remedy) => Err(GraphError::NoPeriod(
                name.to_owned(),
                dispatch.name(),
                remedy,
            )),
            None => Ok(index),
        }
    }

    /// Sets the number of cores that the real clock has for preemptive executors; see
    /// [`Clock::cores`](crate::Clock::cores).
    pub fn set_cores(&mut self, cores: Option<usize>) {
        self.cores = cores;
    }

    /// Why the graph cannot run under this clock, with the remedy.
    pub fn refusal_of(&self, clock: ClockKind) -> Option<String> {
        let (seat, why) = self.needs_virtual_time()?;
        (clock == ClockKind::Real).then(|| format!("{}: {why}", seat.name))
    }

    /// The node that the real clock cannot run, with the reason and the remedy.
    pub(crate) fn needs_virtual_time(&self) -> Option<(&Seat, String)> {
        let mut spare = self.cores.unwrap_or(0);
        let mut executors = self.stage.executors();
        executors.find_map(|(dispatch, members)| {
            let executor = dispatch.name();
            let why = match dispatch.threads() {
                Threads::Virtual => format!("the real clock has no executor {executor}"),
                Threads::Cores(_) if self.cores.is_none() => {
                    format!("under the real clock {executor} needs real-time priority (--realtime)")
                }
                Threads::Cores(cores) if cores > spare => format!(
                    "under the real clock {executor} needs {cores} cores beside the one for all \
                     other threads, and {spare} are left"
                ),
                Threads::Cores(cores) => {
                    spare -= cores;
                    return None;
                }
                Threads::Shared(_) => return None,
            };
            let first = members.first()?;
            Some((
                &self.seats[first.node],
                format!("{why}: choose the virtual clock"),
            ))
        })
    }
}
