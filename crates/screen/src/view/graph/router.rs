//! The cells of the lines: tracks in the gaps, on which topics go up or down, and lanes below
//! the boxes.

use std::collections::BTreeMap;

use super::{
    GraphView,
    nodes::Wire,
    place::GraphLayout,
    route::{Route, dangling_length},
};
use crate::view::sheet::clamp;

/// One topic in one gap: the rows at which it enters and leaves.
struct WirePassage {
    route: usize,
    from: Vec<u16>,
    to: Vec<u16>,
}

/// A graph with the places of its lines.
pub(super) struct Router<'a> {
    pub(super) view: GraphView<'a>,
    pub(super) layout: &'a GraphLayout,
    /// Column at which route number `.1` goes up or down in gap number `.0`.
    tracks: BTreeMap<(usize, usize), u16>,
}

impl<'a> Router<'a> {
    /// Finds the tracks of all topics.
    pub(super) fn new(view: GraphView<'a>, layout: &'a GraphLayout) -> Self {
        let mut router = Self {
            view,
            layout,
            tracks: BTreeMap::new(),
        };
        for gap in 0..layout.gaps.len() {
            let order = in_order(router.bends(gap));
            for (place, route) in order.iter().enumerate() {
                let track = router.track(gap, place, order.len());
                router.tracks.insert((gap, *route), track);
            }
        }
        router
    }

    /// Returns the lines of all topics.
    pub(super) fn wires(&self) -> Vec<Wire> {
        self.layout
            .routes
            .all
            .iter()
            .enumerate()
            .map(|(number, route)| self.wire(number, route))
            .collect()
    }

    /// Returns the first column of `gap` with a vertical line, or the end of the gap.
    pub(super) fn limit(&self, gap: usize) -> u16 {
        self.tracks
            .range((gap, 0)..(gap + 1, 0))
            .map(|(_, x)| *x)
            .min()
            .unwrap_or(self.layout.gaps[gap][1])
    }

    /// Returns the rows at which route `number` enters and leaves `gap`.
    fn passage(&self, number: usize, gap: usize) -> WirePassage {
        let topic = self.layout.routes.all[number].topic;
        let [from, to] = [&self.layout.exits, &self.layout.entries].map(|ports| {
            ports
                .iter()
                .filter(|port| port.topic == topic && port.gap == gap)
                .map(|port| port.row)
                .collect()
        });
        WirePassage {
            route: number,
            from,
            to,
        }
    }

    /// Returns the row of the lane of route `number`, if any.
    fn lane(&self, number: usize) -> Option<u16> {
        let lane = self.layout.routes.all[number].lane?;
        Some(self.layout.lanes + clamp(lane))
    }

    /// Returns the topics that go up or down in `gap`.
    fn bends(&self, gap: usize) -> Vec<WirePassage> {
        let passages = self
            .layout
            .routes
            .all
            .iter()
            .enumerate()
            .filter(|(_, route)| route.gaps.contains(&gap) && !route.dangles())
            .map(|(number, _)| self.passage(number, gap));
        let bent = |passage: &WirePassage| {
            let mut rows = passage.from.iter().chain(&passage.to);
            let first = rows.next();
            self.lane(passage.route).is_some() || rows.any(|row| Some(row) != first)
        };
        passages.filter(bent).collect()
    }

    /// Column of track number `place` of `count`: close to the readers, with room for
    /// text before it.
    fn track(&self, gap: usize, place: usize, count: usize) -> u16 {
        let [start, end] = self.layout.gaps[gap];
        let room = usize::from(end - start);
        let step = if room > 2 * count + 1 { 2 } else { 1 };
        let back = 2 + step * (count - 1 - place);
        let back = back + usize::from(room > back + 2 && step == 2);
        end.saturating_sub(clamp(back)).max(start)
    }

    fn wire(&self, number: usize, route: &Route) -> Wire {
        let mut wire = Wire {
            topic: route.topic,
            ..Wire::default()
        };
        let lane = self.lane(number);
        let mut turns = Vec::new();
        for &gap in &route.gaps {
            let passage = self.passage(number, gap);
            if route.dangles() {
                self.dangling(&mut wire, &passage, gap);
                continue;
            }
            let [start, end] = self.layout.gaps[gap];
            let last = end.saturating_sub(1).max(start);
            let track = self.tracks.get(&(gap, number)).copied();
            for row in &passage.from {
                wire.horizontal(*row, start, track.unwrap_or(last));
                wire.starts.push((*row, start));
            }
            for row in &passage.to {
                wire.horizontal(*row, track.unwrap_or(last), last);
                wire.heads.push((*row, last));
            }
            if let (Some(track), Some([top, bottom])) = (track, passage.reach(lane)) {
                wire.vertical(track, top, bottom);
                turns.push(track);
            }
        }
        let ends = turns.iter().min().zip(turns.iter().max());
        if let (Some(lane), Some((first, last))) = (lane, ends) {
            wire.horizontal(lane, *first, *last);
        }
        wire.measure();
        wire
    }

    /// Short lines out of the frame.
    fn dangling(&self, wire: &mut Wire, passage: &WirePassage, gap: usize) {
        let [start, end] = self.layout.gaps[gap];
        let name = &self.view.frame.topics[wire.topic].name;
        for &row in &passage.from {
            let crossed = self.bends(gap).iter().any(|bend| {
                let reach = bend.reach(self.lane(bend.route));
                reach.is_some_and(|[top, bottom]| (top..=bottom).contains(&row))
            });
            let end = if crossed { self.limit(gap) } else { end };
            let length = dangling_length(name, usize::from(end.saturating_sub(start)));
            if let Some(length) = length.filter(|_| !self.is_taken(wire.topic, gap, row)) {
                let last = start + clamp(length) - 1;
                wire.horizontal(row, start, last);
                wire.heads.push((row, last));
            }
        }
    }

    /// Returns whether a line out of the frame would overlap another one.
    fn is_taken(&self, topic: usize, gap: usize, row: u16) -> bool {
        self.layout
            .routes
            .all
            .iter()
            .enumerate()
            .filter(|(_, route)| route.topic != topic)
            .filter(|(_, route)| !route.dangles() || route.topic < topic)
            .any(|(number, _)| self.passage(number, gap).from.contains(&row))
    }
}

impl WirePassage {
    /// Returns the first and the last row of its vertical line, with the row of a `lane`.
    fn reach(&self, lane: Option<u16>) -> Option<[u16; 2]> {
        let rows = self.from.iter().chain(&self.to).chain(&lane).copied();
        Some([rows.clone().min()?, rows.max()?])
    }
}

/// Returns the routes of `passages` from left to right: a route that enters on a row has to turn
/// before another one leaves on the same row.
fn in_order(mut passages: Vec<WirePassage>) -> Vec<usize> {
    let mut order = Vec::new();
    while !passages.is_empty() {
        let first = (0..passages.len()).find(|n| {
            let out = &passages[*n].to;
            let mut others = passages.iter().enumerate().filter(|(m, _)| m != n);
            !others.any(|(_, other)| other.from.iter().any(|row| out.contains(row)))
        });
        // In a cycle lines overlap for a few cells.
        order.push(passages.remove(first.unwrap_or(0)).route);
    }
    order
}
