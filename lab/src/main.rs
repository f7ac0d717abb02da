//! The ratelab command.
fn main() {}
