//! Chunks of the cart-pole: the settings of its plans, and its model as what a policy plans by.

mod model_error;
mod planned;
mod planning;

use std::time::Duration;

use ratelab_policy::chunk::{ActionShape, ChunkSettings};
use ratelab_system::{BuildError, Builder, Setup};

pub use self::model_error::ModelError;
pub(crate) use self::planning::PLANNING;
use crate::{POLICY, ParameterError};
pub use ratelab_policy::chunk::{CHUNK, Chunk, PlanKind};

/// Δ: the time that an action is meant for.
pub(crate) const ACTION_PERIOD: Duration = Duration::from_millis(20);

/// The actions of the cart-pole.
const ACTIONS: ActionShape = ActionShape {
    width: 1,
    period: ACTION_PERIOD,
};

/// Name of the parameter with the model of a plan.
pub(crate) const MODEL: &str = "model";

/// The settings of a run with chunks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CartChunks {
    /// The settings of any robot.
    pub settings: ChunkSettings,
    /// The policy's model of the plant.
    pub model: ModelError,
}

impl CartChunks {
    /// Takes the settings of a run that is built, if its policy answers with chunks.
    ///
    /// # Errors
    /// As of [`ChunkSettings::take`].
    pub(crate) fn take(builder: &mut Builder<'_>) -> Result<Option<Self>, BuildError> {
        let settings = ChunkSettings::take(builder, ACTIONS, &[MODEL])?;
        let told = |error: ParameterError| BuildError::Setting(error.to_string());
        Ok(match settings {
            Some(_) => Self::from_setup(builder.setup()).map_err(told)?,
            None => None,
        })
    }

    /// Reads the settings in `setup`; `None` for a policy without chunks.
    ///
    /// # Errors
    /// [`ParameterError`] for an invalid value.
    pub fn from_setup(setup: &Setup) -> Result<Option<Self>, ParameterError> {
        let Some(settings) = ChunkSettings::from_setup(setup, ACTIONS)? else {
            return Ok(None);
        };
        let model = setup.parameter(POLICY, MODEL).map(str::parse);
        Ok(Some(Self {
            settings,
            model: model.transpose()?.unwrap_or_default(),
        }))
    }
}
