//! Answers that are computed in the background, such as trials of what fixes a run.

use std::{thread, time::Duration};

use crossbeam_channel::{Receiver, RecvTimeoutError, bounded};
use ratelab::Knob;
use ratelab_experiment::cause::{Trial, Tried};
use ratelab_system::{Setup, WorldKind};

/// A run and the cures that are tried in it.
type CuredRun = (Setup, WorldKind, Vec<Knob>);

/// Trials in the background, one at a time.
pub type CureTrials = Asked<CuredRun, Option<Tried>>;

impl CureTrials {
    /// Returns the outcome of `trial` with `cures`, as far as known; `over` if the run has ended.
    pub fn follow(&mut self, trial: Trial, cures: Vec<Knob>, over: bool) -> Option<&Tried> {
        if cures.is_empty() {
            return None;
        }
        self.receive(false);
        let run = (trial.config().setup.clone(), trial.config().world, cures);
        if !self.is(&run) && !self.is_coming() {
            self.ask(run.clone(), move |(_, _, cures)| trial.run(cures));
        }
        self.receive(over);
        self.answer_to(&run)?.as_ref()
    }
}

#[cfg(test)]
mod tests;

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
