//! The link between the publishers of a topic and its readers.

use std::{fmt, str::FromStr, time::Duration};

use ratelab::millis;

use crate::draw::Draw;

/// The accepted texts.
const EXPECTED: &str = "expected none, or parts with commas in between: delay:MS, delay:A..B, \
    delay:lognormal:MEDIAN,P99, in-order, loss:P, burst:P,N, reliable:MS";

/// A part of a link as text.
struct LinkPart {
    name: &'static str,
    /// Sets it to this value.
    set: fn(&mut Link, &str) -> Result<(), String>,
    /// Its value; `None` for a link without it.
    value: fn(&Link) -> Option<String>,
}

/// All of them in order. Another kind of loss or delay is a row here, a field of the link, and what
/// a channel does with that.
static PARTS: [LinkPart; 5] = [
    LinkPart {
        name: "delay",
        set: |link, value| delay(value).map(|delay| link.delay = delay),
        value: |link| (!link.delay.is_none()).then(|| link.delay.to_string()),
    },
    LinkPart {
        name: "in-order",
        set: |link, value| match value {
            "" => {
                link.in_order = true;
                Ok(())
            }
            _ => Err(no_part("in-order")),
        },
        value: |link| link.in_order.then(String::new),
    },
    LinkPart {
        name: "loss",
        set: |link, value| probability(value).map(|loss| link.loss = loss),
        value: |link| (link.loss > 0.0).then(|| link.loss.to_string()),
    },
    LinkPart {
        name: "burst",
        set: |link, value| burst(value).map(|burst| link.burst = Some(burst)),
        value: |link| {
            let Burst { start, length } = link.burst?;
            Some(format!("{start},{length}"))
        },
    },
    LinkPart {
        name: "reliable",
        set: |link, value| millis::parse(value).map(|again| link.reliable = Some(again)),
        value: |link| Some(millis::to_millis(link.reliable?).to_string()),
    },
];

fn no_part(name: &str) -> String {
    format!("{name:?} is no part of a link: {EXPECTED}")
}

/// The longest mean length of a burst (messages).
const LONGEST_BURST: f64 = 1e9;

/// A model of message transport: delay, order and loss. As text `none`, or
/// comma-separated parts, each at most once: `delay:30`, `delay:5..40` or
/// `delay:lognormal:10,50` (ms), `in-order`, `loss:0.2`, `burst:0.01,5`, `reliable:40`
/// (ms).
///
/// ```
/// use ratelab_effects::Link;
///
/// let link: Link = "loss:0.2,delay:lognormal:10,50,in-order".parse()?;
/// assert_eq!(link.to_string(), "delay:lognormal:10,50,in-order,loss:0.2");
/// assert!("loss:1,reliable:40".parse::<Link>().is_err());
/// # Ok::<(), String>(())
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

    /// The delay (ms), if it is always the same.
    pub fn delay_ms(&self) -> Option<f64> {
        match self.delay {
            Draw::Constant(delay) => Some(millis::to_millis(delay)),
            _ => None,
        }
    }

    /// This link with another `part`, such as `delay:30`.
    ///
    /// # Errors
    /// The accepted values, if there is no such part, or no such link.
    pub fn with(&self, part: &str) -> Result<Self, String> {
        let mut link = self.clone();
        let (name, value) = part.split_once(':').unwrap_or((part, ""));
        link.add(name, value)?;
        link.to_string().parse()
    }

    /// Adds the part called `name`. Returns an error message for an invalid part.
    fn add(&mut self, name: &str, value: &str) -> Result<(), String> {
        let part = PARTS.iter().find(|part| part.name == name);
        (part.ok_or_else(|| no_part(name))?.set)(self, value)
    }
}

fn delay(value: &str) -> Result<Draw, String> {
    match value.parse() {
        Ok(Draw::Measured(_)) | Err(_) => Err(format!("{value:?} is no delay: {EXPECTED}")),
        Ok(draw) => Ok(draw),
    }
}

fn probability(text: &str) -> Result<f64, String> {
    let known = text.trim().parse().ok();
    let known = known.filter(|p| (0.0..=1.0).contains(p));
    known.ok_or_else(|| format!("{text:?} is no probability: expected 0 to 1"))
}

fn burst(value: &str) -> Result<Burst, String> {
    let (start, length) = value
        .split_once(',')
        .ok_or_else(|| format!("burst:{value} lacks a number: expected burst:P,N"))?;
    let known = length.trim().parse().ok();
    let known = known.filter(|n| (1.0..=LONGEST_BURST).contains(n));
    Ok(Burst {
        start: probability(start)?,
        length: known.ok_or_else(|| {
            format!(
                "{length:?} is no mean length of bursts: expected 1 to {LONGEST_BURST} messages"
            )
        })?,
    })
}

/// Splits a list into the first part and the rest. Two kinds of parts contain a comma.
fn first_part(list: &str) -> (&str, Option<&str>) {
    let commas = usize::from(list.starts_with("burst:") || list.starts_with("delay:lognormal:"));
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
        match parts.is_empty() {
            true => f.write_str("none"),
            false => f.write_str(&parts.join(",")),
        }
    }
}

impl FromStr for Link {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (mut link, mut names) = (Self::NONE, Vec::new());
        let mut rest = Some(text.trim()).filter(|text| *text != "none");
        while let Some(list) = rest {
            let (part, others) = first_part(list.trim_start());
            let (name, value) = part.split_once(':').unwrap_or((part, ""));
            if names.contains(&name) {
                return Err(format!("{name} is there twice: {EXPECTED}"));
            }
            link.add(name, value)?;
            names.push(name);
            rest = others;
        }
        if link.reliable.is_some() && link.loss >= 1.0 {
            return Err(
                "a reliable link never delivers at loss:1: expected less than 1".to_owned(),
            );
        }
        Ok(link)
    }
}
