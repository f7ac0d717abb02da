//! What a bag does not tell of a chain, on which its ages with a change rest.

use ratelab_bag::{Analysis, BagChain, BagNode, Kind};

use super::NO_REPEATS;

/// How sure a kind must be.
pub const SURE: f64 = 0.55;

/// The part of a core from which on nodes that share a thread starve each other.
const NEAR_A_CORE: f64 = 0.9;

/// Why ages of a changed graph may be others; `None` if nothing is known against them.
pub fn reason(analysis: &Analysis, chain: &BagChain) -> Option<String> {
    let nodes = || chain.path.iter().filter_map(|topic| analysis.node(*topic));
    let named = |node: &BagNode| format!("the node of {}", analysis.names[node.topic]);
    let unclear = nodes().find(|node| node.kind == Kind::Unknown || node.confidence < SURE);
    if let Some(node) = unclear {
        return Some(format!("{} may be a timer or triggered", named(node)));
    }
    let locked = nodes().find(|node| is_locked(analysis, node));
    if let Some(node) = locked {
        return Some(format!(
            "{} has a rate that locks with its input: try --phases",
            named(node)
        ));
    }
    let busy_timer = nodes().find(|node| may_repeat(analysis, node));
    if let Some(node) = busy_timer {
        return Some(format!(
            "{} may work on old data again where it ticks faster",
            named(node)
        ));
    }
    let shared = |node: &&BagNode| {
        let mut threads = analysis.shared.iter();
        threads.any(|thread| thread.contains(&node.topic))
    };
    if let Some(node) = nodes().find(shared) {
        return Some(format!("{} shares a thread", named(node)));
    }
    let busy = nodes().find(|node| load(analysis, node) > NEAR_A_CORE);
    busy.map(|node| format!("{} needs nearly a core", named(node)))
}

/// Whether the phase between a timer and its input is always the same.
fn is_locked(analysis: &Analysis, node: &BagNode) -> bool {
    const FEW: u32 = 6;
    let timed = node.input.as_ref().and_then(|input| input.timed);
    let Some(timed) = timed.filter(|_| node.kind == Kind::Timer) else {
        return false;
    };
    let input = node.parent().and_then(|parent| analysis.node(parent));
    let Some(period) = input.and_then(|input| input.period) else {
        return false;
    };
    let span = analysis.end as f64;
    // The phase of one against the other moves by less than a quarter period over the bag.
    (1..=FEW).any(|times| {
        let turns = f64::from(times) * timed.period / period.length;
        let off = (turns - turns.round()).abs() * period.length;
        let repeats = span / (f64::from(times) * timed.period);
        turns.round() >= 1.0 && off * repeats < 0.25 * period.length
    })
}

/// Whether a timer works much, and no tick shows what it does without new data.
fn may_repeat(analysis: &Analysis, node: &BagNode) -> bool {
    const MUCH: f64 = 0.15;
    let repeats = node
        .input
        .as_ref()
        .map_or(0.0, |input| input.triggered.repeats);
    node.kind == Kind::Timer && repeats < NO_REPEATS && load(analysis, node) > MUCH
}

/// The part of a core that a node needs.
fn load(analysis: &Analysis, node: &BagNode) -> f64 {
    let runs = analysis.found().runs(node);
    let busy: i64 = runs.iter().map(|(start, end)| (end - start).max(0)).sum();
    busy as f64 / analysis.end.max(1) as f64
}
