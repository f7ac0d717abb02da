//! Which names a graph file may give and use.

use super::{
    GraphFile, NodeSpec,
    error::{Checked, Placed, holds, refuse, unknown},
};
use crate::CHAINS;

/// The longest name (characters).
const LONGEST_NAME: usize = 64;

/// Returns the node called `name`; `None` if it may be one of the system in the middle, which is
/// checked when that is known.
pub(super) fn node_of<'f>(file: &'f GraphFile, name: &Placed) -> Checked<Option<&'f NodeSpec>> {
    match file.node(&name.text) {
        None if file.inner.is_none() => unknown("no node", name, file.names()),
        known => Ok(known),
    }
}

/// Refuses a name that would be ambiguous in knobs, options and recordings.
pub(super) fn name(name: &Placed) -> Checked {
    let plain = |c: char| c.is_alphanumeric() || "_-.".contains(c);
    let fits = name.text.chars().all(plain)
        && name.text.starts_with(|c: char| c.is_alphanumeric())
        && name.text.chars().count() <= LONGEST_NAME;
    let expected = "expected letters, digits, _ and -, beginning with a letter or a digit";
    if fits {
        Ok(())
    } else {
        refuse(name.at, format!("{:?} is no name: {expected}", name.text))
    }
}

/// Refuses a name that is none of a topic.
pub(super) fn topic_name(name: &Placed) -> Checked {
    let parts = name.text.strip_prefix('/').map(|rest| rest.split('/'));
    let plain = |c: char| c.is_alphanumeric() || "_-".contains(c);
    let fits = name.text.chars().count() <= LONGEST_NAME
        && parts
            .is_some_and(|mut parts| parts.all(|part| !part.is_empty() && part.chars().all(plain)));
    if name.text == CHAINS {
        let what = format!("{CHAINS} has the data ages: choose another name");
        return refuse(name.at, what);
    }
    let expected = "expected a slash, then letters, digits, _ and -, such as \"/image\"";
    if fits {
        Ok(())
    } else {
        refuse(name.at, format!("{:?} is no topic: {expected}", name.text))
    }
}

/// Refuses a name in a list that has it `before`.
pub(super) fn once(key: &str, name: &Placed, before: &[Placed]) -> Checked {
    if holds(before, &name.text) {
        let what = format!("{key}: {:?} is there twice: leave one out", name.text);
        return refuse(name.at, what);
    }
    Ok(())
}
