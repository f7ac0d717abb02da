//! What a frame shows of a node, of a topic and of the push in force.

use std::time::Duration;

use ratelab::{Event, Time};
use ratelab_account::{NodeAccount, Snapshot, TopicAccount};
use ratelab_study::{experiment::mean_parts, system::System};

use super::standing::health;
use crate::{
    cause::{Hang, acting, latest},
    flights::dots,
    frame::{AgeData, Health, NodeData, PartKind, PushData, PushSentence, Quantiles, TopicData},
    knobs::in_words,
    reaction,
    run::RunSource,
};

/// The parts of the age of the push in force.
pub(super) fn push(
    session: &dyn RunSource,
    graph: &Snapshot,
    age: Option<AgeData>,
) -> Option<PushData> {
    let acts = acting(session.system(), graph)?;
    let lineage = session.lineage();
    let (from, to) = match age {
        Some(age) => age.stretch,
        None => latest(graph, lineage, acts),
    };
    let parts = lineage.push_at(acts, graph.now)?.parts(graph.now);
    let stages = mean_parts(lineage, acts, from, to);
    let mut mean = PartKind::ALL.map(|kind| {
        let of_kind = stages
            .iter()
            .filter(|(stage, _)| PartKind::of(*stage) == kind);
        let ns: f64 = of_kind.map(|(_, ns)| ns).sum();
        (kind, Duration::from_nanos(ns as u64))
    });
    let known: Duration = mean.iter().map(|(_, took)| *took).sum();
    let rest = age.map_or(Duration::ZERO, |age| age.mean.saturating_sub(known));
    mean.iter_mut()
        .filter(|(kind, _)| *kind == PartKind::Elsewhere)
        .for_each(|(_, took)| *took += rest);
    Some(PushData {
        sentence: PushSentence::of(&parts, lineage.topology()),
        reaction: reaction::greatest(lineage, acts, from, to),
        mean: mean.to_vec(),
    })
}

/// What is shown of a node.
pub(super) fn node_data(
    session: &dyn RunSource,
    node: &NodeAccount,
    [lateness, tick_time]: [Quantiles; 2],
    (hangs, now): (&[Hang], Time),
) -> NodeData {
    let place = session.place(&node.name);
    let gone = place.as_ref().is_some_and(|place| place.absent.is_some());
    NodeData {
        name: node.name.clone(),
        caption: session.system().about().caption(&node.name),
        hz: node.hz,
        triggered: !node.triggers.is_empty(),
        ticks: node.ticks,
        overruns: node.overruns,
        lit: false,
        health: match gone {
            true => Health::Gone,
            false => health(node, hangs, now),
        },
        place: place.map(|place| place.text),
        lateness,
        tick_time,
    }
}

/// What is shown of a topic.
pub(super) fn topic_data(topic: &TopicAccount, age: Quantiles, now: Time) -> TopicData {
    TopicData {
        name: topic.name.clone(),
        depth: topic.depth.get(),
        published: topic.published,
        per_second: topic.per_second(now),
        average: topic.average(now),
        dropped: topic.dropped(),
        dropped_lately: topic.dropped_lately(now),
        lost: topic.lost,
        lost_lately: topic.lost_lately(now),
        overtaken: topic.overtaken,
        dots: dots(&topic.flights, now),
        publishers: topic.publishers.clone(),
        readers: topic.readers.iter().map(|s| s.node).collect(),
        age,
        held: topic.newest.map(|newest| now.since(newest)),
    }
}

/// The marks of the knobs in `events` from run time `begin` (s) on.
pub(super) fn marks(system: &dyn System, events: &[Event], begin: f64) -> Vec<(f64, String)> {
    let recent = events
        .iter()
        .filter(|event| event.at.as_secs_f64() >= begin);
    let knobs: Vec<_> = recent.filter_map(Event::knob).collect();
    let marks = in_words(system, &knobs).into_iter();
    marks.map(|(at, text)| (at.as_secs_f64(), text)).collect()
}
