//! The age of pushes, and of the last change.

use std::{collections::VecDeque, time::Duration};

use ratelab::{Head, Time, TimeSpan};
use ratelab_metrics::{LATELY, Lineage, PushAge, Sawtooth, Snapshot};
use ratelab_system::System;

use crate::age::AgeData;

/// Moments kept: an hour at 50 Hz.
const KEPT: usize = 180_000;

/// The age of the push in force, as a saw.
#[derive(Default)]
pub struct PushAges {
    /// Whether states have all of it; `None` before the first look at the graph.
    by_states: Option<bool>,
    /// The age from the newest state on.
    newest: Option<Sawtooth>,
    /// Run times and the integral of the age until then (s²).
    areas: VecDeque<(Time, f64)>,
    /// The last second, as the newest sample has it: exact however rarely one samples.
    late: Option<AgeData>,
    /// Run time (s) and age (ms) at the ends of each tooth.
    saw: VecDeque<(f64, f64)>,
}

impl PushAges {
    /// Adds the present push of `graph` where states do not have it; to be called before the
    /// first state.
    pub fn look(&mut self, system: &dyn System, graph: &Snapshot) {
        let by_states = self
            .by_states
            .get_or_insert_with(|| by_states(system, graph));
        let mut ages = graph.nodes.iter().map(|node| &node.push_age);
        if !*by_states && let Some(age) = ages.find(|age| age.saw().is_some()) {
            self.seen(age, graph.now);
        }
    }

    /// Adds the push of a state: from run time `at` on it is derived from a sensing at
    /// `sensed`.
    pub fn state(&mut self, at: Time, sensed: Time) {
        if self.by_states == Some(false) {
            return;
        }
        let before = self.newest;
        let newest = before.map_or(Sawtooth::new(at, sensed), |before| {
            before.drop_to(at, sensed)
        });
        let peak = before.map(|before| (at.as_secs_f64(), before.age(at).as_secs_f64() * 1e3));
        self.saw.extend(peak);
        self.newest = Some(newest);
        self.add(newest, at);
    }

    fn seen(&mut self, age: &PushAge, now: Time) {
        let is_new = self.areas.back().is_none_or(|(at, _)| *at < now);
        if let Some(saw) = age.saw().filter(|_| is_new) {
            self.add(*saw, now);
            self.late = age.lately(now).map(|late| AgeData {
                mean: Duration::from_secs_f64(late.mean_s),
                greatest: late.greatest,
                stretch: TimeSpan::new(late.from, now),
                ..AgeData::default()
            });
        }
    }

    fn add(&mut self, age: Sawtooth, at: Time) {
        self.areas.push_back((at, age.area_s2(at)));
        self.saw
            .push_back((at.as_secs_f64(), age.age(at).as_secs_f64() * 1e3));
        let old = |kept: usize| kept.saturating_sub(KEPT);
        self.areas.drain(..old(self.areas.len()));
        self.saw.drain(..old(self.saw.len()));
    }

    /// Returns the age over the last second before `now`, or the last two `period`s if that is
    /// longer, without its limits. `None` before the first push, and where it was not looked at
    /// that often.
    pub fn recent(&self, period: Duration, now: Time) -> Option<AgeData> {
        let window = LATELY.max(period * 2);
        let recent = match self.late.filter(|_| window == LATELY) {
            Some(late) => late,
            None => self.over(window)?,
        };
        Some(AgeData {
            greatest: recent.greatest.max(self.present(now)),
            ..recent
        })
    }

    /// Returns the age of the push in force at `now`, which has grown since its newest state; zero
    /// where a newer state may be on its way, because the run is ahead of the states that came.
    fn present(&self, now: Time) -> Duration {
        let mut newest = self.areas.iter().rev().map(|(at, _)| *at);
        let is_newest = match (newest.next(), newest.next()) {
            (Some(last), Some(before)) => now.since(last) <= last.since(before),
            _ => true,
        };
        self.newest
            .filter(|_| is_newest)
            .map_or(Duration::ZERO, |newest| newest.age(now))
    }

    /// Returns the age over the last `window` before the newest state; at the first one, the age
    /// there.
    fn over(&self, window: Duration) -> Option<AgeData> {
        let &(now, area) = self.areas.back()?;
        let within = |at: Time| now.since(at) < window;
        let first = self.areas.partition_point(|(at, _)| !within(*at));
        let &(begin, before) = self.areas.get(first.saturating_sub(1))?;
        let time = now.since(begin);
        if time > window * 2 {
            return None;
        }
        let since = begin.as_secs_f64();
        let greatest = self
            .saw
            .iter()
            .rev()
            .take_while(|(at, _)| *at > since)
            .map(|(_, ms)| *ms)
            .fold(0.0, f64::max);
        let mean = if time.is_zero() {
            self.saw.back()?.1 / 1e3
        } else {
            (area - before) / time.as_secs_f64()
        };
        Some(AgeData {
            mean: Duration::from_secs_f64(mean.max(0.0)),
            greatest: Duration::from_secs_f64(mean.max(greatest / 1e3)),
            stretch: TimeSpan::new(begin, now),
            ..AgeData::default()
        })
    }

    /// Returns the saw from run time `begin` to `end` (s): run times and ages (ms).
    pub fn saw(&self, begin: f64, end: f64) -> Vec<(f64, f64)> {
        let first = self.saw.partition_point(|(at, _)| *at < begin);
        let last = self.saw.partition_point(|(at, _)| *at <= end);
        self.saw.range(first..last).copied().collect()
    }
}

/// Returns whether the node whose latency matters publishes the states.
fn by_states(system: &dyn System, graph: &Snapshot) -> bool {
    let node = system
        .states_topic()
        .and_then(|name| graph.topic(name))
        .and_then(|topic| graph.nodes.get(*topic.publishers.first()?));
    let pushes = system.latency().map(|(node, _)| node);
    node.is_some_and(|node| Some(&*node.name) == pushes)
}

/// Returns the greatest reaction time of the pushes of node `acts` within a stretch of run time: from a
/// sensing, for what changes right after it, to the first push derived from a later one. `None`
/// without such a sensing.
///
/// It equals the greatest push age: Günzel and others, ECRTS 2023.
pub fn greatest(lineage: &Lineage, acts: usize, span: TimeSpan) -> Option<Duration> {
    let pushes = pushes(lineage, acts, span);
    let (_, oldest, source) = *pushes.first()?;
    let reaction = lineage
        .sent(source)
        .rev()
        .map(Head::sensed)
        .take_while(|sensed| *sensed >= oldest)
        .filter_map(|sensed| {
            pushes
                .iter()
                .find(|(_, derived, _)| *derived > sensed)
                .map(|(since, ..)| since.since(sensed))
        });
    reaction.max()
}

/// Returns the pushes in force within a stretch of run time, oldest first: run time of the first
/// application, run time of the sensing, and the topic of its message.
fn pushes(lineage: &Lineage, acts: usize, span: TimeSpan) -> Vec<(Time, Time, usize)> {
    let mut pushes = Vec::new();
    let with_last = TimeSpan::new(span.from, span.to + Time::RESOLUTION);
    for (push, _) in lineage.pushes_within(acts, with_last) {
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
    use super::*;
    use crate::{
        lineage_taps::LineageTaps,
        tests::{
            kit::{self, config},
            sample::ms,
        },
    };
    use ratelab_experiment::Experiment;

    /// Steps of 20 ms until `end`, each on the newest sensing, one every `every` ms.
    fn steps(every: u64, end: u64) -> PushAges {
        let mut ages = PushAges::default();
        for at in (0..=end).step_by(20) {
            ages.state(ms(at), ms(at / every * every));
        }
        ages
    }

    #[test]
    fn a_run_that_is_ahead_of_its_states_makes_no_push_older() {
        let ages = steps(20, 3_000);
        let greatest = |now: u64| {
            let recent = ages.recent(Duration::ZERO, ms(now)).expect("pushes");
            recent.greatest.as_millis()
        };
        let known = greatest(3_000);
        assert!(greatest(3_015) >= 15, "between two states it grows");
        assert_eq!(
            greatest(60_000),
            known,
            "the states of a fast run come later"
        );
    }

    #[test]
    fn the_mean_is_over_the_last_second() {
        let [fresh, old] =
            [20, 200].map(|every| steps(every, 3_000).recent(Duration::ZERO, ms(3_000)));
        let [fresh, old] = [fresh, old].map(|recent| recent.expect("pushes"));
        assert_eq!(fresh.mean.as_micros(), 10_000);
        assert_eq!(old.mean.as_micros(), 100_000);
        assert_eq!(old.greatest, Duration::from_millis(200));
        // It was fresh, and is not for half a second.
        let mut turned = steps(20, 1_000);
        for at in (1_020..=1_500).step_by(20) {
            turned.state(ms(at), ms(1_000));
        }
        let mean = turned
            .recent(Duration::ZERO, ms(1_500))
            .expect("pushes")
            .mean;
        assert_eq!(mean.as_micros(), (500 * 10 + 500 * 250) / 1_000 * 1_000);
    }

    #[test]
    fn a_single_sample_has_the_whole_last_second() {
        let (mut pushes, mut ages) = (PushAge::default(), PushAges::default());
        pushes.push(ms(100), ms(0)); // 100 to 600 ms old, then
        pushes.push(ms(600), ms(590)); // 10 to 20 ms.
        ages.seen(&pushes, ms(610));
        let recent = ages.recent(Duration::ZERO, ms(610)).expect("pushes");
        assert_eq!(recent.mean.as_micros(), (500 * 350 + 10 * 15) * 1_000 / 510);
        assert_eq!(recent.greatest, Duration::from_millis(600));
    }

    #[test]
    fn two_long_periods_count_whole() {
        let slow = steps(2_000, 8_000);
        let mean = |period| {
            let recent = slow.recent(Duration::from_secs(period), ms(8_000));
            recent.map(|age| age.mean)
        };
        assert_eq!(mean(2), Some(Duration::from_secs(1)));
        assert_eq!(mean(0), Some(Duration::from_millis(1_500)));
    }

    #[test]
    fn before_the_first_push_there_is_no_age() {
        let none = PushAges::default();
        assert_eq!(none.recent(Duration::ZERO, Time::ZERO), None);
    }

    #[test]
    fn at_the_first_push_the_age_is_that_of_this_push() {
        let mut first = PushAges::default();
        first.state(ms(30), ms(10));
        let age = first.recent(Duration::ZERO, ms(30)).expect("a push");
        assert_eq!([age.mean, age.greatest], [Duration::from_millis(20); 2]);
    }

    #[test]
    fn no_push_is_older_than_the_greatest_age_between_two_states_too() {
        let age = steps(200, 160).recent(Duration::ZERO, ms(174));
        let greatest = age.expect("pushes").greatest;
        assert_eq!(greatest, Duration::from_millis(174));
    }

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
            let span = TimeSpan::new(from, to);
            let reaction = greatest(lineage, acts, span);
            assert_eq!(reaction, Some(Duration::from_millis(ms)), "{setup}");
            let age = lineage.greatest_age(acts, span);
            assert_eq!(reaction, Some(age), "{setup}");
        }
    }
}
