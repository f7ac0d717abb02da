//! The graph: sensor, policy and actuator, and the player of a policy that answers with chunks.

use ratelab::{Depth, KnobKind, Match, Topic};
use ratelab_system::{BuildError, Builder, SharedWorld};

use super::{
    ACTUATOR, Action, Actuator, CONTROL_HZ, CartPlant, ControlStep, Observation, POLICY,
    PolicyNode, SENSOR, SIMILAR, Sensor, SimilarReadings, actuator_hz,
    chunk::{
        CHUNK, Chunk, ChunkPlanner, ChunkPolicy, ChunkSettings, PLAYER, PLAYER_STEP, Player,
        REQUEST,
    },
    policy::Policy,
};

/// The topics between the nodes.
pub(crate) struct Topics {
    pub(crate) observations: Topic<Observation>,
    pub(crate) actions: Topic<Action>,
}

impl Topics {
    /// Adds sensor, policy and actuator around `plant`; the actuator moves it, and publishes its
    /// `steps`, unless it moves by itself.
    pub(crate) fn robot(
        &self,
        builder: &mut Builder<'_>,
        plant: SharedWorld<impl CartPlant>,
        policy: Box<dyn Policy>,
        steps: Option<Topic<ControlStep>>,
    ) -> Result<(), BuildError> {
        let (observations, seen) = (self.observations.clone(), plant.clone());
        let similar = builder
            .parameter(SENSOR, SIMILAR)
            .map(SimilarReadings::parse)
            .transpose()
            .map_err(setting_error)?
            .unwrap_or_default();
        builder.node(SENSOR, CONTROL_HZ, 0, move |wiring| Sensor {
            plant: seen.clone(),
            observations: wiring.publisher(&observations),
            similar,
        })?;
        let observations = builder.through(&self.observations, 0)?;
        let last = match self.chunks(builder)? {
            Some(chunks) => self.with_chunks(builder, policy, &observations, chunks)?,
            None => {
                builder.single_node(POLICY, actuator_hz().into(), 1, |wiring| PolicyNode {
                    policy,
                    observations: wiring.subscription(&observations),
                    actions: wiring.publisher(&self.actions),
                })?;
                1
            }
        };
        let actions = builder.through(&self.actions, last)?;
        // Its rate was a knob once, and there are recordings of that.
        let was_turned = builder.was_turned(KnobKind::Rate, ACTUATOR);
        let fixed: &[KnobKind] = match (&steps, was_turned) {
            (None, _) => &[],
            (Some(_), true) => &[KnobKind::Clock, KnobKind::StampClock],
            (Some(_), false) => &[KnobKind::Rate, KnobKind::Clock, KnobKind::StampClock],
        };
        builder.node(ACTUATOR, CONTROL_HZ, last + 1, move |wiring| {
            const REASON: &str = "each of its ticks is 20 ms of the plant's time: \
                choose another node, or the world \"own\"";
            wiring.fix(fixed.iter().copied(), REASON);
            Actuator::wired(wiring, plant.clone(), &actions, steps.as_ref())
        })
    }

    /// Returns the settings of chunks, if the policy answers with any.
    fn chunks(&self, builder: &mut Builder<'_>) -> Result<Option<ChunkSettings>, BuildError> {
        let mut set = Vec::new();
        for (node, name, _) in ChunkSettings::PARAMETERS {
            set.extend(builder.parameter(node, name).map(|_| name));
        }
        match set.first() {
            Some(name) if !set.contains(&ChunkSettings::CHUNK) => {
                Err(BuildError::Setting(format!(
                    "--{name} is for a policy that answers with chunks: give --chunk H as well"
                )))
            }
            _ => ChunkSettings::from_setup(builder.setup()).map_err(setting_error),
        }
    }

    /// Adds a policy that answers with chunks, and their player; returns its priority.
    fn with_chunks(
        &self,
        builder: &mut Builder<'_>,
        policy: Box<dyn Policy>,
        observations: &Topic<Observation>,
        settings: ChunkSettings,
    ) -> Result<u32, BuildError> {
        if settings.refill.is_some() && builder.setup().rate(POLICY).is_some() {
            return Err(setting_error(NO_RATE));
        }
        let depth = Depth::new(Chunk::DEPTH).unwrap_or(Depth::MAX);
        let chunks = Topic::new(CHUNK, builder.setup().depth(CHUNK).unwrap_or(depth));
        builder.record_as(chunks.clone(), Chunk::names(settings.horizon));
        let planner = ChunkPlanner::new(&settings).map_err(other)?;
        let (requests, release) = match settings.refill {
            Some(_) => (builder.topic(REQUEST), Match::Each.into()),
            None => (builder.internal_topic(REQUEST), actuator_hz().into()),
        };
        builder.single_node(POLICY, release, 1, |wiring| ChunkPolicy {
            policy,
            planner,
            last_tick: wiring.last_tick(),
            observations: wiring.subscription(observations),
            chunks: wiring.publisher(&chunks),
            requests: settings.refill.map(|_| wiring.trigger(&requests)),
        })?;
        let steps = builder.topic(PLAYER_STEP);
        let chunks = builder.through(&chunks, 1)?;
        builder.single_node(PLAYER, actuator_hz().into(), 2, |wiring| {
            wiring.fix([KnobKind::Rate], "it plays an action every 20 ms");
            Player::new(
                &settings,
                wiring.subscription(&chunks),
                wiring.publisher(&self.actions),
                wiring.publisher(&steps),
                settings.refill.map(|_| wiring.publisher(&requests)),
            )
        })?;
        Ok(2)
    }
}

/// Why a policy that ticks on request refuses a rate.
const NO_RATE: &str = "refill and control-hz exclude each other: with a refill the policy ticks on \
                       request, and has no rate; leave one of them out";

/// Returns an invalid setting.
pub(crate) fn setting_error(error: impl std::fmt::Display) -> BuildError {
    BuildError::Setting(error.to_string())
}

/// Any other error of a part of the graph.
pub(crate) fn other(error: impl std::error::Error + Send + Sync + 'static) -> BuildError {
    BuildError::Other(Box::new(error))
}
