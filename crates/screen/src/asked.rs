//! Answers that are computed in the background.

use std::{thread, time::Duration};

use crossbeam_channel::{Receiver, RecvTimeoutError, bounded};

/// Maximum wait of a frame after the end of a run, when no later frame will come.
const PATIENCE: Duration = Duration::from_millis(100);

/// The answer to one question at a time. Until it has come, the one before is kept.
pub struct Asked<Q, A> {
    question: Option<Q>,
    coming: Option<Receiver<(Q, A)>>,
    /// The newest answer, with its question.
    known: Option<(Q, A)>,
}

impl<Q, A> Default for Asked<Q, A> {
    fn default() -> Self {
        Self {
            question: None,
            coming: None,
            known: None,
        }
    }
}

impl<Q: Clone + PartialEq + Send + 'static, A: Send + 'static> Asked<Q, A> {
    /// Returns whether `question` was asked last.
    pub fn is(&self, question: &Q) -> bool {
        self.question.as_ref() == Some(question)
    }

    /// Asks `question`, which `answer` computes on a thread of its own; an answer that is
    /// still to come is forgotten.
    pub fn ask(&mut self, question: Q, answer: impl FnOnce(&Q) -> A + Send + 'static) {
        let (sender, coming) = bounded(1);
        self.question = Some(question.clone());
        self.coming = Some(coming);
        thread::spawn(move || {
            let found = answer(&question);
            // The receiver may be gone.
            let _ = sender.send((question, found));
        });
    }

    /// Takes the answer if it has come; a run that is `over` waits for it a moment.
    pub fn receive(&mut self, over: bool) {
        let patience = if over { PATIENCE } else { Duration::ZERO };
        match self.coming.as_ref().map(|it| it.recv_timeout(patience)) {
            Some(Ok(known)) => (self.coming, self.known) = (None, Some(known)),
            Some(Err(RecvTimeoutError::Disconnected)) => self.coming = None,
            Some(Err(RecvTimeoutError::Timeout)) | None => {}
        }
    }

    /// Returns the newest answer.
    pub fn newest(&self) -> Option<&A> {
        self.known.as_ref().map(|(_, answer)| answer)
    }

    /// Returns the answer to `question`, if that is the newest.
    pub fn answer_to(&self, question: &Q) -> Option<&A> {
        self.known
            .as_ref()
            .filter(|(of, _)| of == question)
            .map(|(_, answer)| answer)
    }

    /// Returns whether an answer is to come.
    pub fn is_coming(&self) -> bool {
        self.coming.is_some()
    }
}
