//! The cause of a loss, from measurements.
//!
//! The age of an action is the sum of its parts. The largest part has an owner, a node or
//! a link, and a knob of the owner is the cure.

mod age;
mod owner;
mod plan;
mod remedy;
mod rules;
mod trial;

use ratelab::{Knob, KnobKind, Time, TimeSpan, TimedKnob};
use ratelab_metrics::{AgeStage, LATELY, Lineage, Snapshot};
use ratelab_system::{Alias, Setup, System, acting_node, names};

pub use age::{AgeData, Strain};
pub use owner::Hang;
pub use plan::PlanFacts;
pub use remedy::{CauseLine, Effect, Remedy};
pub use rules::AgeOwner;
pub use trial::{Trial, Tried};

pub use crate::candidates::upstream;
use crate::millis::{ms, number};

/// A run that is lost, or may be lost soon.
pub struct Facts<'a> {
    /// Its system.
    pub system: &'a dyn System,
    /// Its knobs in force.
    pub setup: &'a Setup,
    /// The knobs that were turned since its start, in order.
    pub commands: &'a [TimedKnob],
    /// Whether it is lost.
    pub lost: bool,
    /// Its graph and counters.
    pub graph: &'a Snapshot,
    /// The chains behind its actions.
    pub lineage: &'a Lineage,
    /// Its recent push age, if known.
    pub age: Option<AgeData>,
    /// The stretch of run time of that age.
    pub late: TimeSpan,
    /// Its newest plan, if any.
    pub plan: Option<PlanFacts>,
    /// Its hangs.
    pub hangs: &'a [Hang],
    /// Number of aliases of rates, from the first, that whoever runs it raises by steps.
    pub stepped_rates: usize,
}

/// Number of causes that are told apart.
const MAX_CAUSES: usize = 3;

/// Share of the longest interval at which another one counts as equally long.
const AS_SLOW: f64 = 0.9;

impl Facts<'_> {
    /// Returns the knobs that would take the causes away, the most important first.
    pub fn cures(&self) -> Vec<Knob> {
        let acts = acting_node(self.system, self.lineage.topology())
            .filter(|_| self.system.judge().lost_anyway(self.setup).is_none());
        let causes = acts.map_or_else(Vec::new, |acts| self.causes(acts));
        causes.into_iter().map(|(_, cure)| cure).collect()
    }

    /// Returns the knobs that were turned since the start, as far as they are in force.
    pub fn turned(&self) -> Setup {
        self.commands
            .iter()
            .map(|timed| timed.knob.clone())
            .collect()
    }

    /// Returns the warnings of the system about a run with the knobs in force and one `more`.
    pub fn warnings(&self, more: Option<Knob>) -> Vec<String> {
        let mut setup = self.system.about().setup();
        setup.extend(self.setup.iter().cloned().chain(more));
        self.system.warnings(&setup)
    }

    /// Returns the cause of the loss and its cure, in short lines; empty for a system without an
    /// age. What was `tried` is what the [cures](Self::cures) did.
    pub fn cause(&self, tried: Option<&Tried>) -> Vec<CauseLine> {
        let Some(acts) = acting_node(self.system, self.lineage.topology()) else {
            return Vec::new();
        };
        let causes = self.causes(acts);
        let of_these = |tried: &&Tried| tried.cures.iter().eq(causes.iter().map(|(_, cure)| cure));
        let tried = tried.filter(of_these);
        let needed = tried.and_then(|tried| tried.needed.as_deref());
        let (hopeless, fresh) = (self.system.judge().lost_anyway(self.setup), self.fresh());
        if hopeless.is_some() || (fresh.is_some() && needed.is_none()) {
            let why = hopeless.unwrap_or_else(|| self.not_held());
            let parts: Vec<String> = fresh.into_iter().chain([why]).collect();
            let remedy = self.choice().map(|_| Remedy::OtherMessage);
            return vec![CauseLine {
                text: parts.join(": "),
                remedy,
            }];
        }
        let needed = needed.unwrap_or_default().iter();
        let needed: Vec<AgeOwner> = needed.map(|index| causes[*index].0).collect();
        let mut owners = self.main_owners(acts);
        // Of what may be wrong with a plan only that counts without which it is mended.
        if !needed.is_empty() && owners.iter().any(|owner| owner.is_of_plans()) {
            owners.retain(|owner| needed.contains(owner));
        }
        let mut lines = lines(&owners, &needed, |owner| {
            let place = causes.iter().position(|(known, _)| *known == owner);
            self.blame(owner, tried, place)
        });
        if lines.is_empty() {
            lines.push("no action was applied in the last second".to_owned().into());
        }
        let symptom = owners.iter().find_map(|owner| self.symptom(*owner));
        lines.extend(
            self.how_old()
                .into_iter()
                .chain(symptom)
                .map(CauseLine::from),
        );
        lines
    }

    /// Returns the owners of the age with a knob that takes their part away, the most important
    /// first, and then what spoils a run at any age.
    fn causes(&self, acts: usize) -> Vec<(AgeOwner, Knob)> {
        let mut owners = self.main_owners(acts);
        let most = owners.len().max(MAX_CAUSES);
        if self.fresh().is_none() {
            let others = self.owners(acts).into_iter().map(|(owner, _)| owner);
            owners.extend(others);
        }
        owners.extend(self.spoiled());
        let mut causes: Vec<(AgeOwner, Knob)> = Vec::new();
        for owner in owners {
            let cure = self.cure(owner).filter(|cure| !self.was_turned(cure));
            if let Some(cure) = cure.filter(|cure| causes.iter().all(|(_, known)| known != cure)) {
                causes.push((owner, cure));
            }
        }
        causes.truncate(most);
        causes
    }

    /// Returns the owners that plan badly, or else the owner of the largest part of an age; for a
    /// slow node, also the nodes that are equally slow.
    pub fn main_owners(&self, acts: usize) -> Vec<AgeOwner> {
        let planners = self.planners();
        if !planners.is_empty() || self.fresh().is_some() {
            return planners;
        }
        let owners = self.owners(acts);
        let Some(&(first, _)) = owners.first() else {
            let mut path = before(self.lineage, acts);
            path.push(acts);
            return self.unreached(&path);
        };
        let AgeOwner::Rate(slowest) = first else {
            return vec![first];
        };
        let slow = self.pace(slowest).mul_f64(AS_SLOW);
        let slow = before(self.lineage, acts)
            .into_iter()
            .filter(|node| self.pace(*node) >= slow);
        let mut slow: Vec<AgeOwner> = slow.map(AgeOwner::Rate).collect();
        if !slow.contains(&first) {
            slow.insert(0, first);
        }
        slow
    }

    /// States that age is not the cause, if it is below the limit of the loop.
    fn fresh(&self) -> Option<String> {
        let age = self.age?;
        let limit = age.limit()?;
        let fresh = age.true_strain() == Strain::Borne && age.greatest < limit;
        let mean = number(age.mean);
        let limit = age.limit_text(number);
        let of = limit.map_or_else(String::new, |limit| format!(" of {limit}"));
        fresh.then(|| format!("age is not to blame ({mean} ms{of})"))
    }

    /// States that the message in force, such as a policy, does not hold the system.
    fn not_held(&self) -> String {
        match self.choice() {
            Some(alias) => {
                let value = names::short_value(self.system, alias, self.setup);
                format!("{} {value} does not hold it", alias.name)
            }
            None => "what decides does not hold it".to_owned(),
        }
    }

    /// Returns the alias of the messages to choose from.
    fn choice(&self) -> Option<&'static Alias> {
        let alias = names::first_alias(self.system, KnobKind::Send);
        alias.filter(|alias| !alias.choices.is_empty())
    }

    /// Returns the age of readings, beside the limit of the loop.
    fn how_old(&self) -> Option<String> {
        let age = self.age?;
        let (greatest, mean) = (ms(age.greatest), number(age.mean));
        let predicted = number(age.mean - age.unpredicted());
        let known = match &*predicted {
            "0" => String::new(),
            predicted => format!(", of which plans knew {predicted}"),
        };
        let text = format!("pushes used readings up to {greatest} old, {mean} on average{known}");
        Some(match age.limit_text(number) {
            Some(limit) => format!("{text}; its limit is {limit}"),
            None => text,
        })
    }

    /// Returns the symptom at the queue of a slow node.
    fn symptom(&self, owner: AgeOwner) -> Option<String> {
        let (AgeOwner::Rate(node) | AgeOwner::Stage(AgeStage::Cost(node))) = owner else {
            return None;
        };
        let input = self
            .graph
            .topics
            .iter()
            .find(|topic| topic.readers.iter().any(|r| r.node == node))?;
        let slower = input
            .publishers
            .iter()
            .map(|node| self.graph.nodes[*node].hz.period())
            .min()?
            < self.graph.nodes[node].hz.period();
        match (input.dropped(), input.depth.get()) {
            (0, 1) => None,
            (0, depth) => slower.then(|| format!("a queue of {depth} dropped nothing")),
            (dropped, _) => Some(format!(
                "{dropped} readings were dropped, each for a newer one"
            )),
        }
    }
}

/// Returns a line for each main owner, and for each other cause without which it is not mended.
fn lines(
    owners: &[AgeOwner],
    needed: &[AgeOwner],
    blame: impl Fn(AgeOwner) -> CauseLine,
) -> Vec<CauseLine> {
    let others = needed.iter().filter(|owner| !owners.contains(owner));
    let line = |(number, owner): (usize, &AgeOwner)| {
        let mut line = blame(*owner);
        if let Some(rest) = line.text.strip_prefix("age comes")
            && number > 0
            && !owners.contains(owner)
        {
            line.text = format!("and{rest}");
        }
        line
    };
    owners.iter().chain(others).enumerate().map(line).collect()
}

/// Returns the stretch of run time whose `age` is explained; without an age the latest one.
pub fn late(
    system: &dyn System,
    graph: &Snapshot,
    lineage: &Lineage,
    age: Option<AgeData>,
) -> TimeSpan {
    match (age, acting_node(system, lineage.topology())) {
        (Some(age), _) => age.stretch,
        (None, Some(acts)) => latest(graph, lineage, acts),
        (None, None) => TimeSpan::new(Time::ZERO, graph.now),
    }
}

/// Returns the last second of a run, or the last two periods of the slowest node on the path to
/// `acts` if that is longer; never before the first push.
pub fn latest(graph: &Snapshot, lineage: &Lineage, acts: usize) -> TimeSpan {
    let periods = before(lineage, acts)
        .into_iter()
        .map(|node| graph.nodes[node].hz.period());
    let window = LATELY.max(periods.max().unwrap_or_default() * 2);
    let from = graph.now - window;
    TimeSpan::new(from.max(lineage.first_push(acts)), graph.now)
}

/// Returns the nodes whose messages reach the one that acts, in the order in which they were added.
fn before(lineage: &Lineage, acts: usize) -> Vec<usize> {
    let mut path = upstream(lineage.topology(), acts);
    path.remove(0);
    path.sort_unstable();
    path
}
