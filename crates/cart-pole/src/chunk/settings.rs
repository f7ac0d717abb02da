//! What can be set of chunks, and its text.

use std::{fmt, str::FromStr, time::Duration};

use ratelab::{alternatives, millis};
use ratelab_system::Setup;
use strum::{Display, IntoStaticStr, VariantArray, VariantNames};

use super::{ACTION_PERIOD, PLAYER};
use crate::{POLICY, ParameterError};

/// The number of actions in a chunk: 1 to [`Horizon::MAX`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Horizon(usize);

impl Horizon {
    /// The longest chunk: 20 s.
    pub const MAX: usize = 1000;

    /// Returns the number of actions.
    pub fn get(self) -> usize {
        self.0
    }

    /// Returns the time that the actions are meant for.
    pub fn duration(self) -> Duration {
        ACTION_PERIOD * self.0 as u32
    }

    /// Parses a horizon, or `none` for a policy without chunks.
    ///
    /// # Errors
    /// [`ParameterError`] for an invalid text.
    pub fn parse(text: &str) -> Result<Option<Self>, ParameterError> {
        let number = text.trim().parse().ok();
        match number.filter(|number| (1..=Self::MAX).contains(number)) {
            Some(number) => Ok(Some(Self(number))),
            None if text.trim() == "none" => Ok(None),
            None => Err(ParameterError::Chunk {
                text: text.to_owned(),
                max: Self::MAX,
            }),
        }
    }
}

/// What a policy plans.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Display, IntoStaticStr, VariantArray, VariantNames,
)]
#[strum(serialize_all = "lowercase")]
pub enum PlanKind {
    /// The action for the reading, again and again.
    Hold,
    /// The policy's own actions, for the states that its model comes to.
    #[default]
    Rollout,
    /// As a rollout, with the actions that are still to be played meanwhile.
    Committed,
}

impl FromStr for PlanKind {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        named(text, "plan")
    }
}

/// How the player knows which action of a chunk belongs to now.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Display, VariantArray, VariantNames)]
#[strum(serialize_all = "lowercase")]
pub enum PlayKind {
    /// By the time since the reading.
    #[default]
    Time,
    /// By the time since the player took the chunk.
    Arrival,
    /// By the number of actions played since the reading.
    Executed,
}

impl FromStr for PlayKind {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        named(text, "way to play")
    }
}

/// What the player does where chunks overlap. As text `newest`, `blend:0.7` or
/// `ensemble:0.01`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Merge {
    /// Plays the chunk taken last.
    #[default]
    Newest,
    /// Gives the new chunk this weight (0 to 1), and what was planned before the rest.
    Blend(f64),
    /// Weights all chunks by exp(−M·j), the oldest with j = 0.
    Ensemble(f64),
}

/// The greatest M: the second oldest chunk weighs nothing any more.
const MAX_DECAY: f64 = 100.0;

impl fmt::Display for Merge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Newest => f.write_str("newest"),
            Self::Blend(weight) => write!(f, "blend:{weight}"),
            Self::Ensemble(decay) => write!(f, "ensemble:{decay}"),
        }
    }
}

impl FromStr for Merge {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        let number = |prefix, most| {
            let number: f64 = text.trim().strip_prefix(prefix)?.parse().ok()?;
            (0.0..=most).contains(&number).then_some(number)
        };
        let merge = number("blend:", 1.0)
            .map(Self::Blend)
            .or_else(|| number("ensemble:", MAX_DECAY).map(Self::Ensemble));
        match merge {
            Some(merge) => Ok(merge),
            None if text.trim() == "newest" => Ok(Self::Newest),
            None => Err(ParameterError::Merge {
                text: text.to_owned(),
                max_decay: MAX_DECAY.to_string(),
            }),
        }
    }
}

/// The delay of its answer that a policy plans for. As text `120` (ms), `last`, `max`, or
/// one of these with a margin, such as `last+20`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExpectedDelay {
    /// Always the same.
    Constant(Duration),
    /// The duration of the last tick, and a margin.
    Last(Duration),
    /// The longest duration so far, and a margin.
    Max(Duration),
}

impl Default for ExpectedDelay {
    fn default() -> Self {
        Self::Last(Duration::ZERO)
    }
}

impl fmt::Display for ExpectedDelay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (word, margin) = match self {
            Self::Constant(delay) => return write!(f, "{}", millis::to_millis(*delay)),
            Self::Last(margin) => ("last", margin),
            Self::Max(margin) => ("max", margin),
        };
        if margin.is_zero() {
            f.write_str(word)
        } else {
            write!(f, "{word}+{}", millis::to_millis(*margin))
        }
    }
}

impl FromStr for ExpectedDelay {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        let (word, margin) = text.split_once('+').unwrap_or((text, "0"));
        let delay = match word.trim() {
            "last" => millis::parse(margin).map(Self::Last),
            "max" => millis::parse(margin).map(Self::Max),
            _ => millis::parse(text).map(Self::Constant),
        };
        delay.map_err(|_| ParameterError::ExpectedDelay(text.to_owned()))
    }
}

/// How much longer the pole of the plan's model is than the plant's. As text `length:1.2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelError {
    /// The factor.
    pub length: f64,
}

impl ModelError {
    /// The accepted factors.
    const LENGTHS: [f64; 2] = [0.1, 10.0];
}

impl Default for ModelError {
    fn default() -> Self {
        Self { length: 1.0 }
    }
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "length:{}", self.length)
    }
}

impl FromStr for ModelError {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        let [min, max] = Self::LENGTHS;
        let length = text.trim().strip_prefix("length:").map(str::parse);
        match length {
            Some(Ok(length)) if (min..=max).contains(&length) => Ok(Self { length }),
            _ => Err(ParameterError::Model {
                text: text.to_owned(),
                min: min.to_string(),
                max: max.to_string(),
            }),
        }
    }
}

/// The settings of chunks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChunkSettings {
    /// Actions in a chunk.
    pub horizon: Horizon,
    /// What the policy plans.
    pub plan: PlanKind,
    /// The delay that it plans for.
    pub expected: ExpectedDelay,
    /// Its model of the plant.
    pub model: ModelError,
    /// Which action belongs to now.
    pub play: PlayKind,
    /// What happens where chunks overlap.
    pub merge: Merge,
    /// The share of the horizon that is left when the player asks for the next chunk (0 to
    /// 1); `None` for a policy that ticks at its rate.
    pub refill: Option<f64>,
}

impl ChunkSettings {
    /// Name of the parameter for the horizon.
    pub const CHUNK: &str = "chunk";

    /// All parameters: the node, the name, and what makes the shortest form of a value.
    pub const PARAMETERS: [(&str, &str, Shortest); 7] = [
        (POLICY, Self::CHUNK, |text| {
            Ok(or_none(Horizon::parse(text)?.map(Horizon::get)))
        }),
        (POLICY, "plan", short::<PlanKind>),
        (POLICY, "expect-delay", short::<ExpectedDelay>),
        (POLICY, "model", short::<ModelError>),
        (PLAYER, "play", short::<PlayKind>),
        (PLAYER, "merge", short::<Merge>),
        (PLAYER, "refill", |text| Ok(or_none(refill(text)?))),
    ];

    /// Reads the settings in `setup`; `None` for a policy without chunks.
    ///
    /// # Errors
    /// [`ParameterError`] for an invalid value.
    pub fn from_setup(setup: &Setup) -> Result<Option<Self>, ParameterError> {
        let horizon = setup.parameter(POLICY, Self::CHUNK).map(Horizon::parse);
        let Some(horizon) = horizon.transpose()?.flatten() else {
            return Ok(None);
        };
        Ok(Some(Self {
            horizon,
            plan: parsed(setup, POLICY, "plan")?,
            expected: parsed(setup, POLICY, "expect-delay")?,
            model: parsed(setup, POLICY, "model")?,
            play: parsed(setup, PLAYER, "play")?,
            merge: parsed(setup, PLAYER, "merge")?,
            refill: match setup.parameter(PLAYER, "refill") {
                Some(share) => refill(share)?,
                None => None,
            },
        }))
    }
}

/// Makes the shortest form of a value of a parameter, or says what is wrong with it.
type Shortest = fn(&str) -> Result<String, ParameterError>;

/// Parses the share of the horizon that is left when the player asks for the next chunk.
fn refill(text: &str) -> Result<Option<f64>, ParameterError> {
    let share: Option<f64> = text.trim().parse().ok();
    match share.filter(|share| (0.0..=1.0).contains(share)) {
        None if text.trim() == "none" => Ok(None),
        None => Err(ParameterError::Refill(text.to_owned())),
        share => Ok(share),
    }
}

fn parsed<T: FromStr<Err = ParameterError> + Default>(
    setup: &Setup,
    node: &str,
    name: &str,
) -> Result<T, ParameterError> {
    let value = setup.parameter(node, name);
    value.map_or_else(|| Ok(T::default()), str::parse)
}

fn or_none(value: Option<impl ToString>) -> String {
    value.map_or_else(|| "none".to_owned(), |value| value.to_string())
}

fn short<T: FromStr<Err = ParameterError> + fmt::Display>(
    value: &str,
) -> Result<String, ParameterError> {
    Ok(value.parse::<T>()?.to_string())
}

/// Replaces `setting` by the one in `text`; returns the one before.
pub(super) fn replace<T: FromStr<Err = ParameterError> + fmt::Display>(
    setting: &mut T,
    text: &str,
) -> Result<String, ParameterError> {
    let before = std::mem::replace(setting, text.parse()?);
    Ok(before.to_string())
}

/// Returns the value called `text`.
fn named<T: VariantArray + VariantNames + Copy>(
    text: &str,
    what: &'static str,
) -> Result<T, ParameterError> {
    let names = <T as VariantNames>::VARIANTS;
    let place = names.iter().position(|name| *name == text.trim());
    let value = place.map(|place| <T as VariantArray>::VARIANTS[place]);
    value.ok_or_else(|| ParameterError::Name {
        text: text.to_owned(),
        what,
        expected: alternatives(names),
    })
}
