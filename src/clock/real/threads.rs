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
    graph::Graph,
    realtime::{CoreShare, spare_cores},
    scheduling::{Dispatch, Member, Stage, Threads},
    seat::Seat,
    sync::Arc,
    task::Task,
    time::Time,
    trigger::{Arrival, Wake},
};

/// The nodes of a graph while they are on their threads.
pub(super) struct NodeThreads {
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
    let shared = |threads| matches!(threads, Threads::Shared(_));
    for (_, members) in executors.filter(|(dispatch, _)| shared(dispatch.threads())) {
        let common = Arc::<Mailbox>::default();
        for member in members {
            mailboxes[member.node] = common.clone();
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
    for (dispatch, members) in graph.stage.executors() {
        let Threads::Cores(cores) = dispatch.threads() else {
            continue;
        };
        let cores = spare.split_off(spare.len().saturating_sub(cores));
        let here = members.iter().map(|member| member.node);
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

impl NodeThreads {
    /// Takes the nodes of this process out of the graph and gives them threads, at run time
    /// `now`.
    pub(super) fn new(graph: &mut Graph, mailboxes: &[Arc<Mailbox>], now: Time) -> Self {
        begin_arrivals(graph, mailboxes);
        let mut shares = shares(graph);
        let executors = graph.stage.executors();
        let executors: Vec<_> = executors
            .map(|(dispatch, members)| (dispatch.clone(), members.to_vec()))
            .collect();
        let tasks = take(&mut graph.stage.tasks).into_iter();
        let nodes = tasks.zip(take(&mut graph.seats)).enumerate();
        let (elsewhere, here): (Vec<Node>, Vec<Node>) = nodes
            .map(|(index, (task, seat))| (index, task, seat))
            .partition(|(.., seat)| seat.remote);
        let mut here: HashMap<usize, Node> = here.into_iter().map(|node| (node.0, node)).collect();
        let mut crew = |members: Vec<Member>, dispatch: Option<Arc<dyn Dispatch>>| {
            let members = members.into_iter().filter_map(|member| {
                let node = here.remove(&member.node)?;
                Some((node, member.number))
            });
            let (nodes, numbers): (Vec<Node>, Vec<usize>) = members.unzip();
            let first = nodes.first()?.0;
            let share = shares.remove(&first).filter(|_| numbers.len() == 1);
            let mut stage_tasks = Vec::new();
            let nodes = nodes.into_iter().map(|(index, task, seat)| {
                stage_tasks.push(task);
                let log = graph.control.state.entries_of(SUPERVISOR + 1 + index);
                (index, seat, log)
            });
            let nodes: Vec<_> = nodes.collect();
            let mut stage = Stage::new(ClockKind::Real, stage_tasks);
            let threads = match dispatch.as_ref().map(|dispatch| dispatch.threads()) {
                Some(Threads::Shared(threads)) => threads,
                _ => 1,
            };
            if let Some(dispatch) = dispatch {
                let members = numbers.into_iter().enumerate();
                let members = members.map(|(node, number)| Member { node, number });
                stage.add_executor(dispatch, members.collect());
            }
            stage.open(now, Vec::new);
            Some(Crew::new(
                stage,
                threads,
                nodes,
                mailboxes[first].clone(),
                share,
            ))
        };
        let mut crews = Vec::new();
        for (dispatch, members) in executors {
            match dispatch.threads() {
                // The operating system has its nodes take turns.
                Threads::Cores(_) => {
                    let mut alone = |member| crew(vec![member], Some(dispatch.clone()));
                    crews.extend(members.into_iter().filter_map(&mut alone));
                }
                _ => crews.extend(crew(members, Some(dispatch))),
            }
        }
        let own = (0..mailboxes.len()).map(|node| vec![Member { node, number: 0 }]);
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
