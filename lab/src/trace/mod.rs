//! A recorded run as a trace for <https://ui.perfetto.dev>: a lane per node and topic,
//! messages as flows between them, plans as bars, and counters.

mod perfetto;
mod tracks;

use perfetto::Trace;
use prost::Message;
use ratelab::{Head, MessageId, Time};
use ratelab_metrics::{Lineage, TickWait, TracedTick, WaitsFor};
use ratelab_system::{PlanBar, System, acting};
use tracks::{EventText, Tracks};

use ratelab_recording::{Recording, end_of};

/// Returns the bytes of a trace of `recording`, a run of `system`.
pub fn trace(recording: &Recording, system: &dyn System) -> Vec<u8> {
    let lineage = recording.lineage().along(system.about().latency_path());
    let topology = lineage.topology();
    let mut tracks = Tracks::default();
    let nodes = tracks.group("nodes");
    for (node, known) in topology.nodes.iter().enumerate() {
        let lane = tracks.lane(nodes, &known.name);
        let ticks = (0..).zip(lineage.ticks(node));
        let mut overruns = 0;
        for (index, worked) in ticks {
            tick(&mut tracks, lane, &lineage, node, index, worked);
            let more = worked.tick.overruns.saturating_sub(overruns);
            overruns = worked.tick.overruns;
            if more > 0 {
                let name = format!("{more} overrun");
                tracks.instant(lane, &*name, end_of(&worked.tick));
            }
        }
        waits(&mut tracks, nodes, &lineage, node);
    }
    let topics = tracks.group("topics");
    for (topic, known) in topology.topics.iter().enumerate() {
        let lane = tracks.lane(topics, &known.name);
        for sent in lineage.sent(topic) {
            message(&mut tracks, lane, topic, sent);
        }
    }
    if let Some(planning) = system.robot().planning() {
        let lanes = recording.plan_lanes(&planning);
        plans(&mut tracks, planning.plans, &lanes);
    }
    counters(&mut tracks, recording, &lineage, system);
    tracks.finish().encode_to_vec()
}

/// Returns whether `bytes` are a trace of this program, and nothing else.
pub fn is_trace(bytes: &[u8]) -> bool {
    Trace::decode(bytes).is_ok_and(|trace| trace.encoded_len() == bytes.len())
}

/// What the ticks of a node waited for, if anything: on a lane of its own, because a viewer draws
/// what overlaps as a part of what began before. The next tick may wait while one runs, and others
/// behind it: each wait is shown from the end of the one before.
fn waits(tracks: &mut Tracks, group: u64, lineage: &Lineage, node: usize) {
    let topology = lineage.topology();
    let ticks = 0..lineage.ticks(node).count();
    let (mut lane, mut before) = (None, Time::ZERO);
    for TickWait { from, to, what } in ticks.flat_map(|index| lineage.waits(node, index)) {
        if to <= before {
            continue;
        }
        let what = match what {
            WaitsFor::Match(topic) => {
                format!("waiting for {} to match", topology.topics[topic].name)
            }
            WaitsFor::Node(by) => format!("waiting for {}", topology.nodes[by].name),
            WaitsFor::Thread => "late".to_owned(),
        };
        let name = format!("{} waits", topology.nodes[node].name);
        let lane = *lane.get_or_insert_with(|| tracks.lane(group, &name));
        tracks.slice(lane, &*what, [from.max(before), to]);
        before = to;
    }
}

/// A tick, with what it was set aside for.
fn tick(
    tracks: &mut Tracks,
    lane: u64,
    lineage: &Lineage,
    node: usize,
    index: usize,
    worked: &TracedTick,
) {
    let tick = &worked.tick;
    let topology = lineage.topology();
    let text = EventText {
        name: "tick",
        flows: flows(lineage, node, index, worked),
        number: Some(("tick", tick.number)),
    };
    tracks.slice(lane, text, [tick.at, end_of(tick)]);
    for TickWait { from, to, what } in lineage.set_aside(node, index) {
        if let WaitsFor::Node(by) = what {
            let what = format!("set aside for {}", topology.nodes[by].name);
            tracks.slice(lane, &*what, [from, to.min(end_of(tick))]);
        }
    }
}

/// Returns the messages first read in a tick, and the messages published by it.
fn flows(lineage: &Lineage, node: usize, index: usize, worked: &TracedTick) -> Vec<u64> {
    let before = index
        .checked_sub(1)
        .and_then(|before| lineage.ticks(node).nth(before));
    let news = worked
        .reads()
        .filter(|read| before.is_none_or(|before| before.reads().all(|known| known != *read)));
    let mut flows: Vec<u64> = news.map(flow).collect();
    let made = lineage.made(node, index).into_iter();
    flows.extend(made.map(flow));
    flows
}

/// Returns the number of a message, unique over all topics.
fn flow(message: MessageId) -> u64 {
    let MessageId { topic, seq } = message;
    ((topic as u64 + 1) << 48) | seq
}

/// A message at its publication, and at its delivery if that is later.
fn message(tracks: &mut Tracks, lane: u64, topic: usize, sent: &Head) {
    let text = |name| EventText {
        name,
        flows: vec![flow(MessageId {
            topic,
            seq: sent.seq,
        })],
        number: Some(("seq", sent.seq)),
    };
    let name = match sent.arrives {
        None => "lost",
        Some(at) if at > sent.at => "sent",
        Some(_) => "message",
    };
    tracks.instant(lane, text(name), sent.at);
    if let Some(at) = sent.arrives.filter(|at| *at > sent.at) {
        tracks.instant(lane, text("arrived"), at);
    }
}

/// The plans on `topic`, and what was played of them.
fn plans(tracks: &mut Tracks, topic: &str, lanes: &[Vec<PlanBar>]) {
    if lanes.is_empty() {
        return;
    }
    let group = tracks.group("plans");
    for (number, bars) in (1..).zip(lanes) {
        let lane = tracks.lane(group, &format!("{topic} {number}"));
        for bar in bars {
            for part in &bar.parts {
                let text = EventText {
                    number: Some(("plan", bar.number)),
                    ..part.word().into()
                };
                tracks.slice(lane, text, [part.from, part.to]);
            }
        }
    }
}

fn counters(tracks: &mut Tracks, recording: &Recording, lineage: &Lineage, system: &dyn System) {
    let topology = lineage.topology();
    let group = tracks.group("counters");
    if let Some(node) = acting(system, topology) {
        let counter = tracks.counter(group, "age of the push", "ms");
        for (at, ms) in saw(lineage, node, recording.until) {
            tracks.count(counter, at, ms);
        }
    }
    for (topic, known) in topology.topics.iter().enumerate() {
        for &reader in &known.readers {
            let reading = &topology.nodes[reader].name;
            let name = format!("queue of {} before {reading}", known.name);
            let counter = tracks.counter(group, &name, "messages");
            for (at, waiting) in lineage.queue(topic, reader) {
                tracks.count(counter, at, waiting as f64);
            }
        }
        let name = format!("dropped on {}", known.name);
        let drops = tracks.counter(group, &name, "messages");
        let mut dropped = None;
        for head in recording.topics[topic].heads() {
            if dropped.replace(head.dropped) != Some(head.dropped) {
                tracks.count(drops, head.at, head.dropped as f64);
            }
        }
    }
}

/// Returns the run time and age (ms) at both ends of each tooth of the sawtooth.
fn saw(lineage: &Lineage, node: usize, until: Time) -> Vec<(Time, f64)> {
    let pushes = lineage.pushes(node);
    let ends = pushes.iter().skip(1).map(|push| push.since).chain([until]);
    let teeth = pushes.iter().zip(ends).flat_map(|(push, end)| {
        [push.since, end].map(|at| (at, push.parts(at).sum_ns() as f64 / 1e6))
    });
    teeth.collect()
}
