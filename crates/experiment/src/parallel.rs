//! Runs on several threads, with results that are independent of their number.

use std::{
    num::NonZeroUsize,
    ops::ControlFlow,
    sync::atomic::{AtomicUsize, Ordering},
    thread,
};

/// Maximum number of results waiting for the caller.
const WAITING: usize = 1_024;

/// Returns the number of threads that this machine runs in parallel.
pub fn all_cores() -> NonZeroUsize {
    thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

/// Calls `work` with all numbers below `count`, in ascending order, on `threads` threads, and
/// `done` with the results on this one, roughly in that order. If `work` has no result or
/// `done` breaks, no further number is begun. Returns whether all that were begun have a
/// result.
pub fn in_parallel<T: Send>(
    threads: NonZeroUsize,
    count: usize,
    work: impl Fn(usize) -> Option<T> + Sync,
    mut done: impl FnMut(usize, T) -> ControlFlow<()>,
) -> bool {
    let (next, given_up) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let (sender, results) = crossbeam_channel::bounded(WAITING);
    thread::scope(|scope| {
        for _ in 0..threads.get().min(count) {
            let (sender, next, given_up, work) = (sender.clone(), &next, &given_up, &work);
            scope.spawn(move || {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number >= count {
                        return;
                    }
                    let Some(result) = work(number) else {
                        given_up.fetch_add(1, Ordering::Relaxed);
                        next.store(count, Ordering::Relaxed);
                        return;
                    };
                    if sender.send((number, result)).is_err() {
                        return; // The caller panicked.
                    }
                }
            });
        }
        drop(sender);
        for (number, result) in results {
            if done(number, result).is_break() {
                next.store(count, Ordering::Relaxed);
            }
        }
    });
    given_up.into_inner() == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_has_its_result_on_any_number_of_threads() {
        for threads in [1, 2, 9] {
            let mut results = vec![None; 40];
            let complete = in_parallel(
                NonZeroUsize::new(threads).expect("a thread"),
                results.len(),
                |number| Some(number * number),
                |number, result| {
                    results[number] = Some(result);
                    ControlFlow::Continue(())
                },
            );
            let expected: Vec<_> = (0..40).map(|number| Some(number * number)).collect();
            assert_eq!((complete, results), (true, expected), "{threads} threads");
        }
    }

    #[test]
    fn no_number_is_begun_after_one_without_a_result() {
        let mut seen = Vec::new();
        let complete = in_parallel(
            NonZeroUsize::MIN,
            9,
            |number| (number < 3).then_some(number),
            |number, _| {
                seen.push(number);
                ControlFlow::Continue(())
            },
        );
        assert_eq!((complete, seen), (false, vec![0, 1, 2]));
    }
}
