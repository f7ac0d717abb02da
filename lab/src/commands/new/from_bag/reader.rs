//! Nodes that read: triggered by messages, or timers.

use ratelab_bag::{BagNode, InputOfNode, Kind, Timed, TimerRun, Triggered, quantile};

use super::{
    Draft, NO_REPEATS,
    sheet::{self, nine_digits, number},
    unsure,
};

/// The part of a period by which a tick may wait for what it read in the bag.
const SLIGHTLY_LATE: f64 = 0.05;

/// The part of a period from which on the phase of a timer is not known.
const UNKNOWN: f64 = 0.04;

/// Costs that vary less, against how far the phase is known, tell nothing of it.
const CONSTANT: f64 = 0.02;

/// How far costs vary by the transport to the recorder, where there are no other times (ns).
const LOG_NOISE: f64 = 1e6;

/// The mean interval of its outputs, in periods, from which on some ticks have none.
const SOME_MISSING: f64 = 1.02;

/// Returns the part of the inputs of a node that it lost on its way to it.
pub(super) fn lost(node: &BagNode) -> f64 {
    let Some(input) = &node.input else { return 0.0 };
    match (node.kind, input.timed) {
        (Kind::Timer, Some(timed)) => 1.0 - timed.holds,
        _ => input.triggered.idle,
    }
}

/// Returns the depth of the queue that a node reads from.
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

/// Returns whether a triggered node shows that no second message waits for it.
pub(super) fn is_short(node: &BagNode) -> bool {
    const SOME: f64 = 0.02;
    let Some(Triggered {
        steps,
        left_out,
        idle,
        ..
    }) = node.input.as_ref().map(|input| &input.triggered)
    else {
        return false;
    };
    node.kind == Kind::Trigger && *left_out as f64 > (SOME + idle) * steps.len() as f64
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
        let sure = format!("{:.0} % sure", node.confidence * 100.0);
        let spread = input.triggered.spread as f64 / 1e6;
        match (input.other, node.kind, input.timed) {
            (Some(other), ..) => {
                let other = self.quoted(other);
                self.sheet.line(&format!(
                    "trigger = [{parent}, {other}]   # both with one stamp; {sure}"
                ));
                self.sheet.line("match = \"exact:10\"");
            }
            (_, Kind::Unknown, _) => self.sheet.line(&format!(
                "trigger = [{parent}]   # neither a trigger nor a timer explains it; {sure}"
            )),
            (.., Some(timed)) => {
                self.sheet.line(&format!(
                    "trigger = [{parent}]   # within {spread:.2} ms after the input, within {:.2} ms on a \
                     grid of {:.2} ms; {sure}",
                    timed.spread as f64 / 1e6,
                    timed.period / 1e6
                ));
                if node.confidence < unsure::SURE {
                    let timed = self.likely(node, timed);
                    let other = self.reading(&format!("{name}.timer"), node, input, timed);
                    self.others(&[other]);
                }
            }
            _ => self.sheet.line(&format!(
                "trigger = [{parent}]   # within {spread:.2} ms after the input, on no grid; {sure}"
            )),
        }
        let costs = self.costs(&name, node);
        if costs != "takes = 0" {
            self.sheet.line(&costs);
        }
    }

    fn timed(&mut self, node: &BagNode, input: &InputOfNode, known: Timed) {
        let name = self.name(node.topic);
        let timed = self.likely(node, known);
        let mut is_only_new = false;
        for (key, why) in self.timer_keys(&name, node, input, timed) {
            is_only_new |= key.starts_with("only_new");
            if key == "takes = 0" {
                continue;
            }
            let why = (!why.is_empty()).then(|| format!("   # {why}"));
            self.sheet
                .line(&format!("{key}{}", why.unwrap_or_default()));
        }
        let parent = self.quoted(input.parent);
        self.sheet.line(&format!("reads = [{parent}]"));
        let mut others = Vec::new();
        if node.confidence < unsure::SURE {
            let costs = self.costs(&format!("{name}.trigger"), node);
            others.push(format!("trigger = [{parent}], {costs}"));
        }
        if known.known_to > UNKNOWN * known.period && !known.is_late {
            let earliest = Timed {
                phase: known.latest() - known.known_to,
                ..known
            };
            others.push(self.reading(&format!("{name}.early"), node, input, earliest));
        }
        if input.triggered.repeats < NO_REPEATS {
            let times = self.most_ticks(node, input, timed);
            let rate = nine_digits(f64::from(times) * 1e9 / timed.period);
            match (times, is_only_new) {
                (1, true) => {}
                (1, false) => others.push("only_new = true".to_owned()),
                _ => others.push(format!("rate = {rate}, only_new = true")),
            }
        }
        self.others(&others);
    }

    /// Returns the timer with the likeliest of the phases that explain the bag equally well.
    fn likely(&self, node: &BagNode, timed: Timed) -> Timed {
        let Some(outputs) = self.analysis.found().outputs(node) else {
            return timed;
        };
        if timed.is_late || timed.known_to < UNKNOWN * timed.period {
            return timed;
        }
        let at_once = outputs.runs(timed).filter(|run| run.start <= run.tick);
        let mut costs: Vec<i64> = at_once.map(|run| (run.end - run.start) as i64).collect();
        let [low, middle, high] = [100, 500, 900].map(|of| quantile(&mut costs, of) as f64);
        let noise = if self.analysis.series[node.topic].has_source {
            CONSTANT * timed.known_to
        } else {
            LOG_NOISE
        };
        let least = middle - (timed.latest() - timed.phase);
        let likely = if high - low < noise {
            least + timed.known_to / 2.0
        } else {
            likely_cost([low, middle, high]).unwrap_or(middle)
        };
        let cost = likely.clamp(least, least + timed.known_to);
        Timed {
            phase: timed.phase - (cost - middle),
            ..timed
        }
    }

    /// Returns how many times as often a timer may tick that is silent without new data: it leaves
    /// out no input, and none waited longer for its tick.
    fn most_ticks(&self, node: &BagNode, input: &InputOfNode, timed: Timed) -> u32 {
        const MOST: u32 = 10;
        if timed.is_late || input.triggered.left_out * 20 > input.triggered.steps.len() {
            return 1;
        }
        let outputs = self.analysis.found().outputs(node);
        let mut waits: Vec<f64> = outputs
            .iter()
            .flat_map(|outputs| outputs.runs(timed))
            .map(|run| run.tick - run.reads.0)
            .collect();
        waits.sort_by(f64::total_cmp);
        let longest = waits.get(waits.len() * 98 / 100).copied();
        let longest = longest.unwrap_or(timed.period);
        let mut times = (2..=MOST).rev();
        let fits = |times: &u32| longest < timed.period / f64::from(*times);
        times.find(fits).unwrap_or(1)
    }

    /// Writes the other readings of a node.
    fn others(&mut self, others: &[String]) {
        let others: Vec<String> = others.iter().map(|keys| sheet::quoted(keys)).collect();
        if !others.is_empty() {
            let others = others.join(", ");
            self.sheet
                .line(&format!("or = [{others}]   # runs with a change try each"));
        }
    }

    /// Returns the keys of a node as such a timer, but for a rate that it has.
    fn reading(&mut self, name: &str, node: &BagNode, input: &InputOfNode, timed: Timed) -> String {
        self.timer_keys(name, node, input, timed)
            .into_iter()
            .filter(|(key, _)| node.kind != Kind::Timer || !key.starts_with("rate"))
            .map(|(key, _)| key)
            .collect::<Vec<_>>()
            .join(", ")
    }

    /// Returns the costs of a node as a triggered one, with their key.
    fn costs(&mut self, name: &str, node: &BagNode) -> String {
        let costs: Vec<f64> = node
            .costs()
            .into_iter()
            .map(|cost| cost.max(0) as f64 / 1e6)
            .collect();
        let takes = self.sheet.values(name, "takes", &costs);
        format!("takes = {}", takes.unwrap_or("0".to_owned()))
    }

    /// Returns the keys of a node as a timer, each with its evidence; its tables are called after
    /// `name`.
    fn timer_keys(
        &mut self,
        name: &str,
        node: &BagNode,
        input: &InputOfNode,
        timed: Timed,
    ) -> Vec<(String, String)> {
        let events = &self.analysis.series[node.topic].events;
        let zero = (self.zero - events.first().copied().unwrap_or(0)) as f64;
        let Some(outputs) = self.analysis.found().outputs(node) else {
            return Vec::new();
        };
        let runs: Vec<TimerRun> = outputs.runs(timed).collect();
        let (grid, ticks) = TimerGrid::fitted(timed, &runs, zero);
        let repeats = 100.0 * input.triggered.repeats;
        let idle = 100.0 * input.triggered.idle;
        let rate = nine_digits(1e9 / timed.period);
        let sure = node.confidence * 100.0;
        let takes = self.sheet.values(name, "takes", &ticks.takes);
        let mut keys = vec![
            (
                format!("rate = {rate}"),
                format!(
                    "{repeats:.0} % of its outputs repeat a stamp, {idle:.0} % of the steps leave out an input that \
                     came while the node was idle; {sure:.0} % sure"
                ),
            ),
            (
                format!("offset = {}", number((grid.origin - zero) / 1e6)),
                format!("read phase known to {} ms", number(timed.known_to / 1e6)),
            ),
            (
                format!("takes = {}", takes.unwrap_or("0".to_owned())),
                String::new(),
            ),
        ];
        // The executor of a shared thread decides on both.
        if !self.analysis.shares_a_thread(node.topic) {
            let wakes = self.sheet.values(name, "wakes", &ticks.wakes);
            keys.extend(wakes.map(|wakes| (format!("wakes = {wakes}"), String::new())));
            keys.extend(
                grid.is_queue
                    .then(|| ("late = \"queue:1\"".to_owned(), String::new())),
            );
        }
        let mean = outputs.mean_interval();
        if input.triggered.repeats < NO_REPEATS && mean > SOME_MISSING * timed.period {
            keys.push((
                "only_new = true".to_owned(),
                "no stamp is there twice, and some ticks have no output".to_owned(),
            ));
        }
        keys
    }
}

/// Returns the likely median of costs with these quantiles (0.1, 0.5 and 0.9), all of which may be
/// larger or smaller by one constant. How skewed they are tells the width of a lognormal distribution
/// against its median; `None` if they are too skewed to be one.
fn likely_cost([low, middle, high]: [f64; 3]) -> Option<f64> {
    // The deviate of the quantile 0.9.
    const DEVIATE: f64 = 1.2816;
    let skew = (high - middle) / (middle - low).max(1.0);
    let sigma = (skew.max(1.0).ln() / DEVIATE).max(0.15);
    (sigma < 1.0).then(|| (high - low) / (2.0 * (DEVIATE * sigma).sinh()))
}

/// When the ticks of a timer are due, in time since its first output (ns).
#[derive(Clone, Copy)]
struct TimerGrid {
    /// The first due time of the graph, since the first output.
    origin: f64,
    period: f64,
    /// Whether a due time waits for the run before.
    is_queue: bool,
    /// Whether ticks begin late.
    is_late: bool,
    /// How much later than due ticks may begin, so that they read what they read in the bag.
    early: f64,
}

impl TimerGrid {
    /// Returns the grid of a timer with these `runs`, in a file whose time begins at `zero`, and its
    /// ticks.
    fn fitted(timed: Timed, runs: &[TimerRun], zero: f64) -> (Self, TimerTicks) {
        let waited = runs.iter().filter(|run| run.start > run.tick + 1.0);
        let overran = runs.iter().filter(|run| run.end - run.start > timed.period);
        let origin = |phase: f64| zero + (phase - zero).rem_euclid(timed.period);
        let mut grid = Self {
            origin: origin(timed.phase),
            period: timed.period,
            // A timer of ROS is called once late, unless the bag shows that it skips instead.
            is_queue: !timed.is_late
                && (waited.count() * 100 > runs.len() || overran.count() * 100 <= runs.len()),
            is_late: timed.is_late,
            early: 0.0,
        };
        let mut ticks = TimerTicks::new(runs, grid);
        grid.early = ticks.too_new(&grid, (1.0 - timed.holds) * runs.len() as f64, runs.len());
        if grid.early > 0.0 {
            grid.origin = origin(grid.origin - grid.early);
            ticks = TimerTicks::new(runs, grid);
        }
        (grid, ticks)
    }

    fn due(self, number: f64) -> f64 {
        self.origin + number * self.period
    }

    /// Returns the number of the next tick after `number`, of a node that is free from `free` on.
    fn next(self, number: f64, free: f64) -> f64 {
        let passed = (free - self.origin) / self.period;
        let passed = if self.is_queue {
            passed.floor()
        } else {
            passed.ceil()
        };
        passed.max(number + 1.0)
    }
}

/// What each tick that starts takes, and how late it is (ms).
#[derive(Default)]
struct TimerTicks {
    takes: Vec<f64>,
    wakes: Vec<f64>,
    /// How long what outputs used had not been the newest as their ticks began (ns).
    too_new: Vec<f64>,
}

impl TimerTicks {
    /// Creates the ticks that make the outputs of `runs`, as the graph will run them: each output
    /// is of the first tick that could read what it used. Others have none, and take no longer than
    /// usual.
    fn new(runs: &[TimerRun], grid: TimerGrid) -> Self {
        const MOST: usize = 10_000_000;
        let mut costs: Vec<f64> = runs.iter().map(|run| run.end - run.start).collect();
        costs.sort_by(f64::total_cmp);
        let at = |share: usize| costs.get(costs.len() * share / 100).copied();
        let usual = at(50).unwrap_or(0.0).max(0.0);
        let may_last = at(98).unwrap_or(0.0) > 0.6 * grid.period;
        let mut ticks = Self::default();
        let (mut number, mut free) = (-1.0, f64::NEG_INFINITY);
        for run in runs {
            let (arrived, replaced) = run.reads;
            let from = if may_last {
                arrived.min(run.start)
            } else {
                run.start
            };
            loop {
                let next = grid.next(number, free);
                let due = grid.due(next);
                let (mut start, mut late) = (due.max(free), 0.0);
                if grid.is_late {
                    (start, late) = (due + run.late, run.late);
                }
                if start >= run.end || ticks.takes.len() >= MOST {
                    // There is no tick for this output.
                    break;
                }
                number = next;
                if start + 1.0 + grid.early < from {
                    // A tick without an output.
                    free = (start + usual).min(run.start);
                    ticks.push(free - start, 0.0);
                    continue;
                }
                let may_wait = grid.early.max(SLIGHTLY_LATE * grid.period);
                if (0.0..=may_wait).contains(&(arrived - start)) {
                    // Constant costs are their mean: that may deliver it a little later.
                    start = arrived + 0.02e6;
                    late = start - due;
                }
                if start > replaced + 1.0 {
                    ticks.too_new.push(start - replaced);
                }
                free = run.end;
                ticks.push(free - start, late);
                break;
            }
        }
        ticks
    }

    fn push(&mut self, takes: f64, late: f64) {
        self.takes.push(takes.max(0.0) / 1e6);
        self.wakes.push(late.max(0.0) / 1e6);
    }

    /// Returns how much earlier ticks must be due so that nearly all of `count` outputs use what
    /// was the newest, but for the `lost` ones that no phase explains; 0 if they do.
    fn too_new(&mut self, grid: &TimerGrid, lost: f64, count: usize) -> f64 {
        const SOME: f64 = 0.005;
        let longest = 0.25 * grid.period;
        self.too_new.retain(|by| *by < longest);
        self.too_new.sort_by(f64::total_cmp);
        let by = self.too_new.get(self.too_new.len() * 95 / 100);
        let expected = lost + SOME * count as f64;
        let is_needed = !grid.is_late && self.too_new.len() as f64 > expected;
        by.filter(|_| is_needed).copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ticks_of_a_timer_make_the_outputs_in_the_bag() {
        // Start, from when to when its input was the newest, and end of each run (ms).
        type RunMs = (f64, (f64, f64), f64);
        let ticks = |runs: &[RunMs], is_queue: bool| {
            let run = |(start, (arrived, replaced), end): &RunMs| TimerRun {
                tick: start * 1e6,
                late: 0.0,
                start: start * 1e6,
                reads: (arrived * 1e6, replaced * 1e6),
                end: end * 1e6,
            };
            let runs: Vec<TimerRun> = runs.iter().map(run).collect();
            let grid = TimerGrid {
                origin: 0.0,
                period: 100e6,
                is_queue,
                is_late: false,
                early: 0.0,
            };
            TimerTicks::new(&runs, grid).takes
        };
        let each = [(0.0, (-9.0, 91.0), 30.0), (100.0, (91.0, 191.0), 140.0)];
        assert_eq!(ticks(&each, false), [30.0, 40.0]);
        // A tick between two outputs takes what is usual.
        let some = [(0.0, (-9.0, 150.0), 30.0), (200.0, (150.0, 350.0), 230.0)];
        assert_eq!(ticks(&some, false), [30.0, 30.0, 30.0]);
        // A run longer than a period is one run, if its input came before it.
        let long = [
            (0.0, (-9.0, 90.0), 70.0),
            (200.0, (91.0, 500.0), 240.0),
            (300.0, (291.0, 400.0), 390.0),
        ];
        assert_eq!(ticks(&long, false), [70.0, 140.0, 90.0]);
        // A due time waits for the run before, or is skipped.
        let busy = [
            (0.0, (-9.0, 90.0), 130.0),
            (130.0, (95.0, 170.0), 180.0),
            (200.0, (195.0, 300.0), 290.0),
        ];
        assert_eq!(ticks(&busy, true), [130.0, 50.0, 90.0]);
        // What ends before its tick could begin has none.
        let early = [(0.0, (-9.0, 90.0), 130.0), (130.0, (95.0, 170.0), 180.0)];
        assert_eq!(ticks(&early, false), [130.0]);
    }
}
