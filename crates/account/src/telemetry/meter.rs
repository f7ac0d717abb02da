//! Distributions of durations, recorded without blocking.

use std::{
    sync::{Arc, OnceLock},
    time::Duration,
};

use ratelab::sync::{
    self,
    atomic::{AtomicU64, Ordering},
};

/// Buckets per octave: the width of each is at most 1/1024 of its values.
const BUCKETS: usize = 1 << BUCKET_BITS;
// Every bucket is a point where the model checker may switch threads, so it uses few.
const BUCKET_BITS: u32 = if sync::MODEL { 2 } else { 10 };

/// Buckets in a block, which is a kilobyte.
const BLOCK: usize = if BUCKETS < 64 { BUCKETS } else { 64 };

/// Octaves in 64 bits: below [`BUCKETS`] there is one bucket per nanosecond.
const OCTAVES: usize = (u64::BITS - BUCKET_BITS + 1) as usize;

/// The distribution of a duration. Count, mean and maximum are exact; quantiles are
/// accurate to 0.1 %, and exact where all samples that close to each other are equal.
#[derive(Clone, Debug)]
pub struct Distribution {
    /// Durations (ns) in ascending order, each with the number of its samples.
    bars: Arc<[(u64, u64)]>,
    count: u64,
    sum: u64,
    max: u64,
}

impl Distribution {
    /// A distribution without samples.
    pub fn empty() -> Self {
        Self {
            bars: Arc::default(),
            count: 0,
            sum: 0,
            max: 0,
        }
    }

    /// Number of samples.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The sum of all samples.
    pub fn sum(&self) -> Duration {
        Duration::from_nanos(self.sum)
    }

    /// The mean in seconds, exact except for the last division; `None` without samples.
    pub fn mean_s(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum as f64 / self.count as f64 / 1e9)
    }

    /// The longest sample; `None` without samples.
    pub fn max(&self) -> Option<Duration> {
        (self.count > 0).then(|| Duration::from_nanos(self.max))
    }

    /// The duration that a share `quantile` (0 to 1) of the samples does not exceed;
    /// `None` without samples.
    pub fn quantile(&self, quantile: f64) -> Option<Duration> {
        let rank = ((quantile * self.count as f64).ceil() as u64).max(1);
        if rank >= self.count {
            return self.max();
        }
        let mut up_to = 0;
        let mut bars = self.bars();
        let bar = bars.find(|(_, count)| {
            up_to += count;
            up_to >= rank
        });
        bar.map(|(duration, _)| duration)
    }

    /// The durations in ascending order, each with its number of samples. Samples within
    /// 0.1 % of each other are combined under their mean.
    pub fn bars(&self) -> impl Iterator<Item = (Duration, u64)> {
        let bars = self.bars.iter();
        bars.map(|(nanos, count)| (Duration::from_nanos(*nanos.min(&self.max)), *count))
    }
}

/// A distribution that one thread at a time records, without blocking, and any number of others
/// read.
#[derive(Clone, Debug, Default)]
pub struct Meter(Arc<BucketCounts>);

/// A histogram that one thread writes while others read, without a lock: a lock would
/// cost more than the rest of recording a sample.
#[derive(Debug)]
struct BucketCounts {
    /// Allocated on first use, octaves and blocks of them: most meters see few, and many see
    /// none.
    octaves: [OnceLock<Box<[Block]>>; OCTAVES],
    sum: AtomicU64,
    max: AtomicU64,
}

/// Neighbouring buckets of an octave.
type Block = OnceLock<Box<[Bucket]>>;

/// Samples that are counted together, represented by their mean: for equal samples it is
/// their exact value, unlike either end of the bucket.
#[derive(Debug, Default)]
struct Bucket {
    count: AtomicU64,
    /// The sum of their excess over the bucket's least value.
    excess: AtomicU64,
}

impl Default for BucketCounts {
    fn default() -> Self {
        Self {
            octaves: [const { OnceLock::new() }; OCTAVES],
            sum: AtomicU64::new(0),
            max: AtomicU64::new(0),
        }
    }
}

impl Meter {
    /// Adds a sample.
    pub fn record(&self, sample: Duration) {
        let nanos = u64::try_from(sample.as_nanos()).unwrap_or(u64::MAX);
        self.0.record(nanos);
    }

    /// Reads the samples so far. A sample recorded concurrently may be in the count
    /// already and in the mean only at the next read.
    pub fn read(&self) -> Distribution {
        let counts = &*self.0;
        let bars: Arc<[(u64, u64)]> = counts.bars().collect();
        Distribution {
            count: bars.iter().map(|(_, count)| count).sum(),
            bars,
            sum: counts.sum.load(Ordering::Relaxed),
            max: counts.max.load(Ordering::Relaxed),
        }
    }
}

impl BucketCounts {
    fn record(&self, nanos: u64) {
        let (octave, bucket) = place(nanos);
        let blocks = self.octaves[octave].get_or_init(|| empty(BUCKETS / BLOCK));
        let buckets = blocks[bucket / BLOCK].get_or_init(|| empty(BLOCK));
        let samples = &buckets[bucket % BLOCK];
        add(&samples.excess, nanos - least(octave, bucket));
        add(&samples.count, 1);
        add(&self.sum, nanos);
        if nanos > self.max.load(Ordering::Relaxed) {
            self.max.store(nanos, Ordering::Relaxed);
        }
    }

    /// The non-empty buckets: mean and count of each.
    fn bars(&self) -> impl Iterator<Item = (u64, u64)> {
        let octaves = self.octaves.iter().enumerate();
        let octaves = octaves.filter_map(|(octave, blocks)| Some((octave, blocks.get()?)));
        let blocks = octaves.flat_map(|(octave, blocks)| {
            let blocks = blocks.iter().enumerate();
            blocks.filter_map(move |(block, buckets)| Some((octave, block, buckets.get()?)))
        });
        let buckets = blocks.flat_map(|(octave, block, buckets)| {
            let buckets = buckets.iter().zip(block * BLOCK..);
            buckets.map(move |(samples, bucket)| (octave, bucket, samples))
        });
        buckets.filter_map(|(octave, bucket, samples)| {
            let count = samples.count.load(Ordering::Relaxed);
            let excess = samples.excess.load(Ordering::Relaxed).checked_div(count)?;
            // A sample recorded concurrently may be in one sum but not in the other.
            let excess = excess.min(width(octave) - 1);
            Some((least(octave, bucket) + excess, count))
        })
    }
}

fn empty<T: Default>(length: usize) -> Box<[T]> {
    (0..length).map(|_| T::default()).collect()
}

/// Adds to a number with a single writer.
fn add(sum: &AtomicU64, more: u64) {
    let sum_so_far = sum.load(Ordering::Relaxed);
    sum.store(sum_so_far.saturating_add(more), Ordering::Relaxed);
}

/// The octave and bucket of a value.
fn place(value: u64) -> (usize, usize) {
    let octave = (value | (BUCKETS as u64 / 2)).ilog2() + 1 - BUCKET_BITS;
    let bucket = value >> octave.saturating_sub(1);
    (octave as usize, bucket as usize % BUCKETS)
}

/// The least value of a bucket.
fn least(octave: usize, bucket: usize) -> u64 {
    match octave {
        0 => bucket as u64,
        _ => (BUCKETS + bucket) as u64 * width(octave),
    }
}

/// The width of the buckets of this octave.
fn width(octave: usize) -> u64 {
    1 << octave.saturating_sub(1)
}
