//! What a frame shows of a node, of a topic and of the push in force.

use std::time::Duration;

use ratelab::{Event, Time};
use ratelab_experiment::cause::Facts;
use ratelab_metrics::{NodeAccount, TopicAccount, mean_parts};
use ratelab_system::{System, acting};

use super::standing::RunMoment;
use crate::{
    age::{PARTS, PushData, PushSentence, UNKNOWN},
    frame::{NodeData, Quantiles, TopicData},
    knobs::in_words,
    lineage_taps::dots,
    push_age,
};

impl RunMoment<'_> {
    /// Returns the parts of the age of the push in force.
    pub fn push(&self) -> Option<PushData> {
        let Facts {
            graph,
            lineage,
            late: (from, to),
            ..
        } = self.facts;
        let acts = acting(self.facts.system, lineage.topology())?;
        let parts = lineage.push_at(acts, graph.now)?.parts(graph.now);
        let stages = mean_parts(lineage, acts, from, to);
        let mut mean = PARTS.map(|[_, word]| {
            Duration::from_nanos(
                stages
                    .iter()
                    .filter(|(stage, _)| stage.word() == word)
                    .map(|(_, ns)| ns)
                    .sum::<f64>() as u64,
            )
        });
        let known: Duration = mean.iter().sum();
        let age = self.facts.age.map_or(Duration::ZERO, |age| age.mean);
        if let Some(place) = PARTS.iter().position(|[_, word]| *word == UNKNOWN) {
            mean[place] += age.saturating_sub(known);
        }
        Some(PushData {
            sentence: PushSentence::new(&parts, lineage.topology()),
            reaction: push_age::greatest(lineage, acts, from, to),
            mean,
        })
    }

    /// Returns what is shown of a node, `lit` if it ticked recently.
    pub fn node(
        &self,
        node: &NodeAccount,
        [lateness, tick_time]: [Quantiles; 2],
        lit: bool,
    ) -> NodeData {
        NodeData {
            name: node.name.clone(),
            caption: self.facts.system.about().caption(&node.name),
            hz: node.hz,
            triggered: !node.triggers.is_empty(),
            ticks: node.ticks,
            overruns: node.overruns,
            lit,
            health: self.health(node),
            place: self.session.place(&node.name).map(|place| place.text),
            lateness,
            tick_time,
        }
    }
}

/// Returns what is shown of a topic.
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
        unmatched: topic.unmatched(),
        dots: dots(&topic.flights, now),
        publishers: topic.publishers.clone(),
        readers: topic.readers.iter().map(|s| s.node).collect(),
        age,
        held: topic.newest.map(|newest| now.since(newest)),
    }
}

/// Returns the marks of the knobs in `events` from run time `begin` (s) on.
pub(super) fn marks(system: &dyn System, events: &[Event], begin: f64) -> Vec<(f64, String)> {
    let knobs: Vec<_> = events
        .iter()
        .filter(|event| event.at.as_secs_f64() >= begin)
        .filter_map(Event::knob)
        .collect();
    let marks = in_words(system, &knobs).into_iter();
    marks.map(|(at, text)| (at.as_secs_f64(), text)).collect()
}
