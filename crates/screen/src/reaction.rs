//! The reaction time: how long a change goes unanswered.

use std::time::Duration;

use ratelab::Time;
use ratelab_metrics::{Lineage, sensing_of};

/// Returns the greatest reaction time of the pushes of node `acts` between two run times: from a
/// sensing, for what changes right after it, to the first push derived from a later one. `None`
/// without such a sensing.
///
/// It equals the greatest push age: Günzel and others, ECRTS 2023.
pub fn greatest(lineage: &Lineage, acts: usize, from: Time, to: Time) -> Option<Duration> {
    let pushes = pushes(lineage, acts, from, to);
    let (_, oldest, source) = *pushes.first()?;
    let sensings = lineage
        .sent(source)
        .rev()
        .map(sensing_of)
        .take_while(|sensed| *sensed >= oldest);
    let reaction = sensings.filter_map(|sensed| {
        let mut later = pushes.iter().filter(|(_, derived, _)| *derived > sensed);
        later.next().map(|(since, ..)| since.since(sensed))
    });
    reaction.max()
}

/// Returns the pushes in force between two run times, oldest first: run time of the first
/// application, run time of the sensing, and the topic of its message.
fn pushes(lineage: &Lineage, acts: usize, from: Time, to: Time) -> Vec<(Time, Time, usize)> {
    let mut pushes = Vec::new();
    for (push, _) in lineage.pushes_between(acts, from, to + Time::RESOLUTION) {
        let age = push.parts(push.since).sum_ns().unsigned_abs();
        let sensed = push.since - Duration::from_nanos(age);
        let chain = lineage.chain_of(&push);
        let Some(source) = chain.messages.last() else {
            break;
        };
        pushes.push((push.since, sensed, source.topic));
    }
    pushes.reverse();
    pushes
}

#[cfg(test)]
mod tests {
    use ratelab_experiment::Experiment;

    use super::*;
    use crate::{
        lineage_taps::LineageTaps,
        tests::kit::{self, config},
    };

    #[test]
    fn the_greatest_reaction_time_is_the_greatest_age_of_a_replaced_push() {
        for (setup, ms) in [
            ("control-hz 50", 20),
            ("control-hz 10; sensor-hz 25", 120),
            ("takes policy 30", 80),
            ("link /obs delay:50", 80),
        ] {
            let config = config(&format!("own; {setup}"));
            let experiment = Experiment::new(kit::setup().system, &config).expect("a graph");
            let mut taps = LineageTaps::new(&experiment);
            experiment.run().expect("no fault");
            let lineage = taps.update();
            let acts = lineage.topology().node("actuator").expect("an actuator");
            let [from, to] = [3, 4].map(|second| Time::from_nanos(second * 1_000_000_000));
            let reaction = greatest(lineage, acts, from, to);
            assert_eq!(reaction, Some(Duration::from_millis(ms)), "{setup}");
            let age = lineage.greatest_age(acts, from, to);
            assert_eq!(reaction, Some(age), "{setup}");
        }
    }
}
