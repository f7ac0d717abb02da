//! The latency of each step of the plant: over time, and its distribution so far.

use std::time::Duration;

use ratelab::{Command, Event, Knob, Time};
use ratelab_metrics::{Distribution, PushAge, Snapshot};
use ratelab_system::{System, paced_node};
use rerun::{BarChart, RecordingStream, TensorData};

use super::lines::{self, BLUE, Line, ORANGE, PINK};
use crate::rrd::timeline::{BatchStream, Written, times};

/// Latency, period and push age (ms).
pub const LATENCY: &str = "plot/latency";

/// Draws latencies.
pub struct LatencyScene {
    meter: String,
    period: Option<PeriodInForce>,
    age: PushAge,
    histogram: Histogram,
}

impl LatencyScene {
    /// Of `system`, whose graph is as in `start`, if it has a latency.
    pub fn new(system: &dyn System, start: &Snapshot) -> Option<Self> {
        let (_, meter) = system.latency()?;
        Some(Self {
            meter: meter.to_owned(),
            period: paced_node(system).map(|node| PeriodInForce::new(node, start.period(node))),
            age: PushAge::default(),
            histogram: Histogram::default(),
        })
    }

    /// Returns the names and looks.
    pub fn begin(&self, rec: &RecordingStream) -> Written {
        let latency = format!("{} latency (ms)", self.meter);
        let period = self.period.iter().map(|period| {
            let name = format!("{} period (ms)", period.node);
            Line::new(name, ORANGE, 2.0)
        });
        let lines = std::iter::once(Line::new(latency, BLUE, 1.0)).chain(period);
        let age = Line::new("push age, mean of the last second (ms)", PINK, 2.0);
        let lines = lines.chain([age]);
        lines::begin(rec, LATENCY, &lines.collect::<Vec<_>>())?;
        self.histogram.begin(rec)
    }

    /// Draws the steps of this batch.
    pub fn add(&mut self, stream: &BatchStream, events: &[Event]) -> Written {
        if let Some(period) = &mut self.period {
            period.learn(events);
        }
        let mut values = Vec::new();
        for step in stream.steps {
            // A gap where nothing led to it yet.
            let latency = step.origin.map(|origin| step.at.since(origin));
            values.push(latency.map_or(f64::NAN, ms));
            values.extend(self.period.iter().map(|period| ms(period.at(step.at))));
            if let Some(sensed) = step.origin {
                self.age.push(step.at, sensed);
            }
            let age = self.age.lately(step.at);
            values.push(age.map_or(f64::NAN, |late| late.mean_s * 1e3));
        }
        let count = 2 + usize::from(self.period.is_some());
        lines::send(stream, LATENCY, &times(stream.steps), values, count)?;
        self.histogram.add(stream)
    }

    /// Draws the distribution at the end of the run.
    pub fn finish(&mut self, stream: &BatchStream, at: Time) -> Written {
        self.histogram.finish(stream, at)
    }
}

fn ms(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

/// The period in force of a node, as events change it.
struct PeriodInForce {
    node: &'static str,
    /// Each period with the run time from which it is in force.
    periods: Vec<(Time, Duration)>,
}

impl PeriodInForce {
    /// Of `node`, which begins with the period `first`.
    fn new(node: &'static str, first: Duration) -> Self {
        let periods = vec![(Time::ZERO, first)];
        Self { node, periods }
    }

    /// Learns of the changes among `events`.
    fn learn(&mut self, events: &[Event]) {
        let changes = events.iter().filter_map(|event| match event.applied()? {
            Command::Set(Knob::Rate { node, hz }) if node == self.node => {
                Some((event.at, hz.period()))
            }
            _ => None,
        });
        self.periods.extend(changes);
    }

    /// Returns the period for a tick at `time`. A change takes effect before any tick that is due
    /// with it.
    fn at(&self, time: Time) -> Duration {
        let period = self.periods.iter().rev().find(|(from, _)| *from <= time);
        period.map_or(Duration::ZERO, |(_, period)| *period)
    }
}

/// The histogram.
pub const HISTOGRAM: &str = "plot/latency_histogram";

/// Run time between two of them.
const PERIOD: Duration = Duration::from_secs(1);

/// Counts latencies.
#[derive(Default)]
pub struct Histogram {
    latencies: Distribution,
    /// Width of a bar as it was last logged (ms); zero before that.
    width: u64,
    next: Option<Time>,
}

impl Histogram {
    /// Returns the colour, which does not change.
    pub fn begin(&self, rec: &RecordingStream) -> Written {
        rec.log_static(HISTOGRAM, &BarChart::update_fields().with_color(BLUE))
    }

    /// Counts the steps of this batch, and logs the histogram once a second.
    pub fn add(&mut self, stream: &BatchStream) -> Written {
        let (mut times, mut rows) = (Vec::new(), Vec::new());
        for step in stream.steps {
            let mut next = self.next.unwrap_or(step.at + PERIOD);
            while next < step.at {
                self.widen(stream, next)?;
                times.push(next);
                rows.push(self.heights());
                next = next + PERIOD;
            }
            self.next = Some(next);
            if let Some(origin) = step.origin {
                self.latencies.add(step.at.since(origin));
            }
        }
        log_heights(stream, &times, rows)
    }

    /// Logs what there is at the end of the run.
    pub fn finish(&mut self, stream: &BatchStream, at: Time) -> Written {
        self.widen(stream, at)?;
        log_heights(stream, &[at], vec![self.heights()])
    }

    /// Takes the narrowest width with which all latencies fit, and logs where
    /// the bars are if that has changed.
    fn widen(&mut self, stream: &BatchStream, at: Time) -> Written {
        let longest = self.latencies.max().unwrap_or_default();
        let width = width_ms(|width| longest < Duration::from_millis(BINS as u64 * width));
        if width == self.width {
            return Ok(());
        }
        self.width = width;
        // The viewer wants the left end of each.
        let places: Vec<f64> = (0..BINS).map(|bar| (bar as u64 * width) as f64).collect();
        let place = BarChart::update_fields().with_abscissa(places);
        let widths = BarChart::update_fields().with_widths([width as f32; BINS]);
        let columns = place.columns([1])?.chain(widths.columns([BINS])?);
        stream.send(HISTOGRAM, &[at], columns)
    }

    /// Steps per bar.
    fn heights(&self) -> TensorData {
        let mut bars = vec![0; BINS];
        for (latency, count) in self.latencies.bars() {
            let bar = latency.as_millis() / u128::from(self.width.max(1));
            bars[(bar as usize).min(BINS - 1)] += count;
        }
        bars.into()
    }
}

fn log_heights(stream: &BatchStream, times: &[Time], rows: Vec<TensorData>) -> Written {
    let bars = BarChart::update_fields().with_many_values(rows);
    stream.send(HISTOGRAM, times, bars.columns_of_unit_batches()?)
}

/// Number of bins.
pub const BINS: usize = 24;

/// Available widths (ms).
const WIDTHS_MS: [u64; 10] = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];

/// Returns the narrowest width (ms) that `fits`, or else the widest.
pub fn width_ms(fits: impl Fn(u64) -> bool) -> u64 {
    let place = WIDTHS_MS.iter().position(|width| fits(*width));
    WIDTHS_MS[place.unwrap_or(WIDTHS_MS.len() - 1)]
}
