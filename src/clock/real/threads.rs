//! Which threads the nodes of a graph have.

use std::collections::{BTreeSet, HashMap};

use super::{
    crew::CrewThreads,
    mailbox::{Mailbox, Wakeup},
};
use crate::{
    clock::crews::Crews,
    graph::Graph,
    realtime::{CoreShare, spare_cores},
    scheduling::Threads,
    sync::Arc,
    trigger::{Arrival, Wake},
};

/// The mailbox of each node's thread; the nodes of an executor have one in common.
pub(super) fn mailboxes(graph: &Graph) -> Vec<Arc<Mailbox>> {
    let nodes = graph.seats.iter();
    let mut mailboxes: Vec<Arc<Mailbox>> = nodes.map(|_| Arc::default()).collect();
    for crew in graph.stage.crews() {
        let dispatch = crew.dispatch.as_ref();
        if dispatch.is_some_and(|d| matches!(d.threads(), Threads::Shared(_))) {
            let common = Arc::<Mailbox>::default();
            for member in &crew.members {
                mailboxes[member.node] = common.clone();
            }
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

/// Takes the crews out of a graph, whose nodes get their messages through their mailboxes.
pub(super) fn crews_of(graph: &mut Graph, mailboxes: &[Arc<Mailbox>]) -> Crews {
    let nodes = mailboxes.iter().enumerate();
    let here = nodes.map(|(node, mailbox)| graph.is_here(node).then(|| mailbox.clone()));
    let post = Arc::new(Post(here.collect()));
    let crews = Crews::of(graph, post.clone());
    for arrival in graph.control.arrivals_after(graph.now()) {
        post.wake(arrival);
    }
    crews
}

/// The threads of the crews that have some here.
pub(super) fn threads<'g>(
    crews: &'g Crews,
    mailboxes: &[Arc<Mailbox>],
    mut shares: HashMap<usize, CoreShare>,
) -> Vec<CrewThreads<'g>> {
    let here = crews.all.iter().filter(|crew| crew.threads > 0);
    let threads = here.map(|crew| {
        let first = crew.nodes()[0];
        CrewThreads::new(crew, mailboxes[first].clone(), shares.remove(&first))
    });
    threads.collect()
}

/// The cores of each node whose executor takes it off them for others, by its index.
pub(super) fn shares(graph: &Graph) -> HashMap<usize, CoreShare> {
    let (mut spare, mut shares) = (spare_cores(), HashMap::new());
    for crew in graph.stage.crews() {
        let threads = crew.dispatch.as_ref().map(|dispatch| dispatch.threads());
        let Some(Threads::Cores(cores)) = threads else {
            continue;
        };
        let cores = spare.split_off(spare.len().saturating_sub(cores));
        let here = || crew.members.iter().filter(|member| !member.remote);
        let priorities: BTreeSet<u32> = here().map(|member| member.priority).collect();
        shares.extend(here().map(|member| {
            let rank = priorities.range(..member.priority).count();
            let cores = cores.clone();
            (member.node, CoreShare { rank, cores })
        }));
    }
    shares
}
