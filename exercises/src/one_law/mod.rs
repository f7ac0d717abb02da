//! One law: the age of the pushes decides, whatever made them old.

mod causes;
mod delay;
mod limit;

pub(crate) use delay::{at_25_hz, at_50_hz};
pub(crate) use limit::{jitter, law};
