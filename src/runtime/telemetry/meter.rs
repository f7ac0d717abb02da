//! Distributions of durations, recorded without ever waiting.

use std::time::Duration;

use hdrhistogram::Histogram;

use crate::runtime::sync::{
    Arc, Mutex,
    atomic::{AtomicU64, Ordering},
    lock, try_lock,
};

/// Significant digits of a histogram: quantiles are true to 0.1 %.
const DIGITS: u8 = 3;

/// Samples a [`Recorder`] keeps aside while somebody reads its meter.
const ASIDE: usize = 64;

/// How some duration was distributed. Count, mean and maximum are exact,
/// quantiles are true to 0.1 %.
#[derive(Clone, Debug)]
pub struct Distribution {
    histogram: Histogram<u64>,
    sum: u64,
    max: u64,
}

impl Distribution {
    /// No samples.
    pub fn empty() -> Self {
        Self {
            // Fails only for more than five digits.
            histogram: Histogram::new(DIGITS).expect("three digits are valid"),
            sum: 0,
            max: 0,
        }
    }

    fn record(&mut self, nanos: u64) {
        // Fails only for a histogram of fixed size, which this is not.
        let _ = self.histogram.record(nanos);
        self.sum = self.sum.saturating_add(nanos);
        self.max = self.max.max(nanos);
    }

    /// How many samples there are.
    pub fn count(&self) -> u64 {
        self.histogram.len()
    }

    /// The sum of all samples.
    pub fn sum(&self) -> Duration {
        Duration::from_nanos(self.sum)
    }

    /// The mean in seconds, exact but for the last division; `None` without
    /// samples.
    pub fn mean_s(&self) -> Option<f64> {
        let count = self.count();
        (count > 0).then(|| self.sum as f64 / count as f64 / 1e9)
    }

    /// The longest sample; `None` without samples.
    pub fn max(&self) -> Option<Duration> {
        (self.count() > 0).then(|| Duration::from_nanos(self.max))
    }

    /// The duration that the share `quantile` (0 to 1) of samples does not
    /// exceed; `None` without samples.
    pub fn quantile(&self, quantile: f64) -> Option<Duration> {
        (self.count() > 0).then(|| {
            let nanos = self.histogram.value_at_quantile(quantile);
            Duration::from_nanos(nanos.min(self.max))
        })
    }

    /// The histogram itself, in nanoseconds, for drawing.
    pub fn histogram(&self) -> &Histogram<u64> {
        &self.histogram
    }
}

/// The reading side of a distribution: any number of clones, on any thread.
#[derive(Clone, Debug)]
pub struct Meter(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    distribution: Mutex<Distribution>,
    lost: AtomicU64,
}

impl Meter {
    /// An empty meter and the one recorder that writes to it.
    pub fn new() -> (Recorder, Self) {
        let meter = Self(Arc::new(Shared {
            distribution: Mutex::new(Distribution::empty()),
            lost: AtomicU64::new(0),
        }));
        let recorder = Recorder {
            meter: meter.clone(),
            aside: Vec::with_capacity(ASIDE),
        };
        (recorder, meter)
    }

    /// What was recorded so far.
    pub fn read(&self) -> Distribution {
        lock(&self.0.distribution).clone()
    }

    /// Samples that found no room because readers held the meter too long.
    pub fn lost(&self) -> u64 {
        self.0.lost.load(Ordering::Relaxed)
    }
}

/// The writing side of a distribution, owned by the one thread that measures.
///
/// Recording never waits: while a reader copies the distribution, samples are
/// kept aside and delivered with the next one. Should the room for that run
/// out, the loss is counted, see [`Meter::lost`].
#[derive(Debug)]
pub struct Recorder {
    meter: Meter,
    aside: Vec<u64>,
}

impl Recorder {
    /// Adds a sample.
    pub fn record(&mut self, sample: Duration) {
        let nanos = u64::try_from(sample.as_nanos()).unwrap_or(u64::MAX);
        let shared = &*self.meter.0;
        if let Some(mut distribution) = try_lock(&shared.distribution) {
            distribution.record(nanos);
            self.aside.drain(..).for_each(|n| distribution.record(n));
        } else if self.aside.len() < ASIDE {
            self.aside.push(nanos);
        } else {
            shared.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Delivers what was kept aside. Waits, so only for when control is at
    /// rest.
    pub fn flush(&mut self) {
        if !self.aside.is_empty() {
            let mut distribution = lock(&self.meter.0.distribution);
            self.aside.drain(..).for_each(|n| distribution.record(n));
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.flush();
    }
}
