//! Rates that are fractions of others.

use ratelab::{Hz, Knob};

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
