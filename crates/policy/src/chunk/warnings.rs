//! Defects of a run with chunks that are known before it begins.

use std::time::Duration;

use ratelab::{Knob, KnobKind};
use ratelab_system::Setup;

use super::{
    OBS, POLICY,
    message::CHUNK,
    settings::{ChunkSettings, ExpectedDelay, Merge, PlanKind, PlayKind},
};

/// The quantile of the costs that a chunk is to outlast.
const USUAL: f64 = 0.99;

/// What the times of a run with chunks come to, as far as they are set.
struct ChunkTimes {
    /// What a tick of the policy takes: the median, and the 99th percentile.
    cost: [Duration; 2],
    /// From the policy to the player, and from the sensor to the policy.
    links: [Duration; 2],
    /// From one chunk to the next, the player's wait included.
    period: Duration,
    loses: bool,
    /// Whether the policy is a program, whose cost the real clock measures.
    is_unknown: bool,
}

impl ChunkTimes {
    fn new(setup: &Setup, settings: &ChunkSettings, is_program: bool) -> Self {
        let takes = setup.knob(KnobKind::Takes, POLICY);
        let draw = takes.and_then(Knob::draw);
        let cost = |u| draw.and_then(|draw| draw.at(u)).unwrap_or_default();
        let link = |topic| match setup.knob(KnobKind::Link, topic) {
            Some(Knob::Link { link, .. }) => Some(link),
            _ => None,
        };
        let delay = |topic| {
            link(topic)
                .and_then(|link| link.delay.median())
                .unwrap_or_default()
        };
        let interval_s = setup
            .rate(POLICY)
            .map_or(settings.shape.period.as_secs_f64(), |hz| 1.0 / hz.get());
        let most = cost(USUAL);
        let periods = (most.as_secs_f64() / interval_s).ceil().max(1.0);
        let period = match settings.refill {
            // The player asks once in a tick at most.
            Some(share) => settings
                .duration()
                .mul_f64(1.0 - share)
                .max(settings.shape.period),
            None => Duration::from_secs_f64(interval_s * periods),
        };
        Self {
            cost: [cost(0.5), most],
            links: [delay(CHUNK), delay(OBS)],
            period,
            is_unknown: takes.is_none() && is_program,
            loses: link(CHUNK).is_some_and(|link| link.loss > 0.0 || link.burst.is_some()),
        }
    }

    /// Returns the delay of an answer, usually.
    fn delay(&self) -> Duration {
        self.cost[0] + self.links[0]
    }

    /// Returns the age of a chunk's reading when the next chunk is there.
    fn oldest(&self) -> Duration {
        self.period + self.cost[1] + self.links[0] + self.links[1]
    }
}

/// Milliseconds, to a tenth.
fn ms(duration: Duration) -> f64 {
    (duration.as_secs_f64() * 1e4).round() / 10.0
}

/// What is known of the policy and the robot of a run with chunks.
#[derive(Clone, Copy, Debug)]
pub struct ChunkLoop {
    /// Whether the policy is a program, whose cost the real clock measures.
    pub is_program: bool,
    /// The age of actions that the loop bears, if that is known.
    pub bears: Option<Duration>,
}

impl ChunkLoop {
    /// Returns the defects of a run with `setup`, each with a remedy.
    pub fn warnings(self, setup: &Setup, settings: &ChunkSettings) -> Vec<String> {
        let times = ChunkTimes::new(setup, settings, self.is_program);
        let defects = [
            too_short(settings, &times),
            unexpected(settings, &times),
            not_committed(settings, &times),
            too_old_a_mean(settings, &times, self.bears),
        ];
        defects.into_iter().flatten().collect()
    }
}

/// Returns a warning if the next chunk comes after the last action of this one.
fn too_short(settings: &ChunkSettings, times: &ChunkTimes) -> Option<String> {
    let (lasts, needed) = (settings.duration(), times.oldest());
    let missing = needed
        .checked_sub(lasts)
        .filter(|missing| !missing.is_zero())?;
    let enough = needed.as_nanos().div_ceil(settings.shape.period.as_nanos());
    Some(format!(
        "a chunk lasts {} ms, and the next one comes after up to {} ms (period {}, cost {}, links \
         {}): the player stalls for up to {} ms; --chunk {enough} lasts",
        ms(lasts),
        ms(needed),
        ms(times.period),
        ms(times.cost[1]),
        ms(times.links[0] + times.links[1]),
        ms(missing),
    ))
}

/// Returns a warning if the policy plans for another delay than the one that is set.
fn unexpected(settings: &ChunkSettings, times: &ChunkTimes) -> Option<String> {
    if settings.plan != PlanKind::Committed || times.is_unknown {
        return None;
    }
    let (delay, cost) = (times.delay(), times.cost[0]);
    let (expected, remedy) = match settings.expected {
        ExpectedDelay::Constant(expected) => (expected, ms(delay).to_string()),
        ExpectedDelay::Last(margin) => (
            cost + margin,
            match times.links[0] {
                Duration::ZERO => "last".to_owned(),
                link => format!("last+{}", ms(link)),
            },
        ),
        ExpectedDelay::Max(_) => return None,
    };
    let off = expected.abs_diff(delay);
    // A margin covers what the policy cannot know, such as the wait for the player.
    let margin = if expected > delay {
        2 * settings.shape.period
    } else {
        Duration::ZERO
    };
    (off >= settings.shape.period + margin).then(|| {
        format!(
            "the policy expects a delay of {} ms, and its answer takes {} ms (cost {}, link {}): \
             its plans are {} ms off; --expect-delay {remedy} fits",
            ms(expected),
            ms(delay),
            ms(cost),
            ms(times.links[0]),
            ms(off),
        )
    })
}

/// Returns a warning about a plan by what is committed, where something else is played.
fn not_committed(settings: &ChunkSettings, times: &ChunkTimes) -> Option<String> {
    let other = [
        (
            settings.play != PlayKind::Time,
            format!("--play {}", settings.play),
        ),
        (
            settings.merge != Merge::Newest,
            format!("--merge {}", settings.merge),
        ),
        (times.loses, format!("losses on {CHUNK}")),
    ];
    let other: Vec<String> = other
        .into_iter()
        .filter_map(|(is, text)| is.then_some(text))
        .collect();
    (settings.plan == PlanKind::Committed && !other.is_empty()).then(|| {
        format!(
            "--plan committed believes that the newest chunk is played by time; with {} its plans \
             are wrong",
            other.join(" and ")
        )
    })
}

/// Returns a warning about an ensemble that is older on average than the loop bears.
fn too_old_a_mean(
    settings: &ChunkSettings,
    times: &ChunkTimes,
    bears: Option<Duration>,
) -> Option<String> {
    let (Merge::Ensemble(decay), Some(bears)) = (settings.merge, bears) else {
        return None;
    };
    let lasts = settings.duration().as_secs_f64();
    let [delay, period] = [times.delay(), times.period].map(|time| time.as_secs_f64());
    let count = ((lasts - delay) / period).ceil().max(1.0);
    let (mut weights, mut ages) = (0.0, 0.0);
    for number in 0..count as u32 {
        let weight = (-decay * f64::from(number)).exp();
        weights += weight;
        ages += weight * (delay + period * (count - 1.0 - f64::from(number)));
    }
    let age = Duration::from_secs_f64(ages / weights);
    (age > bears && count > 1.0).then(|| {
        format!(
            "--merge {} averages {count} chunks, whose readings are {} ms old on average, and the \
             limit of the loop is {} ms; --merge newest averages none",
            settings.merge,
            ms(age),
            ms(bears),
        )
    })
}
