//! The commands, a file each. Code that several of them share is outside of this folder:
//! none imports another.

mod branch;
mod completions;
mod exercise;
mod export_web;
mod grade;
mod hunt;
mod info;
mod keys;
mod lab;
mod man;
mod network;
mod new;
mod picture;
mod replay;
mod run;
mod sweep;
mod tour;
mod trace;
mod verify;

pub use branch::branch;
pub use completions::completions;
pub use exercise::exercise;
pub use export_web::export_web;
pub use grade::grade;
pub use hunt::hunt;
pub use info::info;
pub use keys::print_keys;
pub use lab::lab;
pub use man::man;
pub use network::{node, up};
pub use new::new;
pub use picture::picture;
pub use replay::replay;
pub use run::run;
pub use sweep::sweep;
pub use tour::tour;
pub use trace::trace;
pub use verify::verify;
