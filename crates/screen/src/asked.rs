//! Answers that are computed in the background, and the age limits of a loop among them.

use std::{sync::Arc, thread, time::Duration};

use crossbeam_channel::{Receiver, RecvTimeoutError, bounded};
use ratelab_study::system::{AgeLimits, Setup, System};

/// Maximum wait of a frame after the end of a run, when no later frame will come.
const PATIENCE: Duration = Duration::from_millis(100);

/// The answer to one question at a time.
pub struct Asked<Q, A> {
    question: Option<Q>,
    coming: Option<Receiver<A>>,
}

impl<Q, A> Default for Asked<Q, A> {
    fn default() -> Self {
        Self {
            question: None,
            coming: None,
        }
    }
}

impl<Q: PartialEq, A: Send + 'static> Asked<Q, A> {
    /// Whether `question` was asked last.
    pub fn is(&self, question: &Q) -> bool {
        self.question.as_ref() == Some(question)
    }

    /// Asks `question`, which `answer` computes on a thread of its own; an answer that is
    /// still to come is forgotten.
    pub fn ask(&mut self, question: Q, answer: impl FnOnce() -> A + Send + 'static) {
        let (sender, coming) = bounded(1);
        thread::spawn(move || {
            // The receiver may be gone.
            let _ = sender.send(answer());
        });
        (self.question, self.coming) = (Some(question), Some(coming));
    }

    /// The answer, if it has come since the last call; a run that is `over` waits for it a
    /// moment.
    pub fn answer(&mut self, over: bool) -> Option<A> {
        let patience = if over { PATIENCE } else { Duration::ZERO };
        let answer = self.coming.as_ref()?.recv_timeout(patience);
        if !matches!(answer, Err(RecvTimeoutError::Timeout)) {
            self.coming = None;
        }
        answer.ok()
    }

    /// Whether an answer is to come.
    pub fn is_coming(&self) -> bool {
        self.coming.is_some()
    }
}

/// The age limits with one setup at a time. Until they are computed the previous ones are kept.
#[derive(Default)]
pub struct LimitsInForce {
    limits: AgeLimits,
    asked: Asked<Setup, AgeLimits>,
}

impl LimitsInForce {
    /// The limits of `system` with `setup`, as far as computed; `over` if the run has ended.
    pub fn follow(&mut self, system: &Arc<dyn System>, setup: Setup, over: bool) -> AgeLimits {
        if !self.asked.is(&setup) {
            let (system, of) = (system.clone(), setup.clone());
            self.asked.ask(setup, move || system.age_limits(&of));
        }
        self.limits = self.asked.answer(over).unwrap_or(self.limits);
        self.limits
    }

    /// Whether limits are being computed.
    pub fn are_coming(&self) -> bool {
        self.asked.is_coming()
    }

    /// The limits as far as computed.
    pub fn known(&self) -> AgeLimits {
        self.limits
    }
}
