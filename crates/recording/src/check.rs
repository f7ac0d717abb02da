//! Compares the claims of a file with its content, and finds the end of its intact part; of any
//! format.

use std::collections::{HashSet, VecDeque};

use ratelab::{ClockKind, Command, Event, Hz, Knob, KnobKind, NodeTopology, Rate, Time, Topology};
use ratelab_metrics::TickRecord;
use ratelab_system::Setup;
use thiserror::Error;

use crate::run::{RecordRow, Recording, RecordingEnd, RunStatus, Series};

/// The defect of a file with an impossible row.
pub const DAMAGED_ROW: &str = "a row in it is damaged";

impl Recording {
    /// Removes everything incomplete or impossible; `sound` is the run time up to which
    /// rows are undamaged, if one is damaged.
    pub(crate) fn check(&mut self, sound: Option<Time>) {
        let limit = [
            sound,
            self.last_in_cadence(),
            self.last_before_a_false_end(),
        ];
        if let Some(limit) = limit.into_iter().flatten().min() {
            self.damage = Some(DAMAGED_ROW);
            // After a false end only the limit is known.
            let known = self.outcome.take().map_or(self.until, |_| limit);
            self.until = known.min(limit);
        }
        match &self.outcome {
            Some(outcome) if self.lacks_some(outcome) => {
                self.damage = Some("messages are missing in it");
            }
            Some(outcome) if outcome.end == RunStatus::WentOn => self.cut(self.last_known()),
            Some(_) => {}
            None => self.cut(self.until.min(self.newest().unwrap_or_default())),
        }
    }

    /// Returns whether the whole run was on the virtual clock: every tick is then at a time given
    /// by the rates of its node.
    fn is_virtual(&self) -> bool {
        let handed_over = |event: &Event| matches!(event.applied(), Some(Command::HandOver(_)));
        self.origin.config.clock == ClockKind::Virtual && !self.events.iter().any(handed_over)
    }

    /// Returns the run time of the last row before one that contradicts the rates of its node, or
    /// comes before another one, if there is such a row. The only gap that a file may claim is a
    /// late beginning.
    fn last_in_cadence(&self) -> Option<Time> {
        if !self.is_virtual() {
            return None;
        }
        let strays = self.nodes().filter_map(|(node, ticks)| {
            let mut schedule = self.schedule(node);
            let mut allowed = |tick: &TickRecord| schedule.allows(tick.number, tick.at);
            let stray = ticks.iter().position(|tick| !allowed(tick))?;
            Some(
                stray
                    .checked_sub(1)
                    .map(|before| ticks[before].at)
                    .unwrap_or_default(),
            )
        });
        let back = self
            .topics
            .iter()
            .flat_map(|rows| rows.heads().windows(2))
            .filter_map(|two| (two[1].at < two[0].at).then_some(two[0].at));
        // Messages are published in ticks.
        let ticked = self
            .nodes()
            .filter_map(|(node, ticks)| {
                let lasts = self.schedule(node).may_miss;
                let last = ticks.last()?;
                Some(last.at + last.took.filter(|_| lasts).unwrap_or_default())
            })
            .max()
            .unwrap_or_default();
        let published = self.topics.iter().filter_map(Series::newest).max();
        let beyond = published.filter(|at| *at > ticked).map(|_| ticked);
        strays.chain(back).chain(beyond).min()
    }

    /// Returns the run time of the last row, if the claimed end contradicts the content.
    fn last_before_a_false_end(&self) -> Option<Time> {
        let outcome = self.outcome.as_ref()?;
        let false_end = self.last_item() > outcome.at
            || !is_sound(outcome, &self.origin.topology)
            || (outcome.end != RunStatus::WentOn && !self.may_rest_until(outcome.at));
        false_end.then(|| self.newest().unwrap_or_default())
    }

    fn schedule(&self, node: &NodeTopology) -> TickSchedule {
        TickSchedule::new(node, &self.origin.config.setup, &self.events)
    }

    /// Returns whether run time can have reached `at` without further ticks.
    fn may_rest_until(&self, at: Time) -> bool {
        !self.is_virtual()
            || self.nodes().all(|(node, ticks)| {
                let last = ticks.last();
                last.is_none_or(|last| self.schedule(node).may_rest(last.number, at))
            })
    }

    /// Returns the run time of the last item, of a run that went on. Events may be ahead of the
    /// rows by any time, or by less than a tick.
    fn last_known(&self) -> Time {
        let event = self
            .events
            .iter()
            .map(|event| event.at)
            .max()
            .filter(|event| self.may_rest_until(*event));
        self.newest().max(event).unwrap_or_default()
    }

    /// Returns whether items counted in `outcome` are missing, or differ from it.
    fn lacks_some(&self, outcome: &RecordingEnd) -> bool {
        self.counts() != [outcome.messages.clone(), outcome.ticks.clone()]
            || !self.may_have_lost(outcome)
    }

    /// Returns whether the losses in `outcome` are possible: the gaps between rows, and the
    /// possible ones after the last row.
    fn may_have_lost(&self, outcome: &RecordingEnd) -> bool {
        let spans = self
            .topics
            .iter()
            .map(span)
            .chain(self.ticks.iter().map(span));
        let (mut least, mut most) = (0_u64, 0_u64);
        for (missing, at) in spans {
            least = least.saturating_add(missing);
            let rest = outcome.at.since(at).as_secs_f64() * self.fastest().get();
            most = most.saturating_add(rest as u64 + 2);
        }
        let most = if self.is_virtual() { 0 } else { most };
        (least..=least.saturating_add(most)).contains(&outcome.lost)
    }

    /// Returns the maximum rate of any node.
    fn fastest(&self) -> Hz {
        let first = self.origin.topology.nodes.iter().map(|node| node.hz);
        let later = self
            .events
            .iter()
            .filter_map(Event::knob)
            .filter_map(|timed| match timed.knob {
                Knob::Rate { hz, .. } => Some(hz),
                _ => None,
            });
        first.chain(later).max().unwrap_or(Hz::MAX)
    }

    /// Removes everything later than `until`.
    fn cut(&mut self, until: Time) {
        self.until = until;
        self.run = self.run.take_until(until);
        self.events.retain(|event| event.at <= until);
    }
}

/// Returns the number of rows that are missing in `series`, and the run time of its last one.
fn span<S: Series>(series: &S) -> (u64, Time) {
    let rows = series.rows();
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
        return (0, Time::ZERO);
    };
    let numbers = last.number().saturating_sub(first.number());
    (
        numbers.saturating_add(1).saturating_sub(rows.len() as u64),
        last.at(),
    )
}

/// Returns whether an end record is possible: nothing in it is later than the end, and the wall
/// time is at most [`Time::MAX`].
fn is_sound(outcome: &RecordingEnd, topology: &Topology) -> bool {
    let mut losses = [&outcome.dropped, &outcome.unmatched].into_iter().flatten();
    losses.all(|losses| losses.len() == topology.topics.len())
        && outcome.result().is_none_or(|end| {
            let longest = u128::from(Time::MAX.as_nanos());
            end.sim_time <= outcome.at
                && end.verdict.at <= outcome.at
                && end.wall_time.as_nanos() <= longest
        })
}

/// Why the description of the run in a recording is not understood.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DescriptionError {
    /// It is not what a recorder writes.
    #[error("what this recording says of itself is damaged")]
    Damaged,
    /// A part of the file is not what a recorder writes.
    #[error("this recording is damaged")]
    DamagedFile,
    /// Its graph is not one that can be built.
    #[error("the graph in this recording is damaged")]
    DamagedGraph,
    /// Its graph is larger than any that is recorded.
    #[error(
        "the graph in this recording has {parts} parts (nodes, topics, their ends, meters): up to \
         {max} are read"
    )]
    LargeGraph {
        /// Number of parts.
        parts: usize,
        /// Number of parts that are read.
        max: usize,
    },
    /// Another version of the format.
    #[error("this recording is of format {found}, this ratelab {reads} {known}: {why}")]
    Format {
        /// The version of the file.
        found: u64,
        /// Which versions are read.
        reads: &'static str,
        /// The version that is written.
        known: u32,
        /// What to do, or why.
        why: &'static str,
    },
}

/// Maximum number of nodes, topics, ends of topics and meters together in a graph. Each
/// may take half a megabyte in a replay; the cart-pole has 12.
const MAX_PARTS: usize = 256;

/// Checks the graph of a recording: its size, unique names, an existing node at every end of a
/// topic, and existing topics that trigger nodes.
///
/// # Errors
/// [`DescriptionError`] for a graph that no recorder writes.
pub fn check_graph(topology: &Topology) -> Result<(), DescriptionError> {
    let Topology { nodes, topics } = topology;
    let meters: usize = nodes.iter().map(|node| 1 + node.meters.len()).sum();
    let ends = |list: &[usize]| list.len();
    let topic_ends = topics
        .iter()
        .map(|topic| 1 + ends(&topic.publishers) + ends(&topic.readers));
    let parts = meters + topic_ends.sum::<usize>();
    if parts > MAX_PARTS {
        return Err(DescriptionError::LargeGraph {
            parts,
            max: MAX_PARTS,
        });
    }
    let at_nodes = |list: &[usize]| are_distinct(list) && list.iter().all(|n| *n < nodes.len());
    let sound = are_distinct(nodes.iter().map(|node| &node.name))
        && are_distinct(topics.iter().map(|topic| &topic.name))
        && nodes.iter().all(|node| are_distinct(&node.meters))
        && nodes
            .iter()
            .all(|node| node.triggers.iter().all(|topic| *topic < topics.len()))
        && topics
            .iter()
            .all(|topic| at_nodes(&topic.publishers) && at_nodes(&topic.readers));
    sound.then_some(()).ok_or(DescriptionError::DamagedGraph)
}

fn are_distinct<T: Eq + std::hash::Hash>(items: impl IntoIterator<Item = T>) -> bool {
    let mut seen = HashSet::new();
    items.into_iter().all(|item| seen.insert(item))
}

/// The ticks of a node under the virtual clock, from its first rate and all changes of
/// it, followed through run time. The cost is independent of the length of the run.
pub struct TickSchedule {
    rate: Rate,
    /// Number of ticks due before the next one.
    ticks: u64,
    /// Later changes, in order.
    ahead: VecDeque<(Time, Hz)>,
    /// Maximum error of a count: one, plus one for each change of rate, so that
    /// recordings stay valid when the handling of changes is revised.
    slack: u64,
    /// Whether some due ticks may have been missed: its ticks had a duration, lateness or offset,
    /// or it stopped for a while.
    pub may_miss: bool,
    /// Whether its clock had an error, so that due times were skipped or repeated.
    wrong: bool,
}

impl TickSchedule {
    /// Creates the schedule of `node` in a run with this `setup` and these `events`.
    pub fn new(node: &NodeTopology, setup: &Setup, events: &[Event]) -> Self {
        let turned: Vec<_> = events
            .iter()
            .filter_map(Event::change)
            .filter(|timed| timed.knob.target() == node.name)
            .collect();
        let knobs = || {
            setup
                .iter()
                .filter(|knob| knob.target() == node.name)
                .chain(turned.iter().map(|timed| &timed.knob))
        };
        let changes = turned.iter().filter_map(|timed| match timed.knob {
            Knob::Rate { hz, .. } => Some((timed.at, hz)),
            _ => None,
        });
        let ahead: VecDeque<_> = changes.collect();
        let rare = turned.iter().filter(|timed| makes_rare(&timed.knob));
        Self {
            rate: Rate::new(node.hz, Time::ZERO),
            ticks: 0,
            slack: 1 + (ahead.len() + rare.count()) as u64,
            ahead,
            may_miss: knobs().any(makes_rare) || node.executor.is_some(),
            wrong: !node.triggers.is_empty() || knobs().any(|knob| knob.kind() == KnobKind::Clock),
        }
    }

    /// Returns whether tick `number` is possible at `at`, which is not before the time of the last
    /// call.
    pub fn allows(&mut self, number: u64, at: Time) -> bool {
        let due = self.ticks_before(at);
        let (most, least) = (
            due.saturating_add(self.slack),
            due.saturating_sub(self.slack),
        );
        self.wrong || (number <= most && (self.may_miss || least <= number))
    }

    /// Returns whether run time can have reached `at` without a tick after tick `last`.
    pub fn may_rest(&mut self, last: u64, at: Time) -> bool {
        let due = self.ticks_before(at).saturating_sub(self.slack);
        self.may_miss || self.wrong || due <= last.saturating_add(1)
    }

    fn ticks_before(&mut self, at: Time) -> u64 {
        while let Some((change, hz)) = self.ahead.pop_front_if(|(change, _)| *change <= at) {
            self.advance_to(change);
            self.rate.set_hz(hz, change);
        }
        self.advance_to(at);
        self.ticks
    }

    fn advance_to(&mut self, at: Time) {
        if self.rate.due() < at {
            let skipped = self.rate.advance_past(at);
            self.ticks = self.ticks.saturating_add(skipped).saturating_add(1);
        }
    }
}

/// Returns whether `knob`, of a node, makes ticks last, late or rare.
fn makes_rare(knob: &Knob) -> bool {
    knob.kind().is_time() || knob.kind().has_no_value()
}
