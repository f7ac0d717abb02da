//! When a node ticks.

use crate::{
    settings::matching::Match,
    time::{Hz, HzError},
};

/// When a node ticks: at a rate, or when messages arrive.
///
/// | | at a rate | on messages |
/// |---|---|---|
/// | a tick is due | at `offset + k / f` | when the message arrives that completes its inputs |
/// | lateness | start − due | start − due: the wait behind earlier messages and for the executor |
/// | response time | end − due | end − due |
/// | still busy when due | an overrun: the tick is skipped | the message waits in the queue of its topic |
/// | loss | counted as overruns of the node | a full queue drops its oldest: a drop of the topic |
///
/// ```
/// use ratelab::{Clock, Depth, Graph, Hz, Inbox, Match, Tick, Time, Topic, VirtualClock};
///
/// let image = Topic::new("/image", Depth::ONE);
/// let mut graph = Graph::new();
/// graph.node("camera", Hz::new(30.0)?, 0, |wiring| {
///     let image = wiring.publisher(&image);
///     move |tick: &mut Tick| tick.publish(&image, ())
/// })?;
/// let detected = Topic::new("/detected", Depth::ONE);
/// graph.node("detector", Match::Each, 1, |wiring| {
///     let (mut image, detected) = (wiring.trigger(&image), wiring.publisher(&detected));
///     move |tick: &mut Tick| {
///         let image = tick.read(&mut image).expect("the image that arrived");
///         assert_eq!(image.stamp, tick.now());
///         tick.publish(&detected, ());
///     }
/// })?;
/// let end = Time::from_secs_f64(1.0)?;
/// VirtualClock.run(&mut graph, &mut Inbox::default(), end)?;
/// assert_eq!(detected.published(), 31);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Release {
    /// At a rate.
    AtRate(Hz),
    /// When a message has arrived on each topic that
    /// [triggers](crate::Wiring::trigger) the node.
    On(Match),
}

impl Release {
    /// Returns the matching of its triggers.
    pub(crate) fn matching(&self) -> Match {
        match self {
            Self::AtRate(_) => Match::Each,
            Self::On(matching) => *matching,
        }
    }

    /// Returns the rate; the lowest one for a node that has no use for it.
    pub(crate) fn hz(&self) -> Hz {
        match self {
            Self::AtRate(hz) => *hz,
            Self::On(_) => Hz::MIN,
        }
    }
}

impl TryFrom<f64> for Release {
    type Error = HzError;

    fn try_from(hz: f64) -> Result<Self, HzError> {
        Hz::new(hz).map(Self::AtRate)
    }
}

impl From<Hz> for Release {
    fn from(hz: Hz) -> Self {
        Self::AtRate(hz)
    }
}

impl From<Match> for Release {
    fn from(matching: Match) -> Self {
        Self::On(matching)
    }
}
