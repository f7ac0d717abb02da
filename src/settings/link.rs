//! The link between the publishers of a topic and its readers.

use std::{fmt, str::FromStr, time::Duration};

use thiserror::Error;

use super::{draw::Draw, error::SettingError};
use crate::millis::{self, MillisError};

/// The longest mean length of a burst (messages).
const MAX_BURST: f64 = 1e9;

/// The accepted texts of a link.
const LINK: &str = "expected none, or parts with commas in between: delay:MS, delay:A..B, \
    delay:lognormal:MEDIAN,P99, delay:file:CSV, delay:drawn:CSV, in-order, loss:P, burst:P,N, reliable:MS";

/// A text that is not a link.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LinkError {
    /// Not a part of a link.
    #[error("{0:?} is not a part of a link: {LINK}")]
    Part(String),
    /// A part that a link has already.
    #[error("{0} is there twice: {LINK}")]
    PartTwice(String),
    /// Not the delay of a link.
    #[error("{0:?} is not a delay: {LINK}")]
    Delay(String),
    /// Not a probability.
    #[error("{0:?} is not a probability: expected 0 to 1")]
    Probability(String),
    /// A burst with one number.
    #[error("burst:{0} lacks a number: expected burst:P,N")]
    Burst(String),
    /// Not a mean length of bursts.
    #[error(
        "{0:?} is not a mean length of bursts: expected 1 to {max} messages",
        max = MAX_BURST
    )]
    BurstLength(String),
    /// A link that sends lost messages again, and loses all.
    #[error("a reliable link never delivers at loss:1: expected less than 1")]
    NeverDelivers,
    /// Not an interval.
    #[error(transparent)]
    Millis(#[from] MillisError),
    /// A delay with a factor that makes no durations.
    #[error(transparent)]
    Factor(#[from] SettingError),
}

/// A part of a link as text.
struct LinkPart {
    name: &'static str,
    /// Sets it to this value.
    set: fn(&mut Link, &str) -> Result<(), LinkError>,
    /// Its value; `None` for a link without it.
    value: fn(&Link) -> Option<String>,
    /// Number of commas in a value that begins like this text.
    commas: fn(&str) -> usize,
}

/// All of them in order. Another kind of loss or delay is a row here, a field of the link, and what
/// a channel does with that.
static PARTS: [LinkPart; 5] = [
    LinkPart {
        name: "delay",
        set: |link, value| delay(value).map(|delay| link.delay = delay),
        value: |link| (!link.delay.is_none()).then(|| link.delay.to_string()),
        commas: Draw::commas,
    },
    LinkPart {
        name: "in-order",
        set: |link, value| {
            link.in_order = value.is_empty();
            let refused = || LinkError::Part(format!("in-order:{value}"));
            link.in_order.then_some(()).ok_or_else(refused)
        },
        value: |link| link.in_order.then(String::new),
        commas: |_| 0,
    },
    LinkPart {
        name: "loss",
        set: |link, value| {
            link.loss = probability(value)?;
            Ok(())
        },
        value: |link| (link.loss > 0.0).then(|| link.loss.to_string()),
        commas: |_| 0,
    },
    LinkPart {
        name: "burst",
        set: |link, value| {
            link.burst = Some(burst(value)?);
            Ok(())
        },
        value: |link| {
            let Burst { start, length } = link.burst?;
            Some(format!("{start},{length}"))
        },
        commas: |_| 1,
    },
    LinkPart {
        name: "reliable",
        set: |link, value| {
            link.reliable = Some(millis::parse(value)?);
            Ok(())
        },
        value: |link| Some(millis::to_millis(link.reliable?).to_string()),
        commas: |_| 0,
    },
];

/// A model of message transport: delay, order and loss. As text `none`, or
/// comma-separated parts, each at most once: `delay:30`, `delay:5..40`,
/// `delay:lognormal:10,50` (ms), `delay:file:CSV` or `delay:drawn:CSV`, `in-order`, `loss:0.2`, `burst:0.01,5`, `reliable:40`
/// (ms).
///
/// ```
/// use ratelab::Link;
///
/// let link: Link = "loss:0.2,delay:lognormal:10,50,in-order".parse()?;
/// assert_eq!(link.to_string(), "delay:lognormal:10,50,in-order,loss:0.2");
/// assert!("loss:1,reliable:40".parse::<Link>().is_err());
/// # Ok::<(), ratelab::LinkError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Time from release to delivery.
    pub delay: Draw,
    /// Whether each message waits for the earlier ones.
    pub in_order: bool,
    /// Probability that a message is lost, bursts aside.
    pub loss: f64,
    /// Losses that occur together.
    pub burst: Option<Burst>,
    /// Interval after which a lost message is sent again; `None` for no retries.
    pub reliable: Option<Duration>,
}

/// Losses that occur together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Burst {
    /// Probability that a message starts a burst.
    pub start: f64,
    /// Mean length (messages).
    pub length: f64,
}

impl Link {
    /// The perfect link: no delay and no loss.
    pub const NONE: Self = Self {
        delay: Draw::NONE,
        in_order: false,
        loss: 0.0,
        burst: None,
        reliable: None,
    };

    /// Returns the delay (ms), if it is always the same.
    pub fn delay_ms(&self) -> Option<f64> {
        match self.delay {
            Draw::Constant(delay) => Some(millis::to_millis(delay)),
            _ => None,
        }
    }

    /// This link with another `part`, such as `delay:30`.
    ///
    /// # Errors
    /// [`LinkError`] for an unknown part or an impossible link.
    pub fn with(&self, part: &str) -> Result<Self, LinkError> {
        let mut link = self.clone();
        let (name, value) = part.split_once(':').unwrap_or((part, ""));
        link.add(name, value)?;
        link.to_string().parse()
    }

    /// Adds the part called `name`.
    fn add(&mut self, name: &str, value: &str) -> Result<(), LinkError> {
        let part = PARTS.iter().find(|part| part.name == name);
        let known = part.ok_or_else(|| LinkError::Part(name.to_owned()))?;
        (known.set)(self, value)
    }
}

fn delay(value: &str) -> Result<Draw, LinkError> {
    match value.parse() {
        Ok(Draw::Measured(measured)) if measured.is_recorded() => {
            Err(LinkError::Delay(value.to_owned()))
        }
        Err(error @ SettingError::Factor(_)) => Err(error.into()),
        Err(_) => Err(LinkError::Delay(value.to_owned())),
        Ok(draw) => Ok(draw),
    }
}

fn probability(text: &str) -> Result<f64, LinkError> {
    let parsed: Option<f64> = text.trim().parse().ok();
    parsed
        .filter(|p| (0.0..=1.0).contains(p))
        .ok_or_else(|| LinkError::Probability(text.to_owned()))
}

fn burst(value: &str) -> Result<Burst, LinkError> {
    let (start, length) = value
        .split_once(',')
        .ok_or_else(|| LinkError::Burst(value.to_owned()))?;
    let parsed: Option<f64> = length.trim().parse().ok();
    let known = parsed.filter(|n| (1.0..=MAX_BURST).contains(n));
    Ok(Burst {
        start: probability(start)?,
        length: known.ok_or_else(|| LinkError::BurstLength(length.to_owned()))?,
    })
}

/// Splits a list into the first part and the rest. The values of some parts have commas.
fn first_part(list: &str) -> (&str, Option<&str>) {
    let named = list.split_once(':');
    let known = named.and_then(|(name, value)| {
        let mut parts = PARTS.iter();
        Some((parts.find(|part| part.name == name)?.commas)(value))
    });
    let commas = known.unwrap_or(0);
    match list.match_indices(',').nth(commas) {
        Some((comma, _)) => (&list[..comma], Some(&list[comma + 1..])),
        None => (list, None),
    }
}

impl fmt::Display for Link {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = PARTS.iter().filter_map(|part| {
            Some(match (part.value)(self)?.as_str() {
                "" => part.name.to_owned(),
                value => format!("{}:{value}", part.name),
            })
        });
        let parts: Vec<String> = parts.collect();
        if parts.is_empty() {
            f.write_str("none")
        } else {
            f.write_str(&parts.join(","))
        }
    }
}

impl FromStr for Link {
    type Err = LinkError;

    fn from_str(text: &str) -> Result<Self, LinkError> {
        let (mut link, mut names) = (Self::NONE, Vec::new());
        let mut rest = Some(text.trim()).filter(|text| *text != "none");
        while let Some(list) = rest {
            let (part, others) = first_part(list.trim_start());
            let (name, value) = part.split_once(':').unwrap_or((part, ""));
            if names.contains(&name) {
                return Err(LinkError::PartTwice(name.to_owned()));
            }
            link.add(name, value)?;
            names.push(name);
            rest = others;
        }
        if link.reliable.is_some() && link.loss >= 1.0 {
            return Err(LinkError::NeverDelivers);
        }
        Ok(link)
    }
}
