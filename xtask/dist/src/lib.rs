//! Packages for users who build nothing: a tarball and a Python wheel.
//!
//! A [`Tree`] of files in memory is written as both. Everything that could vary between
//! builds is fixed: order, dates, owners, modes.

pub mod licences;

mod error;
mod platform;
mod program;
mod share;
mod tree;
mod wheel;

pub use error::Error;
pub use platform::{Machine, glibc, wheel_tag};
pub use program::Linker;
pub use share::share;
pub use tree::{File, Tree, tarball};
pub use wheel::{Wheel, wheel};
