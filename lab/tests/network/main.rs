//! A run in several processes, from outside: on this machine, and on several.

mod hosts;
mod part;
mod runs;
#[path = "../support/mod.rs"]
mod support;
