//! The words for each owner of an age, and for what its cure does.

use ratelab::{Hz, Knob, KnobKind};
use ratelab_effects::takes_time;
use ratelab_study::system::System;

use super::{Facts, Owner, Tried, acting, ms, number};
use std::time::Duration;

/// The keys that raise the rates of the first aliases.
const RATE_KEYS: [char; 2] = [']', '}'];

/// Recent messages of a link from which on a share of them is told.
const ENOUGH: usize = 100;

/// What a cure did where it was tried.
#[derive(Clone, Copy)]
pub enum Effect {
    /// It was not tried.
    Untried,
    /// It mends the run.
    Mends,
    /// It does together with those before it.
    MendsToo,
    /// It is not enough: the age without it and with it.
    FallsShort(Option<[Duration; 2]>),
    /// It does nothing for the run beside the others.
    Idle,
}

impl Effect {
    /// The effect of the cure with index `place` among those that were `tried`.
    pub fn of(tried: Option<&Tried>, place: Option<usize>) -> Self {
        let (Some(tried), Some(place)) = (tried, place) else {
            return Self::Untried;
        };
        match tried.needed.as_deref() {
            Some([only]) if *only == place => Self::Mends,
            Some([first, ..]) if *first == place && place == 0 => Self::FallsShort(tried.ages),
            Some(needed) if needed.contains(&place) => Self::MendsToo,
            Some(_) => Self::Idle,
            None if place == 0 => Self::FallsShort(tried.ages),
            None => Self::FallsShort(None),
        }
    }

    /// A sentence about `cure`.
    fn told(self, cure: &str) -> String {
        match self {
            Self::Untried => format!("try {cure}"),
            Self::Mends => format!("{cure} mends it"),
            Self::MendsToo => format!("{cure}, too, mends it"),
            Self::FallsShort(Some([before, after])) if after < before => {
                let taken = number(before - after);
                format!("{cure} takes {taken} of {} away", ms(before))
            }
            Self::FallsShort(_) | Self::Idle => format!("{cure} alone is not enough"),
        }
    }
}

impl Facts<'_> {
    /// The knob that takes the part of `owner` away; `None` where there is none.
    pub(super) fn cure(&self, owner: Owner) -> Option<Knob> {
        let text = match owner {
            Owner::Rate(node) => return self.usual_rate(node),
            Owner::Cost(node) => {
                let (name, none) = (self.node(node), format!("takes {} none", self.node(node)));
                let cured = self.is_set_to_take(name) || self.was_turned(&none.parse().ok()?);
                cured.then_some(none)?
            }
            Owner::Hang(node) => format!("hang {} 0", self.node(node)),
            Owner::Late(node) if self.graph.nodes[node].executor.is_some() => return None,
            Owner::Late(node) => format!("wakes {} none", self.node(node)),
            Owner::Crash(node) => format!("restart {}", self.node(node)),
            Owner::Clock(node) => format!("clock {} 0 0", self.node(node)),
            Owner::Phase(node) => format!("offset {} 0", self.node(node)),
            Owner::Link(topic) => format!("link {} none", self.topic(topic)),
            Owner::Order(topic) => format!("read {} newest", self.topic(topic)),
            Owner::Match(..) => return None,
        };
        text.parse().ok()
    }

    /// The rate of `node` at the start of a usual run, if it is higher.
    fn usual_rate(&self, node: usize) -> Option<Knob> {
        let name = self.node(node);
        let mut aliases = self.system.aliases().iter();
        let alias = aliases.find(|alias| alias.knobs == [(KnobKind::Rate, name)])?;
        let hz: Hz = alias.default.parse().ok()?;
        let node = name.to_owned();
        (hz.get() > self.graph.node(name)?.hz.get()).then_some(Knob::Rate { node, hz })
    }

    /// Whether a knob sets the duration of the ticks of `node`; without one they take the
    /// time that they need.
    fn is_set_to_take(&self, node: &str) -> bool {
        let mut knobs = self.setup.iter();
        knobs.any(|knob| knob.target() == node && takes_time(knob))
    }

    /// Whether `knob` was turned since the start, and is in force.
    pub(super) fn was_turned(&self, knob: &Knob) -> bool {
        self.turned.iter().any(|turned| turned == knob)
    }

    /// The stage in which the age arose, and its cure with its `effect`.
    pub(super) fn blame(&self, owner: Owner, effect: Effect) -> String {
        let arose = match owner {
            Owner::Rate(node) => return self.blame_rate(node),
            Owner::Cost(node) => return self.blame_cost(node, effect),
            Owner::Match(topic, node) => {
                let (name, other) = (self.node(node), self.topic(topic));
                let share = self.share(owner);
                return format!(
                    "the age arose as the {name} waits for {other}, to match{share}: what makes \
                     {other} come sooner helps"
                );
            }
            Owner::Late(node) => {
                let name = self.node(node);
                if let Some(executor) = self.graph.nodes[node].executor {
                    let share = self.share(owner);
                    return format!(
                        "the age arose as the {name} waits for its executor {executor}{share}: \
                         quicker nodes in it help, or another executor"
                    );
                }
                format!("the age arose in the {name}: it wakes late")
            }
            Owner::Hang(node) => {
                let (name, cost) = (self.node(node), self.hang(node).unwrap_or_default());
                format!(
                    "the age arose in the {name}: it hung, one tick took {}",
                    ms(cost)
                )
            }
            Owner::Crash(node) => self.blame_crash(node),
            Owner::Clock(node) => {
                let (name, every) = (self.node(node), ms(self.interval(node)));
                format!("the age arose in the {name}: by its wrong clock it ticks every {every}")
            }
            Owner::Phase(_) => "the age arose as messages wait for ticks".to_owned(),
            Owner::Link(topic) => {
                let name = self.topic(topic);
                let delay = self.delay(topic);
                let what = match (losses(self.lost(topic)), delay.is_zero()) {
                    (Some(loses), true) => loses,
                    (Some(loses), false) => format!("takes {} and {loses}", ms(delay)),
                    (None, _) => format!("takes {}", ms(delay)),
                };
                format!("the age arose on {name}: its link {what}")
            }
            Owner::Order(topic) => {
                let (name, depth) = (self.topic(topic), self.graph.topics[topic].depth);
                format!(
                    "the age arose in the queue of {name}: it is read from the old end, {depth} \
                     deep"
                )
            }
        };
        match self.cure(owner) {
            Some(cure) => format!("{arose}. {}", self.advice(&cure, effect)),
            None => arose,
        }
    }

    /// A crash, before the first message or after it.
    fn blame_crash(&self, node: usize) -> String {
        let name = self.node(node);
        let mut sent = self.graph.topics.iter();
        let published = sent.any(|topic| topic.publishers.contains(&node) && topic.published > 0);
        match published {
            true => format!("the {name} crashed: its last message stays in use"),
            false => format!("the {name} crashed before its first message"),
        }
    }

    fn blame_cost(&self, node: usize, effect: Effect) -> String {
        let (name, every) = (self.node(node), ms(self.interval(node)));
        let time = self.time().as_secs_f64();
        let busy = (self.busy(node).as_secs_f64() / time * 100.0).min(100.0);
        let advice = match self.cure(Owner::Cost(node)) {
            Some(cure) => self.advice(&cure, effect),
            None => "try a faster one".to_owned(),
        };
        format!(
            "the age arose in the {name}: its ticks take {busy:.0} % of the time and come every \
             {every}. {advice}"
        )
    }

    /// Names `cure`; where keys turn knobs, with the key of the prompt.
    fn advice(&self, cure: &Knob, effect: Effect) -> String {
        if self.was_turned(cure) {
            return format!("{cure} came too late");
        }
        let key = if self.live { ":" } else { "" };
        effect.told(&format!("{key}{cure}"))
    }

    /// The share of an owner in the age, in parentheses.
    fn share(&self, owner: Owner) -> String {
        let owners = acting(self.system, self.graph).map(|acts| self.owners(acts));
        let owners = owners.unwrap_or_default();
        let all: Duration = owners.iter().map(|(_, took)| *took).sum();
        let own = owners.iter().find(|(known, _)| *known == owner);
        own.filter(|_| !all.is_zero())
            .map_or_else(String::new, |(_, took)| {
                let share = took.as_secs_f64() / all.as_secs_f64() * 100.0;
                format!(" ({share:.0} % of it)")
            })
    }

    /// Whether a higher rate of the node asks nothing for more than there is time for.
    fn has_time(&self, node: usize) -> bool {
        let node = &self.graph.nodes[node];
        let Ok(hz) = Hz::new(node.hz.get() * 1.25) else {
            return true;
        };
        let mut setup = self.system.about().setup();
        setup.extend(self.setup.iter().cloned());
        let now = self.system.warnings(&setup);
        let node = node.name.to_string();
        setup.extend([Knob::Rate { node, hz }]);
        self.system.warnings(&setup) == now
    }

    fn blame_rate(&self, node: usize) -> String {
        let name = self.node(node);
        let every = match self.graph.nodes[node].overruns {
            0 => self.pace(node),
            _ => self.interval(node),
        };
        let (setting, key) = rate_setting(self.system, name);
        let mut turned = self.turned.iter();
        let raised = turned.any(|knob| knob.kind() == KnobKind::Rate && knob.target() == name)
            && self.pace(node) > self.graph.nodes[node].hz.period();
        let cure = match key.filter(|_| self.live) {
            _ if !self.has_time(node) => {
                "There is no time for a higher rate: lower the load first".to_owned()
            }
            _ if raised => format!("{setting} was raised too late"),
            Some(key) => format!("{key} raises {setting}"),
            None => format!("raise {setting}"),
        };
        let topics = self.graph.topics.iter();
        let reads = topics
            .clone()
            .any(|topic| topic.readers.iter().any(|reader| reader.node == node));
        let mut outputs =
            topics.filter(|topic| topic.publishers.contains(&node) && !topic.readers.is_empty());
        let arose = match (reads, outputs.next()) {
            (true, Some(topic)) => {
                format!("on {}: the {name} decides every {}", topic.name, ms(every))
            }
            (true, None) => format!("in the {name}: it acts every {}", ms(every)),
            (false, _) => {
                let times = (10.0 / every.as_secs_f64()).round() / 10.0;
                format!("at the {name}: it looks {times} times a second")
            }
        };
        format!("the age arose {arose}. {cure}")
    }
}

/// What a link did to its recent messages, if it lost any: a share of a few of them says
/// little, so that they are counted.
fn losses((lost, sent): (usize, usize)) -> Option<String> {
    let share = || 100.0 * lost as f64 / sent as f64;
    (lost > 0).then(|| match sent < ENOUGH {
        true => format!("lost {lost} of {sent}"),
        false => format!("loses {:.0} % of {sent} messages", share()),
    })
}

/// The name of the rate of `node`, and the key that raises it.
fn rate_setting(system: &dyn System, node: &str) -> (String, Option<char>) {
    let aliases = system.aliases().iter();
    let mut rates = aliases
        .filter(|alias| alias.kind() == KnobKind::Rate)
        .enumerate();
    let alias = rates.find(|(_, alias)| alias.knobs == [(KnobKind::Rate, node)]);
    match alias {
        Some((number, alias)) => (alias.name.to_owned(), RATE_KEYS.get(number).copied()),
        None => (format!("rate {node}"), None),
    }
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
