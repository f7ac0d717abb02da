//! Messages whose numbers and payloads are in different chunks: tools for rerun's files keep wide
//! columns apart from narrow ones.

use std::collections::BTreeMap;

use ratelab::Head;
use rerun::log::{Chunk, RowId};

use super::columns;

/// The halves of the messages of a topic, by row.
#[derive(Default)]
pub struct MessageHalves(BTreeMap<RowId, (Option<Head>, Option<Vec<f64>>)>);

impl MessageHalves {
    /// Returns whether `chunk` has one half of its messages.
    pub fn are_in(chunk: &Chunk) -> bool {
        columns::has_numbers::<Head>(chunk) != columns::is_plotted(chunk)
    }

    /// Adds the rows of `chunk`.
    pub fn add(&mut self, chunk: &Chunk) {
        let heads = columns::read::<Head>(chunk).into_iter();
        let payloads = columns::plotted(chunk).into_iter();
        for (id, (head, payload)) in chunk.row_ids().zip(heads.zip(payloads)) {
            let (known, numbers) = self.0.entry(id).or_default();
            *known = known.or(head);
            if let Some(payload) = payload {
                *numbers = Some(payload.to_vec());
            }
        }
    }

    /// Returns the messages in the order of their numbers; `None` if a half is missing.
    pub fn joined(self) -> Option<Vec<(Head, Vec<f64>)>> {
        let mut rows = self
            .0
            .into_values()
            .map(|(head, payload)| head.zip(payload))
            .collect::<Option<Vec<_>>>()?;
        rows.sort_by_key(|(head, _)| head.seq);
        Some(rows)
    }
}
