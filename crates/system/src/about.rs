//! What a system says about its graph, as data, with rates that are fractions of others.

use std::{borrow::Cow, fmt, sync::Arc};

use ratelab::{Hz, Knob, TimedKnob};

use crate::{CHAINS, DataChain, FigureLimit, PlantRecord, Setup};

/// The description of a [`System`](super::System). Each part may be left out.
#[derive(Clone, Copy, Debug, Default)]
pub struct About<'s> {
    /// The topic of the plant's steps: each message gives a row of a table, a picture and
    /// a verdict.
    pub state: Option<&'s str>,
    /// The main latency, as a node and the name of its meter. It must measure the age of
    /// the [`origin`](ratelab::Message::origin) of each message of
    /// [`state`](Self::state) at its publication, so that it can be computed from a
    /// recording.
    pub latency: Option<(&'s str, &'s str)>,
    /// The function of nodes in a few words that begin with the verb, such as `sensor` and
    /// `reads the plant`.
    pub captions: &'static [(&'static str, &'static str)],
    /// Its settings. The settings of a run replace them.
    pub settings: &'s [Knob],
    /// What happens during its runs. Programs give it to a run as knobs.
    pub events: &'s [TimedKnob],
    /// The rates that follow others.
    pub dividers: &'s [Divider],
    /// The text of its [graph file](crate::graph_file). Recordings contain it.
    pub graph_file: Option<&'s str>,
    /// The robot in its middle that moves by itself. Recordings contain it.
    pub plant: Option<&'s PlantRecord>,
    /// Its chains, whose data ages are on the topic [`CHAINS`]: they count in the verdict.
    pub chains: &'s [DataChain],
    /// The limits for figures of its runs.
    pub limits: &'s [FigureLimit],
}

impl<'s> About<'s> {
    /// Returns the topics on the way of the data to the node of its latency, the sensor first; empty
    /// if the origin of each message tells it.
    pub fn latency_path(&self) -> &'s [String] {
        match self.chains.first() {
            Some(first) if self.state == Some(CHAINS) => first.topics(),
            _ => &[],
        }
    }

    /// Returns the function of `node`.
    pub fn caption(&self, node: &str) -> Option<&'static str> {
        self.captions
            .iter()
            .find(|(of, _)| *of == node)
            .map(|(_, text)| *text)
    }

    /// Returns its settings as the knobs of a run.
    pub fn setup(&self) -> Setup {
        self.settings.iter().cloned().collect()
    }

    /// Returns `knobs`, after what follows from each of them: a setup that they extend has what is set
    /// by itself.
    pub fn with_followers<'k>(
        &self,
        knobs: impl Iterator<Item = &'k Knob> + Clone,
    ) -> impl Iterator<Item = Knob> {
        knobs
            .clone()
            .flat_map(|knob| self.followers(knob))
            .chain(knobs.cloned())
    }

    /// Returns what follows from `knob` for other nodes.
    pub fn followers(&self, knob: &Knob) -> impl Iterator<Item = Knob> {
        self.dividers
            .iter()
            .filter_map(move |divider| divider.follow(knob))
    }
}

/// Nodes that share something beside topics.
#[derive(Clone, Debug)]
pub struct Group {
    /// Name of the group, such as `plant`.
    pub name: String,
    /// Names of its nodes. A run may lack some of them.
    pub nodes: Vec<String>,
}

impl Group {
    /// Creates the group called `name` of these nodes.
    pub fn new(name: impl Into<String>, nodes: impl IntoIterator<Item: Into<String>>) -> Self {
        Self {
            name: name.into(),
            nodes: nodes.into_iter().map(Into::into).collect(),
        }
    }
}

/// A quantity over time, from the messages of one recorded topic.
#[derive(Clone, Debug)]
pub struct Signal {
    /// Name, such as `pole angle`.
    pub name: Cow<'static, str>,
    /// Unit, such as `°`; empty if it has none.
    pub unit: Cow<'static, str>,
    /// Name of the topic.
    pub topic: Cow<'static, str>,
    /// Computes the quantity from a message's [`Fields`](ratelab_metrics::Fields).
    pub value: SignalValue,
    /// The least and the greatest value before the run is lost, if there are limits.
    pub limits: Option<[f64; 2]>,
    /// The range of its plot in normal operation: least and greatest.
    pub range: [f64; 2],
}

/// A quantity of a message.
#[derive(Clone)]
pub struct SignalValue(Arc<OfRow>);

type OfRow = dyn Fn(&[f64]) -> f64 + Send + Sync;

impl SignalValue {
    /// Computes the quantity by `value`.
    pub fn new(value: impl Fn(&[f64]) -> f64 + Send + Sync + 'static) -> Self {
        Self(Arc::new(value))
    }

    /// Computes the quantity from a message with the numbers `row`.
    pub fn compute(&self, row: &[f64]) -> f64 {
        (self.0)(row)
    }
}

impl fmt::Debug for SignalValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SignalValue")
    }
}

impl Signal {
    /// Returns whether `value` is beyond the limits.
    pub fn is_lost_at(&self, value: f64) -> bool {
        self.limits
            .is_some_and(|[least, greatest]| value < least || value > greatest)
    }
}

/// A node that ticks once in some ticks of another one, as the controllers of a controller manager.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Divider {
    /// Its name.
    pub node: String,
    /// Name of the other node.
    pub of: String,
    /// Number of the other node's ticks for each of its own.
    pub by: u64,
}

impl Divider {
    /// Returns the divider of `node` in a text such as `control / 10`; `None` if that is none.
    pub fn parse(node: &str, text: &str) -> Option<Self> {
        let (of, by) = text.split_once('/')?;
        let by = by.trim().parse().ok().filter(|by| *by > 0)?;
        Some(Self {
            node: node.to_owned(),
            of: of.trim().to_owned(),
            by,
        })
    }

    /// Returns its rate, rounded down to a microhertz, where the other node has the rate `of`;
    /// `None` if that is below all rates.
    pub fn rate(&self, of: Hz) -> Option<Hz> {
        let micro = of.as_micro() / self.by;
        (micro >= Hz::MIN.as_micro()).then(|| Hz::from_micro(micro))
    }

    /// Returns what follows from `knob` for the node.
    pub fn follow(&self, knob: &Knob) -> Option<Knob> {
        match knob {
            Knob::Rate { node, hz } if *node == self.of => Some(Knob::Rate {
                node: self.node.clone(),
                hz: self.rate(*hz)?,
            }),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rate(node: &str, hz: f64) -> Knob {
        Knob::Rate {
            node: node.to_owned(),
            hz: Hz::new(hz).expect("a rate"),
        }
    }

    fn tenth() -> Divider {
        Divider::parse("planner", "control / 10").expect("a divider")
    }

    #[test]
    fn a_divider_is_a_node_and_a_whole_number_from_one_on() {
        for (text, expected) in [
            ("control / 10", Some(("control", 10))),
            ("control/1", Some(("control", 1))),
            ("a b / 3", Some(("a b", 3))),
            ("control / 0", None),
            ("control / -2", None),
            ("control / 2.5", None),
            ("control /", None),
            ("control", None),
            ("10", None),
        ] {
            let found = Divider::parse("planner", text);
            let found = found.as_ref().map(|found| (&*found.of, found.by));
            assert_eq!(found, expected, "{text}");
        }
    }

    #[test]
    fn a_divided_rate_is_rounded_down_and_never_below_all_rates() {
        for (hz, by, expected) in [
            (100.0, 10, Some(10_000_000)),
            (10.0, 3, Some(3_333_333)),
            (0.001, 1, Some(1_000)),
            (0.001, 2, None),
        ] {
            let divider = Divider { by, ..tenth() };
            let found = divider.rate(Hz::new(hz).expect("a rate"));
            assert_eq!(found.map(Hz::as_micro), expected, "{hz} / {by}");
        }
    }

    #[test]
    fn a_divided_node_follows_the_rate_of_its_node_alone() {
        assert_eq!(
            tenth().follow(&rate("control", 50.0)),
            Some(rate("planner", 5.0))
        );
        assert_eq!(tenth().follow(&rate("camera", 50.0)), None);
        let crash = "crash control".parse().expect("a knob");
        assert_eq!(tenth().follow(&crash), None);
    }

    #[test]
    fn what_follows_from_a_knob_comes_before_it_so_that_the_node_s_own_rate_counts() {
        let dividers = [tenth()];
        let about = About {
            dividers: &dividers,
            ..About::default()
        };
        let own = [rate("planner", 7.0), rate("control", 50.0)];
        let all = about.with_followers(own.iter()).collect::<Setup>();
        assert_eq!(all.rate("planner").map(Hz::get), Some(7.0));
    }

    #[test]
    fn a_signal_is_lost_beyond_its_limits_and_never_without_any() {
        let signal = |limits| Signal {
            name: "angle".into(),
            unit: "°".into(),
            topic: "/state".into(),
            value: SignalValue::new(|row| row[0]),
            limits,
            range: [-1.0, 1.0],
        };
        for (value, lost) in [(-12.1, true), (-12.0, false), (12.0, false), (12.1, true)] {
            assert_eq!(
                signal(Some([-12.0, 12.0])).is_lost_at(value),
                lost,
                "{value}"
            );
            assert!(!signal(None).is_lost_at(value), "{value}");
        }
    }
}
