//! A virtual clock: who ticks next, and when.

/// Nanoseconds in a second.
const NANOS: u64 = 1_000_000_000;

/// Ticks nodes with rates of `hz`, all from time zero, until `end` (ns). Of nodes that are
/// due at the same instant the first in the list ticks first. `tick` receives the index of
/// the node and the time (ns), and returns whether to go on.
pub fn run<const NODES: usize>(
    hz: [u64; NODES],
    end: u64,
    mut tick: impl FnMut(usize, u64) -> bool,
) {
    let mut ticks = [0_u64; NODES];
    loop {
        let due = |node: usize| ticks[node] * (NANOS / hz[node]);
        let Some(next) = (0..NODES).min_by_key(|&node| due(node)) else {
            return;
        };
        let now = due(next);
        if now > end || !tick(next, now) {
            return;
        }
        ticks[next] += 1;
    }
}
