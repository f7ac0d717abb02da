//! The timeline: a lane per node with its ticks, a lane per topic with what became of its
//! messages, and lanes of plans with what was played of them.
//!
//! Which messages were read is known only at the end, so these lanes are made of the
//! complete recording, with the same [`Lineage`] as the timeline of the dashboard.

use std::{collections::HashSet, time::Duration};

use ratelab::Time;
use ratelab_metrics::{Lineage, TickWait, TracedTick};
use ratelab_system::{BarPart, PlanBar, Planning};
use rerun::{Color, EntityPath, RecordingStream, StateChange, StateConfiguration, TimeColumn};

use super::lines::{BLUE, GREY, ORANGE};
use crate::{
    rrd::{
        schema::path,
        timeline::{RUN_TIME, Written},
    },
    run::{Recording, end_of},
};

/// The lanes.
pub const TIMELINE: &str = "timeline";

/// A tick, until its end.
const TICK: &str = "tick";
/// A tick without a duration: [`INSTANT_WIDTH`] wide, to be seen.
const INSTANT: &str = "tick without duration";
/// The delay between the due time of a tick and its start.
const LATE: &str = "late";
/// Such a delay, as others had the executor.
const WAITING: &str = "waiting for the executor";
/// A part of a tick for which it was set aside for a more urgent one.
const ASIDE: &str = "set aside";
/// A tick that was too long, so that the next period was skipped.
const OVERRUN: &str = "overrun";

/// The newest message, by what became of it.
const READ: &str = "read";
const UNREAD: &str = "unread";
const LOST: &str = "lost on the link";

/// Between two ticks.
const NOTHING: &str = "";

/// Width of a tick without a duration, unless the next one comes earlier.
const INSTANT_WIDTH: Duration = Duration::from_millis(1);

/// When a lane changed, and to what.
type Changes = Vec<(Time, &'static str)>;

/// Logs the lanes of `recording`, until that `is_overdue`. They are on the timeline of run time only.
pub fn add(
    rec: &RecordingStream,
    recording: &Recording,
    planning: Option<Planning>,
    is_overdue: fn() -> bool,
) -> Written {
    if is_overdue() {
        return Ok(());
    }
    let lineage = recording.lineage();
    let topology = lineage.topology();
    for (node, known) in topology.nodes.iter().enumerate() {
        if is_overdue() {
            return Ok(());
        }
        let waits = match known.executor {
            Some(_) => WAITING,
            None => LATE,
        };
        let mut looks = vec![
            (TICK, BLUE),
            (INSTANT, BLUE),
            (waits, GREY),
            (OVERRUN, ORANGE),
        ];
        looks.extend(known.executor.as_ref().map(|_| (ASIDE, GREY)));
        let run = lineage
            .ticks(node)
            .enumerate()
            .map(|(index, worked)| (worked, lineage.set_aside(node, index)));
        let lane = path(&[TIMELINE, "node", &known.name]);
        send(rec, lane, &looks, &ticks(run, waits))?;
    }
    let read = topology.topics.iter().enumerate();
    for (topic, known) in read.filter(|(_, topic)| !topic.readers.is_empty()) {
        if is_overdue() {
            return Ok(());
        }
        let lane = path(&[TIMELINE, "topic", &known.name]);
        let looks = [(READ, BLUE), (UNREAD, GREY), (LOST, ORANGE)];
        send(
            rec,
            lane,
            &looks,
            &messages(&lineage, topic, &known.readers),
        )?;
    }
    planning.map_or(Ok(()), |planning| {
        plans(rec, &recording.plan_lanes(&planning))
    })
}

/// Logs the lanes of plans.
fn plans(rec: &RecordingStream, lanes: &[Vec<PlanBar>]) -> Written {
    let colours = [(BarPart::PLAYED, BLUE), (BarPart::PLANNED, GREY)];
    for (number, bars) in (1..).zip(lanes) {
        let mut changes = Changes::new();
        for part in bars.iter().flat_map(|bar| &bar.parts) {
            change(&mut changes, part.from, part.word());
            change(&mut changes, part.to, NOTHING);
        }
        let lane = path(&[TIMELINE, "plan", &number.to_string()]);
        send(rec, lane, &colours, &changes)?;
    }
    Ok(())
}

/// Returns the lane of a node from its ticks, each with the stretches for which it was set aside;
/// `waits` is the state before a late one.
fn ticks<'a>(
    ticks: impl Iterator<Item = (&'a TracedTick, Vec<TickWait>)>,
    waits: &'static str,
) -> Changes {
    let mut changes = Changes::new();
    let (mut idle_from, mut overruns) = (Time::ZERO, None);
    for (TracedTick { tick, .. }, aside) in ticks {
        let due = tick.due();
        if due < tick.at {
            change(&mut changes, due.max(idle_from), waits);
        }
        let first = (tick.number == 0).then_some(0);
        let before = overruns.replace(tick.overruns).or(first);
        let overran = before.is_some_and(|before| before < tick.overruns);
        let end = end_of(tick);
        let (state, until) = match tick.ends.map(|_| end > tick.at) {
            Some(true) if overran => (OVERRUN, Some(end)),
            Some(true) => (TICK, Some(end)),
            Some(false) => (INSTANT, Some(tick.at + INSTANT_WIDTH)),
            // The run ended before.
            None => (TICK, None),
        };
        change(&mut changes, tick.at, state);
        for part in aside {
            change(&mut changes, part.from, ASIDE);
            change(&mut changes, part.to.min(end), state);
        }
        if let Some(until) = until {
            change(&mut changes, until, NOTHING);
        }
        idle_from = end;
    }
    changes
}

/// Adds a change; what it comes before or replaces is left out.
fn change(changes: &mut Changes, at: Time, state: &'static str) {
    while changes.pop_if(|(before, _)| *before >= at).is_some() {}
    if changes.last().is_none_or(|(_, before)| *before != state) {
        changes.push((at, state));
    }
}

/// Returns the lane of a topic.
fn messages(lineage: &Lineage, topic: usize, readers: &[usize]) -> Changes {
    let reads = readers.iter().flat_map(|&node| lineage.ticks(node));
    let read: HashSet<u64> = reads
        .flat_map(TracedTick::reads)
        .filter(|read| read.topic == topic)
        .map(|read| read.seq)
        .collect();
    let mut changes = Changes::new();
    for sent in lineage.sent(topic) {
        let state = match sent.arrives {
            None => LOST,
            Some(_) if read.contains(&sent.seq) => READ,
            Some(_) => UNREAD,
        };
        change(&mut changes, sent.at, state);
    }
    changes
}

/// Logs when a lane changed, and to what, with the `looks` of its states. Nothing without changes.
pub fn send(
    rec: &RecordingStream,
    lane: EntityPath,
    looks: &[(impl AsRef<str>, Color)],
    changes: &[(Time, impl AsRef<str>)],
) -> Written {
    if changes.is_empty() {
        return Ok(());
    }
    let states = StateConfiguration::new()
        .with_values(looks.iter().map(|(state, _)| state.as_ref()))
        .with_colors(looks.iter().map(|(_, colour)| *colour));
    rec.log_static(lane.clone(), &states)?;
    let times = changes.iter().map(|(at, _)| at.as_nanos() as i64);
    let times = TimeColumn::new_duration_nanos(RUN_TIME, times);
    let rows = StateChange::new().with_state(changes.iter().map(|(_, state)| state.as_ref()));
    rec.send_columns(lane, [times], rows.columns_of_unit_batches()?)
}
