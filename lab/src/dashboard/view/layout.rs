//! The layout of the screen, by its size.

use ratatui::layout::{Constraint, Layout as Split, Rect, Size};

use crate::dashboard::panes::Pane;

/// The smallest screen with any content but its own size.
pub const LEAST: Size = Size::new(40, 12);

/// The smallest screen with all panes at once.
const ALL_PANES: Size = Size::new(80, 24);

/// The smallest screen with generous spacing.
const ROOMY: Size = Size::new(120, 36);

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
    /// The verdict, if its pane is hidden.
    pub verdict: Option<Rect>,
    /// The visible panes.
    pub panes: Vec<(Pane, Rect)>,
    /// Everything between status and footer.
    pub body: Rect,
    /// The position in a recording, above the bottom line.
    pub scrubber: Option<Rect>,
    /// Bottom line: keys.
    pub footer: Rect,
}

impl ScreenLayout {
    /// Divides `area`, which [is enough](is_enough), between the panes that `exist`. The
    /// focused pane gets all of it if it is zoomed or the screen is small. The lines are
    /// the heights for the age and for a scrubber.
    pub fn of(
        area: Rect,
        (focus, zoomed): (Pane, bool),
        [age, scrubber]: [u16; 2],
        exist: impl Fn(Pane) -> bool,
    ) -> Self {
        let line = Constraint::Length(1);
        let lines = age;
        let [age, second] = [age, scrubber].map(Constraint::Length);
        let parts = [line, age, Constraint::Fill(1), second, line];
        let [status, age, body, second, footer] = rows(area, parts);
        let (verdict, panes) = if is_single(area, zoomed) {
            one_pane(body, focus)
        } else if lines > 0 && !is_roomy(area) {
            (None, few_panes(body, focus, exist))
        } else if body.height >= TALL && Pane::ALL.into_iter().all(&exist) {
            (None, two_columns(body))
        } else {
            (
                None,
                all_panes(body, focus, is_roomy(area), lines > 0, exist),
            )
        };
        Self {
            status,
            age,
            verdict,
            panes,
            body,
            scrubber: (scrubber > 0).then_some(second),
            footer,
        }
    }
}

/// Whether `area` is large enough for any content.
pub fn is_enough(area: Rect) -> bool {
    fits(LEAST, area)
}

/// Whether only one pane is shown in `area`.
pub fn is_single(area: Rect, zoomed: bool) -> bool {
    zoomed || !fits(ALL_PANES, area)
}

/// Whether `area` is large enough for generous spacing.
pub fn is_roomy(area: Rect) -> bool {
    fits(ROOMY, area)
}

fn fits(size: Size, area: Rect) -> bool {
    area.width >= size.width && area.height >= size.height
}

fn one_pane(body: Rect, focus: Pane) -> (Option<Rect>, Vec<(Pane, Rect)>) {
    if focus == Pane::Events {
        return (None, vec![(focus, body)]);
    }
    let [pane, verdict] = rows(body, [Constraint::Fill(1), Constraint::Length(1)]);
    (Some(verdict), vec![(focus, pane)])
}

/// The graph on top; below it the plant and the figures on the left, and all panes over
/// time on the right.
fn two_columns(body: Rect) -> Vec<(Pane, Rect)> {
    let rest = Constraint::Fill(1);
    let [graph, below] = rows(body, [Constraint::Length(11), rest]);
    let [left, right] = columns(below, [Constraint::Percentage(56), rest]);
    let [plant, figures] = rows(left, [rest, Constraint::Length(19)]);
    let lengths = [rest, Constraint::Length(LANES), Constraint::Length(12)];
    let [signal, timeline, events] = rows(right, lengths);
    vec![
        (Pane::Graph, graph),
        (Pane::Plant, plant),
        (Pane::Signal, signal),
        (Pane::Figures, figures),
        (Pane::Events, events),
        (Pane::Timeline, timeline),
    ]
}

/// The graph on top, and below it the plant and the signal, or the focused pane in their
/// place.
fn few_panes(body: Rect, focus: Pane, exist: impl Fn(Pane) -> bool) -> Vec<(Pane, Rect)> {
    // The tables of the figures need more rows.
    let height = if focus == Pane::Figures { 5 } else { 7 };
    let [graph, rest] = rows(body, [Constraint::Length(height), Constraint::Fill(1)]);
    if matches!(focus, Pane::Figures | Pane::Events | Pane::Timeline) {
        return vec![(Pane::Graph, graph), (focus, rest)];
    }
    let widths = [Constraint::Percentage(38), Constraint::Fill(1)];
    let [left, right] = match (exist(Pane::Plant), exist(Pane::Signal)) {
        (true, true) => columns(rest, widths),
        (true, false) => [rest, Rect::default()],
        (false, _) => [Rect::default(), rest],
    };
    let panes = [
        (Pane::Graph, graph),
        (Pane::Plant, left),
        (Pane::Signal, right),
    ];
    panes.into_iter().filter(|(pane, _)| exist(*pane)).collect()
}

fn all_panes(
    body: Rect,
    focus: Pane,
    roomy: bool,
    aged: bool,
    exist: impl Fn(Pane) -> bool,
) -> Vec<(Pane, Rect)> {
    let (plant, signal) = (exist(Pane::Plant), exist(Pane::Signal));
    let rest = Constraint::Fill(1);
    let (graph, middle) = match (plant || signal, roomy) {
        (false, _) => (rest, Constraint::Length(0)),
        (true, true) => (Constraint::Length(11), rest),
        (true, false) => (Constraint::Length(7), rest),
    };
    // With an age, the signal is more important than the figures.
    let (middle, bottom) = match (aged && middle == rest, roomy) {
        (true, false) => (Constraint::Fill(4), Constraint::Fill(3)),
        _ => (middle, rest),
    };
    let [graph, middle, bottom] = rows(body, [graph, middle, bottom]);
    let left = match (plant, signal) {
        (true, true) => 42,
        (true, false) => 100,
        (false, _) => 0,
    };
    let [left, right] = columns(middle, [Constraint::Percentage(left), rest]);
    let [figures, events] = columns(bottom, [Constraint::Percentage(62), rest]);
    // The timeline takes the place of the figures.
    let instead = focus == Pane::Timeline;
    let panes = [
        (Pane::Graph, graph),
        (Pane::Plant, left),
        (Pane::Signal, right),
        (
            if instead {
                Pane::Timeline
            } else {
                Pane::Figures
            },
            figures,
        ),
        (Pane::Events, events),
    ];
    panes.into_iter().filter(|(pane, _)| exist(*pane)).collect()
}

fn rows<const N: usize>(area: Rect, constraints: [Constraint; N]) -> [Rect; N] {
    Split::vertical(constraints).areas(area)
}

fn columns<const N: usize>(area: Rect, constraints: [Constraint; N]) -> [Rect; N] {
    Split::horizontal(constraints).areas(area)
}
