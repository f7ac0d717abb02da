//! Hold or zero: what an actuator does while nothing new arrives.

use ratelab::Hz;
use ratelab_cart_pole::{
    CONTROL_HZ,
    policy::Scripted,
    stability::{Loop, Lost, StabilityError, Timing, WorldModel},
};

use crate::framework::{
    Answer, Brief, Exercise, ExerciseKind, Failure, Findings, KnobRuns, Measurement, Range, Table,
    Tolerance, own_world, survey,
};

/// Starts for each loss.
const STARTS: u64 = 20;

/// Probabilities of loss.
const LOSSES: [&str; 5] = ["0.5", "0.6", "0.7", "0.8", "0.9"];

/// The probability of the question.
const ASKED: &str = "0.8";

const RANGE: Range = Range {
    least: 0.0,
    most: STARTS as f64,
    whole: true,
};

/// The first question: the last action is held.
pub const HOLD: HoldOrZero = HoldOrZero {
    brief: &Brief {
        number: 9,
        part: "a",
        name: "hold",
        title: "Hold or zero: hold",
        kind: ExerciseKind::PredictThenRun,
        objective: "Four of five actions are lost on the way, each on its own: 80 %. The policy \
                    decides 50 times a second, so ten still arrive in a second, as many as from a \
                    policy at 10 Hz. While nothing new arrives the actuator holds the last \
                    action. The world does not wait. Losses of 50 to 90 % run for ten seconds \
                    from 20 starts each.",
        question: "At a loss of 80 %, how many of the 20 starts stay up?",
        quantity: "starts up",
        unit: "",
        tolerance: Tolerance::Within(2.0),
        range: RANGE,
        choices: &[],
    },
    zero: false,
};

/// The second question: no force once the action is old.
pub const ZERO: HoldOrZero = HoldOrZero {
    brief: &Brief {
        number: 9,
        part: "b",
        name: "zero",
        title: "Hold or zero: zero",
        kind: ExerciseKind::PredictThenRun,
        objective: "The same losses once more, draw for draw. Now the actuator lets go: where no \
                    action arrives in time for its tick it pushes no more, until one does. Four of \
                    five times there is then no force at all.",
        question: "At a loss of 80 %, how many of the 20 starts stay up with no force?",
        quantity: "starts up",
        unit: "",
        tolerance: Tolerance::Within(2.0),
        range: RANGE,
        choices: &[],
    },
    zero: true,
};

/// A question about a way to bridge losses.
pub struct HoldOrZero {
    brief: &'static Brief,
    zero: bool,
}

impl Exercise for HoldOrZero {
    fn brief(&self) -> &'static Brief {
        self.brief
    }

    fn measure(&self, _seed: u64) -> Result<Findings, Failure> {
        let held = losses("hold")?;
        if !self.zero {
            let asked = asked(&held)?;
            return Ok(Findings {
                table: table(&[("hold", &held)]),
                refuted: Vec::new(),
                answer: Answer::Exactly(asked.up() as f64),
                meaning: format!(
                    "{} stayed up, though ten actions a second are enough where they come evenly. \
                     Chance is not even: of 500 messages twenty lost in a row are no surprise, \
                     and for so long, 0.4 s, the motor pushes one way, by a reading of a pole that \
                     has long moved on. The mean says nothing of the longest gap.",
                    asked.up_of(),
                ),
                measurements: measurements("hold", &held),
            });
        }
        let let_go = losses("zero:0")?;
        let asked = asked(&let_go)?;
        let [hold_margin, zero_margin] = [margin(Lost::Hold)?, margin(Lost::Zero)?];
        let mut measured = measurements("zero", &let_go);
        measured.push(Measurement::new("loss margin, hold", hold_margin));
        measured.push(Measurement::new("loss margin, zero", zero_margin));
        Ok(Findings {
            table: table(&[("hold", &held), ("zero", &let_go)]),
            refuted: Vec::new(),
            answer: Answer::Exactly(asked.up() as f64),
            meaning: format!(
                "{} stayed up with no force between two actions. An old push is worse than none: \
                 it was right for a pole that leant the other way. Theory agrees about small \
                 deviations: their squares shrink on average up to a loss of {:.0} % where the \
                 last action is held, and up to {:.0} % where there is none. It is no rule for \
                 every plant: a pole forgives a moment without force, a drone does not.",
                asked.up_of(),
                hold_margin * 100.0,
                zero_margin * 100.0,
            ),
            measurements: measured,
        })
    }

    fn next_part(&self) -> Option<&'static dyn Exercise> {
        (!self.zero).then_some(&ZERO)
    }
}

/// All losses, with this handling of stale actions.
fn losses(on_stale: &str) -> Result<Vec<KnobRuns>, Failure> {
    let base = own_world(&format!("on-stale {on_stale}"))?;
    let links = LOSSES.map(|loss| format!("loss:{loss}"));
    survey(base, "link /action", &links, 0..STARTS)
}

fn asked(groups: &[KnobRuns]) -> Result<&KnobRuns, Failure> {
    let mut asked = groups.iter();
    let asked = asked.find(|group| group.value == format!("loss:{ASKED}"));
    asked.ok_or_else(|| Failure::Unmeasured("no such loss".to_owned()))
}

/// The loss at which the expected square of a small deviation grows.
fn margin(lost: Lost) -> Result<f64, Failure> {
    let timing = Timing::direct(Hz::new(CONTROL_HZ)?);
    let control = Loop::cart_pole(Scripted::GAINS, WorldModel::Continuous, timing);
    Ok(control.map_err(StabilityError::from)?.loss_margin(lost)?)
}

fn table(ways: &[(&str, &Vec<KnobRuns>)]) -> Table {
    let mut table = Table::new(["loss", "between two actions", "stay up", "push age"]);
    for (index, loss) in LOSSES.iter().enumerate() {
        for (way, groups) in ways {
            let group = &groups[index];
            table.row([
                (*loss).to_owned(),
                (*way).to_owned(),
                group.up_of(),
                format!("{:.1} ms", group.push_age_ms()),
            ]);
        }
    }
    table
}

fn measurements(way: &str, groups: &[KnobRuns]) -> Vec<Measurement> {
    let measured = LOSSES.iter().zip(groups).map(|(loss, group)| {
        let name = format!("{way}, loss {loss}: starts balanced");
        Measurement::new(name, group.up() as f64)
    });
    measured.collect()
}
