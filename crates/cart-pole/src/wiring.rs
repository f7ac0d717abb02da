//! The graph: sensor, policy and actuator, and the player of a policy that answers with chunks.

use ratelab::{KnobKind, Topic};
use ratelab_policy::chunk::{ChunkNodes, ChunkPlanner};
use ratelab_system::{BuildError, Builder, SharedWorld};

use super::{
    ACTUATOR, Action, Actuator, CONTROL_HZ, CartPlant, ControlStep, Observation, POLICY,
    PolicyNode, SENSOR, SIMILAR, Sensor, SimilarReadings, actuator_hz, body::Body,
    chunk::CartChunks, policy::Policy,
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
        let last = match CartChunks::take(builder)? {
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

    /// Adds a policy that answers with chunks, and their player; returns its priority.
    fn with_chunks(
        &self,
        builder: &mut Builder<'_>,
        policy: Box<dyn Policy>,
        observations: &Topic<Observation>,
        chunks: CartChunks,
    ) -> Result<u32, BuildError> {
        let model = Body::model(chunks.model.length).map_err(other)?;
        let nodes = ChunkNodes {
            settings: chunks.settings,
            names: vec!["action (share of 10 N)".to_owned()],
            rate: actuator_hz(),
            paced: "it plays an action every 20 ms",
            observations,
            actions: &self.actions,
        };
        let planner = ChunkPlanner::new(&chunks.settings, model, vec![0.0]);
        nodes.add(builder, policy, planner)?;
        Ok(ChunkNodes::<Observation, Action>::PRIORITY)
    }
}

/// Returns an invalid setting.
pub(crate) fn setting_error(error: impl std::fmt::Display) -> BuildError {
    BuildError::Setting(error.to_string())
}

/// Any other error of a part of the graph.
pub(crate) fn other(error: impl std::error::Error + Send + Sync + 'static) -> BuildError {
    BuildError::Other(Box::new(error))
}
