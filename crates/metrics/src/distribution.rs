//! Distributions of durations.

use std::{sync::Arc, time::Duration};

/// Buckets per octave: the width of each is at most 1/1024 of its values.
const BUCKETS: u64 = 1 << BUCKET_BITS;
const BUCKET_BITS: u32 = 10;

/// Buckets in a block.
const BLOCK: u64 = 32;

/// The distribution of a duration. Count, mean and maximum are exact; quantiles are
/// accurate to 0.1 %, and exact where all samples that close to each other are equal.
///
/// A copy is cheap: it shares the blocks of buckets until they grow.
#[derive(Clone, Debug, Default)]
pub struct Distribution {
    /// Neighbouring buckets with the number of their block, in order: most distributions have few.
    blocks: Vec<(u64, Arc<[Bucket; BLOCK as usize]>)>,
    count: u64,
    sum: u64,
    max: u64,
}

/// Samples that are counted together, represented by their mean: for equal samples it is
/// their exact value, unlike either end of the bucket.
#[derive(Clone, Copy, Debug, Default)]
struct Bucket {
    count: u64,
    /// The sum of their excess over the bucket's least value.
    excess: u64,
}

impl Distribution {
    /// Adds a sample.
    pub fn add(&mut self, sample: Duration) {
        let nanos = u64::try_from(sample.as_nanos()).unwrap_or(u64::MAX);
        let place = place(nanos);
        let number = place / BLOCK;
        let index = self.blocks.partition_point(|(known, _)| *known < number);
        if self
            .blocks
            .get(index)
            .is_none_or(|(known, _)| *known != number)
        {
            self.blocks.insert(index, (number, Arc::default()));
        }
        let (_, block) = &mut self.blocks[index];
        let bucket = &mut Arc::make_mut(block)[(place % BLOCK) as usize];
        bucket.count += 1;
        bucket.excess = bucket.excess.saturating_add(nanos - least(place));
        self.count += 1;
        self.sum = self.sum.saturating_add(nanos);
        self.max = self.max.max(nanos);
    }

    /// Returns the number of samples.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Returns the sum of all samples.
    pub fn sum(&self) -> Duration {
        Duration::from_nanos(self.sum)
    }

    /// Returns the mean in seconds, exact except for the last division; `None` without samples.
    pub fn mean_s(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum as f64 / self.count as f64 / 1e9)
    }

    /// Returns the longest sample; `None` without samples.
    pub fn max(&self) -> Option<Duration> {
        (self.count > 0).then(|| Duration::from_nanos(self.max))
    }

    /// Returns the duration that a share `quantile` (0 to 1) of the samples does not exceed;
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

    /// Returns the durations in ascending order, each with its number of samples. Samples within
    /// 0.1 % of each other are combined under their mean.
    pub fn bars(&self) -> impl Iterator<Item = (Duration, u64)> {
        let buckets = self
            .blocks
            .iter()
            .flat_map(|(block, buckets)| (block * BLOCK..).zip(buckets.iter()));
        buckets.filter_map(|(place, bucket)| {
            let mean = least(place) + bucket.excess.checked_div(bucket.count)?;
            Some((Duration::from_nanos(mean), bucket.count))
        })
    }
}

/// Returns the number of a value's bucket, over all octaves: below [`BUCKETS`] there is one per
/// nanosecond.
fn place(value: u64) -> u64 {
    let octave = u64::from((value | (BUCKETS / 2)).ilog2() + 1 - BUCKET_BITS);
    octave * BUCKETS + (value >> octave.saturating_sub(1)) % BUCKETS
}

/// Returns the least value of a bucket.
fn least(place: u64) -> u64 {
    let (octave, bucket) = (place / BUCKETS, place % BUCKETS);
    match octave {
        0 => bucket,
        _ => (BUCKETS + bucket) << (octave - 1),
    }
}
