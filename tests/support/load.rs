//! Threads that keep cores busy.

use std::{
    hint::black_box,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
};

/// Threads that keep cores busy while this lives.
pub struct Load(Arc<AtomicBool>);

impl Load {
    /// Starts `threads` of them.
    pub fn new(threads: usize) -> Self {
        let over = Arc::new(AtomicBool::new(false));
        for _ in 0..threads {
            let over = over.clone();
            thread::spawn(move || {
                while !over.load(Ordering::Relaxed) {
                    black_box((0..1_000).fold(0_u64, |sum, n| sum ^ black_box(n)));
                }
            });
        }
        Self(over)
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}
