//! The rules: each reason of an old age with its place, its words and its remedy.

use std::time::Duration;

use ratelab::{Hz, Knob, KnobKind};
use ratelab_metrics::AgeStage;
use ratelab_system::{Alias, Spoiler, acting_node};

use super::{CauseLine, Effect, Facts, Remedy, Tried};
use crate::{candidates, millis::ms};

/// Recent messages of a link from which on a share of them is told.
const ENOUGH: usize = 100;

/// What an age is due to, with the index of the node or topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AgeOwner {
    /// What makes data old at a stage by itself: long ticks, an executor, a link, a queue that is read
    /// from its old end, messages that come later than their matches.
    Stage(AgeStage),
    /// A node has too low a rate.
    Rate(usize),
    /// A node hung in one tick.
    Hang(usize),
    /// A node ticks late.
    Late(usize),
    /// A node crashed.
    Crash(usize),
    /// A node has a clock error.
    Clock(usize),
    /// A node has a phase shift against the others.
    Phase(usize),
    /// A node has no action to play: its plan was over before the next came.
    Stall(usize),
    /// Plans came after another delay than a node had expected.
    Delay(usize),
    /// A parameter of a node.
    Spoiler {
        /// The node.
        node: usize,
        /// The place of the parameter in the list of the system.
        number: usize,
    },
}

/// The kind of the knob that takes a reason away, and where the age comes from.
type CauseRule = (Option<KnobKind>, fn(&Facts<'_>, AgeOwner) -> String);

impl AgeOwner {
    /// Returns the index of its node, or of its topic.
    pub(super) fn place(self) -> usize {
        match self {
            Self::Stage(stage) => stage.place(),
            Self::Rate(node)
            | Self::Hang(node)
            | Self::Late(node)
            | Self::Crash(node)
            | Self::Clock(node)
            | Self::Phase(node)
            | Self::Stall(node)
            | Self::Delay(node)
            | Self::Spoiler { node, .. } => node,
        }
    }

    /// Returns whether plans may be wrong for it, which a trial alone can tell.
    pub(super) fn is_of_plans(self) -> bool {
        matches!(self, Self::Stall(_) | Self::Delay(_) | Self::Spoiler { .. })
    }

    fn rule(self) -> CauseRule {
        match self {
            Self::Rate(_) => (None, slow_pace),
            Self::Stage(AgeStage::Cost(_)) => (Some(KnobKind::Takes), long_ticks),
            Self::Hang(_) => (Some(KnobKind::Hang), |facts, of| {
                let (name, took) = (facts.name(of), facts.hang(of.place()).unwrap_or_default());
                let took = ms(took);
                format!("age comes from the {name}: it hung, one tick took {took}")
            }),
            Self::Late(_) => (Some(KnobKind::Wakes), |facts, of| {
                format!("age comes from the {}: it wakes late", facts.name(of))
            }),
            Self::Stage(AgeStage::Executor(_)) => (None, busy_executor),
            Self::Crash(_) => (Some(KnobKind::Restart), end_of_messages),
            Self::Clock(_) => (Some(KnobKind::Clock), |facts, of| {
                let (name, every) = (facts.name(of), ms(facts.interval(of.place())));
                format!("age comes from the {name}: by its wrong clock it ticks every {every}")
            }),
            Self::Phase(_) => (Some(KnobKind::Offset), |_, _| {
                "age comes from messages that wait for ticks".to_owned()
            }),
            Self::Stage(AgeStage::Link(_)) => (Some(KnobKind::Link), slow_link),
            Self::Stage(AgeStage::Queue(_)) => (Some(KnobKind::Read), |facts, of| {
                let (name, depth) = (facts.name(of), facts.graph.topics[of.place()].depth);
                format!(
                    "age comes from the queue of {name}: it is read from the old end, {depth} \
                     deep"
                )
            }),
            Self::Stage(_) => (None, late_match),
            Self::Stall(_) => (None, no_action),
            Self::Delay(_) => (None, |facts, of| {
                let missed = facts.plan.and_then(|plan| plan.missed).unwrap_or_default();
                let (name, [expected, delay]) = (facts.name(of), missed.map(ms));
                format!(
                    "the {name} predicts wrongly: it expected a delay of {expected}, not {delay}"
                )
            }),
            Self::Spoiler { .. } => (None, |facts, of| {
                let spoiler = facts.spoiler(of);
                spoiler.map_or_else(String::new, |it| it.told.replace("{}", facts.value(it)))
            }),
        }
    }
}

fn slow_pace(facts: &Facts<'_>, owner: AgeOwner) -> String {
    let (name, node) = (facts.name(owner), owner.place());
    let (period, changed) = (
        facts.graph.nodes[node].hz.period(),
        facts.rate_changed(node),
    );
    let every = match (changed, facts.graph.nodes[node].overruns) {
        // A mean over the change would be a rate that never was.
        (Some(_), _) => period,
        (None, 0) => facts.pace(node),
        (None, _) => facts.interval(node),
    };
    let since = changed.map_or_else(String::new, |at| {
        let only = if facts.pace(node) > period {
            "only "
        } else {
            ""
        };
        format!(", {only}since {at}")
    });
    let mut topics = facts.graph.topics.iter();
    let mut read = topics.clone().flat_map(|topic| &topic.readers);
    let output = topics.find(|topic| topic.publishers.contains(&node) && !topic.readers.is_empty());
    let origin = match (read.any(|reader| reader.node == node), output) {
        (true, Some(topic)) => {
            format!("{}: the {name} decides every {}", topic.name, ms(every))
        }
        (true, None) => format!("the {name}: it acts every {}", ms(every)),
        (false, _) => {
            let times = (10.0 / every.as_secs_f64()).round() / 10.0;
            format!("the {name}: it looks {times} times a second")
        }
    };
    format!("age comes from {origin}{since}")
}

fn long_ticks(facts: &Facts<'_>, owner: AgeOwner) -> String {
    let (name, every) = (facts.name(owner), ms(facts.interval(owner.place())));
    let time = facts.time().as_secs_f64();
    let busy = (facts.busy(owner.place()).as_secs_f64() / time * 100.0).min(100.0);
    format!(
        "age comes from the {name}: its ticks take {busy:.0} % of the time and come every \
         {every}"
    )
}

fn busy_executor(facts: &Facts<'_>, of: AgeOwner) -> String {
    let (name, share) = (facts.name(of), facts.share(of));
    let executor = facts.graph.nodes[of.place()]
        .executor
        .as_ref()
        .map(ToString::to_string)
        .unwrap_or_default();
    format!(
        "age comes from the {name}, which waits for its executor {executor}{share}: quicker \
         nodes in it help, or another executor"
    )
}

fn late_match(facts: &Facts<'_>, of: AgeOwner) -> String {
    let waits = match of {
        AgeOwner::Stage(AgeStage::Match { node, .. }) => &*facts.graph.nodes[node].name,
        _ => "",
    };
    let (other, share) = (facts.name(of), facts.share(of));
    format!(
        "age comes from the {waits}, which waits for {other}, to match{share}: what makes \
         {other} come sooner helps"
    )
}

/// Stalls, and how long the plans are.
fn no_action(facts: &Facts<'_>, of: AgeOwner) -> String {
    let (name, plan) = (facts.name(of), facts.plan);
    let [actions, needed] = plan.map_or([0; 2], |plan| [plan.actions, plan.needed]);
    format!(
        "age comes from the {name}: it had no action, as plans have {actions} and the next one \
         came after {needed}"
    )
}

/// Returns a crash, before the first message or after it.
fn end_of_messages(facts: &Facts<'_>, owner: AgeOwner) -> String {
    let name = facts.name(owner);
    let sent = facts
        .graph
        .topics
        .iter()
        .any(|topic| topic.publishers.contains(&owner.place()) && topic.published > 0);
    if sent {
        format!("the {name} crashed: its last message stays in use")
    } else {
        format!("the {name} crashed before its first message")
    }
}

fn slow_link(facts: &Facts<'_>, owner: AgeOwner) -> String {
    let (name, delay) = (facts.name(owner), facts.delay(owner.place()));
    let takes = format!("takes {}", ms(delay));
    let what = match (losses(facts.lost(owner.place())), delay.is_zero()) {
        (Some(loses), true) => loses,
        (Some(loses), false) => format!("{takes} and {loses}"),
        (None, _) => takes,
    };
    format!("age comes from {name}: its link {what}")
}

impl Facts<'_> {
    /// Returns the name of the node or the topic of `owner`.
    pub fn name(&self, owner: AgeOwner) -> &str {
        match owner {
            AgeOwner::Stage(stage) => stage.owner(self.lineage.topology()),
            _ => &self.graph.nodes[owner.place()].name,
        }
    }

    /// Returns the knob that takes the part of `owner` away; `None` where there is none.
    pub(super) fn cure(&self, owner: AgeOwner) -> Option<Knob> {
        let name = self.name(owner);
        let (remedy, _) = owner.rule();
        let remedy = remedy.and_then(|kind| candidates::without(kind, name));
        match owner {
            AgeOwner::Rate(_) => self.usual_rate(name).or_else(|| self.twice_the_rate(owner)),
            AgeOwner::Stall(_) => Some((self.system.robot().planning()?.longer)(self.plan?.needed)),
            AgeOwner::Delay(_) => {
                let cure = (self.system.robot().planning()?.expecting)(self.plan?.delay);
                Some(cure).filter(|cure| self.setup.iter().all(|knob| knob != cure))
            }
            AgeOwner::Spoiler { .. } => {
                let Spoiler { name, sound, .. } = self.spoiler(owner)?;
                Some(Knob::Parameter {
                    node: self.name(owner).to_owned(),
                    name: (*name).to_owned(),
                    value: (*sound).to_owned(),
                })
            }
            // Without a knob ticks take the time that they need.
            AgeOwner::Stage(AgeStage::Cost(_)) => remedy.filter(|cure| {
                let is_set = self
                    .setup
                    .iter()
                    .any(|knob| knob.target() == name && knob.takes_time());
                is_set || self.was_turned(cure)
            }),
            _ => remedy,
        }
    }

    fn spoiler(&self, owner: AgeOwner) -> Option<&'static Spoiler> {
        match owner {
            AgeOwner::Spoiler { number, .. } => {
                self.system.robot().planning()?.spoilers.get(number)
            }
            _ => None,
        }
    }

    /// Returns the rate of node `name` at the start of a usual run, if it is higher.
    fn usual_rate(&self, name: &str) -> Option<Knob> {
        let alias = self
            .system
            .knobs()
            .aliases()
            .iter()
            .find(|alias| alias.knobs == [(KnobKind::Rate, name)])?;
        let hz: Hz = alias.default.parse().ok()?;
        let node = name.to_owned();
        (hz.get() > self.graph.node(name)?.hz.get()).then_some(Knob::Rate { node, hz })
    }

    /// Returns twice the rate of the node of `owner`, if no step raises it and there is time.
    fn twice_the_rate(&self, owner: AgeOwner) -> Option<Knob> {
        let (node, view) = (owner.place(), &self.graph.nodes[owner.place()]);
        let is_timed = view.triggers.is_empty();
        let steps = self.stepped_rate(&view.name).is_some();
        let hz = candidates::twice(view.hz)?;
        (is_timed && !steps && self.has_time(node)).then(|| Knob::Rate {
            node: view.name.to_string(),
            hz,
        })
    }

    /// Returns whether `knob` was turned since the start, and is in force.
    pub(super) fn was_turned(&self, knob: &Knob) -> bool {
        self.turned().iter().any(|turned| turned == knob)
    }

    /// Returns the stage that the age comes from, and its cure, which has index `place` in the cures
    /// that were `tried`.
    pub(super) fn blame(
        &self,
        owner: AgeOwner,
        tried: Option<&Tried>,
        place: Option<usize>,
    ) -> CauseLine {
        let (_, told) = owner.rule();
        let remedy = match (owner, self.cure(owner)) {
            (AgeOwner::Rate(_), cure) => self.faster(owner, cure, tried, place),
            (_, Some(cure)) if self.was_turned(&cure) => Some(Remedy::Known(if self.lost {
                format!("{cure} came too late")
            } else {
                format!("{cure} is in force now")
            })),
            (_, Some(cure)) => Some(Remedy::Turn(cure, Effect::new(tried, place))),
            (AgeOwner::Stage(AgeStage::Cost(_)), None) => {
                Some(Remedy::Known("try a faster one".to_owned()))
            }
            (_, None) => None,
        };
        CauseLine {
            text: told(self, owner),
            remedy,
        }
    }

    /// Returns how to raise the rate of the node of `owner`: by steps, or by a `cure` that was
    /// `tried`; `None` for a node without a rate of its own.
    fn faster(
        &self,
        owner: AgeOwner,
        cure: Option<Knob>,
        tried: Option<&Tried>,
        place: Option<usize>,
    ) -> Option<Remedy> {
        let name = self.name(owner);
        let is_its_rate = |knob: &_| Knob::kind(knob) == KnobKind::Rate && knob.target() == name;
        let raised = self.turned().iter().any(is_its_rate)
            && self.pace(owner.place()) > self.graph.nodes[owner.place()].hz.period();
        if !self.has_time(owner.place()) {
            let load = "There is no time for a higher rate: lower the load first";
            return Some(Remedy::Known(load.to_owned()));
        }
        if raised {
            let alias = self.rate_alias(name);
            let setting =
                alias.map_or_else(|| format!("rate {name}"), |(_, it)| it.name.to_owned());
            return Some(Remedy::Known(if self.lost {
                format!("{setting} was raised too late")
            } else {
                format!("{setting} was raised: the age falls now")
            }));
        }
        match self.stepped_rate(name) {
            Some((place, alias)) => Some(Remedy::Raise {
                place,
                name: alias.name,
            }),
            None => Some(Remedy::Turn(cure?, Effect::new(tried, place))),
        }
    }

    /// Returns whether a higher rate of the node asks nothing for more than there is time for.
    fn has_time(&self, node: usize) -> bool {
        let node = &self.graph.nodes[node];
        let Ok(hz) = Hz::new(node.hz.get() * 1.25) else {
            return true;
        };
        self.warnings(Some(Knob::Rate {
            node: node.name.to_string(),
            hz,
        })) == self.warnings(None)
    }

    /// Returns the alias of the rate of `node`, and its place among the aliases of rates.
    fn rate_alias(&self, node: &str) -> Option<(usize, &Alias)> {
        self.system
            .knobs()
            .aliases()
            .iter()
            .filter(|alias| alias.kind() == KnobKind::Rate)
            .enumerate()
            .find(|(_, alias)| alias.knobs == [(KnobKind::Rate, node)])
    }

    /// Returns the same for a rate that is raised by steps.
    fn stepped_rate(&self, node: &str) -> Option<(usize, &Alias)> {
        self.rate_alias(node)
            .filter(|(number, _)| *number < self.stepped_rates)
    }

    /// Returns the share of `owner` in the age, in parentheses.
    fn share(&self, owner: AgeOwner) -> String {
        let owners = acting_node(self.system, self.lineage.topology())
            .map(|acts| self.owners(acts))
            .unwrap_or_default();
        let all: Duration = owners.iter().map(|(_, took)| *took).sum();
        let own = owners.iter().find(|(known, _)| *known == owner);
        own.filter(|_| !all.is_zero())
            .map_or_else(String::new, |(_, took)| {
                let share = took.as_secs_f64() / all.as_secs_f64() * 100.0;
                format!(" ({share:.0} % of it)")
            })
    }
}

/// Returns what a link did to its recent messages, if it lost any: a share of a few of them says
/// little, so that they are counted.
fn losses((lost, sent): (usize, usize)) -> Option<String> {
    let share = || 100.0 * lost as f64 / sent as f64;
    (lost > 0).then(|| {
        if sent < ENOUGH {
            format!("lost {lost} of {sent}")
        } else {
            format!("loses {:.0} % of {sent} messages", share())
        }
    })
}

#[cfg(test)]
mod tests {
    use super::losses;

    #[test]
    fn a_share_is_told_of_many_messages_and_few_are_counted() {
        for (lost, told) in [
            ((0, 20), None),
            ((20, 20), Some("lost 20 of 20")),
            ((90, 99), Some("lost 90 of 99")),
            ((90, 100), Some("loses 90 % of 100 messages")),
        ] {
            assert_eq!(losses(lost).as_deref(), told);
        }
    }
}
