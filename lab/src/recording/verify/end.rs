//! How a run ended when it was recorded, held against how it ends now.

use ratelab::{Fault, Time, Topology};
use ratelab_account::{Observer, TopicAccount};

use super::{difference::Difference, series::nanos};
use crate::recording::schema::{RecordingEnd, RunResult, RunStatus};

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
    let differs = |what: &str, recorded: String, computed: String| {
        (recorded != computed).then(|| Difference {
            at: outcome.at,
            what: what.to_owned(),
            recorded,
            computed,
        })
    };
    let ends = match (&outcome.end, computed) {
        (RunStatus::Ended(recorded), Ok(computed)) => parts(recorded)
            .into_iter()
            .zip(parts(computed))
            .find_map(|((what, recorded), (_, computed))| differs(what, recorded, computed)),
        (RunStatus::WentOn, _) => return None,
        (recorded, computed) => {
            let recorded = match recorded {
                RunStatus::Failed { fault } => fault.clone(),
                RunStatus::Ended(end) => verdict(end),
                RunStatus::WentOn => return None,
            };
            let computed = computed.as_ref().map_or_else(Fault::to_string, verdict);
            differs("the end of the run", recorded, computed)
        }
    };
    let now = observer.now().max(newest);
    let clock = observer.status().clock;
    ends.or_else(|| differs("run time at the end", nanos(outcome.at), nanos(now)))
        .or_else(|| {
            differs(
                "the clock at the end",
                outcome.clock.to_string(),
                clock.to_string(),
            )
        })
        .or_else(|| {
            differs(
                "what came too fast",
                outcome.lost.to_string(),
                lost.to_string(),
            )
        })
        .or_else(|| {
            let recorded = outcome.dropped.as_ref()?.iter();
            let topics = observer.snapshot().topics;
            let computed = topics.iter().map(TopicAccount::dropped);
            let topics = topology.topics.iter().zip(recorded.zip(computed));
            topics
                .into_iter()
                .find_map(|(topic, (recorded, computed))| {
                    let what = format!("messages of {} dropped in all", topic.name);
                    differs(&what, recorded.to_string(), computed.to_string())
                })
        })
}

/// The parts of an end, each to the bit.
fn parts(end: &RunResult) -> [(&'static str, String); 4] {
    let finals = end.finals.iter().map(|(name, value)| {
        let value = value.map_or("none".to_owned(), |value| {
            format!("{value:?} ({:#018x})", value.to_bits())
        });
        format!("{name} {value}")
    });
    [
        ("the end of the run", verdict(end)),
        ("time of the verdict", nanos(end.verdict.at)),
        ("run time at the end", nanos(end.sim_time)),
        (
            "figures of the last state",
            finals.collect::<Vec<_>>().join(", "),
        ),
    ]
}

fn verdict(end: &RunResult) -> String {
    format!("{} after {} steps", end.verdict.name, end.steps)
}
