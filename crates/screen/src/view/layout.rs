//! The layout of the screen, by its size.

use ratatui::layout::{
    Constraint::{self, Fill, Length, Percentage},
    Layout, Rect, Size,
};

use crate::panes::{Pane, Panes};

/// What the others leave.
const REST: Constraint = Fill(1);

/// The smallest screen with any content but its own size.
pub const MIN_SIZE: Size = Size::new(40, 12);

/// The smallest screen with all panes at once.
const ALL_PANES: Size = Size::new(80, 24);

/// The smallest screen with generous spacing.
const ROOMY: Size = Size::new(120, 36);

/// Minimum width of a screen with the figures beside the signal, in the place of a plant.
const WITH_FIGURES: u16 = 110;

/// Minimum height of a body with a separate timeline, and the height of that timeline.
const TALL: u16 = 40;
const LANES: u16 = 10;

/// The parts of the screen.
#[derive(Debug)]
pub struct ScreenLayout {
    /// Top line: clock, time, seed.
    pub status: Rect,
    /// The push age below it, and on small screens the cause of a loss; empty without an
    /// age.
    pub age: Rect,
    /// The verdict, if its pane is hidden; empty otherwise.
    pub verdict: Rect,
    /// The visible panes.
    pub panes: Vec<(Pane, Rect)>,
    /// Everything between status and footer.
    pub body: Rect,
    /// The position in a recording, above the bottom line; empty without one.
    pub scrubber: Rect,
    /// Bottom line: keys.
    pub footer: Rect,
}

impl ScreenLayout {
    /// Divides `area`, which [is enough](is_enough), between the panes that `exist`. The
    /// focused pane gets all of it if it is zoomed or the screen is small. The lines are
    /// the heights for the age and for a scrubber.
    pub fn new(
        area: Rect,
        Panes { focus, zoomed, .. }: Panes,
        [age, scrubber]: [u16; 2],
        exist: impl Fn(Pane) -> bool,
    ) -> Self {
        let heights = [Length(1), Length(age), REST, Length(scrubber), Length(1)];
        let [status, head, body, scrubber, footer] = rows(area, heights);
        let mut verdict = Rect::default();
        let mut panes = if is_single(area, zoomed) {
            let line = Length(u16::from(focus != Pane::Events));
            let [pane, line] = rows(body, [REST, line]);
            verdict = line;
            vec![(focus, pane)]
        } else if age > 0 && !is_roomy(area) {
            few_panes(body, focus, &exist)
        } else if body.height >= TALL && Pane::ALL.into_iter().all(&exist) {
            two_columns(body)
        } else {
            all_panes(body, focus, is_roomy(area), &exist)
        };
        panes.retain(|(pane, _)| *pane == focus || exist(*pane));
        Self {
            status,
            age: head,
            verdict,
            panes,
            body,
            scrubber,
            footer,
        }
    }
}

/// Returns whether `area` is large enough for any content.
pub fn is_enough(area: Rect) -> bool {
    fits(MIN_SIZE, area)
}

/// Returns whether only one pane is shown in `area`.
pub fn is_single(area: Rect, zoomed: bool) -> bool {
    zoomed || !fits(ALL_PANES, area)
}

/// Returns whether `area` is large enough for generous spacing.
pub fn is_roomy(area: Rect) -> bool {
    fits(ROOMY, area)
}

fn fits(size: Size, area: Rect) -> bool {
    area.width >= size.width && area.height >= size.height
}

/// Returns the graph on top; below it the plant and the figures on the left, and all panes over
/// time on the right.
fn two_columns(body: Rect) -> Vec<(Pane, Rect)> {
    let [graph, below] = rows(body, [Length(11), REST]);
    let [left, right] = columns(below, 56);
    let [plant, figures] = rows(left, [REST, Length(19)]);
    let [signal, timeline, events] = rows(right, [REST, Length(LANES), Length(12)]);
    vec![
        (Pane::Graph, graph),
        (Pane::Plant, plant),
        (Pane::Signal, signal),
        (Pane::Figures, figures),
        (Pane::Events, events),
        (Pane::Timeline, timeline),
    ]
}

/// Returns the graph on top, and below it the plant and the signal, or the signal and the figures,
/// or the focused pane in their place.
fn few_panes(body: Rect, focus: Pane, exist: impl Fn(Pane) -> bool) -> Vec<(Pane, Rect)> {
    // The tables of the figures need more rows.
    let height = if focus == Pane::Figures { 5 } else { 7 };
    let [graph, rest] = rows(body, [Length(height), REST]);
    if matches!(focus, Pane::Figures | Pane::Events | Pane::Timeline) {
        return vec![(Pane::Graph, graph), (focus, rest)];
    }
    if !exist(Pane::Plant) && rest.width >= WITH_FIGURES {
        let [left, right] = columns(rest, 46);
        return vec![
            (Pane::Graph, graph),
            (Pane::Signal, left),
            (Pane::Figures, right),
        ];
    }
    let [left, right] = columns(rest, share(38, exist));
    vec![
        (Pane::Graph, graph),
        (Pane::Plant, left),
        (Pane::Signal, right),
    ]
}

fn all_panes(
    body: Rect,
    focus: Pane,
    roomy: bool,
    exist: impl Fn(Pane) -> bool,
) -> Vec<(Pane, Rect)> {
    let over_time = exist(Pane::Plant) || exist(Pane::Signal);
    let (graph, middle) = match (over_time, roomy) {
        (false, _) => (REST, Length(0)),
        (true, true) => (Length(11), REST),
        (true, false) => (Length(7), REST),
    };
    let [graph, middle, bottom] = rows(body, [graph, middle, REST]);
    let [left, right] = columns(middle, share(42, &exist));
    let [figures, events] = columns(bottom, 62);
    // The timeline takes the place of the figures.
    let instead = match focus {
        Pane::Timeline => Pane::Timeline,
        _ => Pane::Figures,
    };
    vec![
        (Pane::Graph, graph),
        (Pane::Plant, left),
        (Pane::Signal, right),
        (instead, figures),
        (Pane::Events, events),
    ]
}

/// Returns the percentage of the plant beside the signal, `usual` if both exist.
fn share(usual: u16, exist: impl Fn(Pane) -> bool) -> u16 {
    match (exist(Pane::Plant), exist(Pane::Signal)) {
        (true, true) => usual,
        (true, false) => 100,
        (false, _) => 0,
    }
}

fn rows<const N: usize>(area: Rect, heights: [Constraint; N]) -> [Rect; N] {
    Layout::vertical(heights).areas(area)
}

/// Two columns of `area`, the first of some percentage.
fn columns(area: Rect, first: u16) -> [Rect; 2] {
    Layout::horizontal([Percentage(first), REST]).areas(area)
}
