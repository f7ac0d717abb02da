//! What a branch changed against the recorded run.

use ratelab::Time;
use ratelab_system::{System, Verdict};

use crate::Recording;

/// A recorded run, and the change at which a branch left it.
pub struct Change {
    /// Run time at which the branch left it.
    pub at: Time,
    /// The verdict of the recorded run; `None` if that is unknown.
    pub recorded: Option<Verdict>,
    /// The knobs that were turned.
    pub knobs: String,
}

impl Change {
    /// Creates the change by `knobs` at which a branch of `recording` of `system` left it.
    pub fn new(recording: &Recording, system: &dyn System, at: Time, knobs: String) -> Self {
        let result = recording.result();
        Self {
            at,
            recorded: result.map(|result| result.verdict.verdict(system)),
            knobs,
        }
    }

    /// Returns the moment of the branch, and the one that was `asked` for if it is another.
    pub fn left(&self, asked: Time) -> String {
        if asked == self.at {
            asked.to_string()
        } else {
            format!("{}, the last rest of the nodes up to {asked}", self.at)
        }
    }

    /// Returns what the change made different; `branch` is the verdict of the branch, unless that
    /// goes on.
    pub fn sentence(&self, branch: Option<Verdict>) -> String {
        let Self { at, knobs, .. } = self;
        let before = self
            .recorded
            .as_ref()
            .map(in_short)
            .unwrap_or_else(|| "not lost so far".to_owned());
        match branch.map(|verdict| in_short(&verdict)) {
            Some(after) => format!("{before}; with {knobs} from {at} on: {after}"),
            None => format!("{before}; now with {knobs} from {at} on"),
        }
    }
}

/// Returns the text of a verdict inside a sentence, such as `fell at 0.580 s`.
fn in_short(verdict: &Verdict) -> String {
    let whole = verdict.to_string();
    let text = whole.split(" (").next().unwrap_or_default();
    let (word, rest) = text.split_at(text.find(' ').unwrap_or(text.len()));
    word.to_lowercase() + rest
}
