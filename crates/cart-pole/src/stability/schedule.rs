//! The sequence of events over one hyper-period.

use std::{collections::HashMap, time::Duration};

use ratelab::{Hz, Time, hyper_period};

use super::{
    control_loop::{StabilityError, WorldModel},
    timing::{LONGEST, Rates, TimedPush, Timing},
};

/// The longest stretch in one map: over longer ones the numbers of an unstable plant
/// leave the range of an `f64`.
const STRETCH: Duration = Duration::from_secs(10);

/// An event of a loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ScheduleEvent {
    /// The plant advances by this number of its world's units.
    Advance(u64),
    /// The plant is read.
    Sense,
    /// The action for an earlier reading comes into force; 0 is the newest reading.
    Apply(usize),
}

/// One hyper-period of a loop.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LoopSchedule {
    /// Length of the period.
    pub period: Duration,
    /// Events of one period.
    pub events: Vec<ScheduleEvent>,
    /// Mean age of the reading behind the action in force (s).
    pub mean_age: f64,
}

impl Rates {
    /// Returns the time after which all three nodes are due together again.
    pub fn hyper_period(self) -> Duration {
        grid(Timing::from(self), WorldModel::Course)
    }
}

impl LoopSchedule {
    /// Creates the schedule of `timing` in `world`, after all nodes have started.
    pub fn new(timing: Timing, world: WorldModel) -> Result<Self, StabilityError> {
        let grid = grid(timing, world);
        let (begin, period) = repetition(timing, grid)?;
        let settled = timing.slowest() + world.unit();
        let (from, to) = (begin + settled, begin + settled + period);
        let pushes: Vec<_> = timing
            .pushes()
            .skip_while(|(start, _)| *start < begin)
            .take_while(|(start, _)| *start < to + settled)
            .map(|(_, push)| push)
            .collect();
        // In the course's world the plant's time starts with the actuator.
        let origin = match (world, timing.actuator) {
            (WorldModel::Course, Some(actuator)) => Time::ZERO + actuator.offset,
            _ => Time::ZERO,
        };
        Ok(Self {
            period,
            events: events(&pushes, world, origin, from, to),
            mean_age: mean_age(&pushes, from, to),
        })
    }
}

/// Returns the number of readings that `events` need.
pub(super) fn readings(events: &[ScheduleEvent]) -> usize {
    let ago = events.iter().map(|event| match event {
        ScheduleEvent::Apply(ago) => ago + 1,
        ScheduleEvent::Advance(_) | ScheduleEvent::Sense => 1,
    });
    ago.max().unwrap_or(1)
}

/// Returns the common period of all nodes and of the world.
fn grid(timing: Timing, world: WorldModel) -> Duration {
    // With the plant's own rate, or one of 1 kHz, it is a whole number of nanoseconds.
    let millisecond = match world {
        WorldModel::Course => None,
        WorldModel::Own(_) | WorldModel::Continuous => Hz::new(1e3).ok(),
    };
    let rates = timing.cadences().map(|cadence| cadence.hz);
    let nanos = hyper_period(rates.chain(millisecond)).as_nanos();
    let common = least_common_multiple(nanos, world.unit().as_nanos());
    Duration::from_nanos(u64::try_from(common).unwrap_or(u64::MAX))
}

fn least_common_multiple(a: u128, b: u128) -> u128 {
    let (mut divisor, mut rest) = (a, b);
    while rest > 0 {
        (divisor, rest) = (rest, divisor % rest);
    }
    (a / divisor.max(1)).saturating_mul(b)
}

/// Returns a decision from which on the schedule repeats, and its period. With a policy that takes
/// time this may be several periods of the grid.
fn repetition(timing: Timing, grid: Duration) -> Result<(Time, Duration), StabilityError> {
    let offset = timing
        .cadences()
        .map(|cadence| cadence.offset)
        .max()
        .unwrap_or_default();
    let longest = grid.max(offset).max(timing.slowest());
    let aperiodic = |hyper_period| StabilityError::Aperiodic {
        rates: Rates {
            sensor: timing.sensor.hz,
            control: timing.policy.hz,
        },
        hyper_period,
    };
    if longest > LONGEST {
        return Err(aperiodic(longest));
    }
    let settled = Time::ZERO + offset;
    let mut seen = HashMap::new();
    for (start, _) in timing.pushes().skip_while(|(start, _)| *start < settled) {
        let phase = start.as_nanos() % grid.as_nanos() as u64;
        if let Some(begin) = seen.insert(phase, start) {
            return Ok((begin, start - begin));
        }
        if start - settled > LONGEST {
            break;
        }
    }
    Err(aperiodic(2 * LONGEST))
}

/// Returns the events of `pushes` in `world` between two moments.
pub(super) fn events(
    pushes: &[TimedPush],
    world: WorldModel,
    origin: Time,
    from: Time,
    to: Time,
) -> Vec<ScheduleEvent> {
    // Within an instant the plant is read before an action is applied.
    let mut moments = Vec::new();
    let (mut readings, mut last) = (0, None);
    for push in pushes {
        if last.replace(push.sensed) != Some(push.sensed) {
            readings += 1;
            moments.push((world.sensed(push.sensed.since(origin)), true, readings));
        }
        moments.push((world.applied(push.applied.since(origin)), false, readings));
    }
    moments.sort_by_key(|(unit, sense, _)| (*unit, !sense));

    let (from, to) = (
        world.applied(from.since(origin)),
        world.applied(to.since(origin)),
    );
    let mut events = Vec::new();
    let (mut now, mut newest) = (from, 0);
    for (unit, sense, reading) in moments {
        newest = if sense { reading } else { newest };
        if (from..to).contains(&unit) {
            advance(&mut events, world, unit - now);
            now = unit;
            events.push(if sense {
                ScheduleEvent::Sense
            } else {
                ScheduleEvent::Apply(newest - reading)
            });
        }
    }
    advance(&mut events, world, to - now);
    events
}

/// Adds an advance by `units`, split into stretches.
fn advance(events: &mut Vec<ScheduleEvent>, world: WorldModel, mut units: u128) {
    let most = (STRETCH.as_nanos() / world.unit().as_nanos()).max(1);
    while units > 0 {
        let stretch = units.min(most);
        events.push(ScheduleEvent::Advance(stretch as u64));
        units -= stretch;
    }
}

/// Returns the mean age of the action in force (s) between two moments, both after the first push.
/// Of several actions applied at once the last counts.
fn mean_age(pushes: &[TimedPush], from: Time, to: Time) -> f64 {
    let mut sum = 0.0;
    let replaced = pushes.iter().skip(1).map(|next| next.applied).chain([to]);
    for (push, replaced) in pushes.iter().zip(replaced) {
        let (begin, end) = (push.applied.max(from), replaced.min(to));
        if begin < end {
            let age = |at: Time| at.since(push.sensed).as_secs_f64();
            sum += (age(end).powi(2) - age(begin).powi(2)) / 2.0;
        }
    }
    sum / to.since(from).as_secs_f64()
}
