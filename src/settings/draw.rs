//! Random durations, such as the duration of ticks.

use std::{fmt, str::FromStr, sync::Arc, time::Duration};

use super::{
    chance::{self, Chance},
    digest::Digest,
    error::{FACTORS, SettingError},
};
use crate::millis;

/// The 99th percentile of the standard normal distribution.
const NORMAL_P99: f64 = 2.326_347_874_040_840_8;

/// Prefix of a log-normal distribution.
const LOGNORMAL: &str = "lognormal:";

/// Prefix of a recording, of whose durations each draw is one.
const RECORDED: &str = "recorded:";

/// Prefix of a column of durations, drawn in its order: after the last comes the first again.
const IN_ORDER: &str = "file:";

/// Prefix of such a column, of whose durations each draw is one.
const DRAWN: &str = "drawn:";

/// What is between a factor and the draw that it multiplies.
const TIMES: char = '*';

/// A distribution of durations. As text, in milliseconds: `30`; `60..110` uniform;
/// `lognormal:30,90` by median and 99th percentile; `recorded:FILE`, `file:CSV` and `drawn:CSV`,
/// the durations in a recording or a column, also with a factor: `0.5 * file:CSV`; `none`.
///
/// ```
/// use ratelab::Draw;
///
/// let draw: Draw = "60..110".parse()?;
/// assert_eq!(draw.to_string(), "60..110");
/// assert!("0".parse::<Draw>()?.is_none());
/// # Ok::<(), ratelab::SettingError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum Draw {
    /// Always the same; zero for none.
    Constant(Duration),
    /// Uniform between the first and the second.
    Uniform(Duration, Duration),
    /// Log-normal: mostly short, occasionally much longer.
    Lognormal {
        /// Median.
        median: Duration,
        /// 99th percentile.
        p99: Duration,
    },
    /// The durations in a file.
    Measured(Measurements),
}

impl Draw {
    /// Always zero.
    pub const NONE: Self = Self::Constant(Duration::ZERO);

    /// This draw with all its durations times `factor`; `None` for a factor that is none.
    fn times(self, factor: f64) -> Option<Self> {
        let (least, greatest) = FACTORS;
        if !(least..=greatest).contains(&factor) {
            return None;
        }
        let scaled = |duration| scaled(duration, factor);
        Some(match self {
            Self::Constant(duration) => Self::Constant(scaled(duration)),
            Self::Uniform(from, to) => Self::Uniform(scaled(from), scaled(to)),
            Self::Lognormal { median, p99 } => Self::Lognormal {
                median: scaled(median),
                p99: scaled(p99),
            },
            Self::Measured(measured) => {
                let factor = Some(measured.factor * factor);
                let factor = factor.filter(|factor| (least..=greatest).contains(factor))?;
                Self::Measured(Measurements { factor, ..measured })
            }
        })
    }

    /// Returns whether it is always zero.
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// Returns the median; `None` while its file is not loaded.
    pub fn median(&self) -> Option<Duration> {
        self.at(0.5)
    }

    /// Returns the number of commas in the text of a distribution that begins like this.
    pub(super) fn commas(text: &str) -> usize {
        let draw = text.rsplit(TIMES).next().unwrap_or(text);
        usize::from(draw.trim_start().starts_with(LOGNORMAL))
    }

    /// Returns the quantile of `u`, from 0 to below 1; `None` while its file is not loaded.
    pub fn at(&self, u: f64) -> Option<Duration> {
        Some(match self {
            Self::Constant(duration) => *duration,
            Self::Uniform(from, to) => {
                let width = to.saturating_sub(*from).as_nanos() as f64;
                *from + Duration::from_nanos((u * width) as u64)
            }
            Self::Lognormal { median, p99 } if u > 0.0 => {
                let (median, p99) = (median.as_nanos() as f64, p99.as_nanos() as f64);
                let sigma = (p99 / median).ln() / NORMAL_P99;
                let drawn = median * (sigma * chance::normal_quantile(u)).exp();
                Duration::from_nanos(drawn.round() as u64)
            }
            Self::Lognormal { .. } => Duration::ZERO,
            Self::Measured(measured) => measured.at(u)?,
        })
    }

    /// Draw number `n` of a chance. A graph refuses a draw whose file is not loaded, so there is
    /// always one.
    pub(crate) fn sample(&self, chance: Chance<'_>, n: u64) -> Duration {
        match self {
            Self::Constant(duration) => *duration,
            Self::Measured(measured) if measured.is_in_order() => {
                measured.nth(n).unwrap_or_default()
            }
            draw => draw.at(chance.uniform(n)).unwrap_or_default(),
        }
    }

    /// Returns the mean of `what` over the draws, by a thousand quantiles of equal weight; `None`
    /// while the file is not loaded.
    pub fn mean_of(&self, what: impl Fn(Duration) -> f64) -> Option<f64> {
        const PARTS: u32 = 1_000;
        if let Self::Constant(duration) = self {
            return Some(what(*duration));
        }
        let at = |part: u32| {
            self.at((f64::from(part) + 0.5) / f64::from(PARTS))
                .map(&what)
        };
        let sum: f64 = (0..PARTS).map(at).sum::<Option<f64>>()?;
        Some(sum / f64::from(PARTS))
    }

    /// Returns the measurements that are not loaded yet.
    pub fn missing(&self) -> Option<&Measurements> {
        match self {
            Self::Measured(measured) if measured.loaded.is_none() => Some(measured),
            _ => None,
        }
    }
}

impl fmt::Display for Draw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ms = |duration: &Duration| millis::to_millis(*duration);
        match self {
            Self::Constant(Duration::ZERO) => f.write_str("none"),
            Self::Constant(duration) => write!(f, "{}", ms(duration)),
            Self::Uniform(from, to) => write!(f, "{}..{}", ms(from), ms(to)),
            Self::Lognormal { median, p99 } => {
                write!(f, "lognormal:{},{}", ms(median), ms(p99))
            }
            Self::Measured(measured) => measured.fmt(f),
        }
    }
}

impl FromStr for Draw {
    type Err = SettingError;

    fn from_str(text: &str) -> Result<Self, SettingError> {
        let text = text.trim();
        if let Some((factor, draw)) = text.split_once(TIMES)
            && let Ok(factor) = factor.trim().parse()
        {
            let refused = || SettingError::Factor(text.to_owned());
            let draw = draw.parse::<Self>()?.times(factor).ok_or_else(refused)?;
            // Its own text is a draw, too.
            return match draw {
                Self::Measured(_) => Ok(draw),
                draw => draw.to_string().parse().map_err(|_| refused()),
            };
        }
        for prefix in [RECORDED, IN_ORDER, DRAWN] {
            if let Some(file) = text.strip_prefix(prefix) {
                return Measurements::parse(prefix, file).map(Self::Measured);
            }
        }
        if let Some(figures) = text.strip_prefix(LOGNORMAL) {
            return lognormal(text, figures);
        }
        if let Some((from, to)) = text.split_once("..") {
            let (from, to) = (millis::parse(from)?, millis::parse(to)?);
            let known = (from <= to).then_some(Self::Uniform(from, to));
            return known.ok_or_else(|| SettingError::Range(text.to_owned()));
        }
        match text {
            "none" => Ok(Self::NONE),
            _ => millis::parse(text)
                .map(Self::Constant)
                .map_err(|_| SettingError::Draw(text.to_owned())),
        }
    }
}

/// Returns a duration times a factor.
fn scaled(duration: Duration, factor: f64) -> Duration {
    Duration::from_nanos((duration.as_nanos() as f64 * factor).round() as u64)
}

fn lognormal(text: &str, figures: &str) -> Result<Draw, SettingError> {
    let refused = || SettingError::Lognormal(text.to_owned());
    let (median, p99) = figures.split_once(',').ok_or_else(refused)?;
    let (median, p99) = (millis::parse(median)?, millis::parse(p99)?);
    if median.is_zero() || p99 < median {
        return Err(SettingError::LognormalOrder(text.to_owned()));
    }
    Ok(Draw::Lognormal { median, p99 })
}

/// Durations that were loaded: in the order of their file, and sorted.
type Loaded = Arc<[Vec<Duration>; 2]>;

/// Measured durations, named by their file. The library reads no such files: the program loads the
/// durations, and the value has them from then on.
#[derive(Clone, Debug)]
pub struct Measurements {
    prefix: &'static str,
    factor: f64,
    file: String,
    pin: Option<Digest>,
    loaded: Option<Loaded>,
}

impl Measurements {
    fn parse(prefix: &'static str, text: &str) -> Result<Self, SettingError> {
        let (file, pin) = match Digest::split_pin(text) {
            Some((file, digest)) => (file, Some(digest?)),
            None => (text, None),
        };
        if file.is_empty() {
            return Err(SettingError::NoFile(prefix));
        }
        Ok(Self {
            prefix,
            factor: 1.0,
            file: file.to_owned(),
            pin,
            loaded: None,
        })
    }

    /// Returns the path of the file.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Returns the same measurements in another file, such as with a path from elsewhere.
    #[must_use]
    pub fn with_file(self, file: String) -> Self {
        Self { file, ..self }
    }

    /// Returns the digest of its durations, if it is known.
    pub fn digest(&self) -> Option<Digest> {
        self.pin
    }

    /// Returns its durations, without the factor; `None` while they are not loaded.
    pub fn durations(&self) -> Option<&[Duration]> {
        let [durations, _] = &**self.loaded.as_ref()?;
        Some(durations)
    }

    /// Returns whether the file is a recording, and no column of numbers.
    pub fn is_recorded(&self) -> bool {
        self.prefix == RECORDED
    }

    fn is_in_order(&self) -> bool {
        self.prefix == IN_ORDER
    }

    /// Returns the same measurements with the durations in the file, pinned to their digest.
    ///
    /// # Errors
    /// If there are no durations, or they differ from the pinned ones.
    pub fn with_durations(&self, mut durations: Vec<Duration>) -> Result<Self, SettingError> {
        let (file, mut sorted) = (&self.file, durations.clone());
        if durations.is_empty() {
            return Err(SettingError::NoDurations(file.clone()));
        }
        sorted.sort_unstable();
        if !self.is_in_order() {
            durations.clone_from(&sorted);
        }
        let nanos = durations.iter().map(|d| d.as_nanos() as u64);
        let content: Vec<u8> = nanos.flat_map(u64::to_le_bytes).collect();
        let found = Digest::new(&content);
        match self.pin {
            Some(expected) if expected != found => Err(SettingError::OtherDurations {
                file: file.clone(),
                expected,
                found,
            }),
            _ => Ok(Self {
                pin: Some(found),
                loaded: Some(Arc::new([durations, sorted])),
                ..self.clone()
            }),
        }
    }

    /// Returns number `n` in the order of the file.
    fn nth(&self, n: u64) -> Option<Duration> {
        let [in_order, _] = &**self.loaded.as_ref()?;
        let nth = in_order.get((n % in_order.len() as u64) as usize);
        nth.map(|duration| self.scaled(*duration))
    }

    fn scaled(&self, duration: Duration) -> Duration {
        if self.has_factor() {
            scaled(duration, self.factor)
        } else {
            duration
        }
    }

    fn has_factor(&self) -> bool {
        self.factor.to_bits() != 1.0_f64.to_bits()
    }

    /// Returns the quantile of `u` in 0..1.
    fn at(&self, u: f64) -> Option<Duration> {
        let [_, sorted] = &**self.loaded.as_ref()?;
        let index = (u * sorted.len() as f64) as usize;
        let at = sorted.get(index.min(sorted.len() - 1));
        at.map(|duration| self.scaled(*duration))
    }
}

impl PartialEq for Measurements {
    /// Returns whether both have the same text: one may be loaded, and the other one not.
    fn eq(&self, other: &Self) -> bool {
        let key = |of: &'_ Self| (of.prefix, of.factor.to_bits(), of.pin);
        key(self) == key(other) && self.file == other.file
    }
}

impl fmt::Display for Measurements {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.has_factor() {
            write!(f, "{} {TIMES} ", self.factor)?;
        }
        write!(f, "{}{}", self.prefix, self.file)?;
        match self.pin {
            Some(digest) => write!(f, "{}{digest}", Digest::PIN),
            None => Ok(()),
        }
    }
}

/// Prefix of a cost that keeps a core busy.
const BUSY: &str = "busy ";

/// The duration of a node's ticks in run time: a [`Draw`], as text with the prefix `busy
/// ` if the real clock is to keep a core busy instead of sleeping.
#[derive(Clone, Debug, PartialEq)]
pub struct Cost {
    /// Duration of a tick.
    pub draw: Draw,
    /// Whether a tick keeps a core busy under the real clock.
    pub busy: bool,
}

impl Cost {
    /// Ticks take no time.
    pub const NONE: Self = Self {
        draw: Draw::NONE,
        busy: false,
    };
}

impl fmt::Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let busy = if self.busy { BUSY } else { "" };
        write!(f, "{busy}{}", self.draw)
    }
}

impl FromStr for Cost {
    type Err = SettingError;

    fn from_str(text: &str) -> Result<Self, SettingError> {
        let draw = text.trim().strip_prefix(BUSY);
        Ok(Self {
            draw: draw.unwrap_or(text).parse()?,
            busy: draw.is_some(),
        })
    }
}
