//! A node as if each of its outputs were triggered by a message.

use crate::{
    numbers::{MS, shortest_half, spread},
    stamps::TopicEvents,
};

/// An input that is left out this long after the output before was left out while idle (ns).
const IDLE: i64 = MS / 2;

/// One output of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TriggeredStep {
    /// The place of the output.
    pub output: usize,
    /// The place of the input that it used; `None` for a repeat.
    pub input: Option<usize>,
    /// When the work on it began (ns).
    pub start: i64,
    /// What it cost (ns); 0 for a repeat.
    pub cost: i64,
    /// Newer inputs that had come by the start.
    pub backlog: usize,
}

/// A node as triggered by one topic.
#[derive(Clone, Debug, Default)]
pub struct Triggered {
    /// Its outputs whose stamps the input has.
    pub steps: Vec<TriggeredStep>,
    /// Inputs that it did not use.
    pub left_out: usize,
    /// The part of the outputs that repeat a stamp.
    pub repeats: f64,
    /// The part of the steps that leave out an input that came while the node was idle.
    pub idle: f64,
    /// The part of the costs below -0.3 ms.
    pub negative: f64,
    /// The part of the starts that are the end of the output before.
    pub busy: f64,
    /// What lies between the 10th and 90th percentile of the costs (ns).
    pub spread: i64,
    /// The width of the shortest interval with half of the costs (ns).
    pub half: i64,
}

impl Triggered {
    /// Creates the node that publishes `b` as triggered by `a`, whose messages arrive `transport`
    /// later. It is not free before the time that `busy_until` has for each output.
    pub fn new(a: &TopicEvents, b: &TopicEvents, transport: i64, busy_until: &[i64]) -> Self {
        let mut fit = Self::default();
        let (mut used, mut had_input) = (None, false);
        let (mut repeats, mut idle, mut of_idle, mut busy) = (0, 0, 0, 0);
        for (output, stamp) in b.stamps.iter().enumerate() {
            let possible = &a.by_stamp[a.with_stamp(*stamp)];
            if possible.is_empty() {
                had_input = false;
                continue;
            }
            let before = busy_until[output];
            let arrival = |place: usize| a.events[place] + transport;
            let next = used.map_or(0, |used: usize| used + 1);
            let newer = possible
                .iter()
                .map(|(_, place)| *place)
                .filter(|place| *place >= next);
            let ready = newer.clone().take_while(|place| arrival(*place) <= before);
            let Some(input) = ready.last().or_else(|| newer.clone().next()) else {
                repeats += 1;
                had_input = false;
                fit.steps.push(TriggeredStep {
                    output,
                    input: None,
                    start: before,
                    cost: 0,
                    backlog: 0,
                });
                continue;
            };
            let start = arrival(input).max(before);
            busy += usize::from(arrival(input) <= before);
            if had_input {
                of_idle += 1;
                fit.left_out += input - next;
                idle += usize::from(input > next && arrival(input - 1) > before + IDLE);
            }
            let ready = a.events[input..].partition_point(|event| event + transport <= start);
            fit.steps.push(TriggeredStep {
                output,
                input: Some(input),
                start,
                cost: b.events[output] - start,
                backlog: ready.saturating_sub(1),
            });
            (used, had_input) = (Some(input), true);
        }
        let mut costs: Vec<i64> = fit.costs().collect();
        let negative = costs.iter().filter(|cost| **cost < -3 * MS / 10).count();
        fit.repeats = part(repeats, fit.steps.len());
        fit.idle = part(idle, of_idle);
        fit.negative = part(negative, costs.len());
        fit.busy = part(busy, costs.len());
        fit.spread = spread(&mut costs);
        fit.half = shortest_half(&mut costs);
        fit
    }

    /// Returns the costs of the outputs that used an input, in order (ns).
    pub fn costs(&self) -> impl Iterator<Item = i64> {
        self.steps
            .iter()
            .filter(|step| step.input.is_some())
            .map(|step| step.cost)
    }
}

/// `some` of `all`; 0 of none.
pub fn part(some: usize, all: usize) -> f64 {
    some as f64 / all.max(1) as f64
}

/// For each output of `b` the time of the one before; long ago for the first.
pub fn ends_before(b: &TopicEvents) -> Vec<i64> {
    let before = b.events.iter().copied();
    std::iter::once(LONG_AGO)
        .chain(before)
        .take(b.events.len())
        .collect()
}

/// A time before all others.
pub const LONG_AGO: i64 = -(1 << 62);

#[cfg(test)]
mod tests {
    use super::*;

    fn series(events: &[i64], stamps: &[i64]) -> TopicEvents {
        let ms = |times: &[i64]| times.iter().map(|time| time * MS).collect();
        let mut series = TopicEvents {
            events: ms(events),
            stamps: ms(stamps),
            ..TopicEvents::default()
        };
        series.sort();
        series
    }

    #[test]
    fn a_node_that_is_busy_leaves_out_inputs_and_one_that_is_idle_too() {
        let inputs = series(&[0, 33, 67, 100, 133], &[1, 2, 3, 4, 5]);
        let fit = |outputs| {
            let outputs = series(outputs, &[1, 2, 4]);
            Triggered::new(&inputs, &outputs, 0, &ends_before(&outputs))
        };
        let busy = fit(&[50, 90, 140]);
        let costs: Vec<i64> = busy.costs().map(|cost| cost / MS).collect();
        assert_eq!(costs, [50, 40, 40]);
        assert_eq!((busy.left_out, busy.idle), (1, 0.0));
        assert_eq!(fit(&[50, 60, 140]).idle, 0.5);
    }
}
