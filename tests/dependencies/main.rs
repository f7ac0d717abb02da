//! What comes from others is known: its licence and its source are allowed.

mod graph;
mod licences;
mod rules;
