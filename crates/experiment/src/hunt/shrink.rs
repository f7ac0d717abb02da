//! Shrinks a list of faults until every part is necessary.

use super::{
    Proof,
    fault::FaultPart,
    trial::{Halt, Trials},
};

/// Maximum number of smaller lists that are all run.
pub const MOST_SMALLER: usize = 4_096;

/// Shrinks `list`, which loses the run. Each step is stored in `list` before the next begins.
pub(super) fn shrink(list: &mut Vec<FaultPart>, trials: &mut Trials<'_>) -> Result<Proof, Halt> {
    delta_debug(list, trials)?;
    let Some(smaller) = all_smaller(list) else {
        return Ok(Proof::EachPart(list.len()));
    };
    // Ordered by size: all lists smaller than the first have been run.
    if let Some(index) = trials.first_lost(&smaller)? {
        list.clone_from(&smaller[index]);
    }
    Ok(Proof::EverySmaller(
        all_smaller(list).map_or(0, |smaller| smaller.len()),
    ))
}

/// Leaves out ever smaller pieces, until every single part is necessary.
pub(super) fn delta_debug(list: &mut Vec<FaultPart>, trials: &mut Trials<'_>) -> Result<(), Halt> {
    let mut pieces = 2;
    while list.len() > 1 {
        let cuts: Vec<usize> = (0..=pieces).map(|cut| cut * list.len() / pieces).collect();
        let alone = cuts.windows(2).map(|cut| list[cut[0]..cut[1]].to_vec());
        let without = cuts
            .windows(2)
            .map(|cut| [&list[..cut[0]], &list[cut[1]..]].concat());
        let lists: Vec<Vec<FaultPart>> = match pieces {
            2 => alone.collect(), // Each is the complement of the other.
            _ => alone.chain(without).collect(),
        };
        match trials.first_lost(&lists)? {
            Some(index) => {
                list.clone_from(&lists[index]);
                pieces = if index < pieces { 2 } else { pieces - 1 };
            }
            None if pieces >= list.len() => return Ok(()),
            None => pieces *= 2,
        }
        pieces = pieces.min(list.len()).max(2);
    }
    Ok(())
}

/// Returns all sublists of `list` by size, without the empty one and `list` itself; `None` if
/// there are too many.
fn all_smaller(list: &[FaultPart]) -> Option<Vec<Vec<FaultPart>>> {
    let mut sorted = list.to_vec();
    sorted.sort_unstable();
    let mut lists = vec![Vec::new()];
    for same in sorted.chunk_by(|one, next| one == next) {
        if lists.len() * (same.len() + 1) > MOST_SMALLER {
            return None;
        }
        let longer = lists.iter().flat_map(|list| {
            (0..=same.len()).map(move |count| [list.as_slice(), &same[..count]].concat())
        });
        lists = longer.collect();
    }
    lists.retain(|smaller: &Vec<FaultPart>| !smaller.is_empty() && smaller.len() < list.len());
    lists.sort_by_key(Vec::len);
    Some(lists)
}
