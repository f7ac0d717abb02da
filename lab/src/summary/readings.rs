//! A run with a change by other readings of the bag behind its graph.

use std::collections::BTreeMap;

use ratelab_experiment::Summary;
use ratelab_system::{DataChain, graph_file::BagReading};

/// The mean age of each chain by each other reading.
#[derive(Default)]
pub struct OtherReadings {
    by_chain: BTreeMap<String, Vec<ReadAge>>,
    /// Nodes of which the change says what the bag does not.
    doubted: Vec<String>,
}

/// The mean age of a chain as the bag may be read as well.
pub struct ReadAge {
    /// What is read in another way.
    pub what: String,
    /// Whether nodes at a new rate have another phase in it.
    pub is_phase: bool,
    /// The mean (ms).
    pub mean_ms: f64,
}

impl OtherReadings {
    /// Creates an empty list of readings, for a change of the nodes that are `doubted`.
    pub fn new(doubted: Vec<String>) -> Self {
        Self {
            doubted,
            ..Self::default()
        }
    }

    /// Adds the ages of `chains` in a run by another `reading`.
    pub fn add(&mut self, reading: &BagReading, chains: &[DataChain], summary: &Summary) {
        for chain in chains {
            let mean = chain.mean_ms(summary.sim_time, &summary.chains);
            let age = mean.map(|mean_ms| ReadAge {
                what: reading.what.clone(),
                is_phase: reading.is_phase,
                mean_ms,
            });
            let of_chain = self.by_chain.entry(chain.name().to_owned()).or_default();
            of_chain.extend(age);
        }
    }

    /// Returns the ages of `chain`.
    pub fn of(&self, chain: &DataChain) -> &[ReadAge] {
        self.by_chain.get(chain.name()).map_or(&[], |ages| ages)
    }

    /// Returns a node of `chain` of which the change says what the bag does not.
    pub fn doubted(&self, chain: &DataChain) -> Option<&str> {
        let node = self.doubted.iter().find(|node| chain.nodes.contains(node));
        node.map(String::as_str)
    }
}
