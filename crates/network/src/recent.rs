//! The newest pairs of two kinds of times, found by either.

use std::{collections::VecDeque, sync::Mutex};

use ratelab::sync::lock;

/// Pairs that are kept: seconds at usual rates.
const KEPT: usize = 1024;

/// The newest pairs.
#[derive(Debug)]
pub(crate) struct Recent<A, B>(Mutex<VecDeque<(A, B)>>);

impl<A, B> Default for Recent<A, B> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<A: Copy, B: Copy> Recent<A, B> {
    /// Keeps a pair.
    pub(crate) fn keep(&self, a: A, b: B) {
        let mut pairs = lock(&self.0);
        pairs.push_back((a, b));
        if pairs.len() > KEPT {
            pairs.pop_front();
        }
    }

    /// The newest pair that is `wanted`.
    pub(crate) fn find(&self, wanted: impl Fn(&A, &B) -> bool) -> Option<(A, B)> {
        let pairs = lock(&self.0);
        pairs.iter().rev().find(|(a, b)| wanted(a, b)).copied()
    }
}
