//! Exercise 12: a clock with a wrong line in `src/clock.rs`.
//!
//! `cargo test -p mend-it` is red, and turns green when that line is mended. `ratelab
//! exercise 12` in a clone runs the cart-pole on this clock, as it stands.

#[cfg_attr(feature = "solved", path = "../../answers/mend/clock.rs")]
mod clock;

pub use clock::run;
