//! Linear theory of a control loop, computed without a run.
//!
//! Near upright the plant is linear ([`Dynamics`]), and so is a balancer while it does
//! not clip: `u = K·y`, with `y` a reading. A graph affects this loop only through time:
//! every action in force belongs to some reading, sensed earlier and applied later. A
//! [`Loop`] is a plant, gains, a [`WorldModel`] and a [`Timing`], and the whole graph becomes
//! a sequence of three kinds of events:
//!
//! | event | map |
//! |---|---|
//! | the plant is read | the stored actions shift by one; the newest is `K·x` |
//! | an action is applied | `u ←` the action of the reading a given number of readings ago |
//! | time passes | `x ← A·x + B·u` |
//!
//! Different rates make the loop time-varying, but periodic: after one **hyper-period**
//! the schedule repeats. The product of the maps over it is the **monodromy matrix**; its
//! eigenvalues are the **Floquet multipliers**. The largest modulus `ρ` decides: a
//! deviation grows by `ρ` every hyper-period `T`, that is at the rate `ln ρ / T` per
//! second, or shrinks if that is negative. A multiplier near −1 means that the deviation
//! changes sides every `T`.
//!
//! # Questions
//!
//! | question | answer |
//! |---|---|
//! | Do small deviations shrink? | [`Loop::stability`]; [`Stability::for_rates`] in the course's world |
//! | Up to which constant delay? | [`Loop::delay_margin`], [`Loop::continuous_margins`] |
//! | Up to which mean push age? | [`age_limit`] |
//! | Up to which changing delay, whatever its pattern? | [`Loop::jitter_margin`] |
//! | Up to which age, for any cause? | [`Loop::oldest_push`] |
//! | Up to which random loss? | [`Loop::loss_margin`], [`Loop::mean_square_growth`] |
//! | Of a policy that answers with chunks? | [`Loop::planned`] |
//! | All of these for a run, from its setup? | [`expected`] |
//! | The cost of deviations? | [`Loop::expected_cost`], [`Loop::cost_along`] |
//!
//! # Limits
//!
//! The theory covers small deviations. The motor is limited to 10 N, and where the action
//! clips, "unstable" may mean a swing that grows to some width and stays there: at 8 to
//! 10 Hz the pole is up in almost every run although every one of these rates is
//! unstable. So a growth rate does not predict survival; use it beside a measurement,
//! never instead of one. [`measured_growth`] measures the same quantity in a run. The
//! margins for changing delays are sufficient conditions: a loop beyond them may be
//! stable.
//!
//! # Sources
//!
//! Zero-order hold and sampled loops: Åström and Wittenmark, *Computer-Controlled
//! Systems*, chapters 2 and 3. Multirate loops as periodic systems, monodromy and
//! multipliers: Bittanti and Colaneri, *Periodic Systems*, chapters 1 and 3. All others
//! are listed at the methods and in `docs/theory.md`.

mod control_loop;
mod covariance;
mod expected;
mod frequency;
mod jitter;
mod monodromy;
mod planned;
mod schedule;
mod span;
mod timing;

use std::time::Duration;

use ratelab::{Message, Time};

use crate::ControlStep;

pub use control_loop::{Loop, StabilityError, WorldModel, gains};
pub use covariance::{Loss, Lost};
pub use expected::{Expected, expected};
pub use frequency::ContinuousMargins;
pub use jitter::{DelayMargin, JitterMargin, age_limit};
pub use monodromy::Stability;
pub use planned::PlannedOutlook;
pub use span::{Dynamics, Noise, Weights};
pub use timing::{Cadence, LONGEST, Rates, TimedPush, Timing};

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
