//! Linear theory of a control rate, before anything is run.
//!
//! Near upright the plant is linear: over one control step a small deviation
//! `x` becomes `A·x + B·u` ([`LinearPlant`](crate::cartpole::LinearPlant)). So
//! is the balancer while it does not clip: `u = K·y`, with `y` the newest
//! reading. Between its decisions the action is held, and that is all a slow
//! policy does wrong. Sensor and policy at rates of their own make the loop
//! time-varying, but what varies comes round: after one **hyper-period**, the
//! least common multiple of the three periods, all three nodes are due together
//! again. Write the graph's own schedule down for that long, one linear map per
//! tick:
//!
//! | who ticks | map |
//! |---|---|
//! | sensor | `y ← x` |
//! | policy | `u ← K·y` |
//! | actuator | `x ← A·x + B·u` |
//!
//! At the start of a hyper-period sensor and policy replace `y` and `u` before
//! the actuator uses them, so the product of the maps takes the plant's state
//! alone to the plant's state one hyper-period `T` later. That product is the
//! **monodromy matrix**; its eigenvalues are the **Floquet multipliers**. The
//! largest modulus `ρ` decides: a deviation grows by `ρ` every `T`, that is at
//! the rate `ln ρ / T` per second, or shrinks if that is negative. A multiplier
//! near −1 tells more: the deviation changes sides every `T`.
//!
//! # Where it stops
//!
//! The theory is about small deviations. The motor has 10 N and no more, and
//! where the action clips, "unstable" may mean a swing that grows to some width
//! and stays there: at 8 to 10 Hz the pole is up in almost every run although
//! every one of these rates is unstable. So a growth rate is no prediction of
//! who survives; put it beside the measurement, never instead of it.
//! [`measured_growth`] is what a run says about the same quantity.
//!
//! # Sources
//!
//! Zero-order hold and sampled loops: Åström and Wittenmark, *Computer-Controlled
//! Systems*, chapters 2 and 3. Multirate loops as periodic systems, monodromy
//! and multipliers: Bittanti and Colaneri, *Periodic Systems*, chapters 1 and 3.

mod growth;
mod monodromy;
mod schedule;

pub use growth::measured_growth;
pub use monodromy::{Stability, StabilityError};
pub use schedule::{LONGEST, Rates};
