//! The messages of a run, and the chains behind its actions.

use std::{collections::VecDeque, mem};

use ratelab::Time;
use ratelab_experiment::Experiment;
use ratelab_metrics::{Flight, Lineage, Observer, Rows, RunRow, Tap};

use crate::{
    frame::Dot,
    run::{RunDigest, WatchedRows, watched},
};

/// Capacity of the tap between two frames: at full speed the virtual clock makes some
/// thousands of messages and ticks per frame.
const BACKLOG: usize = 1 << 17;

/// Messages and ticks kept per topic and node: twenty minutes at 50 Hz.
const KEPT: usize = 1 << 16;

/// Builds the lineage of a graph from a tap on all of it.
pub struct LineageTaps {
    /// The lineage as of the last update.
    pub lineage: Lineage,
    observer: Observer,
    /// Number of events already searched for knobs.
    events: usize,
    /// `None` once it is closed.
    tap: Option<Tap<RunRow>>,
    /// The new messages of the [`watched`] topics, each with the index of its topic.
    watched: Vec<(usize, WatchedRows)>,
    /// Digest of everything from the tap.
    pub digest: RunDigest,
}

impl LineageTaps {
    /// Attaches to `experiment` from its beginning.
    pub fn new(experiment: &Experiment) -> Self {
        let (observer, taps) = (experiment.observer(), experiment.taps());
        let (system, topology) = (experiment.system(), observer.topology());
        let watched = watched(&**system)
            .filter_map(|name| {
                let index = topology.topic(&name);
                let recorded = taps.topics().iter().find(|topic| topic.name() == name);
                Some((index?, (name, Rows::new(recorded?.fields().len()))))
            })
            .collect();
        let lineage = Lineage::new(topology, experiment.config().setup.iter()).keeping(KEPT);
        Self {
            lineage: lineage.along(system.about().latency_path()),
            observer,
            events: 0,
            tap: Some(taps.all(BACKLOG)),
            watched,
            digest: RunDigest::default(),
        }
    }

    /// Returns the lineage up to now.
    pub fn update(&mut self) -> &Lineage {
        let events = self.observer.events(self.events);
        self.events += events.len();
        events.iter().for_each(|event| self.lineage.event(event));
        // No later rows: a run without pacing fills the tap as fast as it is emptied.
        let items = self.tap.iter().map(Tap::items);
        for row in items.flat_map(|items| items.try_iter().take(items.len())) {
            match row {
                RunRow::Message(topic, head, row) => {
                    self.lineage.message(topic, &head);
                    self.digest.message(topic, &head, &row);
                    let mut watched = self.watched.iter_mut();
                    if let Some((_, (_, rows))) = watched.find(|(index, _)| *index == topic) {
                        let _ = rows.push(head, row); // Of the same width.
                    }
                }
                RunRow::Tick(node, tick) => {
                    self.digest.tick(node, &tick);
                    self.lineage.tick(node, tick);
                }
            }
        }
        self.lineage.settle();
        &self.lineage
    }

    /// Returns the messages on the [`watched`] topics since the last call.
    pub fn new_rows(&mut self) -> Vec<WatchedRows> {
        self.update();
        let new = self.watched.iter_mut().map(|(_, (name, rows))| {
            let none = Rows::new(rows.width());
            (name.clone(), mem::replace(rows, none))
        });
        new.collect()
    }

    /// Returns the number of messages and ticks lost because updates were too rare.
    pub fn lost(&self) -> u64 {
        self.tap.as_ref().map_or(0, Tap::lost)
    }

    /// Closes the tap, so that a run waiting for it can end.
    pub fn let_go(&mut self) {
        self.update();
        self.tap = None;
        self.watched.clear();
    }
}

/// Position of a lost message (share of the way).
const LOST_AT: f64 = 0.5;

/// Returns the messages in flight at run time `now`; `None` for a link without delay. A lost
/// message goes half the way and stays there for the other half of its time.
pub fn dots(flights: &VecDeque<Flight>, now: Time) -> Option<Vec<Dot>> {
    let took = |flight: &Flight| Some(flight.arrives?.since(flight.released));
    let usual = flights
        .iter()
        .rev()
        .filter_map(took)
        .find(|took| !took.is_zero())?;
    let dots = flights.iter().filter_map(|flight| {
        let took = took(flight).unwrap_or(usual);
        let (end, passed) = (flight.released + took, now.since(flight.released));
        let under_way = flight.released <= now && now < end;
        let way = passed.as_secs_f64() / took.as_secs_f64();
        let lost = flight.arrives.is_none() && way >= LOST_AT;
        under_way.then_some(Dot {
            way: if lost { LOST_AT } else { way },
            lost,
        })
    });
    Some(dots.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Release and arrival of a message (ms).
    type Sample = (u64, Option<u64>);

    #[test]
    fn a_dot_is_on_its_way_as_long_as_its_message_and_a_lost_one_ends_half_way() {
        const BOTH: &[Sample] = &[(0, Some(40)), (20, Some(60))];
        const LOST: &[Sample] = &[(0, Some(40)), (100, None)];
        let ms = |ms: u64| Time::from_nanos(ms * 1_000_000);
        for (flights, now, expected) in [
            (BOTH, 10, Some(&[(0.25, false)][..])),
            (BOTH, 30, Some(&[(0.75, false), (0.25, false)])),
            (BOTH, 40, Some(&[(0.5, false)])),
            (BOTH, 60, Some(&[])),
            (LOST, 110, Some(&[(0.25, false)])),
            (LOST, 135, Some(&[(LOST_AT, true)])),
            (LOST, 140, Some(&[])),
            // A link that takes no time has no dots of its own.
            (&[], 9, None),
            (&[(0, None), (5, Some(5))], 9, None),
        ] {
            let flights = flights.iter().map(|(released, arrives)| Flight {
                released: ms(*released),
                arrives: arrives.map(ms),
            });
            let dots = dots(&flights.collect(), ms(now));
            let found: Option<Vec<_>> =
                dots.map(|dots| dots.iter().map(|dot| (dot.way, dot.lost)).collect());
            assert_eq!(found, expected.map(<[_]>::to_vec), "{now} ms");
        }
    }
}
