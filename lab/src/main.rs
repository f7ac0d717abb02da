//! The `ratelab` command: the cart-pole and its course.

use std::process::ExitCode;

fn main() -> ExitCode {
    ratelab_lab::course()
}
