//! The search for faults: adjacent ones first, then random ones.

use std::{ops::Range, time::Duration};

use ratelab::{Chance, Time};
use ratelab_metrics::TopicAccount;

use super::{
    Budget, HuntError,
    fault::FaultPart,
    trial::{Halt, Trials, delta_debug},
};
use crate::Summary;

/// Number of random lists, tried if no window is enough.
pub const RANDOM_LISTS: usize = 1_000;

/// Maximum number of beginnings of windows, spread evenly over the run.
const MOST_STARTS: u64 = 1_000;

/// Ratio of the largest windows that are shrunk to the budget.
const BEYOND: usize = 2;

/// Ratio of the stretch for a random list to a window.
const ROOM: usize = 4;

/// The windows of a budget in a run.
pub(super) struct Windows {
    topic: String,
    lose: usize,
    late: usize,
    hang: usize,
    shift: usize,
    /// Number of messages of the topic.
    messages: u64,
    /// End of the run (run time).
    end: Time,
    /// Period of the node that may hang.
    period: Duration,
}

/// Windows of one kind: lists by size and beginning.
struct WindowKind<'w> {
    /// The largest size.
    most: usize,
    /// Number of possible beginnings.
    starts: u64,
    /// Returns the list of a given size and beginning.
    list: Box<dyn Fn(usize, u64) -> Vec<FaultPart> + 'w>,
}

impl Windows {
    /// Creates the windows of `budget` in the run without faults.
    pub fn new(budget: &Budget, usual: &Summary) -> Result<Self, HuntError> {
        let [lose, late, hang, shift] = budget.counts();
        let topic = usual.topic(&budget.topic);
        let is_read = topic.is_some_and(TopicAccount::is_read);
        let messages = topic.map_or(0, |topic| topic.published);
        if lose + late > 0 && (!is_read || messages == 0) {
            let why = if is_read {
                "it carried no message"
            } else {
                "no node reads such a topic"
            };
            let read = usual.topics.iter().filter(|topic| topic.is_read());
            if read.clone().next().is_none() {
                return Err(HuntError::NoReader);
            }
            let read = read.map(|topic| &*topic.name);
            return Err(HuntError::target(&budget.topic, why, read));
        }
        let node = |(name, _): &(String, Duration)| {
            let nodes = usual.nodes.iter().map(|node| &*node.name);
            let unknown = || HuntError::target(name, "there is no such node", nodes);
            usual.node(name).ok_or_else(unknown)
        };
        budget.shift.as_ref().map(node).transpose()?;
        let node = budget.hang.as_ref().map(node).transpose()?;
        Ok(Self {
            topic: budget.topic.clone(),
            lose,
            late,
            hang,
            shift,
            messages,
            end: usual.sim_time,
            period: node.map_or(Duration::ZERO, |node| node.hz.period()),
        })
    }

    /// Returns whether nothing may go wrong but a shift.
    pub fn only_shift(&self) -> bool {
        self.lose + self.late + self.hang == 0
    }

    /// Looks for the smallest window that loses the run.
    pub fn search(&self, trials: &mut Trials<'_>) -> Result<(), Halt> {
        let kinds = self.kinds();
        for kind in &kinds {
            kind.search(0..kind.most, trials)?;
        }
        if trials.best().is_none() && kinds.len() > 1 {
            let together = self.together();
            together.search(0..together.most, trials)?;
        }
        Ok(())
    }

    /// Looks for lists within the budget to which larger windows shrink: their faults are uneven,
    /// as those of no window are.
    pub fn search_beyond(&self, trials: &mut Trials<'_>) -> Result<(), Halt> {
        for kind in self.kinds() {
            let window = kind.search(kind.most..kind.most * BEYOND, trials)?;
            if let Some(mut list) = window {
                delta_debug(&mut list, trials)?;
            }
        }
        Ok(())
    }

    /// Losses; delays of 1, 2, 4, … messages by the same time; hangs.
    fn kinds(&self) -> Vec<WindowKind<'_>> {
        let mut kinds = vec![WindowKind {
            most: self.lose,
            starts: self.messages,
            list: Box::new(|size, start| self.lost(size, start)),
        }];
        let widths = (0..).map(|power| 1 << power);
        kinds.extend(
            widths
                .take_while(|width| *width <= self.late)
                .map(|width| WindowKind {
                    most: self.late / width,
                    starts: self.messages,
                    list: Box::new(move |size, start| self.late(size, width, start)),
                }),
        );
        kinds.push(WindowKind {
            most: self.hang,
            starts: self.ticks(),
            list: Box::new(|size, tick| vec![FaultPart::Hang(self.tick(tick)); size]),
        });
        // A larger shift is no worse than a smaller one: each is tried.
        let shift = self.shift;
        kinds.push(WindowKind {
            most: shift.min(1),
            starts: shift as u64,
            list: Box::new(move |size, start| {
                vec![FaultPart::Shift; (size - 1) * shift + start as usize + 1]
            }),
        });
        kinds.retain(|kind| kind.most > 0 && kind.starts > 0);
        kinds
    }

    /// Returns an equal share of each kind, at the same time.
    fn together(&self) -> WindowKind<'_> {
        let most = self.lose.max(self.late).max(self.hang).max(self.shift);
        let share = move |of: usize, size: usize| (of * size).div_ceil(most);
        WindowKind {
            most,
            starts: self.messages.max(self.ticks()),
            list: Box::new(move |size, start| {
                let moment = start as f64 / self.messages.max(self.ticks()) as f64;
                let at = |count: u64| (moment * count as f64) as u64;
                let tick = self.tick(at(self.ticks()));
                let lost = share(self.lose, size);
                let mut list = self.lost(lost, at(self.messages));
                list.extend(self.late(share(self.late, size), 1, at(self.messages) + lost as u64));
                list.extend(vec![FaultPart::Hang(tick); share(self.hang, size)]);
                list.extend(vec![FaultPart::Shift; share(self.shift, size)]);
                list
            }),
        }
    }

    fn lost(&self, size: usize, start: u64) -> Vec<FaultPart> {
        let last = self.messages.min(start + size as u64);
        (start..last).map(FaultPart::Lost).collect()
    }

    fn late(&self, size: usize, width: usize, start: u64) -> Vec<FaultPart> {
        let last = self.messages.min(start + width as u64);
        let messages = start..last;
        messages
            .flat_map(|seq| vec![FaultPart::Late(seq); size])
            .collect()
    }

    /// Returns the number of due times of the node that may hang.
    fn ticks(&self) -> u64 {
        let ticks = self.end.as_nanos() as u128 / self.period.as_nanos().max(1);
        if self.hang > 0 { ticks as u64 } else { 0 }
    }

    fn tick(&self, number: u64) -> Time {
        Time::from_nanos(number * self.period.as_nanos() as u64)
    }

    /// Lists that use the whole budget, anywhere in a stretch longer than a window; the
    /// random draws are those of `SEED hunt TOPIC N`.
    pub fn random(&self, seed: u64) -> Vec<Vec<FaultPart>> {
        let (what, name) = ("hunt", self.topic.as_str());
        let chance = Chance { seed, what, name };
        let mut number = 0_u64;
        let mut below = |count: u64| {
            number += 1;
            (chance.uniform(number) * count as f64) as u64
        };
        let lists = (0..RANDOM_LISTS).map(|_| {
            let start = below(self.messages.max(1));
            let room = |of: usize| (of * ROOM) as u64;
            let mut list: Vec<FaultPart> = Vec::new();
            let end = self.messages.min(start + room(self.lose));
            let mut messages: Vec<u64> = (start..end).collect();
            for _ in 0..self.lose.min(messages.len()) {
                let place = below(messages.len() as u64) as usize;
                list.push(FaultPart::Lost(messages.swap_remove(place)));
            }
            let end = self.messages.min(start + room(self.late));
            list.extend((0..self.late).map(|_| FaultPart::Late(start + below(end - start))));
            if self.hang > 0 {
                let at = self.tick(below(self.ticks()));
                list.extend(vec![FaultPart::Hang(at); self.hang]);
            }
            list.extend(vec![FaultPart::Shift; self.shift]);
            list
        });
        lists.collect()
    }
}

impl WindowKind<'_> {
    /// Finds by bisection the smallest size that is enough anywhere, above the start of `sizes`
    /// and up to its end; returns the list with its first beginning.
    fn search(
        &self,
        sizes: Range<usize>,
        trials: &mut Trials<'_>,
    ) -> Result<Option<Vec<FaultPart>>, Halt> {
        let mut try_size = |size: usize| {
            let lists = self.lists(size);
            let first = trials.first_lost(&lists)?;
            Ok::<_, Halt>(first.map(|index| lists[index].clone()))
        };
        let (mut too_small, mut enough) = (sizes.start, sizes.end);
        let mut smallest = try_size(enough)?;
        while smallest.is_some() && enough - too_small > 1 {
            let middle = usize::midpoint(too_small, enough);
            match try_size(middle)? {
                None => too_small = middle,
                list => (smallest, enough) = (list, middle),
            }
        }
        Ok(smallest)
    }

    /// Returns all lists of a size, by their beginnings.
    fn lists(&self, size: usize) -> Vec<Vec<FaultPart>> {
        let count = self.starts.min(MOST_STARTS);
        let start =
            |place: u64| (u128::from(place) * u128::from(self.starts) / u128::from(count)) as u64;
        (0..count)
            .map(|place| (self.list)(size, start(place)))
            .collect()
    }
}
