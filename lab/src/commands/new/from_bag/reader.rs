//! Nodes that read: triggered by messages, or timers.

use ratelab_bag::{BagNode, InputOfNode, Kind, Timed};

use super::{
    Draft,
    sheet::{nine_digits, number},
};

/// The part of the inputs of a node that it lost on its way to it.
pub(super) fn lost(node: &BagNode) -> f64 {
    let Some(input) = &node.input else { return 0.0 };
    match (node.kind, input.timed) {
        (Kind::Timer, Some(timed)) => 1.0 - timed.holds,
        _ => input.triggered.idle,
    }
}

/// The depth of the queue that a node reads from.
pub(super) fn depth(node: &BagNode) -> usize {
    let Some(input) = node.input.as_ref().filter(|_| node.kind == Kind::Trigger) else {
        return 1;
    };
    let steps = &input.triggered.steps;
    let waiting = steps.iter().filter(|step| step.backlog > 0).count();
    let inputs = steps.len() + input.triggered.left_out;
    if waiting * 50 <= steps.len() || input.triggered.left_out * 20 >= inputs {
        return 1;
    }
    steps.iter().map(|step| step.backlog + 1).max().unwrap_or(1)
}

impl Draft<'_> {
    /// Writes a node that reads. Returns whether it is in the graph.
    pub(super) fn reader(&mut self, node: &BagNode) -> bool {
        let Some(input) = &node.input else {
            return false;
        };
        if !self.written.contains(&input.parent) {
            return false;
        }
        let name = self.name(node.topic);
        self.sheet.line(&format!("\n[node.{name}]"));
        match (node.kind, input.timed) {
            (Kind::Timer, Some(timed)) => self.timed(node, input, timed),
            _ => self.triggered(node, input),
        }
        let published = self.published(node.topic);
        self.sheet.line(&published);
        true
    }

    fn triggered(&mut self, node: &BagNode, input: &InputOfNode) {
        let name = self.name(node.topic);
        let parent = self.quoted(input.parent);
        let sure = format!("sure to {:.0} %", node.confidence * 100.0);
        let spread = input.triggered.spread as f64 / 1e6;
        match (input.other, node.kind, input.timed) {
            (Some(other), ..) => {
                let other = self.quoted(other);
                self.sheet.line(&format!("trigger = [{parent}, {other}]   # both with one stamp; {sure}"));
                self.sheet.line("match = \"exact:10\"");
            }
            (_, Kind::Unknown, _) => self.sheet.line(&format!(
                "trigger = [{parent}]   # neither a trigger nor a timer explains it; {sure}"
            )),
            (.., Some(timed)) => self.sheet.line(&format!(
                "trigger = [{parent}]   # within {spread:.2} ms after the input, within {:.2} ms on a grid \
                 of {:.2} ms; {sure}",
                timed.spread as f64 / 1e6,
                timed.period / 1e6
            )),
            _ => self.sheet.line(&format!(
                "trigger = [{parent}]   # within {spread:.2} ms after the input, on no grid; {sure}"
            )),
        }
        let costs: Vec<f64> = node
            .costs()
            .into_iter()
            .map(|cost| cost.max(0) as f64 / 1e6)
            .collect();
        if let Some(takes) = self.sheet.values(&name, "takes", &costs) {
            self.sheet.line(&format!("takes = {takes}"));
        }
    }

    fn timed(&mut self, node: &BagNode, input: &InputOfNode, timed: Timed) {
        let name = self.name(node.topic);
        let events = &self.analysis.series[node.topic].events;
        let first = events.first().copied().unwrap_or(0) as f64;
        let zero = self.zero as f64;
        let offset = (first + timed.phase - zero).rem_euclid(timed.period);
        let Some(outputs) = self.analysis.found().outputs(node) else {
            return;
        };
        let ticks = outputs.ticks(timed).zip(&input.triggered.steps);
        let runs = ticks.map(|((tick, late, _), step)| {
            let number = ((first + tick - zero - offset) / timed.period).round();
            TimerRun {
                number: number.max(0.0) as usize,
                late,
                end: events[step.output] as f64 - zero,
            }
        });
        let TimerTicks {
            takes,
            wakes,
            begun_late,
        } = TimerTicks::new(&runs.collect::<Vec<_>>(), offset, timed.period);
        let repeats = 100.0 * input.triggered.repeats;
        let idle = 100.0 * input.triggered.idle;
        self.sheet.line(&format!(
            "rate = {}   # {repeats:.0} % of its outputs repeat a stamp, {idle:.0} % of the steps leave out an \
             input that came while the node was idle; sure to {:.0} %",
            nine_digits(1e9 / timed.period),
            node.confidence * 100.0
        ));
        self.sheet.line(&format!(
            "offset = {}   # read phase known to {} ms",
            number(offset / 1e6),
            number(timed.known_to / 1e6)
        ));
        if let Some(takes) = self.sheet.values(&name, "takes", &takes) {
            self.sheet.line(&format!("takes = {takes}"));
        }
        if timed.is_late {
            if let Some(wakes) = self.sheet.values(&name, "wakes", &wakes) {
                self.sheet.line(&format!("wakes = {wakes}"));
            }
        } else if begun_late * 100 > input.triggered.steps.len() {
            self.sheet.line("late = \"queue:1\"");
        }
        let parent = self.quoted(input.parent);
        self.sheet.line(&format!("reads = [{parent}]"));
    }
}

/// A run of a timer (ns).
struct TimerRun {
    number: usize,
    late: f64,
    end: f64,
}

/// What each tick that starts takes, and how late it is (ms).
struct TimerTicks {
    takes: Vec<f64>,
    wakes: Vec<f64>,
    /// Ticks that waited for the run before.
    begun_late: usize,
}

impl TimerTicks {
    /// The ticks of `runs`; one without an output takes the median.
    fn new(runs: &[TimerRun], offset: f64, period: f64) -> Self {
        const MOST: usize = 10_000_000;
        let mut ticks = Self {
            takes: Vec::with_capacity(runs.len()),
            wakes: Vec::with_capacity(runs.len()),
            begun_late: 0,
        };
        let mut without = Vec::new();
        let (mut next, mut free) = (0, f64::NEG_INFINITY);
        for run in runs {
            for number in next..run.number.min(MOST) {
                // A tick within a run does not start.
                if offset + number as f64 * period >= free {
                    without.push(ticks.takes.len());
                    ticks.takes.push(0.0);
                    ticks.wakes.push(0.0);
                }
            }
            // A tick has one output: another one is of the next tick.
            let number = run.number.max(next);
            let due = offset + number as f64 * period + run.late;
            ticks.begun_late += usize::from(free > due + 1.0 && run.late == 0.0);
            ticks.takes.push((run.end - due.max(free)).max(0.0) / 1e6);
            ticks.wakes.push(run.late / 1e6);
            (next, free) = (number + 1, run.end);
        }
        let mut sorted = ticks.takes.clone();
        sorted.sort_by(f64::total_cmp);
        let known = &sorted[without.len().min(sorted.len())..];
        let usual = known.get(known.len() / 2).copied().unwrap_or(0.0);
        for place in without {
            ticks.takes[place] = usual;
        }
        ticks
    }
}
