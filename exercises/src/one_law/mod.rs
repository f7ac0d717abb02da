//! One law: the age of the pushes decides, whatever made them old.

mod causes;
mod delay;
mod limit;

pub use delay::{AT_25_HZ, AT_50_HZ};
pub use limit::{JITTER, LAW};
