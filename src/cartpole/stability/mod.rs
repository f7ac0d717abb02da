//! Linear theory of a loop, before anything is run.
//!
//! Near upright the plant is linear ([`Dynamics`]), and so is a balancer while it
//! does not clip: `u = K·y`, with `y` a reading. All that a graph does to this loop
//! is to let time pass: every action in force is that of some reading, sensed
//! earlier and applied later. A [`Loop`] is a plant, gains, a [`World`] and a
//! [`Timing`], and the whole graph becomes a sequence of three kinds of events:
//!
//! | event | map |
//! |---|---|
//! | the plant is read | the actions that are remembered move on; the newest is `K·x` |
//! | an action is applied | `u ←` the action of the reading so many readings ago |
//! | time passes | `x ← A·x + B·u` |
//!
//! Rates of their own make the loop time-varying, but what varies comes round:
//! after one **hyper-period** the schedule begins again. The product of the maps
//! over it is the **monodromy matrix**; its eigenvalues are the **Floquet
//! multipliers**. The largest modulus `ρ` decides: a deviation grows by `ρ` every
//! hyper-period `T`, that is at the rate `ln ρ / T` per second, or shrinks if that
//! is negative. A multiplier near −1 tells more: the deviation changes sides every
//! `T`.
//!
//! # Questions
//!
//! | question | answer |
//! |---|---|
//! | Do small deviations shrink? | [`Loop::stability`]; [`Stability::of`] in the course's world |
//! | Up to which constant delay? | [`Loop::delay_margin`], [`Loop::continuous_margins`] |
//! | Up to which mean push age? | [`age_limit`] |
//! | Up to which changing delay, whatever its pattern? | [`Loop::jitter_margin`] |
//! | Up to which age, whatever made it? | [`Loop::oldest_push`] |
//! | Up to which random loss? | [`Loop::loss_margin`], [`Loop::mean_square_growth`] |
//! | What do deviations cost? | [`Loop::expected_cost`], [`Loop::cost_along`] |
//!
//! # Where it stops
//!
//! The theory is about small deviations. The motor has 10 N and no more, and
//! where the action clips, "unstable" may mean a swing that grows to some width
//! and stays there: at 8 to 10 Hz the pole is up in almost every run although
//! every one of these rates is unstable. So a growth rate is no prediction of
//! who survives; put it beside the measurement, never instead of it.
//! [`measured_growth`] is what a run says about the same quantity. The margins for
//! changing delays are sufficient conditions: a loop beyond them may be stable.
//!
//! # Sources
//!
//! Zero-order hold and sampled loops: Åström and Wittenmark, *Computer-Controlled
//! Systems*, chapters 2 and 3. Multirate loops as periodic systems, monodromy
//! and multipliers: Bittanti and Colaneri, *Periodic Systems*, chapters 1 and 3.
//! All others beside the methods, and in `docs/theory.md`.

mod age;
mod control_loop;
mod cost;
mod covariance;
mod criterion;
mod delay;
mod dynamics;
mod frequency;
mod gains;
mod growth;
mod jitter;
mod loss;
mod monodromy;
mod passage;
mod schedule;
mod span;
mod spectral;
mod timing;
mod world;

pub use age::{NoLimit, age_limit};
pub use control_loop::Loop;
pub use covariance::{Loss, Lost};
pub use criterion::{Noise, Weights};
pub use delay::DelayMargin;
pub use dynamics::Dynamics;
pub use frequency::ContinuousMargins;
pub use gains::{NoTheory, gains};
pub use growth::measured_growth;
pub use jitter::JitterMargin;
pub use monodromy::{Stability, StabilityError};
pub use schedule::LONGEST;
pub use timing::{Cadence, Push, Rates, Timing};
pub use world::World;
