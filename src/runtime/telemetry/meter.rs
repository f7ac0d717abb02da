//! Distributions of durations, recorded without ever waiting.

use std::{
    sync::{Arc, LazyLock, OnceLock},
    time::Duration,
};

use hdrhistogram::Histogram;

use crate::runtime::{
    sync::atomic::{AtomicU64, Ordering},
    topic::bump,
};

/// Significant digits of a histogram: quantiles are true to 0.1 %.
const DIGITS: u8 = 3;

/// Buckets in an octave, as many as a histogram of that many digits has.
const BUCKETS: usize = 1 << BUCKET_BITS;
// Every bucket is a place where the model checker may switch threads: few do.
const BUCKET_BITS: u32 = if cfg!(feature = "model") { 2 } else { 10 };

/// Octaves in 64 bits: below [`BUCKETS`] there is one bucket per nanosecond.
const OCTAVES: usize = (u64::BITS - BUCKET_BITS + 1) as usize;

/// How some duration was distributed. Count, mean and maximum are exact,
/// quantiles are true to 0.1 %.
#[derive(Clone, Debug)]
pub struct Distribution {
    /// Shared by all copies: a histogram without a sample has 16 kB already.
    histogram: Arc<Histogram<u64>>,
    sum: u64,
    max: u64,
}

impl Distribution {
    /// No samples.
    pub fn empty() -> Self {
        static EMPTY: LazyLock<Arc<Histogram<u64>>> = LazyLock::new(|| Arc::new(histogram()));
        Self {
            histogram: EMPTY.clone(),
            sum: 0,
            max: 0,
        }
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

fn histogram() -> Histogram<u64> {
    // Fails only for more than five digits.
    Histogram::new(DIGITS).expect("three digits are valid")
}

/// The reading side of a distribution: any number of clones, on any thread.
#[derive(Clone, Debug)]
pub struct Meter(Arc<Counts>);

/// A histogram that one thread writes while others read, without a lock: a
/// lock costs more than all else that recording a sample does.
#[derive(Debug)]
struct Counts {
    /// Made when they are first needed: most meters see few octaves, and many
    /// see none.
    octaves: [OnceLock<Box<[AtomicU64]>>; OCTAVES],
    sum: AtomicU64,
    max: AtomicU64,
}

impl Meter {
    /// An empty meter and the one recorder that writes to it.
    pub fn new() -> (Recorder, Self) {
        let meter = Self(Arc::new(Counts {
            octaves: [const { OnceLock::new() }; OCTAVES],
            sum: AtomicU64::new(0),
            max: AtomicU64::new(0),
        }));
        (Recorder(meter.clone()), meter)
    }

    /// What was recorded so far. A sample that is being recorded meanwhile may
    /// be in the count already and in the mean only next time.
    pub fn read(&self) -> Distribution {
        let counts = &*self.0;
        let mut recorded = counts.recorded().peekable();
        if recorded.peek().is_none() {
            return Distribution::empty();
        }
        let mut histogram = histogram();
        for (value, count) in recorded {
            // Grows as needed, which it can for any number of 64 bits.
            let _ = histogram.record_n(value, count);
        }
        Distribution {
            histogram: Arc::new(histogram),
            sum: counts.sum.load(Ordering::Relaxed),
            max: counts.max.load(Ordering::Relaxed),
        }
    }
}

impl Counts {
    fn record(&self, nanos: u64) {
        let (octave, bucket) = place(nanos);
        let buckets = self.octaves[octave].get_or_init(|| {
            let zeros = (0..BUCKETS).map(|_| AtomicU64::new(0));
            zeros.collect()
        });
        bump(&buckets[bucket]);
        let sum = self.sum.load(Ordering::Relaxed).saturating_add(nanos);
        self.sum.store(sum, Ordering::Relaxed);
        if nanos > self.max.load(Ordering::Relaxed) {
            self.max.store(nanos, Ordering::Relaxed);
        }
    }

    /// The buckets that are not empty: the least value of each, and its count.
    fn recorded(&self) -> impl Iterator<Item = (u64, u64)> {
        let octaves = self.octaves.iter().enumerate();
        let octaves = octaves.filter_map(|(octave, buckets)| Some((octave, buckets.get()?)));
        let buckets = octaves.flat_map(|(octave, buckets)| {
            let buckets = buckets.iter().enumerate();
            buckets
                .map(move |(bucket, count)| (least(octave, bucket), count.load(Ordering::Relaxed)))
        });
        buckets.filter(|(_, count)| *count > 0)
    }
}

/// In which octave and bucket a value is counted.
fn place(value: u64) -> (usize, usize) {
    let octave = (value | (BUCKETS as u64 / 2)).ilog2() + 1 - BUCKET_BITS;
    let bucket = value >> octave.saturating_sub(1);
    (octave as usize, bucket as usize % BUCKETS)
}

/// The least value that is counted there.
fn least(octave: usize, bucket: usize) -> u64 {
    match octave {
        0 => bucket as u64,
        _ => ((BUCKETS + bucket) as u64) << (octave - 1),
    }
}

/// The writing side of a distribution, owned by the one thread that measures.
/// Recording never waits, and neither does reading.
#[derive(Debug)]
pub struct Recorder(Meter);

impl Recorder {
    /// Adds a sample.
    pub fn record(&mut self, sample: Duration) {
        let nanos = u64::try_from(sample.as_nanos()).unwrap_or(u64::MAX);
        self.0.0.record(nanos);
    }
}
