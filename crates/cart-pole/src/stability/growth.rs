//! The growth of a small deviation, measured in a run.

use std::time::Duration;

use ratelab::{Message, Time};

use crate::ControlStep;

/// Returns the rate (1/s) at which the pole's angle grew in a run, from run time `from` until the
/// action first clipped, or the run ended; negative if it shrank.
///
/// The first half of that interval is skipped, until the fastest-growing part of the
/// deviation dominates. In the second half the angles at two moments a whole number of
/// `hyper_period`s apart are compared, because in between the angle follows the schedule
/// rather than its trend.
///
/// Where the largest multipliers are a complex pair, at 11 Hz and above, the
/// angle turns as well as shrinks, and this does not measure it.
///
/// `None` if less than one hyper-period remains, or no angle to compare.
pub fn measured_growth(
    steps: &[Message<ControlStep>],
    from: Time,
    hyper_period: Duration,
) -> Option<f64> {
    let linear: Vec<_> = steps
        .iter()
        .skip_while(|step| step.stamp < from)
        .take_while(|step| !clips(&step.data))
        .collect();
    let (first, last) = (linear.first()?, linear.last()?);
    let half = last.stamp.since(first.stamp) / 2;
    let periods = half.as_nanos().checked_div(hyper_period.as_nanos())?;
    let apart = hyper_period * u32::try_from(periods).ok()?;
    let early = linear
        .iter()
        .find(|step| step.stamp + apart == last.stamp)?;
    let ratio = last.data.qpos[1] / early.data.qpos[1];
    let growth = ratio.abs().ln() / apart.as_secs_f64();
    growth.is_finite().then_some(growth)
}

/// Returns whether the action is clipped.
fn clips(step: &ControlStep) -> bool {
    step.action.0.abs() >= 1.0
}
