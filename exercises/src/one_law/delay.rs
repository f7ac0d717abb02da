//! Which delay fells the pole at a control rate.

use crate::framework::{
    Answer, Brief, Exercise, ExerciseKind, Failure, Findings, KnobRuns, Measurement, Range, Table,
    Tolerance, own_world, survey,
};

/// Delays of `/action` (ms).
const DELAYS: [u32; 11] = [0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100];

/// Starts for each delay.
const STARTS: u64 = 6;

const RANGE: Range = Range {
    least: 0.0,
    most: 100.0,
    whole: false,
};

/// The first question: at 50 Hz.
pub const AT_50_HZ: Delay = Delay {
    brief: &Brief {
        number: 6,
        part: "a",
        name: "one-law-50",
        title: "One law: a delay at 50 Hz",
        kind: ExerciseKind::PredictThenRun,
        objective: "From here on the world does not wait: the plant moves by itself, and the \
                    actuator applies an action within 2 ms of its delivery. All nodes keep their \
                    rates, the policy 50 Hz, but the network holds each action back for a constant \
                    time: 0, 10, 20 and so on up to 100 ms. Each delay runs for ten seconds from \
                    six starts.",
        question: "At which delay does the pole first fail to stay up?",
        quantity: "delay",
        unit: "ms",
        tolerance: Tolerance::Between,
        range: RANGE,
        choices: &[],
    },
    hz: 50.0,
    next: Some(&AT_25_HZ),
    meaning: "What is in force is older than the delay: a push is held until the next one is \
              applied. The last column is the mean age of the reading behind the push in force, \
              the push age.",
};

/// The second question: at 25 Hz.
pub const AT_25_HZ: Delay = Delay {
    brief: &Brief {
        number: 6,
        part: "b",
        name: "one-law-25",
        title: "One law: a delay at 25 Hz",
        kind: ExerciseKind::PredictThenRun,
        objective: "The same delays once more, and now the policy decides 25 times a second, so \
                    that each push is held for 40 ms and no longer for 20. Nothing else has \
                    changed. Look at the push ages of the first table before you predict.",
        question: "At 25 Hz, at which delay does the pole first fail to stay up?",
        quantity: "delay",
        unit: "ms",
        tolerance: Tolerance::Between,
        range: RANGE,
        choices: &[],
    },
    hz: 25.0,
    next: Some(&super::LAW),
    meaning: "The same delay is worth more harm at 25 Hz, and by a fixed amount: to hold a push \
              for 20 ms longer makes it 10 ms older on average. Compare the push ages between \
              which the pole falls in the two tables, not the delays.",
};

/// A question about the delay at one control rate.
pub struct Delay {
    brief: &'static Brief,
    hz: f64,
    next: Option<&'static dyn Exercise>,
    meaning: &'static str,
}

impl Exercise for Delay {
    fn brief(&self) -> &'static Brief {
        self.brief
    }

    fn measure(&self, _seed: u64) -> Result<Findings, Failure> {
        let base = own_world(&format!("rate actuator 500, control-hz {}", self.hz))?;
        let links = DELAYS.map(|delay| format!("delay:{delay}"));
        let groups = survey(base, "link /action", &links, 0..STARTS)?;
        let turn = groups.iter().position(|group| !group.all_up());
        let turn = turn.and_then(|turn| Some((turn.checked_sub(1)?, turn)));
        let (held, failed) =
            turn.ok_or_else(|| Failure::Unmeasured("no delay held and then fell".to_owned()))?;
        let rows = || DELAYS.iter().zip(&groups);
        Ok(Findings {
            table: table(rows()),
            refuted: Vec::new(),
            answer: Answer::Between {
                from: DELAYS[held].into(),
                to: DELAYS[failed].into(),
            },
            meaning: format!(
                "At {} ms every start stayed up, with a push age of {:.0} ms; at {} ms {} did, \
                 with {:.0} ms. {}",
                DELAYS[held],
                groups[held].push_age_ms(),
                DELAYS[failed],
                groups[failed].up_of(),
                groups[failed].push_age_ms(),
                self.meaning,
            ),
            measurements: rows().flat_map(measurements).collect(),
        })
    }

    fn next_part(&self) -> Option<&'static dyn Exercise> {
        self.next
    }
}

fn table<'g>(rows: impl Iterator<Item = (&'g u32, &'g KnobRuns)>) -> Table {
    let mut table = Table::new(["delay", "balanced", "push age"]);
    for (delay, group) in rows {
        table.row([
            format!("{delay} ms"),
            group.up_of(),
            format!("{:.1} ms", group.push_age_ms()),
        ]);
    }
    table
}

fn measurements((delay, group): (&u32, &KnobRuns)) -> [Measurement; 2] {
    [
        Measurement::new(format!("{delay} ms: starts balanced"), group.up() as f64),
        Measurement::new(format!("{delay} ms: push age (ms)"), group.push_age_ms()),
    ]
}
