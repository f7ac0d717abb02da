//! Exercises on the rate of a control loop: predict, run, check.
//!
//! Each exercise states its objective and asks for one number. After the prediction it
//! runs on the virtual clock, in the ordinary graph, and compares the prediction with the
//! measurement. All printed results are measured in the same run of the program. The
//! expected measurements are in `bands.toml`, each with its source.
//!
//! ```
//! use exercises::{ALL, framework::Prediction};
//!
//! let exercise = exercises::find(2).expect("there is a second one");
//! println!("{}\n\n{}", exercise.brief().objective, exercise.brief().question);
//! let prediction = Prediction::read("2 because nothing is lost any more", exercise.brief())?;
//! let findings = exercise.run()?;
//! println!("{}\n{}", findings.table, findings.reconcile(exercise.brief(), &prediction));
//! assert!(exercise.check()?.iter().all(|check| check.holds()));
//! assert_eq!(ALL.len(), 5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The five exercises are modules of this crate; [`framework`] is their common part.

pub mod cliff;
pub mod deeper_queue;
pub mod framework;
pub mod limits;
pub mod rescue;
pub mod ties;

use framework::Exercise;

/// All exercises in their order.
pub const ALL: [&dyn Exercise; 5] = [
    &cliff::Cliff,
    &deeper_queue::DeeperQueue,
    &ties::Ties,
    &limits::Limits,
    &rescue::Rescue,
];

/// The exercise with this number, counted from one.
pub fn find(number: u32) -> Option<&'static dyn Exercise> {
    let mut all = ALL.into_iter();
    all.find(|exercise| exercise.brief().number == number)
}
