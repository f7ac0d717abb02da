//! Short texts of knobs for the screen.

use ratelab::{Knob, Time, TimedKnob};
use ratelab_study::system::{Alias, KnobText, Setup, System};

use crate::names::{short, short_value};

/// The texts of `knobs`, by their aliases if they have one, each with its run time.
pub fn in_words(system: &dyn System, knobs: &[TimedKnob]) -> Vec<(Time, String)> {
    let mut words = Vec::new();
    for together in knobs.chunk_by(|a, b| a.at == b.at) {
        let shortened = together.iter().map(|timed| TimedKnob {
            at: timed.at,
            knob: shortened(system, &timed.knob),
        });
        let lines = KnobText(system.aliases()).lines(&shortened.collect::<Vec<_>>());
        let texts = lines.iter().filter_map(|line| line.split_once(' '));
        words.extend(texts.map(|(_, text)| (together[0].at, text.to_owned())));
    }
    words
}

/// The texts of `knobs` in a sentence.
pub fn listed(system: &dyn System, knobs: &[Knob]) -> String {
    let at = Time::ZERO;
    let knobs = knobs.iter().cloned().map(|knob| TimedKnob { at, knob });
    let words = in_words(system, &knobs.collect::<Vec<_>>()).into_iter();
    words.map(|(_, text)| text).collect::<Vec<_>>().join(", ")
}

/// `alias` and its value in `setup`, such as `policy scripted`.
pub fn setting(system: &dyn System, alias: &Alias, setup: &Setup) -> String {
    format!("{} {}", alias.name, short_value(system, alias, setup))
}

fn shortened(system: &dyn System, knob: &Knob) -> Knob {
    match knob {
        Knob::Send { node, text } => Knob::Send {
            node: node.clone(),
            text: short(system, node, text),
        },
        other => other.clone(),
    }
}
