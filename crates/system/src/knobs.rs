//! The knobs of a system: its settings before a run, names of its own, and messages that its nodes
//! understand.

use std::{path::PathBuf, time::Duration};

use ratelab::{Depth, Hz, Knob, KnobError, KnobKind, TimedKnob};
use serde::{Deserialize, Serialize};

/// Knobs set before the run begins. All others keep the system's defaults.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Setup(Vec<Knob>);

impl Setup {
    /// Sets `knob`, in place of an earlier value. A crash or a restart has none: it comes
    /// after all that was set before.
    pub fn set(&mut self, knob: Knob) {
        if knob.kind().has_no_value() {
            self.0.retain(|known| !known.is_of(&knob));
        }
        match self.0.iter_mut().find(|known| known.is_of(&knob)) {
            Some(known) => *known = knob,
            None => self.0.push(knob),
        }
    }

    /// Returns the setup with `knob` set.
    #[must_use]
    pub fn with(mut self, knob: Knob) -> Self {
        self.set(knob);
        self
    }

    /// Returns the knob of this `kind` for a [subject](Knob::subject), if it is set.
    pub fn knob(&self, kind: KnobKind, subject: &str) -> Option<&Knob> {
        self.0
            .iter()
            .find(|knob| knob.kind() == kind && knob.subject() == subject)
    }

    /// Returns the rate of `node`, if it is set.
    pub fn rate(&self, node: &str) -> Option<Hz> {
        match self.knob(KnobKind::Rate, node)? {
            Knob::Rate { hz, .. } => Some(*hz),
            _ => None,
        }
    }

    /// Offset of `node`, if it is set.
    pub fn offset(&self, node: &str) -> Option<Duration> {
        match self.knob(KnobKind::Offset, node)? {
            Knob::Offset { offset, .. } => Some(*offset),
            _ => None,
        }
    }

    /// Depth of `topic`, if it is set.
    pub fn depth(&self, topic: &str) -> Option<Depth> {
        match self.knob(KnobKind::Depth, topic)? {
            Knob::Depth { depth, .. } => Some(*depth),
            _ => None,
        }
    }

    /// Message to `node`, if one is set.
    pub fn message(&self, node: &str) -> Option<&str> {
        match self.knob(KnobKind::Send, node)? {
            Knob::Send { text, .. } => Some(text),
            _ => None,
        }
    }

    /// Parameter `name` of `node`, if it is set.
    pub fn parameter(&self, node: &str, name: &str) -> Option<&str> {
        match self.knob(KnobKind::Parameter, &format!("{node} {name}"))? {
            Knob::Parameter { value, .. } => Some(value),
            _ => None,
        }
    }

    /// Returns all knobs, in the order in which they were first set.
    pub fn iter(&self) -> impl Iterator<Item = &Knob> + Clone {
        self.0.iter()
    }
}

impl Extend<Knob> for Setup {
    fn extend<I: IntoIterator<Item = Knob>>(&mut self, knobs: I) {
        knobs.into_iter().for_each(|knob| self.set(knob));
    }
}

impl FromIterator<Knob> for Setup {
    fn from_iter<I: IntoIterator<Item = Knob>>(knobs: I) -> Self {
        let mut setup = Self::default();
        setup.extend(knobs);
        setup
    }
}

/// The knobs of a [`System`](crate::System) that it has names or rules of its own for. It returns
/// them from [`System::knobs`](crate::System::knobs).
pub trait SystemKnobs {
    /// Returns its own names for some knobs, such as `control-hz` for `rate policy`.
    fn aliases(&self) -> &'static [Alias] {
        &[]
    }

    /// Returns a knob that makes runs fail, as text, such as `control-hz 5`: the setting of `--break`.
    fn broken(&self) -> Option<&'static str> {
        None
    }

    /// Returns whether `knob` counts for a whole run: it cannot be turned while that goes on.
    fn is_fixed(&self, knob: &Knob) -> bool {
        let _ = knob;
        false
    }

    /// Returns the recordable form of a message to `node`, with the same meaning whenever
    /// the run is repeated, such as a file with the digest of its content. Loads
    /// everything that the node will need, outside of the node's thread. `seed` and
    /// `setup` are those of the run.
    ///
    /// # Errors
    /// The reason why the node would refuse the message, with a remedy.
    fn resolve(&self, seed: u64, setup: &Setup, node: &str, text: &str) -> Result<String, String> {
        let _ = (seed, setup, node);
        Ok(text.to_owned())
    }

    /// Returns the shortest form of a `value` of the parameter `name` of `node`.
    ///
    /// # Errors
    /// The reason why the node would refuse it, with a remedy.
    fn parameter(&self, [node, name]: [&str; 2], value: &str) -> Result<String, String> {
        let _ = (node, name);
        Ok(value.to_owned())
    }

    /// Returns the file named by a message to `node`, if any: outputs of the command must not
    /// replace it.
    fn file(&self, node: &str, text: &str) -> Option<PathBuf> {
        let _ = (node, text);
        None
    }

    /// Returns whether a message to `node` names a program, which runs in a process of its own: as
    /// the recordable form of the message says (see [`resolve`](Self::resolve)), or the file of that
    /// name if the system `looks` at it.
    fn is_program(&self, node: &str, text: &str, looks: bool) -> bool {
        let _ = (node, text, looks);
        false
    }
}

/// A system's own name for a knob, or for several with a common value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Alias {
    /// Name, such as `control-hz`.
    pub name: &'static str,
    /// The knobs: their kinds and [subjects](Knob::subject).
    pub knobs: &'static [(KnobKind, &'static str)],
    /// The default value.
    pub default: &'static str,
    /// The known values, if they can be listed; others may be valid too.
    pub choices: &'static [&'static str],
    /// Description for help texts.
    pub help: &'static str,
}

impl Alias {
    /// Returns the kind of all its knobs.
    pub fn kind(&self) -> KnobKind {
        self.knobs.first().map_or(KnobKind::Send, |(kind, _)| *kind)
    }

    /// Returns the knobs, set to `value`.
    ///
    /// # Errors
    /// [`KnobError`] for an invalid value.
    pub fn set(&self, value: &str) -> Result<Vec<Knob>, KnobError> {
        self.knobs
            .iter()
            .map(|(kind, of)| kind.set(of, value))
            .collect()
    }

    /// Returns the value in a text that may name its node before, as in `noise sensor 0.1`: a
    /// parameter of one node only.
    pub(super) fn without_node<'t>(&self, text: &'t str) -> &'t str {
        let [(KnobKind::Parameter, subject)] = self.knobs else {
            return text;
        };
        let node = subject.split_whitespace().next().unwrap_or_default();
        let rest = text.strip_prefix(node);
        rest.filter(|rest| rest.starts_with(char::is_whitespace))
            .map_or(text, str::trim_start)
    }

    /// Returns the initial value: from `setup`, or else the default. If its knobs have several
    /// values, that of the first.
    pub fn value(&self, setup: &Setup) -> String {
        self.knobs
            .first()
            .and_then(|(kind, of)| setup.knob(*kind, of))
            .map_or_else(|| self.default.to_owned(), Knob::value)
    }

    /// Returns the common value of the knobs at the beginning of `knobs`, if they are the knobs
    /// of this alias with one value and one time.
    pub(super) fn value_of(&self, knobs: &[TimedKnob]) -> Option<String> {
        let turned = knobs.get(..self.knobs.len())?;
        let (first, value) = (turned.first()?, turned.first()?.knob.value());
        let same = |(turned, (kind, of)): (&TimedKnob, &(KnobKind, &str))| {
            let knob = &turned.knob;
            let known = knob.kind() == *kind && knob.subject() == *of;
            known && turned.at == first.at && knob.value() == value
        };
        turned.iter().zip(self.knobs).all(same).then_some(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn knob(text: &str) -> Knob {
        text.parse().expect(text)
    }

    #[test]
    fn a_setup_has_each_setting_once_and_a_crash_after_all_that_came_before() {
        for (set, expected) in [
            ("rate a 5; rate a 7", "rate a 7"),
            ("rate a 5; rate b 7; rate a 9", "rate a 9; rate b 7"),
            ("rate a 5; offset a 3", "rate a 5; offset a 3"),
            ("depth /x 2; depth /x 3", "depth /x 3"),
            ("crash a; rate a 5; crash a", "rate a 5; crash a"),
            (
                "set a gain 1; set a bias 2; set a gain 3",
                "set a gain 3; set a bias 2",
            ),
        ] {
            let setup: Setup = set.split("; ").map(knob).collect();
            let found: Vec<String> = setup.iter().map(Knob::to_string).collect();
            assert_eq!(found.join("; "), expected, "{set}");
        }
    }

    #[test]
    fn a_setup_tells_what_is_set_of_a_node_or_topic_and_nothing_else() {
        let setup: Setup = ["rate a 5", "depth /x 3", "send a go", "set a gain 1"]
            .map(knob)
            .into_iter()
            .collect();
        assert_eq!(setup.rate("a").map(Hz::get), Some(5.0));
        assert_eq!(setup.rate("b"), None);
        assert_eq!(setup.depth("/x").map(Depth::get), Some(3));
        assert_eq!(setup.message("a"), Some("go"));
        assert_eq!(setup.parameter("a", "gain"), Some("1"));
        assert_eq!(setup.parameter("a", "bias"), None);
        assert_eq!(setup.offset("a"), None);
    }

    #[test]
    fn an_alias_has_the_value_that_all_its_knobs_have_at_once() {
        const BOTH: Alias = Alias {
            name: "queue-depth",
            knobs: &[(KnobKind::Depth, "/obs"), (KnobKind::Depth, "/action")],
            default: "1",
            choices: &[],
            help: "",
        };
        for (lines, expected) in [
            (["1 depth /obs 8", "1 depth /action 8"], Some("8")),
            (["1 depth /obs 8", "1 depth /action 7"], None),
            (["1 depth /obs 8", "2 depth /action 8"], None),
            (["1 depth /action 8", "1 depth /obs 8"], None),
        ] {
            let knobs = crate::KnobText::default().parse_list(&lines.join("\n"));
            let found = BOTH.value_of(&knobs.expect("knobs"));
            assert_eq!(found.as_deref(), expected, "{lines:?}");
        }
        assert_eq!(BOTH.value(&Setup::default()), "1");
    }
}
