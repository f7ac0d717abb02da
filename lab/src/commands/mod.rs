//! The commands, a file each. Code that several of them share is outside of this folder:
//! none imports another.

mod completions;
mod exercise;
mod hunt;
mod info;
mod keys;
mod lab;
mod man;
mod node;
mod picture;
mod replay;
mod run;
mod sweep;
mod trace;
mod up;
mod verify;

pub use completions::completions;
pub use exercise::exercise;
pub use hunt::hunt;
pub use info::info;
pub use keys::print_keys;
pub use lab::lab;
pub use man::man;
pub use node::node;
pub use picture::picture;
pub use replay::replay;
pub use run::run;
pub use sweep::sweep;
pub use trace::trace;
pub use up::up;
pub use verify::verify;
