//! The deep queue that kills: nothing is dropped, and everything grows old.

use ratelab::Time;
use ratelab_experiment::Config;

use crate::framework::{
    Answer, Failure, Findings, KnobRuns, Measurement, PredictionPlace, Table, asked, edge,
    obs_dropped, own_world, survey,
};

/// Starts for each depth.
const STARTS: u64 = 3;

/// Duration of a run (s).
const DURATION_S: f64 = 30.0;

/// A queue deep enough to drop nothing before the fall.
const DEEP: usize = 10;

/// Queues with these depths, read from their old end.
fn queues<const DEPTHS: usize>(depths: [usize; DEPTHS]) -> Result<[KnobRuns; DEPTHS], Failure> {
    let base = Config {
        end: Time::from_secs_f64(DURATION_S)?,
        ..own_world("control-hz 49, read /obs oldest")?
    };
    survey(base, "depth /obs", depths, STARTS)
}

fn findings(
    groups: &[KnobRuns],
    place: PredictionPlace,
    answer: Answer,
    meaning: String,
) -> Findings {
    Findings {
        table: table(groups),
        place,
        answer,
        meaning,
        measurements: groups.iter().flat_map(measurements).collect(),
    }
}

/// Returns the first question: when the first and the last of the runs with a queue of ten fell.
pub(crate) fn time() -> Result<Findings, Failure> {
    let groups = queues([1, DEEP, 100])?;
    let deep = asked(&groups, |group| {
        group.value == DEEP.to_string() && group.up() == 0
    })?;
    let falls = deep.runs.iter().map(|run| run.sim_time.as_secs_f64());
    let (first, last) = ends(falls);
    let answer = Answer::Between {
        from: first,
        to: last,
    };
    let lost: u64 = deep.runs.iter().map(obs_dropped).sum();
    let meaning = format!(
        "Every second one reading arrives more than is taken, and waits: every second the policy \
         reads 20 ms further into the past. The pushes begin 10 ms old, and about four seconds later \
         they are too old: it fell after {first:.2} to {last:.2} s, with {lost} messages dropped. \
         The queue of 1 dropped one message a second and stood. In exercise 2 a deep queue \
         did nothing, because the policy read its newest message.",
    );
    Ok(findings(&groups, PredictionPlace::Row(1), answer, meaning))
}

/// Returns the second question: the deepest queue before the first that kills.
pub(crate) fn depth() -> Result<Findings, Failure> {
    let groups = queues([1, 2, 3, 4, 5, 6, 7, 8, 9, DEEP])?;
    let (stands, kills) = edge(&groups, KnobRuns::all_up)?;
    let meaning = format!(
        "A full queue of {depth} messages makes each reading {depth} periods old and not older: \
         the pushes stay at {:.0} ms, just within the law of exercise 6. With one message more \
         they grow to {:.0} ms, and the pole falls. The drops kept the pole up: a limit of the \
         queue is a limit of the age. Read the newest, or keep the queue short, or both.",
        stands.push_age_ms(),
        kills.push_age_ms(),
        depth = stands.value,
    );
    let answer = Answer::Exactly(stands.number());
    Ok(findings(&groups, PredictionPlace::Between, answer, meaning))
}

/// Returns the least and the greatest of `values`.
fn ends(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(least, most), value| (least.min(value), most.max(value)),
    )
}

/// Returns a row for each depth, so that the head stays in sight.
fn table(groups: &[KnobRuns]) -> Table {
    let until = |group: &KnobRuns| {
        let until = group.runs.iter().map(|run| run.sim_time.as_secs_f64());
        format!("{} s", span(until, 2))
    };
    let drops = |group: &KnobRuns| span(group.runs.iter().map(|run| obs_dropped(run) as f64), 0);
    Table::from_items(
        groups,
        &[
            ("depth", &|group| group.value.clone()),
            ("stay up", &KnobRuns::up_of),
            ("until", &until),
            ("dropped", &drops),
            ("push age", &KnobRuns::push_age),
        ],
    )
}

/// Returns the least and the greatest of `values`, or one number where they are the same.
fn span(values: impl Iterator<Item = f64>, decimals: usize) -> String {
    let (least, most) = ends(values);
    let [least, most] = [least, most].map(|number| format!("{number:.decimals$}"));
    if least == most {
        least
    } else {
        format!("{least} to {most}")
    }
}

fn measurements(group: &KnobRuns) -> impl Iterator<Item = Measurement> {
    group.runs.iter().enumerate().flat_map(|(start, run)| {
        Measurement::list(
            format_args!("depth {}, seed {start}", group.value),
            [
                ("until (s)", run.sim_time.as_secs_f64()),
                ("/obs dropped", obs_dropped(run) as f64),
            ],
        )
    })
}
