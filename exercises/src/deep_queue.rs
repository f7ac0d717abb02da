//! The deep queue that kills: nothing is dropped, and everything grows old.

use ratelab::Time;
use ratelab_study::experiment::{Config, sweep::CellResult};

use crate::framework::{
    Answer, Brief, Exercise, ExerciseKind, Failure, Findings, KnobRuns, Measurement, Range, Table,
    Tolerance, own_world, survey,
};

/// Starts for each depth.
const STARTS: u64 = 3;

/// Duration of a run (s).
const DURATION_S: u32 = 30;

/// A queue deep enough to drop nothing before the fall.
const DEEP: usize = 10;

/// The first question: a queue of ten messages.
pub const TIME: DeepQueue = DeepQueue {
    brief: &Brief {
        number: 7,
        part: "a",
        name: "deep-queue",
        title: "The deep queue that kills",
        kind: ExerciseKind::PredictThenRun,
        objective: "The sensor publishes 50 readings a second; the policy takes 49. It is almost \
                    as fast, and a queue of ten messages catches what it leaves. But this queue \
                    is read like the callback queue of a ROS node, oldest first: each tick takes \
                    the oldest unread reading and no other. The world does not wait. Queues of 1, \
                    10 and 100 messages run for half a minute from three starts.",
        question: "With a queue of 10, after how many seconds does the pole fall?",
        quantity: "time of fall",
        unit: "s",
        tolerance: Tolerance::Within(1.0),
        range: Range {
            least: 0.0,
            most: DURATION_S as f64,
            whole: false,
        },
        choices: &[],
    },
    depths: &[1, DEEP, 100],
    next: Some(&DEPTH),
};

/// The second question: the deepest queue that does no harm.
pub const DEPTH: DeepQueue = DeepQueue {
    brief: &Brief {
        number: 7,
        part: "b",
        name: "deep-queue-depth",
        title: "The deep queue that kills: how deep",
        kind: ExerciseKind::PredictThenRun,
        objective: "Somewhere between 1 and 10 messages the queue begins to kill. A full queue \
                    drops its oldest message, and then nothing in it grows older. Each depth from \
                    1 to 10 runs for half a minute from three starts.",
        question: "What is the deepest queue with which the pole stays up?",
        quantity: "depth",
        unit: "messages",
        tolerance: Tolerance::Exact,
        range: Range {
            least: 1.0,
            most: DEEP as f64,
            whole: true,
        },
        choices: &[],
    },
    depths: &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10],
    next: None,
};

/// A question about queues that are read from their old end.
pub struct DeepQueue {
    brief: &'static Brief,
    depths: &'static [usize],
    next: Option<&'static dyn Exercise>,
}

impl Exercise for DeepQueue {
    fn brief(&self) -> &'static Brief {
        self.brief
    }

    fn measure(&self, _seed: u64) -> Result<Findings, Failure> {
        let base = Config {
            end: Time::from_secs_f64(DURATION_S.into())?,
            ..own_world("control-hz 49, read /obs oldest")?
        };
        let groups = survey(base, "depth /obs", self.depths, 0..STARTS)?;
        let (answer, meaning) = if self.next.is_some() {
            time(&groups)?
        } else {
            depth(self.depths, &groups)?
        };
        Ok(Findings {
            table: table(&groups),
            refuted: Vec::new(),
            answer,
            meaning,
            measurements: groups.iter().flat_map(measurements).collect(),
        })
    }

    fn next_part(&self) -> Option<&'static dyn Exercise> {
        self.next
    }
}

/// Run times of the falls (s).
fn falls(group: &KnobRuns) -> impl Iterator<Item = f64> {
    let lost = group.runs.iter().filter(|run| run.verdict.is_lost());
    lost.map(|run| run.sim_time.as_secs_f64())
}

/// The first topic with a reader is `/obs`.
fn dropped(run: &CellResult) -> u64 {
    run.dropped.first().copied().unwrap_or_default()
}

/// The first question: when the first and the last of the runs fell.
fn time(groups: &[KnobRuns]) -> Result<(Answer, String), Failure> {
    let deep = groups.iter().find(|group| group.value == DEEP.to_string());
    let stood = || Failure::Unmeasured("the queue did no harm".to_owned());
    let deep = deep.filter(|group| group.up() == 0).ok_or_else(stood)?;
    let (first, last) = falls(deep).fold((f64::INFINITY, 0.0_f64), |(first, last), at| {
        (first.min(at), last.max(at))
    });
    let answer = Answer::Between {
        from: first,
        to: last,
    };
    let lost: u64 = deep.runs.iter().map(dropped).sum();
    let meaning = format!(
        "Every second one reading more arrives than is taken, and waits; so every second the \
         policy reads 20 ms further into the past. It begins with pushes that are 10 ms old, and \
         four seconds later they are as old as the pole bears: it fell after {first:.2} to \
         {last:.2} s, with {lost} messages dropped. The queue of 1 dropped one message a second \
         and stood. In exercise 2 a deep queue did nothing, because its newest message was read.",
    );
    Ok((answer, meaning))
}

/// The second question: the deepest queue before the first that kills.
fn depth(depths: &[usize], groups: &[KnobRuns]) -> Result<(Answer, String), Failure> {
    let kills = groups.iter().position(|group| !group.all_up());
    let kills = kills.and_then(|kills| Some((kills.checked_sub(1)?, kills)));
    let (stands, kills) =
        kills.ok_or_else(|| Failure::Unmeasured("no depth stood and the next fell".to_owned()))?;
    let meaning = format!(
        "A full queue of {} messages makes each reading {} periods old and no older: the pushes \
         stay at {:.0} ms, just within the law of exercise 6. With one message more they grow to \
         {:.0} ms, and the pole falls. The drops that the deeper queue avoids were what kept the \
         pole up: a bound on the queue is a bound on the age. Read the newest, or keep the queue \
         short, or both.",
        depths[stands],
        depths[stands],
        groups[stands].push_age_ms(),
        groups[kills].push_age_ms(),
    );
    Ok((Answer::Exactly(depths[stands] as f64), meaning))
}

/// A row for each depth, so that the head stays in sight.
fn table(groups: &[KnobRuns]) -> Table {
    let mut table = Table::new(["depth", "stay up", "until", "dropped", "push age"]);
    for group in groups {
        let until = group.runs.iter().map(|run| run.sim_time.as_secs_f64());
        let drops = group.runs.iter().map(|run| dropped(run) as f64);
        table.row([
            group.value.clone(),
            group.up_of(),
            format!("{} s", span(until, 2)),
            span(drops, 0),
            format!("{:.1} ms", group.push_age_ms()),
        ]);
    }
    table
}

/// The least and the greatest of `values`, or one number where they are the same.
fn span(values: impl Iterator<Item = f64> + Clone, decimals: usize) -> String {
    let least = values.clone().fold(f64::INFINITY, f64::min);
    let most = values.fold(f64::NEG_INFINITY, f64::max);
    let [least, most] = [least, most].map(|number| format!("{number:.decimals$}"));
    match least == most {
        true => least,
        false => format!("{least} to {most}"),
    }
}

fn measurements(group: &KnobRuns) -> Vec<Measurement> {
    let mut measured = Vec::new();
    for (start, run) in group.runs.iter().enumerate() {
        let name = |what| format!("depth {}, seed {start}: {what}", group.value);
        measured.extend([
            Measurement::new(name("until (s)"), run.sim_time.as_secs_f64()),
            Measurement::new(name("/obs dropped"), dropped(run) as f64),
        ]);
    }
    measured
}
