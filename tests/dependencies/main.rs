//! What comes from others is known: its licence and its source are allowed, and
//! each crate that is named in a manifest has a reason to be here.

#[path = "../common/clone.rs"]
mod clone;
mod facts;
mod graph;
mod licences;
mod metadata;
mod page;
mod rules;
