//! The cart-pole as a system: sensor, policy and actuator around a plant.

use std::{fmt::Display, path::PathBuf, str::FromStr};

use ratelab::{ClockExit, Hz, Knob, Tick, Time};
use ratelab_experiment::Config;
use ratelab_metrics::Fields;
use ratelab_policy::chunk::{ChunkLoop, ChunkSettings, ChunkTally, PLAYER};
use ratelab_system::{
    About, AgeLimits, Alias, BuildError, Builder, Final, Group, Joints, Judge, KnobText,
    KnobTextError, Picture, Planning, QuadraticCost, RobotInfo, RunTally, Setup, Signal,
    SignalValue, StateTable, System, SystemKnobs, Verdict, VerdictKind, WORLD, WorldKind, overload,
};

use super::{
    ACTION, ACTUATOR, CONTROL_HZ, ControlStep, DISTURB, Fall, FreePlant, OBS, OBSERVE, OnStale,
    POLE_LIMIT_RAD, POLICY, ParameterError, Plant, Pose, SENSE_TO_ACT, SENSOR, SIMILAR,
    SharedPlant, SimilarReadings, actuator_hz,
    aliases::ALIASES,
    chunk::{CartChunks, MODEL, ModelError, PLANNING, PlanKind},
    in_words, mujoco_version, picture,
    plant::Newtons,
    policy::{
        CartTerms, Policy, PolicyCache, PolicyContext, PolicyKind, PolicySpec, SwappablePolicy,
    },
    table,
    verdict::{self, falls},
    wiring::{Topics, other, setting_error},
};
use crate::stability::{Rates, Weights, age_limit};

/// Name of the topic with the state of the plant after each control step.
pub const STATE: &str = "/state";

/// A control rate at which the scripted policy loses the pole for every seed (Hz).
pub const BROKEN_HZ: f64 = 5.0;

/// Makes the policy of a run.
type MakePolicy = dyn Fn(PolicyContext) -> Box<dyn Policy> + Send + Sync;

/// The cart-pole. All its runs share the policies it has loaded.
#[derive(Default)]
pub struct CartPole {
    policies: PolicyCache,
    own: Option<Box<MakePolicy>>,
}

impl CartPole {
    /// Parses and writes knobs with the cart-pole's aliases.
    pub const KNOBS: KnobText = KnobText(ALIASES);

    /// Creates a cart-pole with the caller's own policy, built for every run.
    ///
    /// ```
    /// use std::sync::Arc;
    /// use ratelab_cart_pole::{Action, CartPole, Observation, policy::Policy};
    /// use ratelab_experiment::{Config, Experiment};
    ///
    /// /// Pushes with all it has to where the pole leans.
    /// struct BangBang;
    ///
    /// impl Policy for BangBang {
    ///     fn name(&self) -> &str {
    ///         "bang-bang"
    ///     }
    ///
    ///     fn act(&mut self, observation: &Observation) -> Action {
    ///         Action(observation.sin_theta.signum())
    ///     }
    /// }
    ///
    /// let system = CartPole::with_policy(|_| Box::new(BangBang));
    /// let summary = Experiment::new(Arc::new(system), &Config::default())?.run()?;
    /// assert!(summary.verdict.is_lost());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn with_policy(
        make: impl Fn(PolicyContext) -> Box<dyn Policy> + Send + Sync + 'static,
    ) -> Self {
        Self {
            own: Some(Box::new(make)),
            ..Self::default()
        }
    }

    /// Ten seconds of virtual time with the knobs in `setup`, a comma-separated list such
    /// as `control-hz 5, policy lqr`.
    ///
    /// # Errors
    /// [`KnobTextError`] for an invalid knob.
    pub fn config(setup: &str) -> Result<Config, KnobTextError> {
        let mut config = Config::default();
        for knob in setup.split(',').filter(|knob| !knob.trim().is_empty()) {
            config.setup.extend(Self::KNOBS.parse(knob)?);
        }
        Ok(config)
    }

    /// Returns the policy called `text`, or the caller's own.
    fn policy(
        &self,
        builder: &mut Builder<'_>,
        context: PolicyContext,
    ) -> Result<Box<dyn Policy>, BuildError> {
        let text = builder.message(POLICY);
        builder.parameter(POLICY, OBSERVE); // It is made with it.
        if let (None, Some(make)) = (text, &self.own) {
            return Ok(make(context));
        }
        let name = text.unwrap_or(PolicyKind::Scripted.name());
        let policy: PolicySpec = name.parse().map_err(setting_error)?;
        let answers = builder.answers(POLICY);
        let cache = self.policies.seeing(terms(builder.setup()));
        let policy = SwappablePolicy::new(&policy, cache, context, answers);
        Ok(Box::new(policy.map_err(setting_error)?))
    }
}

/// Returns the inputs of a run's policies.
fn context(seed: u64, setup: &Setup) -> PolicyContext {
    let chunk = chunks(setup);
    let control_hz = setup.rate(POLICY).filter(|_| chunk.is_none());
    PolicyContext {
        seed,
        control_hz: control_hz.unwrap_or(actuator_hz()),
        chunk: chunk.map(|chunk| chunk.horizon.get()),
    }
}

/// Returns what a policy in a file sees by `setup`.
fn terms(setup: &Setup) -> CartTerms {
    let set = setup.parameter(POLICY, OBSERVE);
    set.and_then(|terms| terms.parse().ok()).unwrap_or_default()
}

/// Returns the settings of chunks in `setup`, if the policy answers with any.
fn chunks(setup: &Setup) -> Option<ChunkSettings> {
    let chunks = CartChunks::from_setup(setup).ok().flatten();
    chunks.map(|chunks| chunks.settings)
}

/// Returns the shortest form of a setting.
fn shortest<T: FromStr<Err = ParameterError> + Display>(text: &str) -> Result<String, String> {
    text.parse::<T>()
        .map(|setting| setting.to_string())
        .map_err(in_words)
}

impl System for CartPole {
    fn name(&self) -> &str {
        "cart-pole"
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let context = context(builder.seed(), builder.setup());
        let policy = self.policy(builder, context)?;
        let topics = Topics {
            observations: builder.topic(OBS),
            actions: builder.topic(ACTION),
        };
        let steps = builder.topic(STATE);
        match builder.world() {
            WorldKind::Course => {
                let plant = SharedPlant::new(Plant::new(builder.seed()).map_err(other)?);
                topics.robot(builder, plant, policy, Some(steps))
            }
            WorldKind::Own { step_ms } => {
                let plant = FreePlant::new(step_ms, builder.seed()).map_err(other)?;
                let plant = builder.own_world(plant, CONTROL_HZ, |wiring| {
                    let steps = wiring.publisher(&steps);
                    move |plant: &FreePlant, tick: &mut Tick| plant.judge(tick, &steps)
                })?;
                topics.robot(builder, plant, policy, None)
            }
        }
    }

    fn about(&self) -> About<'_> {
        About {
            state: Some(STATE),
            latency: Some((ACTUATOR, SENSE_TO_ACT)),
            captions: &[
                (SENSOR, "reads the plant"),
                (POLICY, "decides"),
                (PLAYER, "plays"),
                (ACTUATOR, "pushes"),
                (WORLD, "moves by itself"),
            ],
            ..About::default()
        }
    }

    fn groups(&self) -> Vec<Group> {
        vec![Group::new("plant", [WORLD, SENSOR, ACTUATOR])]
    }

    fn signals(&self) -> Vec<Signal> {
        const LIMIT: f64 = POLE_LIMIT_RAD / std::f64::consts::PI * 180.0;
        vec![
            Signal {
                name: "pole angle".into(),
                unit: "°".into(),
                topic: STATE.into(),
                value: SignalValue::new(|row| pole_angle(row).to_degrees()),
                limits: Some([-LIMIT, LIMIT]),
                range: [-14.0, 14.0],
            },
            Signal {
                name: "cart position".into(),
                unit: "m".into(),
                topic: STATE.into(),
                value: SignalValue::new(|row| row.get(3).copied().unwrap_or(f64::NAN)),
                limits: Some([-super::CART_LIMIT_M, super::CART_LIMIT_M]),
                range: [-2.6, 2.6],
            },
            Signal {
                name: "action".into(),
                unit: "share of 10 N".into(),
                topic: STATE.into(),
                value: SignalValue::new(|row| row.get(1).copied().unwrap_or(f64::NAN)),
                limits: None,
                range: [-1.0, 1.0],
            },
        ]
    }

    fn warnings(&self, setup: &Setup) -> Vec<String> {
        let Some(settings) = chunks(setup) else {
            return Vec::new();
        };
        let policy = setup.message(POLICY).unwrap_or(PolicyKind::Scripted.name());
        let policy: Option<PolicySpec> = policy.parse().ok();
        let known = ChunkLoop {
            is_program: policy.as_ref().is_some_and(PolicySpec::is_program),
            bears: policy
                .and_then(|policy| falls(&policy, actuator_hz()))
                .map(|[_, constant]| constant),
        };
        known.warnings(setup, &settings)
    }

    fn overloads(&self, setup: &Setup) -> Vec<String> {
        let asked = chunks(setup).is_some_and(|chunk| chunk.refill.is_some());
        let paced = [SENSOR, POLICY, PLAYER, ACTUATOR]
            .into_iter()
            .filter(|node| !(asked && *node == POLICY));
        let rate = |node| setup.rate(node).unwrap_or(actuator_hz());
        let overloads = paced.filter_map(|node| overload(node, rate(node), setup));
        overloads.collect()
    }

    fn judge(&self) -> &dyn Judge {
        self
    }

    fn robot(&self) -> &dyn RobotInfo {
        self
    }

    fn knobs(&self) -> &dyn SystemKnobs {
        self
    }
}

impl Judge for CartPole {
    fn verdict(&self, exit: &ClockExit, at: Time, state: Option<&[f64]>) -> Verdict {
        let fall = state.and_then(pose).and_then(|pose| pose.fall());
        let kind = match (fall, exit) {
            (Some(Fall::Pole), _) => verdict::POLE_FELL,
            (Some(Fall::Cart), _) => verdict::CART_LEFT_RAIL,
            (None, ClockExit::Completed) if state.is_none() => verdict::NEVER_MOVED,
            (None, ClockExit::Completed) => verdict::BALANCED,
            (None, _) => verdict::STOPPED,
        };
        Verdict::new(kind, at)
    }

    fn verdicts(&self) -> Vec<VerdictKind> {
        verdict::ALL.to_vec()
    }

    fn finals(&self, state: &[f64]) -> Vec<Final> {
        vec![Final {
            name: "final_pole_angle".into(),
            unit: "rad".into(),
            value: pole_angle(state),
        }]
    }

    fn tally(&self, setup: &Setup) -> Option<Box<dyn RunTally>> {
        chunks(setup)?;
        Some(Box::new(ChunkTally::new(1)))
    }

    fn quadratic_cost(&self) -> Option<QuadraticCost> {
        Some(QuadraticCost {
            sum: "(x/2.4 m)^2 + (angle/12 deg)^2 + u^2",
            of_state: cost_of,
        })
    }

    fn lost_anyway(&self, setup: &Setup) -> Option<String> {
        match setup.message(POLICY)?.parse().ok()? {
            PolicySpec::BuiltIn(kind @ (PolicyKind::Zero | PolicyKind::Random)) => {
                Some(format!("the {kind} policy balances at no rate"))
            }
            _ => None,
        }
    }

    fn age_limits(&self, setup: &Setup) -> AgeLimits {
        let named = setup.message(POLICY);
        if named.is_none() && self.own.is_some() {
            return AgeLimits::default();
        }
        let policy = named.unwrap_or(PolicyKind::Scripted.name()).parse();
        // A plan has an action for each tick of the player, however rarely it is made.
        let plans = chunks(setup).is_some_and(|chunk| chunk.plan != PlanKind::Hold);
        let control = setup.rate(POLICY).filter(|_| !plans);
        let [sensor, control] = [setup.rate(SENSOR), control].map(|hz| hz.unwrap_or(actuator_hz()));
        let Ok(policy) = policy else {
            return AgeLimits::default();
        };
        let band = falls(&policy, control);
        AgeLimits {
            grows: age_limit(&policy, Rates { sensor, control }).ok(),
            may_fall: band.map(|[jittered, _]| jittered),
            falls: band.map(|[_, constant]| constant),
        }
    }
}

impl RobotInfo for CartPole {
    fn picture(&self, state: &[f64]) -> Option<Picture> {
        Some(picture::draw(&ControlStep::from_row(state)?))
    }

    fn table(&self) -> Option<StateTable> {
        Some(table::TABLE)
    }

    fn engine(&self) -> Option<(&str, &str)> {
        Some(("MuJoCo", mujoco_version()))
    }

    fn joints(&self) -> &'static [Joints] {
        &super::message::JOINTS
    }

    fn planning(&self) -> Option<Planning> {
        Some(PLANNING)
    }

    /// No push from five control periods after the sensing behind the newest action.
    fn watchdog(&self, setup: &Setup) -> Option<String> {
        let hz = setup.rate(POLICY).map_or(CONTROL_HZ, Hz::get);
        Some(format!("on-stale zero:{}", 5.0 * 1e3 / hz))
    }
}

impl SystemKnobs for CartPole {
    fn aliases(&self) -> &'static [Alias] {
        Self::KNOBS.0
    }

    fn broken(&self) -> Option<&'static str> {
        Some("control-hz 5")
    }

    fn is_fixed(&self, knob: &Knob) -> bool {
        let Knob::Parameter { node, name, .. } = knob else {
            return false;
        };
        let own = [[POLICY, MODEL], [POLICY, OBSERVE]];
        let mut fixed = ChunkSettings::FIXED.into_iter().chain(own);
        fixed.any(|fixed| fixed == [&**node, &**name])
    }

    /// Pins a policy's file to its current content.
    fn resolve(&self, seed: u64, setup: &Setup, node: &str, text: &str) -> Result<String, String> {
        if node == ACTUATOR {
            return shortest::<OnStale>(text);
        }
        if node != POLICY {
            return Ok(text.to_owned());
        }
        let context = context(seed, setup);
        let policy = text.parse::<PolicySpec>().map_err(in_words)?;
        // As in a log, which names a program and has none started.
        if policy.is_program() {
            return Ok(policy.to_string());
        }
        let policies = self.policies.seeing(terms(setup));
        let pinned = policies.pin(&policy).and_then(|pinned| {
            // The node would refuse a policy that cannot be created.
            pinned.policy(context)?;
            // Without chunks here a sweep may still have them as an axis.
            if context.chunk.is_some() {
                pinned.check_chunk(context.chunk)?;
            }
            Ok(pinned)
        });
        match pinned {
            Ok(pinned) => Ok(pinned.spec().to_string()),
            Err(error) => Err(in_words(error)),
        }
    }

    fn parameter(&self, [node, name]: [&str; 2], value: &str) -> Result<String, String> {
        let known = ChunkSettings::PARAMETERS
            .into_iter()
            .find(|(of, known, _)| [*of, *known] == [node, name]);
        match (node, name, known) {
            (ACTUATOR, DISTURB, _) => shortest::<Newtons>(value),
            (POLICY, OBSERVE, _) => shortest::<CartTerms>(value),
            (POLICY, MODEL, _) => shortest::<ModelError>(value),
            (SENSOR, SIMILAR, _) => SimilarReadings::parse(value)
                .map(|similar| similar.norm().to_string())
                .map_err(in_words),
            (.., Some((.., shortest))) => shortest(value).map_err(in_words),
            _ => Err(format!("{node} has no parameter {name:?}")),
        }
    }

    fn file(&self, node: &str, text: &str) -> Option<PathBuf> {
        match text.parse().ok().filter(|_| node == POLICY)? {
            PolicySpec::File(file) => Some(PathBuf::from(file.path)),
            PolicySpec::BuiltIn(_) => None,
        }
    }

    fn is_program(&self, node: &str, text: &str, looks: bool) -> bool {
        let policy: Option<PolicySpec> = text.parse().ok().filter(|_| node == POLICY);
        policy.is_some_and(|policy| {
            let found = || policy.load().is_ok_and(|loaded| loaded.spec().is_program());
            policy.is_program() || looks && found()
        })
    }
}

fn pose(state: &[f64]) -> Option<Pose> {
    let step = ControlStep::from_row(state)?;
    Some(Pose::new(step.qpos))
}

/// Returns what a state costs, by the weights of `lqr`: 1 for a cart at the end of its rail, a pole
/// at its limit, and a motor that has no more.
fn cost_of(state: &[f64]) -> f64 {
    let &[_, action, _, cart, hinge, ..] = state else {
        return 0.0;
    };
    let (weights, pole) = (Weights::default(), Pose::new([cart, hinge]).pole_angle);
    let [of_cart, of_pole, ..] = weights.state;
    of_cart * cart * cart + of_pole * pole * pole + weights.action * action * action
}

/// Returns the pole's angle from upright in a message on [`STATE`] (rad).
pub fn pole_angle(state: &[f64]) -> f64 {
    pose(state).map_or(0.0, |pose| pose.pole_angle)
}
