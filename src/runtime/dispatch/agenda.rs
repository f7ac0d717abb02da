//! The events of triggered nodes and of executors, in order.

use std::collections::BTreeMap;

use crate::runtime::time::Time;

/// The order of events within an instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Phase {
    /// A tick ends, and its messages are released.
    Ends,
    /// A message arrives for a node that it triggers.
    Arrives,
    /// A timer of an executor is due.
    Released,
    /// A node with a thread of its own begins a tick.
    Starts,
    /// An executor looks for something to start.
    Picks,
}

/// Order of nodes in the same phase: priority, then order of addition.
pub(crate) type Rank = (u32, usize);

/// The place of an event in the order of all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place {
    pub(crate) at: Time,
    pub(crate) phase: Phase,
    pub(crate) rank: Rank,
    /// Number of the event, so that no two have the same place.
    number: u64,
}

impl Place {
    /// The place before all numbered events with this phase and rank.
    pub(crate) fn before(at: Time, phase: Phase, rank: Rank) -> Self {
        let number = 0;
        Self {
            at,
            phase,
            rank,
            number,
        }
    }

    /// The place after all numbered events with this phase and rank.
    pub(crate) fn after(at: Time, phase: Phase, rank: Rank) -> Self {
        let number = u64::MAX;
        Self {
            at,
            phase,
            rank,
            number,
        }
    }
}

/// An event of a node: with `Arrives` of one of the topics that trigger it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AgendaItem {
    pub(crate) node: usize,
    pub(crate) input: usize,
}

/// The events to come.
#[derive(Debug, Default)]
pub(crate) struct Agenda {
    events: BTreeMap<Place, AgendaItem>,
    added: u64,
}

impl Agenda {
    /// Adds an event of a node; returns its place.
    pub(crate) fn add(&mut self, at: Time, phase: Phase, rank: Rank, node: usize) -> Place {
        self.insert(at, phase, rank, AgendaItem { node, input: 0 })
    }

    /// Adds the arrival of a message: those of the same instant in the order of
    /// publication.
    pub(crate) fn add_arrival(&mut self, at: Time, node: usize, input: usize) {
        self.insert(at, Phase::Arrives, (0, 0), AgendaItem { node, input });
    }

    fn insert(&mut self, at: Time, phase: Phase, rank: Rank, entry: AgendaItem) -> Place {
        self.added += 1;
        let number = self.added;
        let place = Place {
            at,
            phase,
            rank,
            number,
        };
        self.events.insert(place, entry);
        place
    }

    /// Removes an event.
    pub(crate) fn remove(&mut self, place: Place) {
        self.events.remove(&place);
    }

    /// Removes the events of a node, except for arrivals.
    pub(crate) fn forget(&mut self, node: usize) {
        self.events
            .retain(|place, entry| entry.node != node || place.phase == Phase::Arrives);
    }

    /// The place of the first event.
    pub(crate) fn first(&self) -> Option<Place> {
        self.events.first_key_value().map(|(place, _)| *place)
    }

    /// Removes the first event.
    pub(crate) fn pop(&mut self) -> Option<(Place, AgendaItem)> {
        self.events.pop_first()
    }
}
