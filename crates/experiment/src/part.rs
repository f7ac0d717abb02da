//! Which nodes may run in a process of their own.

use ratelab_system::Group;

/// Returns the reason why the nodes named in `here` cannot be a process of their own, of all nodes
/// `names`, if there is one.
pub(super) fn check(groups: &[Group], names: &[&str], here: &[String]) -> Option<String> {
    let is_here = |name: &str| here.iter().any(|node| node == name);
    if let Some(unknown) = here.iter().find(|node| !names.contains(&node.as_str())) {
        let known = names.join(", ");
        return Some(format!(
            "there is no node {unknown:?}: expected some of {known}"
        ));
    }
    for Group { name, nodes } in groups {
        let (in_here, away): (Vec<&str>, Vec<&str>) = nodes
            .iter()
            .map(String::as_str)
            .filter(|node| names.contains(node))
            .partition(|node| is_here(node));
        if let (Some(here), Some(away)) = (in_here.first(), away.first()) {
            return Some(format!(
                "{here} and {away} share the {name}: run them in one process, as {name}"
            ));
        }
    }
    None
}
