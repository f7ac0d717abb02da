//! The latency of each step of the plant: over time beside the period of the
//! [paced node](paced_node) and the push age, and as a distribution.

use std::time::Duration;

use ratelab::{Command, Event, Knob, Time};
use ratelab_metrics::{PushAge, Snapshot};
use ratelab_system::{System, paced_node};
use rerun::RecordingStream;

use super::{
    histogram::Histogram,
    lines::{self, Line},
    palette::{BLUE, ORANGE, PINK},
};
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

    /// Names and looks.
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
        let mut periods = self.periods.iter().rev();
        let period = periods.find(|(from, _)| *from <= time);
        period.map_or(Duration::ZERO, |(_, period)| *period)
    }
}
