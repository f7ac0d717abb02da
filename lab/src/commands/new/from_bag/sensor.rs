//! Nodes that read nothing: on the grid of a timer, or whenever their data came.

use ratelab_bag::BagNode;

use super::{
    Draft, MIN_COUNT,
    sheet::{nine_digits, number, source_of},
};

/// The most silences that are written as a crash and a restart.
const MAX_SILENCES: usize = 50;

/// Nodes from which on those that nobody reads are left out: a graph file has 200 parts.
const MANY: usize = 40;

/// Periods without data that are a silence.
const SILENCE: f64 = 3.0;

/// The rate of a node that replays any arrivals (Hz).
const REPLAY: f64 = 1_000.0;

/// A grid of ticks: one of each `period` from `origin` on (ns).
#[derive(Clone, Copy)]
struct TickGrid {
    origin: f64,
    period: f64,
}

impl TickGrid {
    /// Creates the grid that data began on; `None` if it did not begin on one.
    fn new(begins: &[f64], period: f64) -> Option<Self> {
        let first = *begins.first()?;
        let mut phases: Vec<f64> = begins
            .iter()
            .map(|begin| (begin - first).rem_euclid(period))
            .collect();
        phases.sort_by(f64::total_cmp);
        let around = phases[0] + period - phases[phases.len() - 1];
        let (mut widest, mut origin) = (around, phases[0]);
        for pair in phases.windows(2) {
            if pair[1] - pair[0] > widest {
                (widest, origin) = (pair[1] - pair[0], pair[1]);
            }
        }
        let mut rests: Vec<f64> = phases
            .iter()
            .map(|phase| (phase - origin).rem_euclid(period))
            .collect();
        rests.sort_by(f64::total_cmp);
        let of = |share: f64| rests[((rests.len() as f64 * share).ceil() as usize).max(1) - 1];
        let late = rests.iter().filter(|rest| **rest >= 0.95 * period).count();
        let is_grid = of(0.9) - of(0.1) < 0.45 * period && late * 50 < rests.len();
        let origin = first + origin;
        // The instant of the first data.
        let origin = origin + ((first - origin) / period).floor() * period;
        is_grid.then_some(Self { origin, period })
    }

    /// Returns the last instant up to `time`.
    fn before(self, time: f64) -> f64 {
        self.origin + ((time - self.origin) / self.period).floor() * self.period
    }
}

/// The ticks of a sensor.
struct SensorTicks {
    lateness: Vec<f64>,
    takes: Vec<f64>,
    /// From when to when it was dead (ns).
    silences: Vec<(f64, f64)>,
}

impl SensorTicks {
    /// Creates the ticks on `grid` of data that began and was published at these times (ns).
    fn new(data: &[(f64, f64)], grid: TickGrid, with_silences: bool) -> Self {
        let mut ticks = Self {
            lateness: Vec::with_capacity(data.len()),
            takes: Vec::with_capacity(data.len()),
            silences: Vec::new(),
        };
        let mut end = f64::NEG_INFINITY;
        for (place, (begin, published)) in data.iter().enumerate() {
            let step = place
                .checked_sub(1)
                .map_or(0.0, |before| begin - data[before].0);
            let is_silence = with_silences
                && step >= SILENCE * grid.period
                && ticks.silences.len() < MAX_SILENCES;
            let instant = if is_silence {
                ticks
                    .silences
                    .push((end + 0.1e6, begin - grid.period / 2.0));
                grid.before(*begin)
            } else if end == f64::NEG_INFINITY {
                grid.before(*begin)
            } else {
                grid.before(end) + grid.period
            };
            ticks.lateness.push((begin - instant).max(0.0) / 1e6);
            let next = data
                .get(place + 1)
                .map_or(f64::INFINITY, |(next, _)| next - begin);
            let takes = (published - begin).min(0.98 * next).max(0.0);
            ticks.takes.push(takes / 1e6);
            end = begin.max(instant) + takes;
        }
        ticks
    }
}

impl Draft<'_> {
    /// Writes a sensor. Returns whether it is in the graph.
    pub(super) fn sensor(&mut self, node: &BagNode) -> bool {
        let mut data: Vec<(f64, f64)> = self
            .analysis
            .begun(node.topic, node.topic)
            .into_iter()
            .map(|(event, begin)| (begin as f64, event as f64))
            .collect();
        data.sort_by(|one, other| one.0.total_cmp(&other.0));
        data.dedup_by(|one, other| one.0 == other.0);
        let begins: Vec<f64> = data.iter().map(|(begin, _)| *begin).collect();
        let period = node.period.map(|period| period.length);
        let grid = period.and_then(|period| TickGrid::new(&begins, period));
        let sharpness = node.period.map_or(0.0, |period| period.sharpness);
        let is_read = self.readers(node.topic).next().is_some();
        if !is_read && self.analysis.nodes.len() > MANY {
            let name = self.quoted(node.topic);
            self.sheet.line(&format!(
                "\n# left out: nobody reads {name}, and a graph has 200 parts"
            ));
            return false;
        }
        if !is_read && (grid.is_none() || data.len() < MIN_COUNT || sharpness < 0.5) {
            let name = self.quoted(node.topic);
            self.sheet.line(&format!(
                "\n# left out: {name} has no rate, and nobody reads it"
            ));
            return false;
        }
        let (name, count) = (self.name(node.topic), data.len());
        let is_slow = |(place, of): (usize, &(f64, f64))| {
            data.get(place + 1)
                .is_some_and(|next| of.1 - of.0 >= next.0 - of.0)
        };
        let slow = data.iter().enumerate().filter(|of| is_slow(*of)).count();
        let evidence = match grid {
            Some(_) => format!("{count} messages"),
            None => format!("{count} messages without a rate: each comes when it came"),
        };
        let with_silences = grid.is_some();
        let grid = grid.unwrap_or(TickGrid {
            origin: begins.first().copied().unwrap_or(0.0),
            period: 1e9 / REPLAY,
        });
        if slow * 50 > count {
            self.source(node, &data, grid, &evidence);
            return true;
        }
        let ticks = SensorTicks::new(&data, grid, with_silences);
        self.timer(&name, grid, &ticks, &evidence);
        self.silences(&name, &data, grid, ticks.silences, with_silences);
        if let Some(takes) = self.sheet.values(&name, "takes", &ticks.takes) {
            self.sheet.line(&format!("takes = {takes}"));
        }
        let published = self.published(node.topic);
        self.sheet.line(&published);
        true
    }

    /// Writes a node at a rate, up to its lateness.
    fn timer(&mut self, name: &str, grid: TickGrid, ticks: &SensorTicks, evidence: &str) {
        let rate = nine_digits(1e9 / grid.period);
        let offset = number(self.in_file(grid.origin));
        self.sheet.line(&format!("\n[node.{name}]"));
        self.sheet.line(&format!("rate = {rate}   # {evidence}"));
        self.sheet.line(&format!("offset = {offset}"));
        if let Some(wakes) = self.sheet.values(name, "wakes", &ticks.lateness) {
            self.sheet.line(&format!("wakes = {wakes}"));
        }
    }

    /// Notes when the node called `name` was silent.
    fn silences(
        &mut self,
        name: &str,
        data: &[(f64, f64)],
        grid: TickGrid,
        silences: Vec<(f64, f64)>,
        with_silences: bool,
    ) {
        for (from, until) in silences {
            let (from, until) = (self.in_file(from), self.in_file(until));
            self.sheet.knob(from, format!("crash {name}"));
            self.sheet.knob(until, format!("restart {name}"));
        }
        let last = data
            .last()
            .map_or(0.0, |(begin, published)| published.max(*begin));
        if with_silences && self.analysis.end as f64 - last >= SILENCE * grid.period {
            let at = self.in_file(last + 0.1e6);
            self.sheet.knob(at, format!("crash {name}"));
        }
    }

    /// Writes a sensor whose data takes longer than its period, with a source before it.
    fn source(&mut self, node: &BagNode, data: &[(f64, f64)], grid: TickGrid, evidence: &str) {
        let name = self.name(node.topic);
        let source = source_of(&name);
        let at_once: Vec<(f64, f64)> = data.iter().map(|(begin, _)| (*begin, *begin)).collect();
        let ticks = SensorTicks::new(&at_once, grid, true);
        self.timer(&source, grid, &ticks, evidence);
        self.silences(&source, &at_once, grid, ticks.silences, true);
        let topic = format!("/{source}");
        self.sheet.line(&format!("publishes = [\"{topic}\"]"));
        let mut delays: Vec<f64> = data
            .iter()
            .map(|(begin, end)| (end - begin).max(0.0) / 1e6)
            .collect();
        delays.sort_by(f64::total_cmp);
        self.sheet.line(&format!("\n[topic.\"{topic}\"]"));
        self.sheet.line("depth = 100");
        self.sheet.line(&format!(
            "link = \"{}\"   # longer than a period: on its way, not at work",
            link(&delays)
        ));
        self.sheet.line(&format!("\n[node.{name}]"));
        self.sheet.line(&format!("trigger = [\"{topic}\"]"));
        let published = self.published(node.topic);
        self.sheet.line(&published);
        self.sheet.add_source(&name);
    }
}

/// Returns the link whose mean is nearest to that of these sorted delays (ms).
fn link(delays: &[f64]) -> String {
    let of = |share: f64| {
        let place = ((delays.len() as f64 * share).ceil() as usize).max(1) - 1;
        delays.get(place).copied().unwrap_or(0.0)
    };
    let mean = delays.iter().sum::<f64>() / delays.len().max(1) as f64;
    if of(1.0) - of(0.0) < 0.02 {
        return format!("delay:{}", number(mean));
    }
    let (low, high) = (of(0.02), of(0.98));
    let (middle, top) = (of(0.5), of(0.99));
    // The 99th percentile of a normal distribution is 2.326 deviations away.
    let sigma = if middle > 0.0 {
        (top / middle).ln() / 2.326
    } else {
        0.0
    };
    let lognormal = middle * (sigma * sigma / 2.0).exp();
    if (f64::midpoint(low, high) - mean).abs() <= (lognormal - mean).abs() || middle <= 0.0 {
        return format!("delay:{}..{},in-order", number(low), number(high));
    }
    format!(
        "delay:lognormal:{},{},in-order",
        number(middle),
        number(top)
    )
}
