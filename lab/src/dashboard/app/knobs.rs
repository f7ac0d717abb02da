//! Knobs: by presets, by exact values, and by timed knobs.

use ratelab::{Command, Event, EventKind, Knob, KnobKind};
use ratelab_effects::Link;
use ratelab_study::{
    experiment::{Config, Experiment},
    system::KnobText,
};

use super::App;
use crate::{
    dashboard::{
        desk::NO_TOPIC,
        presets::{self, Direction},
        sampler::RunSource,
        settings::listed,
    },
    recording::with_durations,
};

impl App {
    /// Turns the rate of the node in focus.
    pub(super) fn turn_rate(&mut self, direction: Direction) {
        self.turn_rate_of(&self.desk.knob_focus.node.clone(), direction);
    }

    /// Turns the rate of the second alias of a rate.
    pub(super) fn turn_second_rate(&mut self, direction: Direction) {
        match self.second_node() {
            Some(node) => self.turn_rate_of(node, direction),
            None => {
                (self.desk).notify("this system has no second rate: ↑ ↓ choose another node");
            }
        }
    }

    pub(super) fn second_node(&self) -> Option<&'static str> {
        let aliases = self.system().aliases().iter();
        let mut rates = aliases.filter(|alias| alias.kind() == KnobKind::Rate);
        let (_, node) = rates.nth(1)?.knobs.first()?;
        Some(node)
    }

    fn turn_rate_of(&mut self, node: &str, direction: Direction) {
        let presets = match self.by_hand {
            Some(_) => &presets::COARSE_RATES[..],
            None => &presets::RATES,
        };
        let wanted = self.knobs.wanted();
        self.turn_or_notify(self.desk.next_rate(node, &wanted, presets, direction));
    }

    /// Turns the depths of the focused topics.
    pub(super) fn turn_depth(&mut self, direction: Direction) {
        self.turn_or_notify(self.desk.next_depth(&self.knobs.wanted(), direction));
    }

    /// Turns the delays of the focused topics.
    pub(super) fn turn_delay(&mut self, direction: Direction) {
        self.turn_link("delay", &presets::DELAYS, direction, |link| link.delay_ms());
    }

    /// Turns the losses of the focused topics.
    pub(super) fn turn_loss(&mut self, direction: Direction) {
        self.turn_link("loss", &presets::LOSSES, direction, |link| {
            Some(link.loss())
        });
    }

    /// Turns the part called `part` of the links of the focused topics, all to the preset
    /// next to the `current` value of the first.
    fn turn_link(
        &mut self,
        part: &str,
        presets: &[f64],
        direction: Direction,
        current: impl Fn(&Link) -> Option<f64>,
    ) {
        let topics = self.desk.knob_focus.topics.clone();
        let links: Vec<Link> = topics.iter().map(|topic| self.link(topic)).collect();
        let Some(first) = links.first() else {
            return self.desk.notify(NO_TOPIC);
        };
        let Some(value) = current(first) else {
            return self
                .desk
                .notify(format!("the {part} is drawn: : types another one"));
        };
        let Some(next) = presets::next(presets, value, direction) else {
            let what = format!("the {part} of {}", topics.join(" and "));
            return self.desk.notify(presets::at_end(&what, direction, value));
        };
        let knobs = topics.into_iter().zip(&links).map(|(topic, link)| {
            let spec = link.with(&format!("{part}:{next}"))?.to_string();
            Ok(Knob::Link { topic, spec })
        });
        self.turn_or_notify(knobs.collect());
    }

    /// The link of the topic called `name`.
    fn link(&self, name: &str) -> Link {
        let wanted = self.knobs.wanted();
        let link = wanted.iter().find_map(|knob| match knob {
            Knob::Link { topic, spec } if topic == name => spec.parse().ok(),
            _ => None,
        });
        link.unwrap_or(Link::NONE)
    }

    pub(super) fn break_it(&mut self) {
        let Some(broken) = self.system().about().broken else {
            return self
                .desk
                .notify("this system has no knob that is known to break it");
        };
        match KnobText(self.system().aliases()).parse(broken) {
            Ok(knobs) if knobs.iter().all(|knob| self.is_at(knob)) => {
                match std::mem::take(&mut self.unbroken) {
                    before if before.is_empty() => {
                        self.desk
                            .notify(format!("it was broken from the start: {broken}"));
                    }
                    before => self.turn(before),
                }
            }
            Ok(knobs) => {
                self.unbroken = knobs
                    .iter()
                    .filter_map(|knob| self.as_it_is(knob))
                    .collect();
                self.turn(knobs);
            }
            Err(error) => self.desk.notify(error.to_string()),
        }
    }

    /// The current setting of the rate or depth that `knob` changes.
    fn as_it_is(&self, knob: &Knob) -> Option<Knob> {
        let graph = self.desk.graph();
        let value = match knob.kind() {
            KnobKind::Rate => graph.node(knob.target())?.hz.get().to_string(),
            KnobKind::Depth => graph.topic(knob.target())?.depth.to_string(),
            _ => return None,
        };
        knob.kind().set(knob.target(), &value).ok()
    }

    /// Whether `knob` already has its value.
    fn is_at(&self, knob: &Knob) -> bool {
        self.knobs.wanted().iter().any(|turned| turned == knob)
    }

    /// Turns knobs, or prints the reason why this is impossible.
    pub(super) fn turn(&mut self, knobs: Vec<Knob>) {
        self.turn_or_notify(Ok(knobs));
    }

    /// The same for knobs that may be missing for a reason.
    fn turn_or_notify(&mut self, knobs: Result<Vec<Knob>, String>) {
        if let Err(reason) = knobs.and_then(|knobs| self.try_to_turn(knobs)) {
            self.desk.notify(reason);
        }
    }

    /// Turns knobs of the running graph; they also apply to the next session.
    ///
    /// # Errors
    /// The accepted values, if one knob is invalid; no knob is turned then.
    fn try_to_turn(&mut self, knobs: Vec<Knob>) -> Result<(), String> {
        let knobs = knobs.into_iter().map(|knob| self.checked(knob));
        let knobs: Vec<Knob> = knobs.collect::<Result<_, _>>()?;
        if self.ended() {
            return self.turn_for_the_next(knobs);
        }
        for knob in knobs {
            self.desk.run.send(knob.clone().into());
            self.knobs.press(knob);
        }
        Ok(())
    }

    /// Turns the knobs in `text`.
    pub(super) fn turn_typed(&mut self, text: &str) -> Result<(), String> {
        let knobs = KnobText(self.system().aliases()).parse(text);
        self.try_to_turn(knobs.map_err(|error| error.to_string())?)
    }

    fn turn_for_the_next(&mut self, knobs: Vec<Knob>) -> Result<(), String> {
        let mut next = self.wanted();
        next.setup.extend(knobs.iter().cloned());
        // No graph is running that could refuse them.
        let built = Experiment::new(self.setup.system.clone(), &next);
        built.map_err(|error| error.to_string())?;
        let turned = listed(self.system(), &knobs);
        knobs.into_iter().for_each(|knob| self.knobs.set(knob));
        self.desk.notify(format!(
            "the run is over: {turned} counts from the next one, r starts it"
        ));
        Ok(())
    }

    /// `knob` in a form the graph accepts.
    fn checked(&self, knob: Knob) -> Result<Knob, String> {
        let graph = self.desk.graph();
        let (what, known): (_, Vec<&str>) = match knob.kind() {
            kind if kind.is_of_topic() => (
                "topic",
                graph.topics.iter().map(|topic| &*topic.name).collect(),
            ),
            _ => ("node", graph.nodes.iter().map(|node| &*node.name).collect()),
        };
        if !known.contains(&knob.target()) {
            let (target, known) = (knob.target(), known.join(", "));
            return Err(format!("there is no {what} {target:?}: expected {known}"));
        }
        match knob {
            Knob::Send { node, text } => {
                let (seed, setup) = (self.config.seed, self.knobs.wanted());
                let text = self.system().resolve(seed, &setup, &node, &text)?;
                Ok(Knob::Send { node, text })
            }
            other => with_durations(other),
        }
    }

    /// Processes new events.
    pub(super) fn follow_events(&mut self) {
        for event in self.desk.run.observer().events(self.events.len()) {
            self.follow(&event);
            self.events.push(event);
        }
    }

    /// Updates the state after the graph has turned a knob.
    pub(super) fn follow(&mut self, event: &Event) {
        if let Some(refusal) = self.knobs.follow(event) {
            self.desk.notify(refusal);
        }
        if let EventKind::Refused {
            command: Command::HandOver(_),
            reason,
        } = &event.what
        {
            self.stays_on_clock(reason.clone());
        }
    }
}

/// `config` without timed knobs: those of a session are turned once, not again at the
/// next start.
pub(super) fn without_knobs(config: Config) -> Config {
    Config {
        knobs: Vec::new(),
        ..config
    }
}
