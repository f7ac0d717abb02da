//! Knobs: by presets, by exact values, and by timed knobs.

use ratelab::{Command, Event, EventKind, Hz, Knob, KnobKind, Link};
use ratelab_experiment::{Config, Experiment};
use ratelab_recording::with_durations;
use ratelab_system::{KnobText, Setup};

use super::{App, shown::ShownRun};
use crate::{
    error::KeyError,
    knobs::{self, Direction, listed, targets},
};

/// What keys turn through presets.
pub(super) struct Dial {
    name: &'static str,
    presets: &'static [f64],
    unit: &'static str,
    /// The value of a node or a topic, as wanted or else in force; `None` if it is random.
    value: fn(&App, &str) -> Option<f64>,
    /// The knob that sets another one.
    knob: fn(&App, &str, f64) -> Result<Knob, KeyError>,
}

const RATE: Dial = Dial {
    name: "rate",
    presets: &knobs::RATES,
    unit: " Hz",
    value: |app, node| {
        let runs = || app.shown.graph().node(node).map(|node| node.hz);
        app.knobs.wanted().rate(node).or_else(runs).map(Hz::get)
    },
    knob: |_, node, hz| number(KnobKind::Rate, node, hz),
};

pub(super) const DEPTH: Dial = Dial {
    name: "depth",
    presets: &knobs::DEPTHS,
    unit: "",
    value: |app, topic| {
        let runs = || app.shown.graph().topic(topic).map(|topic| topic.depth);
        let depth = app.knobs.wanted().depth(topic).or_else(runs);
        depth.map(|depth| depth.get() as f64)
    },
    knob: |_, topic, depth| number(KnobKind::Depth, topic, depth),
};

pub(super) const DELAY: Dial = Dial {
    name: "delay",
    presets: &knobs::DELAYS,
    unit: "",
    value: |app, topic| app.link(topic).delay_ms(),
    knob: |app, topic, ms| app.linked(topic, &format!("delay:{ms}")),
};

pub(super) const LOSS: Dial = Dial {
    name: "loss",
    presets: &knobs::LOSSES,
    unit: "",
    value: |app, topic| Some(app.link(topic).loss),
    knob: |app, topic, share| app.linked(topic, &format!("loss:{share}")),
};

fn number(kind: KnobKind, target: &str, value: f64) -> Result<Knob, KeyError> {
    kind.set(target, &value.to_string())
        .map_err(KeyError::refused)
}

impl App {
    /// Turns the rate of the node in focus.
    pub(super) fn turn_rate(&mut self, direction: Direction) {
        self.turn_rate_of(self.shown.knob_focus.node.clone(), direction);
    }

    /// Turns the rate of the second alias of a rate.
    pub(super) fn turn_second_rate(&mut self, direction: Direction) {
        match self.second_node() {
            Some(node) => self.turn_rate_of(node.to_owned(), direction),
            None => self.notify("this system has no second rate: ↑ ↓ choose another node"),
        }
    }

    pub(super) fn second_node(&self) -> Option<&'static str> {
        let mut rates = self
            .system()
            .knobs()
            .aliases()
            .iter()
            .filter(|alias| alias.kind() == KnobKind::Rate);
        let (_, node) = rates.nth(1)?.knobs.first()?;
        Some(node)
    }

    fn turn_rate_of(&mut self, node: String, direction: Direction) {
        let presets = match self.course.by_hand {
            Some(_) => &knobs::COARSE_RATES[..],
            None => RATE.presets,
        };
        self.turn_dial(&Dial { presets, ..RATE }, &[node], direction);
    }

    /// Turns `dial` of the focused topics.
    pub(super) fn turn_topics(&mut self, dial: &Dial, direction: Direction) {
        self.turn_dial(dial, &self.shown.knob_focus.topics.clone(), direction);
    }

    /// Turns `dial` of all `targets` to the preset next to the value of the first.
    fn turn_dial(&mut self, dial: &Dial, targets: &[String], direction: Direction) {
        let Some(first) = targets.first() else {
            return self.notify("this system has no topic that is read");
        };
        let Dial { name, unit, .. } = dial;
        let Some(value) = (dial.value)(self, first) else {
            return self.notify(format!("the {name} is drawn: : types another one"));
        };
        let Some(next) = knobs::next(dial.presets, value, direction) else {
            let what = format!("the {name} of {}", targets.join(" and "));
            let value = format!("{value}{unit}");
            return self.notify(knobs::at_end(&what, direction, value));
        };
        let knobs = targets.iter().map(|target| (dial.knob)(self, target, next));
        self.turn(knobs.collect());
    }

    /// Returns the link of `topic`.
    fn link(&self, topic: &str) -> Link {
        match self.knobs.wanted().knob(KnobKind::Link, topic) {
            Some(Knob::Link { link, .. }) => link.clone(),
            _ => Link::NONE,
        }
    }

    /// Returns the knob of that link with another `part`.
    fn linked(&self, topic: &str, part: &str) -> Result<Knob, KeyError> {
        let link = self.link(topic).with(part).map_err(KeyError::refused)?;
        Ok(Knob::Link {
            topic: topic.to_owned(),
            link,
        })
    }

    /// Turns the knob that breaks the system, or turns it back.
    pub(super) fn break_it(&mut self) {
        let Some(broken) = self.system().knobs().broken() else {
            return self.notify("this system has no knob that is known to break it");
        };
        let knobs = match self.parsed(broken) {
            Ok(knobs) => knobs,
            Err(error) => return self.notify(error.to_string()),
        };
        let wanted = self.knobs.wanted();
        let is_broken = |knob| wanted.iter().any(|turned| turned == knob);
        let before = std::mem::take(&mut self.unbroken);
        if !knobs.iter().all(is_broken) {
            self.unbroken = knobs
                .iter()
                .filter_map(|knob| self.as_it_is(knob))
                .collect();
            self.turn(Ok(knobs));
        } else if before.is_empty() {
            self.notify(format!("it was broken from the start: {broken}"));
        } else {
            self.turn(Ok(before));
        }
    }

    /// Returns the current setting of the rate or depth that `knob` changes.
    fn as_it_is(&self, knob: &Knob) -> Option<Knob> {
        let graph = self.shown.graph();
        let value = match knob.kind() {
            KnobKind::Rate => graph.node(knob.target())?.hz.get().to_string(),
            KnobKind::Depth => graph.topic(knob.target())?.depth.to_string(),
            _ => return None,
        };
        knob.kind().set(knob.target(), &value).ok()
    }

    /// Turns knobs, or gives notice of the reason why this is impossible.
    pub(crate) fn turn(&mut self, knobs: Result<Vec<Knob>, KeyError>) {
        if let Err(reason) = knobs.and_then(|knobs| self.try_to_turn(knobs)) {
            self.notify(reason.to_string());
        }
    }

    /// Returns the knobs in `text`.
    pub(super) fn parsed(&self, text: &str) -> Result<Vec<Knob>, KeyError> {
        let knobs = KnobText(self.system().knobs().aliases()).parse(text);
        knobs.map_err(KeyError::refused)
    }

    /// Turns knobs of the running graph; they also apply to the next session.
    ///
    /// # Errors
    /// The accepted values, if one knob is invalid; no knob is turned then.
    pub(super) fn try_to_turn(&mut self, knobs: Vec<Knob>) -> Result<(), KeyError> {
        if let ShownRun::Remote(run) = &mut self.shown.run {
            // The process that has them checks them.
            knobs.into_iter().for_each(|knob| run.turn(knob));
            return Ok(());
        }
        let knobs = knobs
            .into_iter()
            .map(|knob| self.checked(knob))
            .collect::<Result<Vec<Knob>, _>>()?;
        if self.ended() {
            return self.turn_for_the_next(knobs, "the run is over");
        }
        let is_fixed = |knob: &Knob| self.system().knobs().is_fixed(knob);
        let (fixed, knobs): (Vec<Knob>, Vec<Knob>) = knobs.into_iter().partition(is_fixed);
        if !fixed.is_empty() {
            self.turn_for_the_next(fixed, "a run keeps it")?;
        }
        for knob in knobs {
            self.shown.run.send(knob.clone().into());
            self.knobs.pending.push(knob);
        }
        Ok(())
    }

    fn turn_for_the_next(&mut self, knobs: Vec<Knob>, why: &str) -> Result<(), KeyError> {
        let mut next = self.wanted();
        next.setup.extend(knobs.iter().cloned());
        // No graph is running that could refuse them.
        Experiment::new(self.setup.system.clone(), &next).map_err(KeyError::refused)?;
        let turned = listed(self.system(), &knobs);
        self.knobs.running.extend(knobs);
        self.notify(format!(
            "{why}: {turned} is used from the next run on: r starts it"
        ));
        Ok(())
    }

    /// Returns `knob` in a form the graph accepts.
    fn checked(&self, knob: Knob) -> Result<Knob, KeyError> {
        let graph = self.shown.graph();
        let known = targets(&graph, knob.kind());
        if !known.contains(&knob.target()) {
            return Err(KeyError::UnknownTarget {
                what: if knob.kind().is_of_topic() {
                    "topic"
                } else {
                    "node"
                },
                target: knob.target().to_owned(),
                known: known.join(", "),
            });
        }
        let (seed, setup) = (self.config.seed, self.knobs.wanted());
        self.system()
            .resolved(seed, &setup, knob)
            .and_then(with_durations)
            .map_err(KeyError::refused)
    }

    /// Updates the state after the graph has obeyed a command, or refused it.
    pub(crate) fn follow(&mut self, event: &Event) {
        if let Some(refusal) = self.knobs.follow(event) {
            self.notify(refusal);
        }
        if let EventKind::Refused {
            command: Command::HandOver(_),
            reason,
        } = &event.what
        {
            self.stays_on_clock(reason);
        }
    }
}

/// Knobs that were turned, before the run and during it.
#[derive(Default)]
pub struct Knobs {
    /// The knobs of the graph, by its events.
    running: Setup,
    /// Turned by keys and not yet answered by the graph, oldest first.
    pub(crate) pending: Vec<Knob>,
}

impl Knobs {
    /// Creates the knobs of a run that begins with `running`.
    pub fn new(running: Setup) -> Self {
        let pending = Vec::new();
        Self { running, pending }
    }

    /// Returns the knobs of the graph, with the knobs on their way to it.
    pub fn wanted(&self) -> Setup {
        let mut wanted = self.running.clone();
        wanted.extend(self.pending.iter().cloned());
        wanted
    }

    /// Follows what the graph did with a knob, be it one that a key turned or one
    /// that was given its time up front; why it refused, if a key asked for it.
    fn follow(&mut self, event: &Event) -> Option<String> {
        match &event.what {
            EventKind::Applied {
                command: Command::Set(knob),
                ..
            } => {
                self.answered(knob);
                self.running.set(knob.clone());
                None
            }
            EventKind::Refused {
                command: Command::Set(knob),
                reason,
            } => self.answered(knob).then(|| format!("{knob}: {reason}")),
            _ => None,
        }
    }

    /// Takes `knob` from the knobs that wait for an answer, if it is the first of its
    /// kind there. A timed knob of the same value may be taken for it: the one that
    /// a key turned then comes later, and sets that value all the same.
    fn answered(&mut self, knob: &Knob) -> bool {
        self.pending
            .iter()
            .position(|other| other.is_of(knob))
            .filter(|index| self.pending[*index] == *knob)
            .map(|index| self.pending.remove(index))
            .is_some()
    }
}

/// Returns `config` without timed knobs: a session turns them once, not again at the next start.
pub(super) fn without_knobs(config: Config) -> Config {
    Config {
        knobs: Vec::new(),
        ..config
    }
}
