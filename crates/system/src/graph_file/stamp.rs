//! Whose header stamp the messages of a node have, which `match` compares.

use ratelab::KnobKind;

use super::{
    GraphFile, HeaderStamp, NodeSpec,
    document::Block,
    error::{Checked, Placed, instead, refuse},
};
use crate::Setup;

/// The beginning of its tick, as a value of the key `stamp`.
const NOW: &str = "now";

impl HeaderStamp {
    /// That of the node in `block`, which reads the `inputs`.
    pub(super) fn read<'b>(
        block: &Block,
        mut inputs: impl Iterator<Item = &'b Placed> + Clone,
    ) -> Checked<Self> {
        let Some(Placed { text, at }) = block.text("stamp") else {
            return Ok(inputs.next().map_or(Self::Now, |_| Self::Of(0)));
        };
        if text == NOW {
            return Ok(Self::Now);
        }
        match inputs.clone().position(|topic| topic.text == *text) {
            Some(input) => Ok(Self::Of(input)),
            None => {
                let known = inputs.map(|topic| &*topic.text).chain([NOW]);
                let (node, instead) = (&block.name.text, instead(text, known));
                refuse(
                    *at,
                    format!("stamp: {node} does not read {text:?}: {instead}"),
                )
            }
        }
    }
}

impl NodeSpec {
    /// Returns the topic whose header stamp it copies, if it copies one.
    fn stamped_by(&self) -> Option<&Placed> {
        match self.stamp {
            HeaderStamp::Now => None,
            HeaderStamp::Of(input) => self.inputs().nth(input),
        }
    }
}

impl GraphFile {
    /// Returns the clocks for stamps in `setup` of nodes that copy the stamps of others.
    pub(super) fn idle_stamp_clocks(&self, setup: &Setup) -> Vec<String> {
        let idle = setup.iter().filter(|knob| knob.kind() == KnobKind::StampClock).filter_map(|knob| {
            let (node, topic) = (knob.target(), self.node(knob.target())?.stamped_by()?);
            let topic = &topic.text;
            Some(format!(
                "stamp_clock of {node} has no effect on header stamps: {node} copies the stamp of \
                 {topic}; with stamp = \"now\" it stamps by its own clock"
            ))
        });
        idle.collect()
    }
}
