//! The distribution of latency so far.

use std::time::Duration;

use ratelab::Time;
use ratelab_metrics::Distribution;
use rerun::{BarChart, RecordingStream, TensorData};

use super::palette::BLUE;
use crate::{
    bins::{BINS, width_ms},
    rrd::timeline::{BatchStream, Written},
};

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
