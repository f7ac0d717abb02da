//! How a run ended when it was recorded, held against how it ends now.

use ratelab::{Fault, Time, Topology};
use ratelab_account::{Observer, TopicAccount};

use super::difference::{ComparedPart, Difference, bits, nanos};
use crate::schema::{RecordingEnd, RunResult, RunStatus};

/// The first part of the end that is not the same: all of it but the wall's time. `newest` is
/// the run time of the last item. What came too fast for the recorder was `lost`, and came
/// again.
pub fn compare(
    outcome: &RecordingEnd,
    topology: &Topology,
    computed: &Result<RunResult, Fault>,
    observer: &Observer,
    (newest, lost): (Time, u64),
) -> Option<Difference> {
    let part =
        |what: &str, recorded: String, computed: String| (what.to_owned(), recorded, computed);
    let results = match (&outcome.end, computed) {
        (RunStatus::Ended(recorded), Ok(computed)) => results(recorded, computed),
        (recorded, computed) => {
            let computed = computed.as_ref().map_or_else(Fault::to_string, verdict);
            vec![part("the end of the run", status(recorded), computed)]
        }
    };
    let now = observer.now().max(newest);
    let clock = observer.status().clock;
    let rest = [
        part("run time at the end", nanos(outcome.at), nanos(now)),
        part(
            "the clock at the end",
            outcome.clock.to_string(),
            clock.to_string(),
        ),
        part(
            "what came too fast",
            outcome.lost.to_string(),
            lost.to_string(),
        ),
    ];
    let topics = observer.snapshot().topics;
    let dropped = topics.iter().map(TopicAccount::dropped);
    let dropped = outcome.dropped.iter().flatten().zip(dropped);
    let dropped = topology
        .topics
        .iter()
        .zip(dropped)
        .map(|(topic, (recorded, computed))| {
            let what = format!("messages of {} dropped in all", topic.name);
            (what, recorded.to_string(), computed.to_string())
        });
    Difference::first(outcome.at, results.into_iter().chain(rest).chain(dropped))
}

/// A part of a result in words.
type ToldPart = fn(&RunResult) -> String;

/// The parts of a result, each to the bit.
fn results(recorded: &RunResult, computed: &RunResult) -> Vec<ComparedPart> {
    let parts: [(&str, ToldPart); 4] = [
        ("the end of the run", verdict),
        ("time of the verdict", |end| nanos(end.verdict.at)),
        ("run time at the end", |end| nanos(end.sim_time)),
        ("figures of the last state", finals),
    ];
    let parts = parts.map(|(what, told)| (what.to_owned(), told(recorded), told(computed)));
    parts.into()
}

fn finals(end: &RunResult) -> String {
    let finals = end.finals.iter().map(|(name, value)| {
        let value = value.map_or("none".to_owned(), bits);
        format!("{name} {value}")
    });
    finals.collect::<Vec<_>>().join(", ")
}

fn status(recorded: &RunStatus) -> String {
    match recorded {
        RunStatus::Failed { fault } => fault.clone(),
        RunStatus::Ended(end) => verdict(end),
        RunStatus::WentOn => "none".to_owned(),
    }
}

fn verdict(end: &RunResult) -> String {
    format!("{} after {} steps", end.verdict.name, end.steps)
}
