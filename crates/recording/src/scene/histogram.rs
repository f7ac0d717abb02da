//! The distribution of latency so far.

use std::time::Duration;

use ratelab::{Head, Time};
use rerun::{BarChart, RecordingStream, TensorData};

use super::palette::BLUE;
use crate::{
    bins::{BINS, WIDEST_MS, width_ms},
    timeline::{BatchStream, Written},
};

/// The histogram.
pub const HISTOGRAM: &str = "plot/latency_histogram";

/// Run time between two of them.
const PERIOD: Duration = Duration::from_secs(1);

/// Counts latencies by the millisecond.
#[derive(Default)]
pub struct Histogram {
    counts: Vec<u64>,
    /// Width of a bar as it was last logged (ms); zero before that.
    width: usize,
    next: Option<Time>,
}

impl Histogram {
    /// The colour, which does not change.
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
            self.count(step);
        }
        log_heights(stream, &times, rows)
    }

    /// Logs what there is at the end of the run.
    pub fn finish(&mut self, stream: &BatchStream, at: Time) -> Written {
        self.widen(stream, at)?;
        log_heights(stream, &[at], vec![self.heights()])
    }

    fn count(&mut self, step: &Head) {
        let Some(latency) = step.origin.map(|origin| step.at.since(origin)) else {
            return;
        };
        let last = BINS * WIDEST_MS as usize - 1;
        let ms = usize::try_from(latency.as_millis()).map_or(last, |ms| ms.min(last));
        if self.counts.len() <= ms {
            self.counts.resize(ms + 1, 0);
        }
        self.counts[ms] += 1;
    }

    /// Takes the narrowest width with which all latencies fit, and logs where
    /// the bars are if that has changed.
    fn widen(&mut self, stream: &BatchStream, at: Time) -> Written {
        let fits = |width: u64| self.counts.len() as u64 <= BINS as u64 * width;
        let width = width_ms(fits) as usize;
        if width == self.width {
            return Ok(());
        }
        self.width = width;
        // The viewer wants the left end of each.
        let places: Vec<f64> = (0..BINS).map(|bar| (bar * width) as f64).collect();
        let place = BarChart::update_fields().with_abscissa(places);
        let widths = BarChart::update_fields().with_widths([width as f32; BINS]);
        let columns = place.columns([1])?.chain(widths.columns([BINS])?);
        stream.send(HISTOGRAM, &[at], columns)
    }

    /// Steps per bar.
    fn heights(&self) -> TensorData {
        let mut bars = vec![0; BINS];
        for (ms, count) in self.counts.iter().enumerate() {
            bars[ms / self.width.max(1)] += count;
        }
        bars.into()
    }
}

fn log_heights(stream: &BatchStream, times: &[Time], rows: Vec<TensorData>) -> Written {
    let bars = BarChart::update_fields().with_many_values(rows);
    stream.send(HISTOGRAM, times, bars.columns_of_unit_batches()?)
}

#[cfg(test)]
mod tests {
    use rerun::{TensorBuffer, TensorData};

    use super::{BINS, Histogram};

    fn bars(data: TensorData) -> Vec<u64> {
        match data.buffer {
            TensorBuffer::U64(bars) => bars.to_vec(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn bars_widen_and_none_is_lost() {
        let mut histogram = Histogram {
            counts: vec![0; 181],
            ..Histogram::default()
        };
        (histogram.counts[0], histogram.counts[180]) = (3, 2);
        histogram.width = 10;
        let counted = bars(histogram.heights());
        assert_eq!((counted.len(), counted[0], counted[18]), (BINS, 3, 2));
    }
}
