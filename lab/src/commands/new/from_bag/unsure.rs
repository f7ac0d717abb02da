//! What a bag does not tell of a chain, on which its ages with a change rest.

use ratelab_bag::{Analysis, BagChain, BagNode, Kind, quantile};

use super::NO_REPEATS;

/// How sure a kind must be.
pub const SURE: f64 = 0.7;

/// The part of a core from which on nodes that share a thread starve each other.
const NEAR_A_CORE: f64 = 0.9;

/// Whether a node has a question open, and which.
type Question = (fn(&Analysis, &BagNode) -> bool, &'static str);

/// What a bag leaves open of a chain.
#[derive(Default)]
pub struct OpenQuestions {
    /// Why ages of a changed graph may be others, whatever is tried.
    pub unsure: Option<String>,
    /// What runs with a change try.
    pub open: Option<String>,
}

impl OpenQuestions {
    /// Creates what the bag leaves open of `chain`.
    pub fn new(analysis: &Analysis, chain: &BagChain) -> Self {
        let path = chain.path.iter();
        let nodes: Vec<&BagNode> = path.filter_map(|topic| analysis.node(*topic)).collect();
        let named = |node: &BagNode| format!("the node of {}", analysis.names[node.topic]);
        let first = |questions: &[Question]| {
            questions.iter().find_map(|(is_so, why)| {
                let node = nodes.iter().find(|node| is_so(analysis, node))?;
                Some(format!("{} {why}", named(node)))
            })
        };
        let may_share = || {
            let loads = |(one, other): &&(usize, usize)| {
                [one, other]
                    .map(|topic| analysis.node(*topic))
                    .into_iter()
                    .flatten()
                    .map(|node| load(analysis, node))
                    .sum::<f64>()
                    > NEAR_A_CORE
            };
            let on_path = |(one, other): &&(usize, usize)| {
                chain.path.contains(one) || chain.path.contains(other)
            };
            let mut pairs = analysis.may_share.iter().filter(on_path);
            let (one, other) = pairs.find(loads)?;
            let [one, other] = [one, other].map(|topic| &analysis.names[*topic]);
            Some(format!(
                "the nodes of {one} and {other} need nearly a core, and may share a thread"
            ))
        };
        let unsure = first(&[
            (is_unknown, UNCLEAR),
            (
                stamps_late,
                "stamps as it publishes: what it reads is not known",
            ),
            (shares_a_thread, "shares a thread"),
        ]);
        Self {
            unsure,
            open: first(&[
                (is_unclear, UNCLEAR),
                (
                    is_locked,
                    "has a rate that locks with its input: try --phases",
                ),
                (
                    may_repeat,
                    "may work on old data again where it ticks faster",
                ),
                (is_busy, "needs nearly a core"),
            ])
            .or_else(may_share),
        }
    }
}

/// Why the kind of a node is not known.
const UNCLEAR: &str = "may be a timer or triggered";

fn is_unknown(_: &Analysis, node: &BagNode) -> bool {
    node.kind == Kind::Unknown
}

fn is_unclear(_: &Analysis, node: &BagNode) -> bool {
    node.confidence < SURE
}

fn shares_a_thread(analysis: &Analysis, node: &BagNode) -> bool {
    analysis.shares_a_thread(node.topic)
}

fn is_busy(analysis: &Analysis, node: &BagNode) -> bool {
    load(analysis, node) > NEAR_A_CORE
}

/// Returns whether the phase between a timer and its input is always the same.
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

/// Returns whether what a topic begins with is stamped only as it is published.
fn stamps_late(analysis: &Analysis, node: &BagNode) -> bool {
    const AT_ONCE: i64 = 100_000;
    let begun = analysis.begun(node.topic, node.topic);
    let mut ages: Vec<i64> = begun.iter().map(|(event, begin)| event - begin).collect();
    node.kind == Kind::Sensor && quantile(&mut ages, 500) < AT_ONCE
}

/// Returns whether a timer works much, and no tick shows what it does without new data.
fn may_repeat(analysis: &Analysis, node: &BagNode) -> bool {
    const MUCH: f64 = 0.15;
    let repeats = node
        .input
        .as_ref()
        .map_or(0.0, |input| input.triggered.repeats);
    node.kind == Kind::Timer && repeats < NO_REPEATS && load(analysis, node) > MUCH
}

/// Returns the part of a core that a node needs.
fn load(analysis: &Analysis, node: &BagNode) -> f64 {
    let runs = analysis.found().runs(node);
    let busy: i64 = runs.iter().map(|(start, end)| (end - start).max(0)).sum();
    busy as f64 / analysis.end.max(1) as f64
}
