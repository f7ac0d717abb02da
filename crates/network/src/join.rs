//! Whether a process may join a run: each node runs once, and all processes are set up alike.
//!
//! The one that comes finds out before anybody knows of it, so it changes nothing.
//!
//! | what it finds | what follows |
//! |---|---|
//! | another process has one of its nodes | [`NetworkError::Taken`] |
//! | the process that listens has another version, graph or setup | [`NetworkError::Setting`] |
//! | a process that does not answer | none of these: it counts when it answers |
//!
//! A process that is there already when the one that listens is started again cannot leave: it
//! is told apart by [`difference`], and the run does not begin with it.

use std::{
    collections::BTreeSet,
    fmt::Display,
    thread,
    time::{Duration, Instant},
};

use ratelab::{Digest, Knob, Topology};
use ratelab_system::{Alias, Setup, WorldKind};

use crate::{error::NetworkError, peers::Peers, telemetry::Info};

/// Time after which a process that waits for the one that listens has it printed.
const NOTICE: Duration = Duration::from_millis(1500);

/// Longest wait for the answers of those that are present: some seconds, so that a process on a
/// busy machine is not taken for one that is not there.
const PATIENCE: Duration = Duration::from_secs(4);

/// Time between two looks.
const PAUSE: Duration = Duration::from_millis(10);

/// The most differences in a text.
const MOST: usize = 3;

/// Waits for the process that listens, unless this is the one, and checks that `own` may join
/// those that are present. Calls `waits` once if nobody listens yet. Returns those that did
/// not answer.
pub(crate) fn check(
    own: &Info,
    peers: &Peers,
    aliases: &[Alias],
    waits: &dyn Fn(),
) -> Result<BTreeSet<u64>, NetworkError> {
    let began = Instant::now();
    let mut waited = false;
    loop {
        let (infos, mute) = answers(peers, began, &BTreeSet::new())?;
        refuse_taken(own, infos.iter())?;
        if let Some(hub) = infos.iter().find(|info| info.is_hub) {
            let differs = |why| NetworkError::Setting(format!("{}: {why}", hub.place()));
            let why = difference(own, hub, aliases);
            return why.map_or(Ok(mute), |why| Err(differs(why)));
        }
        if own.is_hub {
            return Ok(mute);
        }
        if !waited && began.elapsed() > NOTICE {
            waits();
            waited = true;
        }
        thread::sleep(PAUSE);
    }
}

/// Checks again, once the others know of `own`: of two that came at the same moment the one
/// with the lower number stays. Waits for none that is `mute`: the others count on `own`.
pub(crate) fn check_again(
    own: &Info,
    peers: &Peers,
    mute: &BTreeSet<u64>,
) -> Result<(), NetworkError> {
    let (infos, _) = answers(peers, Instant::now(), mute)?;
    let was_first = |other: &&Info| other.zero.is_some() || other.incarnation < own.incarnation;
    refuse_taken(own, infos.iter().filter(was_first))
}

/// Returns what runs in those that are present, once all but the `mute` ones have answered, or
/// shortly after `began`; and who has not answered by then.
fn answers(
    peers: &Peers,
    began: Instant,
    mute: &BTreeSet<u64>,
) -> Result<(Vec<Info>, BTreeSet<u64>), NetworkError> {
    let present = peers.present()?;
    loop {
        let infos = peers.infos();
        let known: BTreeSet<u64> = infos.iter().map(|info| info.incarnation).collect();
        let missing: BTreeSet<u64> = present.difference(&known).copied().collect();
        if missing.is_subset(mute) || began.elapsed() > PATIENCE {
            return Ok((infos, missing));
        }
        thread::sleep(PAUSE);
    }
}

/// Refuses to join where one of the `others` runs a node of `own`.
fn refuse_taken<'a>(
    own: &Info,
    mut others: impl Iterator<Item = &'a Info>,
) -> Result<(), NetworkError> {
    let Some(other) = others.find(|other| !own.shared(other).is_empty()) else {
        return Ok(());
    };
    let both = own.shared(other);
    let verb = if both.len() == 1 { "runs" } else { "run" };
    let (both, process) = (both.join(" and "), other.process());
    Err(NetworkError::Taken(format!(
        "{both} {verb} already, in {process}: end that one first"
    )))
}

/// Returns how the process `other` is set up differently from `own`, with what to try; `None` if it
/// is not. What is not set has the default of its one of `aliases`.
pub(crate) fn difference(own: &Info, other: &Info, aliases: &[Alias]) -> Option<String> {
    let mut all = Vec::new();
    if own.ratelab != other.ratelab {
        all.push(format!("ratelab {}", both(&other.ratelab, &own.ratelab)));
    }
    let [there, here] = [other, own].map(|info| world(info.config.world));
    if there != here {
        all.push(both(there, here));
    }
    all.extend(knobs(own, other, aliases));
    if all.is_empty() && own.topology != other.topology {
        all.push(graph_differences(&own.topology, &other.topology));
    }
    let more = all.len().saturating_sub(MOST);
    all.truncate(MOST);
    if more > 0 {
        all.push(format!("{more} more"));
    }
    (!all.is_empty()).then(|| format!("{}: start both with the same options", all.join(", ")))
}

fn both(there: impl Display, here: impl Display) -> String {
    format!("{there} there, {here} here")
}

fn world(kind: WorldKind) -> String {
    match kind {
        WorldKind::Course => "the world of the course".to_owned(),
        WorldKind::Own { step_ms } => {
            format!("a world of its own with steps of {} ms", step_ms.get())
        }
    }
}

/// Returns the knobs that are set to different values before the run.
fn knobs(own: &Info, other: &Info, aliases: &[Alias]) -> Vec<String> {
    let [here, there] = [own, other].map(|info| complete(&info.config.setup, aliases));
    let text = |knob: &Knob| format!("{:?}", knob.to_string());
    let of_here = here.iter().filter_map(|knob| {
        let Some(known) = there.iter().find(|known| known.is_of(knob)) else {
            return Some(format!("{} only here", text(knob)));
        };
        (!is_same(known, knob)).then(|| both(text(known), text(knob)))
    });
    let is_here = |knob: &Knob| here.iter().any(|known| known.is_of(knob));
    let of_there = there
        .iter()
        .filter(|knob| !is_here(knob))
        .map(|knob| format!("{} only there", text(knob)));
    of_here.chain(of_there).collect()
}

/// Returns the setup with the defaults of what it does not set.
fn complete(setup: &Setup, aliases: &[Alias]) -> Setup {
    let mut complete: Setup = aliases
        .iter()
        .filter_map(|alias| alias.set(alias.default).ok())
        .flatten()
        .collect();
    complete.extend(setup.iter().cloned());
    complete
}

/// Returns whether two knobs are the same. A file may have another path on another machine: its
/// digest decides.
fn is_same(one: &Knob, other: &Knob) -> bool {
    let digest = |knob: &Knob| match knob {
        Knob::Send { text, .. } => Some(text.rsplit_once(Digest::PIN)?.1.to_owned()),
        _ => None,
    };
    one == other || digest(one).is_some_and(|digest_of| Some(digest_of) == digest(other))
}

/// Returns the first difference of two graphs.
fn graph_differences(here: &Topology, there: &Topology) -> String {
    if let Some((here, there)) = first(&here.nodes, &there.nodes) {
        return if here.name != there.name {
            format!("a node {}", both(&there.name, &here.name))
        } else if here.hz != there.hz {
            format!("{} at {}", here.name, both(there.hz, here.hz))
        } else {
            format!("another node {}", here.name)
        };
    }
    if let Some((here, there)) = first(&here.topics, &there.topics) {
        return if here.name == there.name {
            format!("another topic {}", here.name)
        } else {
            format!("a topic {}", both(&there.name, &here.name))
        };
    }
    let count =
        |graph: &Topology| format!("{} nodes, {} topics", graph.nodes.len(), graph.topics.len());
    both(count(there), count(here))
}

/// Returns the first two that differ.
fn first<'a, T: PartialEq>(here: &'a [T], there: &'a [T]) -> Option<(&'a T, &'a T)> {
    here.iter().zip(there).find(|(here, there)| here != there)
}

#[cfg(test)]
#[path = "../../../tests/support/table.rs"]
mod table;

#[cfg(test)]
mod tests {
    use super::table::rows;
    use super::*;
    use ratelab_cart_pole::CartPole;
    use ratelab_experiment::Experiment;
    use std::sync::Arc;

    /// What runs in a process with these settings.
    fn info(setup: &str, change: impl FnOnce(&mut Info)) -> Info {
        let (system, config) = (Arc::new(CartPole::default()), CartPole::config(setup));
        let experiment = Experiment::new(system, &config.expect("a setup")).expect("cart-pole");
        let mut info = Info::new(&experiment, &["policy".to_owned()]);
        info.ratelab = "1".to_owned();
        change(&mut info);
        info
    }

    /// The knobs of a process, those of the other, and how they differ.
    #[test]
    fn processes_with_other_knobs_are_told_which() {
        for [own, other, expected] in rows(
            r#"
            |                                |
            | policy scripted, control-hz 50 |
            | control-hz 20                  | "rate policy 20" there, "rate policy 50" here
            policy lqr     | | "send policy scripted" there, "send policy lqr" here
            takes sensor 3 | | "takes sensor 3" only here
            control-hz 20, sensor-hz 20, queue-depth 3, think-ms 30 | | 2 more
            "#,
        ) {
            check(&info(&own, |_| ()), &info(&other, |_| ()), &expected);
        }
    }

    /// Knobs that name a file are the same where its content is.
    #[test]
    fn processes_that_are_set_up_differently_are_told_how() {
        let policy = |text: &'static str| {
            move |info: &mut Info| {
                let (node, text) = ("policy".to_owned(), text.to_owned());
                info.config.setup.set(Knob::Send { node, text });
            }
        };
        let own_world = WorldKind::parse("own", None).expect("a world");
        let file = info("", policy("a/p@sha256:12"));
        let there = "\"send policy a/p@sha256:13\" there";
        check(&file, &info("", policy("b/p@sha256:12")), "");
        check(&file, &info("", policy("a/p@sha256:13")), there);
        let here = info("", |_| ());
        let differs = |change: &dyn Fn(&mut Info), expected: &str| {
            check(&here, &info("", change), expected);
        };
        differs(&|info| info.config.seed = 7, "");
        differs(
            &|info| info.ratelab = "2".to_owned(),
            "ratelab 2 there, 1 here",
        );
        let world = "a world of its own with steps of 1 ms there";
        differs(&|info| info.config.world = own_world, world);
        let planner = |info: &mut Info| info.topology.nodes[1].name = "planner".to_owned();
        differs(&planner, "a node planner there, policy here");
        differs(&|info| drop(info.topology.topics.pop()), "topics there");
    }

    /// Checks how two processes differ; not at all where nothing is expected.
    #[track_caller]
    fn check(own: &Info, other: &Info, expected: &str) {
        let Some(found) = difference(own, other, CartPole::KNOBS.0) else {
            return assert_eq!(expected, "", "no difference");
        };
        let told = !expected.is_empty() && found.contains(expected);
        let remedy = found.ends_with("start both with the same options");
        assert!(told && remedy, "{expected:?}: {found}");
    }
}
