//! A schedule that adds up periods, in a common form: after its tick a node is due again
//! one period later, with times as floating-point seconds.

use ratelab::Time;
use ratelab_cart_pole::CONTROL_HZ;

use super::Nodes;
use crate::framework::Failure;

/// Ticks the nodes, with the policy at `control_hz`, in the order of their due times until
/// the pole falls or `seconds` are over.
///
/// # Errors
/// [`Failure`] if a node fails, or a time is invalid.
pub fn schedule(nodes: &mut Nodes, control_hz: f64, seconds: f64) -> Result<(), Failure> {
    let periods = [CONTROL_HZ, control_hz, CONTROL_HZ].map(|hz| 1.0 / hz);
    let mut due = [0.0_f64; 3];
    loop {
        // Of nodes that are due together the first one ticks first.
        let first = (0..due.len()).min_by(|&a, &b| due[a].total_cmp(&due[b]));
        let Some(next) = first.filter(|&next| due[next] <= seconds) else {
            return Ok(());
        };
        if !nodes.tick(next, Time::from_secs_f64(due[next])?)? {
            return Ok(());
        }
        due[next] += periods[next];
    }
}
