//! Ours beside the floor and the alternatives, in one run.
fn main() {}
