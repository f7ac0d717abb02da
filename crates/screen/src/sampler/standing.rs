//! Where a run stands, and why.

use std::time::Duration;

use ratelab::{ClockExit, KnobKind, Time};
use ratelab_account::{NodeAccount, Snapshot, TopicAccount};
use ratelab_study::system::{System, VerdictKind, plant, verdict};

use super::Sampler;
use crate::{
    cause::{Facts, Hang, Trial, acting, latest},
    frame::{AgeData, Health, PlanData, Standing, Strain, VerdictData},
    knobs::first_node,
    run::RunSource,
};

/// Run time without a step after which the plant stands still, unless two periods are
/// longer.
const STILL: Duration = Duration::from_millis(250);

/// Why the same rates may give another age from the start.
const PHASE: &str = "turned on the way, ticks meet at another phase: after r the age may differ";

impl Sampler {
    /// The state of the run, and the reason for its end.
    pub(super) fn verdict(
        &mut self,
        session: &dyn RunSource,
        graph: &Snapshot,
        (age, plan): (Option<AgeData>, Option<&PlanData>),
    ) -> VerdictData {
        let ended = session.summary().map(|summary| summary.verdict);
        let Some(verdict) = ended.or(self.lost) else {
            return unheard(session, graph)
                .or_else(|| self.silent(session, graph.now))
                .or_else(|| self.stands_still(session, graph))
                .unwrap_or_else(|| self.going_on(session, graph, (age, plan)));
        };
        let why = match (still(session.system(), graph), verdict.is_lost()) {
            (Some(_), _) => self.waits(session, graph),
            (None, true) => self.reasons(session, graph, (age, plan)),
            (None, false) => Vec::new(),
        };
        let standing = match verdict.is_lost() {
            true => Standing::Lost,
            false => Standing::Done,
        };
        let headline = format!("{verdict}{}", self.as_before(session));
        state(standing, &verdict.name().replace('_', " "), headline, why)
    }

    /// A running run of a chain through which nothing came so far, with the verdict if it
    /// ended now.
    fn silent(&self, session: &dyn RunSource, now: Time) -> Option<VerdictData> {
        let system = session.system();
        if system.chains().is_none() || system.chains() != system.state() {
            return None;
        }
        let newest = (!self.state.is_empty()).then_some(&self.state[..]);
        let ended = verdict(system, &ClockExit::Completed, now, [newest; 2]);
        let mut why = self.overloads(session);
        why.push(format!("if it ended now: {ended}"));
        let headline = "RUNNING, no data so far".to_owned();
        let lost = ended.is_lost();
        lost.then_some(state(Standing::Good, "", headline, why))
    }

    /// A running run whose plant stands still.
    fn stands_still(&self, session: &dyn RunSource, graph: &Snapshot) -> Option<VerdictData> {
        let headline = match still(session.system(), graph)? {
            None => "NOT MOVED: the plant made no step so far".to_owned(),
            Some(last) => format!("STANDS STILL: the last step of the plant was at {last}"),
        };
        let why = self.waits(session, graph);
        Some(state(Standing::Warned, "stands still", headline, why))
    }

    /// A running run that is not lost.
    fn going_on(
        &mut self,
        session: &dyn RunSource,
        graph: &Snapshot,
        (age, plan): (Option<AgeData>, Option<&PlanData>),
    ) -> VerdictData {
        let system = session.system();
        let idle = age.is_none() && is_idle(system, graph);
        let strain = age.map(|age| age.strain());
        let headline = match strain {
            Some(Strain::Falls) => "NOT LOST YET: pushes are older than it bears".to_owned(),
            _ if idle => "NOT LOST YET: no action was applied so far".to_owned(),
            _ => so_far(system) + self.as_before(session),
        };
        if idle
            || matches!(
                strain,
                Some(Strain::Swings | Strain::MayFall | Strain::Falls)
            )
        {
            let why = self.reasons(session, graph, (age, plan));
            return state(Standing::Warned, "", headline, why);
        }
        let mut why = self.overloads(session);
        why.extend(living(system, graph, age));
        let turned = self.turned.iter().any(|knob| knob.kind() == KnobKind::Rate);
        why.extend(age.filter(|_| turned).map(|_| PHASE.to_owned()));
        state(Standing::Good, "", headline, why)
    }

    /// What the nodes are asked for beyond their time, with the knobs in force.
    fn overloads(&self, session: &dyn RunSource) -> Vec<String> {
        let mut setup = session.system().about().setup();
        setup.extend(self.setup(session).iter().cloned());
        session.system().warnings(&setup)
    }

    /// States that the run equals the previous one, if it does.
    fn as_before(&self, session: &dyn RunSource) -> &'static str {
        match (self.same(session), session.summary()) {
            (Some(true), Some(_)) => ": identical to the last run, bit for bit",
            (Some(true), None) => ", as in the last run, bit for bit",
            _ => "",
        }
    }

    /// Why the plant stands still.
    fn waits(&self, session: &dyn RunSource, graph: &Snapshot) -> Vec<String> {
        let gone = gone(session, graph);
        let Some((_, node)) = moves(session.system(), graph).filter(|_| gone.is_empty()) else {
            return gone;
        };
        let (name, key) = (&node.name, if session.live() { ":" } else { "" });
        vec![match health(node, &self.hangs(session), graph.now) {
            Health::Crashed => {
                format!("the {name} crashed: the plant waits for it. {key}restart {name} goes on")
            }
            Health::Hangs => format!("the {name} hangs in one tick: the plant waits for its end"),
            _ if node.busy => format!("the {name} is in a long tick: the plant waits for its end"),
            _ => format!("the {name} does not tick: the plant waits for it"),
        }]
    }

    fn reasons(
        &mut self,
        session: &dyn RunSource,
        graph: &Snapshot,
        (age, plan): (Option<AgeData>, Option<&PlanData>),
    ) -> Vec<String> {
        let gone = gone(session, graph);
        if !gone.is_empty() {
            return gone;
        }
        let mut reasons = self.overloads(session);
        let (setup, hangs) = (self.setup(session), self.hangs(session));
        let (system, live) = (session.shared_system().clone(), session.live());
        let trial = Trial::new(system.clone(), session.config(), setup.clone(), graph.now);
        let over = session.summary().is_some();
        let lineage = session.lineage();
        let late = match (age, acting(&*system, graph)) {
            (Some(age), _) => age.stretch,
            (None, Some(acts)) => latest(graph, lineage, acts),
            (None, None) => (Time::ZERO, graph.now),
        };
        let facts = Facts {
            system: &*system,
            setup: &setup,
            turned: &self.turned,
            graph,
            lineage,
            age,
            late,
            plan,
            hangs: &hangs,
            live,
        };
        let tried = self.trials.follow(trial, facts.cures(), over);
        // More load than there is time for comes before the parts of an age, which follow from it.
        reasons.extend(facts.cause(tried));
        reasons
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

/// The state of `node` at run time `now`. A hang takes effect at the first tick after its
/// command.
pub(super) fn health(node: &NodeAccount, hangs: &[Hang], now: Time) -> Health {
    let mut hangs = hangs.iter().filter(|hang| *hang.node == *node.name);
    let hangs = hangs.any(|hang| hang.is_at(now, node.hz.period()));
    match node.crashed {
        true => Health::Crashed,
        false if hangs && node.busy => Health::Hangs,
        false => Health::Works,
    }
}

/// Whether the plant stands still, and since which step; `None` if it moves.
fn still(system: &dyn System, graph: &Snapshot) -> Option<Option<Time>> {
    let (steps, node) = moves(system, graph)?;
    let patience = STILL.max(node.hz.period() * 2);
    let rest = graph.now.since(steps.newest.unwrap_or(Time::ZERO));
    (rest > patience).then_some(steps.newest)
}

/// Whether the plant moves, and nothing has pushed it for long after the start.
fn is_idle(system: &dyn System, graph: &Snapshot) -> bool {
    let pushed =
        acting(system, graph).is_none_or(|acts| graph.nodes[acts].push_age.in_force().is_some());
    let periods = graph.nodes.iter().map(|node| node.hz.period());
    let patience = STILL.max(periods.max().unwrap_or_default() * 2);
    !pushed && plant(system).is_some() && graph.now > Time::ZERO + patience
}

/// The steps of the plant, and the node that makes them.
fn moves<'g>(
    system: &dyn System,
    graph: &'g Snapshot,
) -> Option<(&'g TopicAccount, &'g NodeAccount)> {
    let steps = graph.topic(plant(system)?)?;
    let node = graph.nodes.get(*steps.publishers.first()?)?;
    Some((steps, node))
}

/// A line for each process of which nothing is heard.
fn gone(session: &dyn RunSource, graph: &Snapshot) -> Vec<String> {
    let places = graph
        .nodes
        .iter()
        .filter_map(|node| session.place(&node.name));
    let mut lines = Vec::new();
    for line in places.filter_map(|place| place.absent) {
        if !lines.contains(&line) {
            lines.push(line);
        }
    }
    lines
}

/// The state of a run that has yet to begin elsewhere, or of whose plant nothing is heard.
fn unheard(session: &dyn RunSource, graph: &Snapshot) -> Option<VerdictData> {
    let absent = gone(session, graph);
    let plant = moves(session.system(), graph).map(|(_, node)| node);
    let place = session.place(&plant.or(graph.nodes.first())?.name)?;
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

/// The current activity, in a sentence with current figures.
fn living(system: &dyn System, graph: &Snapshot, age: Option<AgeData>) -> Vec<String> {
    let (Some(age), Some(node)) = (age, first_node(system, graph)) else {
        return Vec::new();
    };
    let (name, hz, ms) = (&node.name, node.hz, age.greatest.as_secs_f64() * 1e3);
    vec![format!(
        "the {name} decides at {hz}; each push is based on a reading at most {ms:.0} ms old"
    )]
}

/// The state of a run that is going well.
fn so_far(system: &dyn System) -> String {
    match system.verdicts().first() {
        Some(well) if **well != VerdictKind::COMPLETED => {
            format!("{} so far", well.name.replace('_', " ").to_uppercase())
        }
        _ => "RUNNING".to_owned(),
    }
}
