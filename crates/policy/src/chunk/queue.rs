//! The queue of planned actions, and those that were played.

use std::{
    collections::VecDeque,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use ratelab::{Cause, Message, Time};
use strum::VariantArray;

use super::{
    ChunkError,
    message::Chunk,
    settings::{ActionShape, Horizon, Merge, PlayKind, replace},
};

/// The most chunks that are kept, more than any queue of them holds.
const MAX_CHUNKS: usize = 1 << 16;

/// A chunk that the player has taken.
pub(super) struct Taken {
    pub(super) chunk: Chunk,
    shape: ActionShape,
    pub(super) seq: u64,
    pub(super) origin: Time,
    /// What an action of it is derived from.
    cause: Cause,
    /// Start of the tick that took it.
    at: Time,
    /// Whether its actions were used.
    used: Box<[AtomicBool]>,
}

impl Taken {
    fn new(message: Message<Chunk>, shape: ActionShape, at: Time) -> Self {
        Self {
            shape,
            seq: message.seq,
            origin: message.sensed(),
            cause: message.cause(),
            at,
            used: message
                .data
                .actions
                .chunks_exact(shape.width)
                .map(|_| false.into())
                .collect(),
            chunk: message.data,
        }
    }

    /// Returns the place of the action that is meant for run time `now`: before the first one
    /// negative.
    pub(super) fn place_by_time(&self, now: Time) -> i64 {
        periods(self.shape, self.origin, now)
    }

    /// Returns the place of the action to be played at `now`.
    fn place(&self, play: PlayKind, now: Time, history: &History) -> i64 {
        match play {
            PlayKind::Time => self.place_by_time(now),
            PlayKind::Arrival => periods(self.shape, self.at, now),
            PlayKind::Executed => history.executed(self.origin) as i64,
        }
    }

    /// Returns the action at this place, if any.
    pub(super) fn action(&self, place: i64) -> Option<&[f32]> {
        let place = usize::try_from(place).ok()?;
        self.chunk.actions.chunks_exact(self.shape.width).nth(place)
    }

    /// Returns the number of its actions.
    fn len(&self) -> i64 {
        self.used.len() as i64
    }

    /// Returns the number of ticks after its reading in which the planned action was played.
    pub(super) fn as_planned(&self, history: &History) -> usize {
        let first = history
            .ticks
            .partition_point(|tick| tick.start < self.origin);
        let meant = history.ticks.iter().skip(first).map_while(|tick| {
            let meant = self.action(self.place_by_time(tick.start))?;
            Some(*meant == *tick.action)
        });
        meant.filter(|as_planned| *as_planned).count()
    }
}

/// Whole periods of actions from one run time to another.
fn periods(shape: ActionShape, from: Time, to: Time) -> i64 {
    let [from, to] = [from, to].map(|time| i128::from(time.as_nanos()));
    let periods = (to - from).div_euclid(shape.period.as_nanos() as i128);
    periods.clamp(i64::MIN.into(), i64::MAX.into()) as i64
}

/// An action to be played.
#[derive(Clone)]
pub(super) struct Planned {
    pub(super) action: Box<[f32]>,
    /// Run time of the reading behind it (ns), a mean if there are several.
    origin: f64,
    /// The newest chunk that went into it.
    newest: Arc<Taken>,
    /// The actions that went into it.
    parts: Vec<(Arc<Taken>, usize)>,
}

impl Planned {
    fn one(taken: &Arc<Taken>, place: i64) -> Option<Self> {
        Some(Self {
            action: taken.action(place)?.into(),
            origin: taken.origin.as_nanos() as f64,
            newest: taken.clone(),
            parts: vec![(taken.clone(), place as usize)],
        })
    }

    /// Returns a mean of this plan with this weight, and of what was planned `before` with the
    /// rest.
    fn blended(self, weight: f64, before: Self) -> Self {
        let mean = |new: f64, old: f64| weight * new + (1.0 - weight) * old;
        Self {
            action: self
                .action
                .iter()
                .zip(&before.action)
                .map(|(new, old)| mean((*new).into(), (*old).into()) as f32)
                .collect(),
            origin: mean(self.origin, before.origin),
            newest: if before.newest.seq > self.newest.seq {
                before.newest
            } else {
                self.newest
            },
            parts: [before.parts, self.parts].concat(),
        }
    }

    /// Returns the newest chunk that went into it, with the run time of the reading behind the
    /// action, to the nanosecond.
    pub(super) fn cause(&self) -> Cause {
        let sensed = Time::from_nanos(self.origin.round_ties_even() as u64);
        self.newest.cause.sensed_at(sensed)
    }

    /// Uses its parts; returns how many of them were not used before.
    pub(super) fn take_parts(&self) -> usize {
        let unused = |(taken, place): &&(Arc<Taken>, usize)| {
            let used = taken.used.get(*place);
            used.is_some_and(|used| !used.swap(true, Ordering::Relaxed))
        };
        self.parts.iter().filter(unused).count()
    }
}

/// The chunks that were taken, and what is planned of them.
pub(super) struct PlayQueue {
    shape: ActionShape,
    pub(super) play: PlayKind,
    merge: Merge,
    /// The newest last.
    taken: VecDeque<Arc<Taken>>,
    /// The actions of this tick and the next ones, where chunks are blended.
    blended: VecDeque<Option<Planned>>,
}

impl PlayQueue {
    pub(super) fn new(shape: ActionShape, play: PlayKind, merge: Merge) -> Self {
        Self {
            shape,
            play,
            merge,
            taken: VecDeque::new(),
            blended: VecDeque::new(),
        }
    }

    /// Returns the chunk taken last.
    pub(super) fn newest(&self) -> Option<&Arc<Taken>> {
        self.taken.back()
    }

    /// Merges in this way from now on; returns the one before. A blend begins with the next
    /// chunk.
    pub(super) fn set_merge(&mut self, text: &str) -> Result<String, ChunkError> {
        let before = replace(&mut self.merge, text)?;
        if !matches!(self.merge, Merge::Blend(_)) {
            self.blended.clear();
        }
        Ok(before)
    }

    /// Returns the number of actions of the newest chunk that are left at `now`, this one included.
    pub(super) fn left(&self, now: Time, history: &History) -> f64 {
        self.newest().map_or(0.0, |newest| {
            let end = newest.len();
            (end - newest.place(self.play, now, history)).clamp(0, end) as f64
        })
    }

    /// Begins a tick.
    pub(super) fn advance(&mut self) {
        self.blended.pop_front();
    }

    /// Takes a chunk in the tick that starts at `now`.
    pub(super) fn take(&mut self, message: Message<Chunk>, now: Time, history: &History) {
        let taken = Arc::new(Taken::new(message, self.shape, now));
        if let Merge::Blend(weight) = self.merge {
            self.blend(&taken, taken.place(self.play, now, history), weight);
        }
        if self.taken.len() == MAX_CHUNKS {
            self.taken.pop_front();
        }
        self.taken.push_back(taken);
    }

    /// Plans this tick and the next ones by a chunk whose action at `place` is for now.
    fn blend(&mut self, taken: &Arc<Taken>, place: i64, weight: f64) {
        let mut before = std::mem::take(&mut self.blended).into_iter();
        let last = taken.len() - place;
        for ahead in 0..last.min(2 * Horizon::MAX as i64) {
            let old = before.next().flatten();
            let new = Planned::one(taken, place + ahead);
            self.blended.push_back(match (new, old) {
                (Some(new), Some(old)) => Some(new.blended(weight, old)),
                (new, _) => new,
            });
        }
    }

    /// Returns the action for the tick that starts at `now`, if any.
    pub(super) fn action(&mut self, now: Time, history: &History) -> Option<Planned> {
        self.drop_played(now, history);
        match self.merge {
            Merge::Newest => {
                let newest = self.newest()?;
                Planned::one(newest, newest.place(self.play, now, history))
            }
            Merge::Blend(_) => self.blended.front()?.clone(),
            Merge::Ensemble(decay) => self.ensemble(now, decay, history),
        }
    }

    /// Returns the weighted mean of all chunks with an action for now.
    fn ensemble(&self, now: Time, decay: f64, history: &History) -> Option<Planned> {
        let at = |taken: &Arc<Taken>| Planned::one(taken, taken.place(self.play, now, history));
        let (mut weights, mut actions, mut ages) = (0.0, vec![0.0; self.shape.width], 0.0);
        let (mut newest, mut parts) = (None, Vec::new());
        for (number, mut one) in self.taken.iter().filter_map(at).enumerate() {
            let weight = (-decay * number as f64).exp();
            weights += weight;
            for (sum, action) in actions.iter_mut().zip(&one.action) {
                *sum += weight * f64::from(*action);
            }
            ages += weight * (now.as_nanos() as f64 - one.origin);
            parts.append(&mut one.parts);
            newest = Some(one.newest);
        }
        let age = (ages / weights).round_ties_even();
        Some(Planned {
            action: actions.iter().map(|sum| (sum / weights) as f32).collect(),
            origin: now.as_nanos() as f64 - age,
            newest: newest?,
            parts,
        })
    }

    /// Drops the oldest chunks as long as they are over, however they are played.
    fn drop_played(&mut self, now: Time, history: &History) {
        while self.taken.len() > 1
            && self.taken.front().is_some_and(|oldest| {
                let end = oldest.len();
                PlayKind::VARIANTS
                    .iter()
                    .all(|kind| oldest.place(*kind, now, history) >= end)
            })
        {
            self.taken.pop_front();
        }
    }
}

/// The most ticks that are remembered: three quarters of an hour at 50 Hz.
const MAX_TICKS: usize = 1 << 17;

/// What the player played. Figures of the run are made of it, so it outlives a crash.
pub(super) struct History {
    /// The action before the first one.
    none: Box<[f32]>,
    pub(super) ticks: VecDeque<PlayedTick>,
    /// Number of published actions.
    published: u64,
    /// Number of actions before its last restart.
    forgotten: u64,
    /// The last one.
    pub(super) last: Option<Box<[f32]>>,
}

/// A tick of the player.
pub(super) struct PlayedTick {
    pub(super) start: Time,
    /// The action that it published, or else the one before; its cost left aside.
    pub(super) action: Box<[f32]>,
    /// Number of actions published before.
    before: u64,
}

impl History {
    /// Creates one of actions of `width` numbers, without any so far.
    pub(super) fn new(width: usize) -> Self {
        Self {
            none: vec![0.0; width].into(),
            ticks: VecDeque::new(),
            published: 0,
            forgotten: 0,
            last: None,
        }
    }

    /// Returns the action that is held.
    fn held(&self) -> Box<[f32]> {
        self.last.as_ref().unwrap_or(&self.none).clone()
    }

    /// Returns the number of actions that were published in ticks which started at `since` or
    /// later, as far as the player remembers.
    pub(super) fn executed(&self, since: Time) -> u64 {
        let first = self.ticks.partition_point(|tick| tick.start < since);
        let before = self.ticks.get(first).map(|tick| tick.before);
        self.published - before.unwrap_or(self.published).max(self.forgotten)
    }

    /// Adds a tick, with its action if any.
    pub(super) fn begin(&mut self, start: Time, action: Option<Box<[f32]>>) {
        if self.ticks.len() == MAX_TICKS {
            self.ticks.pop_front();
        }
        self.ticks.push_back(PlayedTick {
            start,
            action: action.unwrap_or_else(|| self.held()),
            before: self.published,
        });
    }

    /// The action of the last tick is published.
    pub(super) fn publish(&mut self, action: Box<[f32]>) {
        self.published += 1;
        self.last = Some(action);
    }

    /// The player begins anew; its last tick came to nothing if it was `cut_off`.
    pub(super) fn restart(&mut self, cut_off: bool) {
        self.forgotten = self.published;
        let held = self.held();
        if let Some(tick) = self.ticks.back_mut().filter(|_| cut_off) {
            tick.action = held;
        }
    }
}
