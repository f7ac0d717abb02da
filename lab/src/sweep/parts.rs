//! The ages of the runs of a sweep and their parts, as columns.

use ratelab_experiment::sweep::CellResult;

/// The mean of an age, or of one of its parts.
#[derive(Clone, PartialEq)]
pub struct PartColumn {
    /// The chain; `None` for the push.
    chain: Option<String>,
    /// What it is, and whose; `None` for the age itself.
    part: Option<(&'static str, String)>,
}

/// Returns the columns of all `results`: the columns of an age side by side, in the order of their
/// first occurrence.
pub fn columns<'r>(results: impl Iterator<Item = &'r CellResult>) -> Vec<PartColumn> {
    let mut columns: Vec<PartColumn> = Vec::new();
    for age in results.flat_map(|result| &result.ages) {
        let keys = age
            .parts
            .iter()
            .map(|part| (part.stage.key(), part.owner.clone()));
        for part in [None].into_iter().chain(keys.map(Some)) {
            let chain = age.chain.clone();
            let column = PartColumn { chain, part };
            if !columns.contains(&column) {
                let after = columns
                    .iter()
                    .rposition(|known| known.chain == column.chain);
                columns.insert(after.map_or(columns.len(), |after| after + 1), column);
            }
        }
    }
    columns
}

impl PartColumn {
    /// Returns its name, with the unit.
    pub fn name(&self) -> String {
        let of = self.chain.as_deref().unwrap_or("push");
        match &self.part {
            None => format!("{of} age ms"),
            Some((key, owner)) => format!("{of} {key} {owner} ms"),
        }
    }

    /// Returns its value in a run (ms): zero for a part that an age lacks.
    pub fn value(&self, result: &CellResult) -> Option<f64> {
        let age = result.ages.iter().find(|age| age.chain == self.chain)?;
        let ns = match &self.part {
            None => age.mean_ns,
            Some((key, owner)) => {
                let mut parts = age.parts.iter();
                let part = parts.find(|part| part.is(key, owner));
                part.map_or(0, |part| part.ns)
            }
        };
        Some(ns as f64 / 1e6)
    }
}
