//! The policy that thinks: it answers late, with a chunk of actions.

use crate::framework::{
    Answer, Failure, Findings, KnobRuns, Measurement, PredictionPlace, Table, asked, edge,
    own_world, survey,
};

/// Starts for each run.
const STARTS: u64 = 20;

/// The thinking times of the first question (ms).
const TIMES: [&str; 5] = ["20", "40", "60", "100", "200"];

/// What the policy of the questions does.
const THINKS: &str = "chunk 50, control-hz 5, takes policy 200, expect-delay 200";

/// The changes to choose from in the second question: a knob, and its value.
const CHANGES: [(&str, &str); 5] = [
    ("chunk", "100"),
    ("merge", "blend:0.7"),
    ("merge", "ensemble:0.01"),
    ("play", "arrival"),
    ("plan", COMMITTED),
];

/// A plan that knows what the robot does meanwhile.
const COMMITTED: &str = "committed";

/// Standard deviations of a force on the cart (N).
const FORCES: [&str; 6] = ["0", "0.5", "1", "1.5", "2", "2.5"];

/// Returns the first question: whether a chunk is enough.
pub(crate) fn chunk() -> Result<Findings, Failure> {
    let groups = survey(own_world("chunk 50")?, "takes policy", TIMES, STARTS)?;
    let up = asked(&groups, |group| group.value == "200")?;
    let (stands, falls) = edge(&groups, KnobRuns::all_up)?;
    let thinks = |group: &KnobRuns| format!("{} ms", group.value);
    Ok(Findings {
        table: table("thinks", thinks, &groups),
        place: PredictionPlace::Row(TIMES.len() - 1),
        answer: Answer::Exactly(up.up() as f64),
        meaning: format!(
            "{} stayed up. The chunk has an action for every instant, but each was planned as if \
             the robot had done nothing since the reading. Meanwhile the robot played the chunk \
             before. So the push age counts again: the pole stands with {}, and falls with {}, \
             much as in exercise 6, where nothing was planned.",
            up.up_of(),
            stands.push_age(),
            falls.push_age(),
        ),
        measurements: measurements("thinking (ms)", &groups).collect(),
    })
}

/// Returns the second question: what the policy must know.
pub(crate) fn knowledge() -> Result<Findings, Failure> {
    let mut groups = Vec::new();
    for (knob, value) in CHANGES {
        for mut group in survey(own_world(THINKS)?, knob, [value], STARTS)? {
            group.value = format!("{knob} {value}");
            groups.push(group);
        }
    }
    let saves = groups
        .iter()
        .position(KnobRuns::all_up)
        .ok_or_else(|| Failure::Unmeasured("nothing saves it".to_owned()))?;
    let refuted = groups
        .iter()
        .map(|group| format!("With {}, {} stayed up.", group.value, group.up_of()));
    Ok(Findings {
        table: table("change", |group| group.value.clone(), &groups),
        place: PredictionPlace::Choice,
        answer: Answer::Choice {
            number: (saves + 1) as f64,
            refuted: refuted.collect(),
        },
        meaning: format!(
            "The pushes are not younger: {}. But the plan begins with the actions that the robot \
             will play until the plan is there, so the model is where the robot will be. Control \
             calls it a Smith predictor, learned policies a frozen prefix. The other four repairs \
             use only what the chunks already hold. And averaging makes even right answers late.",
            groups[saves].push_age(),
        ),
        measurements: measurements("", &groups).collect(),
    })
}

/// Returns the third question: what no plan can know.
pub(crate) fn disturbed() -> Result<Findings, Failure> {
    let base = own_world(&format!("{THINKS}, plan {COMMITTED}"))?;
    let late = survey(base, "disturb", FORCES, STARTS)?;
    let at_once = survey(own_world("")?, "disturb", FORCES, STARTS)?;
    let (bears, too_much) = edge(&late, |group| 2 * group.up() >= group.runs.len())?;
    let rows: Vec<_> = late.iter().zip(&at_once).collect();
    Ok(Findings {
        table: Table::from_items(
            &rows,
            &[
                ("force", &|(late, _)| format!("{} N", late.value)),
                ("stay up, 200 ms", &|(late, _)| late.up_of()),
                ("stay up, at once", &|(_, at_once)| at_once.up_of()),
                ("push age, 200 ms", &|(late, _)| late.push_age()),
            ],
        ),
        place: PredictionPlace::Between,
        answer: Answer::Between {
            from: bears.number(),
            to: too_much.number(),
        },
        meaning: format!(
            "With {} N {} stayed up, with {} N {}; the motor has 10 N. The plan knows what the \
             robot does, but not what is done to it: the policy sees a random push {} later, and \
             the push has grown. Nobody predicted this part of the age. A policy that answers at once \
             stands far more, and so does one that thinks half as long. The age is the limit again, \
             only a higher one.",
            bears.value,
            bears.up_of(),
            too_much.value,
            too_much.up_of(),
            bears.push_age(),
        ),
        measurements: measurements("committed, force (N)", &late)
            .chain(measurements("at once, force (N)", &at_once))
            .collect(),
    })
}

fn table(head: &str, name: impl Fn(&KnobRuns) -> String, groups: &[KnobRuns]) -> Table {
    Table::from_items(
        groups,
        &[
            (head, &name),
            ("stay up", &KnobRuns::up_of),
            ("push age", &KnobRuns::push_age),
        ],
    )
}

fn measurements(what: &str, groups: &[KnobRuns]) -> impl Iterator<Item = Measurement> {
    groups.iter().map(move |group| {
        let subject = format!("{what} {}", group.value);
        group.balanced(subject.trim_start())
    })
}
