//! Which threads the nodes of a graph have.

use std::{
    collections::{BTreeSet, HashMap},
    mem::take,
};

use super::{
    SUPERVISOR,
    crew::Crew,
    mailbox::{Mailbox, Wakeup},
};
use crate::{
    command::ClockKind,
    executor::{Callback, Executor},
    graph::Graph,
    realtime::{CoreShare, spare_cores},
    scheduling::Stage,
    seat::Seat,
    sync::Arc,
    task::Task,
    time::Time,
    trigger::{Arrival, Wake},
};

/// The nodes of a graph while they are on their threads.
pub(super) struct Threads {
    pub(super) crews: Vec<Crew>,
    /// Those of other processes.
    elsewhere: Vec<Node>,
}

/// A node with its index.
type Node = (usize, Task, Seat);

/// The mailbox of each node's thread; the nodes of an executor have one in common.
pub(super) fn mailboxes(graph: &Graph) -> Vec<Arc<Mailbox>> {
    let nodes = graph.seats.iter();
    let mut mailboxes: Vec<Arc<Mailbox>> = nodes.map(|_| Arc::default()).collect();
    let executors = graph.stage.executors();
    for (_, members) in executors.filter(|(executor, _)| !executor.is_preemptive()) {
        let common = Arc::<Mailbox>::default();
        for (node, _) in members {
            mailboxes[*node] = common.clone();
        }
    }
    mailboxes
}

/// Posts arrivals to the threads of the nodes.
struct Post(Vec<Option<Arc<Mailbox>>>);

impl Wake for Post {
    fn wake(&self, arrival: Arrival) {
        if let Some(Some(mailbox)) = self.0.get(arrival.node) {
            mailbox.post(Wakeup::Arrival(arrival));
        }
    }
}

/// Has the nodes of this process get their messages through their mailboxes.
fn begin_arrivals(graph: &mut Graph, mailboxes: &[Arc<Mailbox>]) {
    let nodes = graph.seats.iter().zip(mailboxes);
    let here = nodes.map(|(seat, mailbox)| (!seat.remote).then(|| mailbox.clone()));
    let post = Arc::new(Post(here.collect()));
    graph.stage.leave(post.clone());
    for arrival in graph.control.arrivals_after(graph.now()) {
        post.wake(arrival);
    }
}

/// The cores of each node whose executor takes it off them for others, by its index.
fn shares(graph: &Graph) -> HashMap<usize, CoreShare> {
    let (mut spare, mut shares) = (spare_cores(), HashMap::new());
    for (executor, members) in graph.stage.executors() {
        let Executor::FixedPriority { cores } = executor else {
            continue;
        };
        let cores = spare.split_off(spare.len().saturating_sub(cores));
        let here = members.iter().map(|(index, _)| *index);
        let here: Vec<usize> = here.filter(|index| !graph.seats[*index].remote).collect();
        let priority = |index: usize| graph.stage.tasks[index].priority;
        let priorities: BTreeSet<u32> = here.iter().map(|index| priority(*index)).collect();
        shares.extend(here.into_iter().map(|index| {
            let rank = priorities.range(..priority(index)).count();
            let cores = cores.clone();
            (index, CoreShare { rank, cores })
        }));
    }
    shares
}

impl Threads {
    /// Takes the nodes of this process out of the graph and gives them threads, at run time
    /// `now`.
    pub(super) fn new(graph: &mut Graph, mailboxes: &[Arc<Mailbox>], now: Time) -> Self {
        begin_arrivals(graph, mailboxes);
        let mut shares = shares(graph);
        let executors = graph.stage.executors();
        let executors: Vec<_> = executors
            .map(|(executor, members)| (executor, members.to_vec()))
            .collect();
        let tasks = take(&mut graph.stage.tasks).into_iter();
        let nodes = tasks.zip(take(&mut graph.seats)).enumerate();
        let (elsewhere, here): (Vec<Node>, Vec<Node>) = nodes
            .map(|(index, (task, seat))| (index, task, seat))
            .partition(|(.., seat)| seat.remote);
        let mut here: HashMap<usize, Node> = here.into_iter().map(|node| (node.0, node)).collect();
        let mut crew = |members: Vec<(usize, Callback)>, executor: Option<Executor>| {
            let members = members.into_iter().filter_map(|(index, callback)| {
                let node = here.remove(&index)?;
                Some((node, callback))
            });
            let (nodes, callbacks): (Vec<Node>, Vec<Callback>) = members.unzip();
            let first = nodes.first()?.0;
            let share = shares.remove(&first).filter(|_| callbacks.len() == 1);
            let mut stage_tasks = Vec::new();
            let nodes = nodes.into_iter().map(|(index, task, seat)| {
                stage_tasks.push(task);
                let log = graph.control.state.entries_of(SUPERVISOR + 1 + index);
                (index, seat, log)
            });
            let nodes: Vec<_> = nodes.collect();
            let mut stage = Stage::new(ClockKind::Real, stage_tasks);
            if let Some(executor) = executor {
                stage.add_executor(executor, callbacks.into_iter().enumerate().collect());
            }
            stage.open(now, Vec::new);
            let threads = match executor {
                Some(Executor::Multi { threads }) => threads,
                _ => 1,
            };
            Some(Crew::new(
                stage,
                threads,
                nodes,
                mailboxes[first].clone(),
                share,
            ))
        };
        let mut crews = Vec::new();
        for (executor, members) in executors {
            match executor {
                // The operating system has its nodes take turns.
                Executor::FixedPriority { .. } => {
                    let alone = Some(Executor::FixedPriority { cores: 1 });
                    let members = members.into_iter();
                    crews.extend(members.filter_map(|member| crew(vec![member], alone)));
                }
                _ => crews.extend(crew(members, Some(executor))),
            }
        }
        let own = (0..mailboxes.len()).map(|index| vec![(index, Callback::of(""))]);
        crews.extend(own.filter_map(|member| crew(member, None)));
        Self { crews, elsewhere }
    }

    /// Number of threads.
    pub(super) fn count(&self) -> usize {
        self.crews.iter().map(|crew| crew.threads).sum()
    }

    /// Puts the nodes back.
    pub(super) fn end(self, graph: &mut Graph) {
        let crews = self.crews.into_iter().flat_map(Crew::into_nodes);
        let mut nodes: Vec<Node> = crews.chain(self.elsewhere).collect();
        nodes.sort_by_key(|node| node.0);
        for (_, task, seat) in nodes {
            graph.stage.tasks.push(task);
            graph.seats.push(seat);
        }
    }
}
