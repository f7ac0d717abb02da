//! Where a run stands, and why.

use std::time::Duration;

use ratelab::{ClockExit, KnobKind, Time};
use ratelab_experiment::cause::{Facts, Trial};
use ratelab_metrics::{NodeAccount, TopicAccount};
use ratelab_system::{Silence, Verdict, VerdictKind, acting_node, plant_topic};

use crate::{
    age::{Strain, ms},
    cause::{CureTrials, told},
    frame::{Health, Standing, VerdictData},
    knobs::first_node,
    run::RunSource,
};

/// Run time without a step after which the plant stands still, unless two periods are
/// longer.
const STILL: Duration = Duration::from_millis(250);

/// Why the same rates may give another age from the start.
const PHASE: &str = "a rate changed in the run, so ticks come at other moments";

/// A run at one moment.
pub(super) struct RunMoment<'a> {
    /// The run.
    pub session: &'a dyn RunSource,
    /// What explains it.
    pub facts: Facts<'a>,
    /// Whether keys turn its knobs; `false` for a recording.
    pub live: bool,
    /// The newest state of the plant; empty before the first.
    pub state: &'a [f64],
    /// Its run time.
    pub state_at: Time,
    /// The verdict from the first lost state on.
    pub lost: Option<Verdict>,
    /// Whether it equals the previous run so far, bit for bit.
    pub same: Option<bool>,
}

impl RunMoment<'_> {
    /// Returns the state of the run, and the reason for its end; `trials` tell what fixes it.
    pub fn verdict(&self, trials: &mut CureTrials) -> VerdictData {
        let ended = self.session.summary().map(|summary| &summary.verdict);
        let Some(verdict) = ended.or(self.lost.as_ref()) else {
            return self
                .unheard()
                .or_else(|| self.lost_by_now())
                .or_else(|| self.stands_still())
                .unwrap_or_else(|| self.going_on(trials));
        };
        let why = match (self.still(), verdict.is_lost()) {
            (Some(_), _) => self.waits(),
            (None, true) => self.reasons(trials),
            (None, false) => Vec::new(),
        };
        let standing = if verdict.is_lost() {
            Standing::Lost
        } else {
            Standing::Done
        };
        let headline = format!("{verdict}{}", self.as_before());
        state(standing, &verdict.name().replace('_', " "), headline, why)
    }

    /// Returns the state of a run that has yet to begin elsewhere, or of whose plant nothing is
    /// heard.
    fn unheard(&self) -> Option<VerdictData> {
        let (absent, graph) = (self.gone(), self.facts.graph);
        let plant = self.moves().map(|(_, node)| node);
        let place = self.session.place(&plant.or(graph.nodes.first())?.name)?;
        let (word, headline) = match graph.now {
            Time::ZERO if !absent.is_empty() => {
                ("waiting", "WAITING: the run has yet to begin".to_owned())
            }
            now => {
                place.absent?;
                let headline = format!("UNKNOWN: nothing is heard of the run since {now}");
                ("unknown", headline)
            }
        };
        Some(state(Standing::Warned, word, headline, absent))
    }

    /// Returns a running run that would be lost if it ended now: nothing came through a chain so
    /// far, or nothing new for too long.
    fn lost_by_now(&self) -> Option<VerdictData> {
        let (system, graph) = (self.facts.system, self.facts.graph);
        let topic = system
            .chains_topic()
            .filter(|chains| Some(*chains) == system.states_topic())?;
        let newest = graph.topic(topic).and_then(|topic| topic.newest);
        // A fast run is ahead of its ages: with an older one the newest data would look too old.
        let at = if self.state.is_empty() || newest == Some(self.state_at) {
            graph.now
        } else {
            self.state_at
        };
        let row = (!self.state.is_empty()).then_some(self.state);
        let ended = system.verdict(&ClockExit::Completed, at, [row; 2]);
        let mut chains = system.about().chains.iter();
        let silence = Silence::default();
        let is_silent = chains.any(|of| of.without_data(at, self.state, &silence).is_some());
        let headline = if is_silent {
            "RUNNING, no data so far"
        } else {
            "RUNNING"
        };
        let mut why = self.gone();
        why.extend(self.facts.warnings(None));
        why.push(format!("if it ended now: {ended}"));
        ended
            .is_lost()
            .then(|| state(Standing::Good, "", headline.to_owned(), why))
    }

    /// Returns a running run whose plant stands still.
    fn stands_still(&self) -> Option<VerdictData> {
        let headline = match self.still()? {
            None => "NOT MOVED: the plant made no step so far".to_owned(),
            Some(last) => format!("STANDS STILL: the last step of the plant was at {last}"),
        };
        Some(state(
            Standing::Warned,
            "stands still",
            headline,
            self.waits(),
        ))
    }

    /// Returns a running run that is not lost.
    fn going_on(&self, trials: &mut CureTrials) -> VerdictData {
        let age = self.facts.age;
        let idle = age.is_none() && self.is_idle();
        let strain = age.map(|age| age.strain());
        let headline = match strain {
            Some(Strain::Falls) => "NOT LOST YET: pushes are older than the limit".to_owned(),
            _ if idle => "NOT LOST YET: no push so far".to_owned(),
            _ => self.so_far() + self.as_before(),
        };
        if idle
            || !self.gone().is_empty()
            || matches!(
                strain,
                Some(Strain::Swings | Strain::MayFall | Strain::Falls)
            )
        {
            return state(Standing::Warned, "", headline, self.reasons(trials));
        }
        let mut why = self.facts.warnings(None);
        why.extend(self.living());
        let rate_turned = self
            .facts
            .commands
            .iter()
            .any(|timed| timed.knob.kind() == KnobKind::Rate);
        let cure = if self.live { "; r: a clean run" } else { "" };
        why.extend(age.filter(|_| rate_turned).map(|_| PHASE.to_owned() + cure));
        state(Standing::Good, "", headline, why)
    }

    /// States that the run equals the previous one, if it does.
    fn as_before(&self) -> &'static str {
        match (self.same, self.session.summary()) {
            (Some(true), Some(_)) => ": identical to the last run, bit for bit",
            (Some(true), None) => ", as in the last run, bit for bit",
            _ => "",
        }
    }

    /// Returns why the plant stands still.
    fn waits(&self) -> Vec<String> {
        let gone = self.gone();
        let Some((_, node)) = self.moves().filter(|_| gone.is_empty()) else {
            return gone;
        };
        let (name, key) = (&node.name, if self.live { ":" } else { "" });
        vec![match self.health(node) {
            Health::Crashed => {
                format!("the {name} crashed: the plant waits for it. {key}restart {name} goes on")
            }
            Health::Hangs => format!("the {name} hangs in one tick: the plant waits for its end"),
            _ if node.busy => format!("the {name} is in a long tick: the plant waits for its end"),
            _ => format!("the {name} does not tick: the plant waits for it"),
        }]
    }

    fn reasons(&self, trials: &mut CureTrials) -> Vec<String> {
        let gone = self.gone();
        if !gone.is_empty() {
            return gone;
        }
        let (session, facts) = (self.session, &self.facts);
        let (system, now) = (session.shared_system().clone(), facts.graph.now);
        let trial = Trial::new(system, session.config(), facts.setup.clone(), now);
        let tried = trials.follow(trial, facts.cures(), session.summary().is_some());
        // More load than there is time for comes before the parts of an age, which follow from it.
        let mut reasons = facts.warnings(None);
        let lines = facts.cause(tried).into_iter();
        reasons.extend(lines.map(|line| told(line, self.live)));
        reasons
    }

    /// Returns the state of `node`. A hang takes effect at the first tick after its command.
    pub fn health(&self, node: &NodeAccount) -> Health {
        let place = self.session.place(&node.name);
        let (mut hangs, now) = (self.facts.hangs.iter(), self.facts.graph.now);
        let hanging = hangs
            .any(|hang| *hang.node == *node.name && hang.span(node.hz.period()).contains(&now));
        if place.is_some_and(|place| place.absent.is_some()) {
            Health::Gone
        } else if node.crashed {
            Health::Crashed
        } else if hanging && node.busy {
            Health::Hangs
        } else {
            Health::Works
        }
    }

    /// Returns whether the plant stands still, and since which step; `None` if it moves.
    fn still(&self) -> Option<Option<Time>> {
        let (steps, node) = self.moves()?;
        let patience = STILL.max(node.hz.period() * 2);
        let rest = self
            .facts
            .graph
            .now
            .since(steps.newest.unwrap_or(Time::ZERO));
        (rest > patience).then_some(steps.newest)
    }

    /// Returns whether the plant moves, and nothing has pushed it for long after the start.
    fn is_idle(&self) -> bool {
        let (system, graph) = (self.facts.system, self.facts.graph);
        let pushed = acting_node(system, self.facts.lineage.topology())
            .is_none_or(|acts| graph.nodes[acts].push_age.in_force().is_some());
        let periods = graph.nodes.iter().map(|node| node.hz.period());
        let patience = STILL.max(periods.max().unwrap_or_default() * 2);
        !pushed && plant_topic(system).is_some() && graph.now > Time::ZERO + patience
    }

    /// Returns the steps of the plant, and the node that makes them.
    fn moves(&self) -> Option<(&TopicAccount, &NodeAccount)> {
        let steps = self.facts.graph.topic(plant_topic(self.facts.system)?)?;
        let node = self.facts.graph.nodes.get(*steps.publishers.first()?)?;
        Some((steps, node))
    }

    /// Returns a line for each process of which nothing is heard.
    fn gone(&self) -> Vec<String> {
        let places = self
            .facts
            .graph
            .nodes
            .iter()
            .filter_map(|node| self.session.place(&node.name));
        let mut lines = Vec::new();
        for line in places.filter_map(|place| place.absent) {
            if !lines.contains(&line) {
                lines.push(line);
            }
        }
        lines
    }

    /// Returns the current activity, in a sentence with current figures.
    fn living(&self) -> Option<String> {
        let node = first_node(self.facts.system, self.facts.graph)?;
        let greatest = ms(self.facts.age?.greatest);
        let (name, hz) = (&node.name, node.hz);
        Some(format!(
            "the {name} decides at {hz}; recent push age: at most {greatest}"
        ))
    }

    /// Returns the state of a run that is going well.
    fn so_far(&self) -> String {
        match self.facts.system.verdicts().first() {
            Some(well) if *well != VerdictKind::COMPLETED => {
                format!("{} so far", well.name.replace('_', " ").to_uppercase())
            }
            _ => "RUNNING".to_owned(),
        }
    }
}

fn state(standing: Standing, word: &str, headline: String, why: Vec<String>) -> VerdictData {
    VerdictData {
        standing,
        word: word.to_owned(),
        headline,
        why,
    }
}
