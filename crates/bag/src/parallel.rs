//! The same work on many things, on all cores.

use std::{
    num::NonZero,
    sync::atomic::{AtomicUsize, Ordering},
    thread,
};

/// Returns what `work` makes of each of `things`, in their order.
pub fn each<T: Sync, R: Send>(things: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let cores = thread::available_parallelism().map_or(1, NonZero::get);
    let next = AtomicUsize::new(0);
    let run = || {
        let mut done = Vec::new();
        loop {
            let place = next.fetch_add(1, Ordering::Relaxed);
            let Some(thing) = things.get(place) else {
                return done;
            };
            done.push((place, work(thing)));
        }
    };
    let mut all = thread::scope(|scope| {
        let others: Vec<_> = (1..cores.min(things.len()))
            .map(|_| scope.spawn(run))
            .collect();
        let mut all = run();
        // A thread that panicked has its share missing: then the whole panics as it would alone.
        all.extend(others.into_iter().flat_map(|other| {
            other
                .join()
                .unwrap_or_else(|why| std::panic::resume_unwind(why))
        }));
        all
    });
    all.sort_by_key(|(place, _)| *place);
    all.into_iter().map(|(_, done)| done).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_made_keeps_its_order() {
        let things: Vec<usize> = (0..1_000).collect();
        assert_eq!(
            each(&things, |thing| thing * 2),
            (0..2_000).step_by(2).collect::<Vec<_>>()
        );
    }
}
