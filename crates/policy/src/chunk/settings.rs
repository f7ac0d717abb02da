//! What can be set of chunks, and its text.

use std::{fmt, str::FromStr, time::Duration};

use ratelab::{alternatives, millis};
use ratelab_system::Setup;
use strum::{Display, IntoStaticStr, VariantArray, VariantNames};

use super::{ChunkError, PLAYER, POLICY};

/// The number of actions in a chunk: 1 to [`Horizon::MAX`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Horizon(usize);

impl Horizon {
    /// The most actions in a chunk: 20 s of them at 50 Hz.
    pub const MAX: usize = 1000;

    /// Returns the number of actions.
    pub fn get(self) -> usize {
        self.0
    }

    /// Parses a horizon, or `none` for a policy without chunks.
    ///
    /// # Errors
    /// [`ChunkError`] for an invalid text.
    pub fn parse(text: &str) -> Result<Option<Self>, ChunkError> {
        let number = text.trim().parse().ok();
        match number.filter(|number| (1..=Self::MAX).contains(number)) {
            Some(number) => Ok(Some(Self(number))),
            None if text.trim() == "none" => Ok(None),
            None => Err(ChunkError::Chunk {
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
    type Err = ChunkError;

    fn from_str(text: &str) -> Result<Self, ChunkError> {
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
    type Err = ChunkError;

    fn from_str(text: &str) -> Result<Self, ChunkError> {
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
    type Err = ChunkError;

    fn from_str(text: &str) -> Result<Self, ChunkError> {
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
            None => Err(ChunkError::Merge {
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
    type Err = ChunkError;

    fn from_str(text: &str) -> Result<Self, ChunkError> {
        let (word, margin) = text.split_once('+').unwrap_or((text, "0"));
        let delay = match word.trim() {
            "last" => millis::parse(margin).map(Self::Last),
            "max" => millis::parse(margin).map(Self::Max),
            _ => millis::parse(text).map(Self::Constant),
        };
        delay.map_err(|_| ChunkError::ExpectedDelay(text.to_owned()))
    }
}

/// What the actions of a robot are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ActionShape {
    /// The numbers of an action.
    pub width: usize,
    /// Δ: the time that an action is meant for.
    pub period: Duration,
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
    /// Which action belongs to now.
    pub play: PlayKind,
    /// What happens where chunks overlap.
    pub merge: Merge,
    /// The share of the horizon that is left when the player asks for the next chunk (0 to
    /// 1); `None` for a policy that ticks at its rate.
    pub refill: Option<f64>,
    /// What its actions are.
    pub shape: ActionShape,
}

impl ChunkSettings {
    /// Name of the parameter for the horizon.
    pub const CHUNK: &str = "chunk";

    /// The parameters that count for a whole run.
    pub const FIXED: [[&str; 2]; 2] = [[POLICY, Self::CHUNK], [PLAYER, "refill"]];

    /// All parameters: the node, the name, and what makes the shortest form of a value.
    pub const PARAMETERS: [(&str, &str, Shortest); 6] = [
        (POLICY, Self::CHUNK, |text| {
            Ok(or_none(Horizon::parse(text)?.map(Horizon::get)))
        }),
        (POLICY, "plan", short::<PlanKind>),
        (POLICY, "expect-delay", short::<ExpectedDelay>),
        (PLAYER, "play", short::<PlayKind>),
        (PLAYER, "merge", short::<Merge>),
        (PLAYER, "refill", |text| Ok(or_none(refill(text)?))),
    ];

    /// Returns the time that the actions of a chunk are meant for.
    pub fn duration(&self) -> Duration {
        self.shape.period * self.horizon.get() as u32
    }

    /// Reads the settings in `setup`, of a robot with such actions; `None` for a policy without chunks.
    ///
    /// # Errors
    /// [`ChunkError`] for an invalid value.
    pub fn from_setup(setup: &Setup, shape: ActionShape) -> Result<Option<Self>, ChunkError> {
        let horizon = setup.parameter(POLICY, Self::CHUNK).map(Horizon::parse);
        let Some(horizon) = horizon.transpose()?.flatten() else {
            return Ok(None);
        };
        Ok(Some(Self {
            horizon,
            plan: parsed(setup, POLICY, "plan")?,
            expected: parsed(setup, POLICY, "expect-delay")?,
            play: parsed(setup, PLAYER, "play")?,
            merge: parsed(setup, PLAYER, "merge")?,
            refill: match setup.parameter(PLAYER, "refill") {
                Some(share) => refill(share)?,
                None => None,
            },
            shape,
        }))
    }
}

/// Makes the shortest form of a value of a parameter, or says what is wrong with it.
pub type Shortest = fn(&str) -> Result<String, ChunkError>;

/// Parses the share of the horizon that is left when the player asks for the next chunk.
fn refill(text: &str) -> Result<Option<f64>, ChunkError> {
    let share: Option<f64> = text.trim().parse().ok();
    match share.filter(|share| (0.0..=1.0).contains(share)) {
        None if text.trim() == "none" => Ok(None),
        None => Err(ChunkError::Refill(text.to_owned())),
        share => Ok(share),
    }
}

fn parsed<T: FromStr<Err = ChunkError> + Default>(
    setup: &Setup,
    node: &str,
    name: &str,
) -> Result<T, ChunkError> {
    let value = setup.parameter(node, name);
    value.map_or_else(|| Ok(T::default()), str::parse)
}

fn or_none(value: Option<impl ToString>) -> String {
    value.map_or_else(|| "none".to_owned(), |value| value.to_string())
}

fn short<T: FromStr<Err = ChunkError> + fmt::Display>(value: &str) -> Result<String, ChunkError> {
    Ok(value.parse::<T>()?.to_string())
}

/// Replaces `setting` by the one in `text`; returns the one before.
pub(super) fn replace<T: FromStr<Err = ChunkError> + fmt::Display>(
    setting: &mut T,
    text: &str,
) -> Result<String, ChunkError> {
    let before = std::mem::replace(setting, text.parse()?);
    Ok(before.to_string())
}

/// Returns the value called `text`.
fn named<T: VariantArray + VariantNames + Copy>(
    text: &str,
    what: &'static str,
) -> Result<T, ChunkError> {
    let names = <T as VariantNames>::VARIANTS;
    let place = names.iter().position(|name| *name == text.trim());
    let value = place.map(|place| <T as VariantArray>::VARIANTS[place]);
    value.ok_or_else(|| ChunkError::Name {
        text: text.to_owned(),
        what,
        expected: alternatives(names),
    })
}
