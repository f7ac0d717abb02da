//! Which threads the nodes of a graph have.

use std::collections::{BTreeSet, HashMap};

use super::{SUPERVISOR, crew::Crew, logged::LoggedNode, mailbox::Mailbox, worker::Worker};
use crate::runtime::{
    dispatch::Dispatcher,
    executor::Executor,
    graph::Graph,
    realtime::{CoreShare, spare_cores},
    scheduled_node::ScheduledNode,
    sync::Arc,
    telemetry::RunState,
    time::Time,
};

/// The nodes of this process, each with its thread or with others on those of an executor.
pub(super) struct Threads<'g> {
    pub(super) workers: Vec<Worker<'g>>,
    pub(super) crews: Vec<Crew<'g>>,
}

/// The mailbox of each node's thread; the nodes of an executor have one in common.
pub(super) fn mailboxes(graph: &Graph) -> Vec<Arc<Mailbox>> {
    let nodes = graph.nodes.iter();
    let mut mailboxes: Vec<Arc<Mailbox>> = nodes.map(|_| Arc::default()).collect();
    let executors = graph.dispatcher.executors();
    for (_, members) in executors.filter(|(executor, _)| !executor.is_preemptive()) {
        let common = Arc::<Mailbox>::default();
        for (node, _) in members {
            mailboxes[*node] = common.clone();
        }
    }
    mailboxes
}

/// The cores of each node whose executor takes it off them for others, by its index.
fn shares(
    dispatcher: &Dispatcher,
    nodes: &[Option<&mut ScheduledNode>],
) -> HashMap<usize, CoreShare> {
    let (mut spare, mut shares) = (spare_cores(), HashMap::new());
    for (executor, members) in dispatcher.executors() {
        let Executor::FixedPriority { cores } = executor else {
            continue;
        };
        let cores = spare.split_off(spare.len().saturating_sub(cores));
        let members = members.iter().filter_map(|(index, _)| {
            let node = nodes[*index].as_ref()?;
            Some((*index, node.entry.priority))
        });
        let members: Vec<_> = members.collect();
        let priorities: BTreeSet<u32> = members.iter().map(|(_, priority)| *priority).collect();
        shares.extend(members.into_iter().map(|(index, priority)| {
            let rank = priorities.range(..priority).count();
            let cores = cores.clone();
            (index, CoreShare { rank, cores })
        }));
    }
    shares
}

impl<'g> Threads<'g> {
    /// Gives the nodes of this process their threads, at run time `now`.
    pub(super) fn new(
        state: &RunState,
        dispatcher: &Dispatcher,
        nodes: &'g mut [ScheduledNode],
        mailboxes: &'g [Arc<Mailbox>],
        now: Time,
    ) -> Self {
        let here = nodes.iter_mut().map(Some);
        let mut here: Vec<_> = here
            .map(|node| node.filter(|node| !node.entry.remote))
            .collect();
        let logged = |index: usize, node| {
            let log = state.threads.stream(SUPERVISOR + 1 + index);
            LoggedNode::new(index, node, log)
        };
        let mut shares = shares(dispatcher, &here);
        let executors = dispatcher.executors();
        let executors = executors.filter(|(executor, _)| !executor.is_preemptive());
        let crews = executors.filter_map(|(executor, callbacks)| {
            let members = callbacks.iter().filter_map(|(index, callback)| {
                let node = here[*index].take()?;
                Some((logged(*index, node), callback.clone()))
            });
            let members: Vec<_> = members.collect();
            let mailbox = mailboxes[callbacks.first()?.0].clone();
            Crew::new(executor, members, mailbox, now)
        });
        let crews = crews.collect();
        let own = here.into_iter().zip(mailboxes).enumerate();
        let own = own.filter_map(|(index, (node, mailbox))| {
            Some(Worker::new(
                logged(index, node?),
                mailbox,
                shares.remove(&index),
            ))
        });
        Self {
            workers: own.collect(),
            crews,
        }
    }

    /// Number of threads.
    pub(super) fn count(&self) -> usize {
        let crews = self.crews.iter().map(|crew| crew.threads);
        self.workers.len() + crews.sum::<usize>()
    }
}
