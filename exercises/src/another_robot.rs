//! Another robot: what the limit of the cart-pole says of it.

use std::sync::Arc;

use ratelab::Hz;
use ratelab_experiment::Config;
use ratelab_plant::RobotPlant;
use ratelab_system::{KnobText, System, graph_file::GraphFile};

use crate::framework::{
    Answer, Failure, Findings, KnobRuns, Measurement, PredictionPlace, Table, edge, survey_of,
};

/// Starts for each delay.
const STARTS: u64 = 10;

/// Delays of `/action` (ms).
const DELAYS: [u32; 9] = [0, 10, 14, 18, 22, 26, 38, 44, 80];

/// What the cart-pole bears with a controller that is made from its model (ms), and how fast it falls
/// (1/s): `docs/plants.md`.
const CART_POLE: [f64; 2] = [83.0, 3.94];

/// The files of a robot.
struct RobotFiles {
    graph: &'static str,
    model: &'static str,
}

/// Two poles on a cart.
const DOUBLE: RobotFiles = RobotFiles {
    graph: include_str!("../../graphs/robots/double.toml"),
    model: include_str!("../../graphs/robots/double.xml"),
};

/// A quadrotor.
const QUAD: RobotFiles = RobotFiles {
    graph: include_str!("../../graphs/robots/quad.toml"),
    model: include_str!("../../graphs/robots/quad.xml"),
};

impl RobotFiles {
    /// Returns the robot, with another limit for all joints if one is given.
    fn robot(&self, limit: Option<f64>) -> Result<RobotPlant, Failure> {
        let limits = limit.map(|limit| format!("\nlimits = {{ \"*\" = {limit} }}\n"));
        let text = self.graph.to_owned() + &limits.unwrap_or_default();
        let file = GraphFile::parse(&text)?;
        let missing = || Failure::Unmeasured("the graph file has no robot".to_owned());
        let spec = file.plant().ok_or_else(missing)?;
        Ok(RobotPlant::built_in(self.model, spec)?)
    }
}

/// A robot with each delay.
struct RobotTrials {
    groups: [KnobRuns; DELAYS.len()],
    theory_ms: f64,
    /// How fast deviations grow without a controller (1/s).
    poles: Vec<f64>,
}

impl RobotTrials {
    fn run(robot: RobotPlant) -> Result<Self, Failure> {
        let theory = robot.bearable_delay(Hz::new(50.0)?);
        let theory_ms = theory.and_then(|delay| delay.ms()).unwrap_or(f64::NAN);
        let poles = robot.poles();
        let robot: Arc<dyn System> = Arc::new(robot);
        let knobs = KnobText(robot.knobs().aliases());
        let base = Config {
            setup: knobs.parse("rate actuator 1000")?.into_iter().collect(),
            ..Config::default()
        };
        let delays = DELAYS.map(|delay| format!("delay:{delay}"));
        let mut groups = survey_of(robot, base, "link /action", delays, STARTS)?;
        for (group, delay) in groups.iter_mut().zip(DELAYS) {
            group.value = delay.to_string();
        }
        Ok(Self {
            groups,
            theory_ms,
            poles,
        })
    }

    fn findings(&self, explain: impl Fn(&KnobRuns) -> String) -> Result<Findings, Failure> {
        let (stands, falls) = edge(&self.groups, KnobRuns::all_up)?;
        let balanced = self
            .groups
            .iter()
            .map(|group| group.balanced(format!("delay {} ms", group.value)));
        let theory = [
            Measurement::new("theory (ms)", self.theory_ms),
            Measurement::new("sum of the poles (1/s)", self.poles.iter().sum::<f64>()),
        ];
        Ok(Findings {
            table: Table::from_items(
                &self.groups,
                &[
                    ("delay", &|group| format!("{} ms", group.value)),
                    ("stand", &KnobRuns::up_of),
                    ("push age", &KnobRuns::push_age),
                ],
            ),
            place: PredictionPlace::Between,
            answer: Answer::Between {
                from: stands.number(),
                to: falls.number(),
            },
            meaning: explain(stands),
            measurements: balanced.chain(theory).collect(),
        })
    }
}

/// Returns the first question: a robot that falls faster.
pub(crate) fn pole() -> Result<Findings, Failure> {
    let trials = RobotTrials::run(DOUBLE.robot(None)?)?;
    let [cart_pole_ms, cart_pole] = CART_POLE;
    let poles: Vec<String> = trials
        .poles
        .iter()
        .map(|pole| format!("{pole:.2}/s"))
        .collect();
    let scaled = |pole: f64| cart_pole_ms * cart_pole / pole;
    trials.findings(|stands| {
        format!(
            "All starts stand {} ms; theory says {} ms. The cart-pole's number, as much less as this one \
             falls faster, would be {:.0} ms. But two deviations grow here, with {}, and one motor holds \
             both: by the sum it is {:.0} ms. That is a size, not a law: what a robot bears depends on \
             its controller, too. Measure it: ratelab margins.",
            stands.value,
            trials.theory_ms,
            scaled(trials.poles.first().copied().unwrap_or_default()),
            poles.join(" and "),
            scaled(trials.poles.iter().sum()),
        )
    })
}

/// Returns the second question: a robot in which nothing falls.
pub(crate) fn no_pole() -> Result<Findings, Failure> {
    let trials = RobotTrials::run(QUAD.robot(None)?)?;
    let gentle = RobotTrials::run(QUAD.robot(Some(5.0))?)?;
    trials.findings(|stands| {
        format!(
            "All starts stand a delay of {} ms; theory says {} ms. Nothing in it falls by itself: the \
             controller tips it, by pushes that were right before the delay. So the limit is the \
             controller's, not the robot's. With limits of 5 m and rad in the place of 0.5, which make \
             it gentler, theory says {} ms. Even a robot that stands by itself can be lost by old \
             feedback.",
            stands.value, trials.theory_ms, gentle.theory_ms,
        )
    })
}
