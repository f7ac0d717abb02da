//! The commands, a file each. Code that several of them share is outside of this folder:
//! none imports another.

mod completions;
mod exercise;
mod hunt;
mod info;
mod keys;
mod lab;
mod man;
mod replay;
mod run;
mod sweep;
mod verify;

pub use completions::completions;
pub use exercise::exercise;
pub use hunt::hunt;
pub use info::info;
pub use keys::print_keys;
pub use lab::lab;
pub use man::man;
pub use replay::replay;
pub use run::run;
pub use sweep::sweep;
pub use verify::verify;
