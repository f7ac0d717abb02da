//! The traffic of a process with others, as lines of a report.

use ratelab_wire::Bridge;

use crate::report::line;

/// A line for each topic that arrived here.
pub fn lines(bridge: &Bridge) -> Vec<String> {
    let inlets = bridge.inlets().iter();
    let lines = inlets.map(|inlet| {
        let lost = inlet.sender().lost;
        let refused: Vec<String> = inlet
            .refused
            .read()
            .into_iter()
            .filter(|(why, _)| !why.is_harmless())
            .map(|(why, count)| format!("{count} {why}"))
            .collect();
        let refused = match refused.as_slice() {
            [] => "0 refused".to_owned(),
            some => format!("refused: {}", some.join(", ")),
        };
        let (name, node) = (&inlet.name, &inlet.node);
        line(
            "wire",
            &format!("{name} from {node}: {lost} lost on the way, {refused}"),
        )
    });
    lines.collect()
}
