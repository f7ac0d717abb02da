//! The screen. One pane per file; each draws a frame, from any source.
//!
//! To add a pane: a variant of [`Pane`] in `panes.rs`, and in its list; a file here that draws it,
//! with an arm in `has` and `render_pane`; its place in `layout.rs`; its text in `explain.rs`; its
//! key in the row of panes in `app/keys/tables.rs`. Data that it needs and `frame.rs` lacks comes
//! from `sampler/`. Then update its row in `docs/commands.md` and the snapshots.

mod age;
mod bottom;
mod canvas;
mod chart;
mod cliff;
mod events;
mod figures;
mod glossary;
mod graph;
mod layout;
mod overlap;
mod page;
mod plant;
pub(super) mod sheet;
mod signal;
mod status;
mod table;
mod text;
mod timeline;

use ratatui::{Frame, layout::Rect, text::Line};
use ratelab::Event;
use ratelab_system::System;

pub use self::glossary::glossary;
#[cfg(test)]
pub use self::page::{EDGES, KEY_GAP, render as render_page};
use self::{layout::ScreenLayout, plant::PictureFit, sheet::Sheet, text::broken};
#[cfg(test)]
pub use super::tests::{sample, testing};
use super::{
    cliff::CliffMap,
    frame::{FrameData, SignalTrace},
    knobs::KnobFocus,
    overlap::OverlapView,
    panes::{Page, Pane, Panes},
    playback::Playback,
    prompt::Prompt,
    run::StatusExtra,
    timeline::Timeline,
};
use crate::theme::Theme;

/// The content of the screen, of a run or of a recording.
pub struct ScreenState<'a> {
    /// The system.
    pub system: &'a dyn System,
    /// The figures.
    pub frame: &'a FrameData,
    /// The signal up to that moment, if the system has one.
    pub trace: Option<SignalTrace>,
    /// The recent ticks and messages, if the chains behind pushes are known.
    pub timeline: Option<Timeline>,
    /// The operations of ticks that overlap, in its place.
    pub overlap: Option<OverlapView>,
    /// The node and the topics of the knob keys.
    pub knob_focus: KnobFocus,
    /// Events up to that moment.
    pub events: Vec<Event>,
    /// More parts of the top line.
    pub extra: StatusExtra,
    /// The controls of the panes.
    pub panes: Panes,
    /// The recording whose position is in the line above the last one.
    pub scrubber: Option<&'a Playback>,
    /// The cliff map, over the panes.
    pub map: Option<&'a CliffMap>,
    /// A page over everything else.
    pub page: Option<Page>,
    /// A page beside the panes to look at: a step of the tour.
    pub aside: Option<Page>,
    /// Keys and their actions, for the last line.
    pub hints: Vec<(String, &'static str)>,
    /// The input line, in their place if it is open.
    pub prompt: &'a Prompt,
    /// The latest notice of the dashboard.
    pub notice: Option<&'a str>,
}

impl ScreenState<'_> {
    /// Returns whether `pane` has content.
    pub fn has(&self, pane: Pane) -> bool {
        match pane {
            Pane::Plant => self.has_picture(),
            Pane::Signal => self.trace.is_some(),
            Pane::Graph | Pane::Figures | Pane::Events => true,
            Pane::Timeline => {
                self.frame.age.is_some() || self.timeline.is_some() || self.overlap.is_some()
            }
        }
    }

    /// Returns the lines below the top one on a screen of the size of `area`: the push age, the
    /// state of the run with its cause, and the parts of the push; none without an age.
    fn head(&self, area: Rect, theme: &Theme) -> Vec<Line<'static>> {
        if !self.has_age() {
            return Vec::new();
        }
        let room = usize::from(area.width);
        let has_parts = area.height >= MIN_FOR_PARTS;
        let push = self.frame.push.as_ref().filter(|_| has_parts);
        let age = age::age_line(self.frame.age.as_ref(), push, room, theme);
        let mut lines = vec![age];
        lines.extend(self.verdict_lines(area, theme));
        // A long cause takes the line of the push.
        if has_parts && lines.len() <= 1 + VERDICT_LINES {
            lines.push(push.map_or_else(Line::default, |push| age::push_line(push, room)));
        }
        lines
    }

    /// Returns the state of the run and its cause, across the screen, if the pane of events is too
    /// small. Beside several panes always the same number of lines, for a stable layout: a single
    /// pane has the verdict below it.
    fn verdict_lines(&self, area: Rect, theme: &Theme) -> Vec<Line<'static>> {
        let single = layout::is_single(area, self.panes.zoomed);
        if layout::is_roomy(area) && !single {
            return Vec::new();
        }
        let room = usize::from(area.width).saturating_sub(1);
        let verdict = &self.frame.verdict;
        let why = verdict.why.iter().flat_map(|why| broken(why, room, theme));
        let why_lines = why.map(|why| Line::raw(format!(" {why}")));
        if single {
            let most = match self.panes.focus {
                Pane::Events => 0,
                _ => VERDICT_LINES - 1,
            };
            return why_lines.take(most).collect();
        }
        let mut headline = events::headline(verdict, theme);
        headline.spans.insert(0, " ".into());
        let mut lines: Vec<_> = [headline].into_iter().chain(why_lines).collect();
        let most = VERDICT_LINES + usize::from(area.height >= MIN_FOR_PARTS);
        let count = lines.len().clamp(VERDICT_LINES, most);
        lines.resize(count, Line::default());
        lines
    }

    /// Returns whether there is an age, or will be one.
    fn has_age(&self) -> bool {
        self.frame.age.is_some() || self.system.latency().is_some()
    }

    /// Returns whether the system has a picture, or may have one after the first state.
    fn has_picture(&self) -> bool {
        let state = &self.frame.state;
        self.system.states_topic().is_some()
            && (state.is_empty() || self.system.robot().picture(state).is_some())
    }
}

/// Minimum height of a screen with the parts of an age.
const MIN_FOR_PARTS: u16 = 20;

/// Lines of a verdict and its cause on a small screen.
const VERDICT_LINES: usize = 3;

/// Draws everything, or only the size of a screen that is too small.
pub fn render(shown: Option<&ScreenState<'_>>, theme: &Theme, frame: &mut Frame<'_>) {
    let area = frame.area();
    let sheet = Sheet::new(theme, false, area, frame.buffer_mut());
    match shown {
        _ if !layout::is_enough(area) => too_small(sheet),
        Some(shown) => render_parts(shown, sheet),
        None => {}
    }
}

fn render_parts(shown: &ScreenState<'_>, mut sheet: Sheet<'_>) {
    let (area, theme) = (sheet.area, sheet.theme);
    let head = shown.head(area, theme);
    let scrubber = u16::from(shown.scrubber.is_some());
    let heights = [sheet::clamp(head.len()), scrubber];
    let layout = ScreenLayout::new(area, shown.panes, heights, |pane| shown.has(pane));
    let name = shown.system.name();
    status::render(name, shown.frame, &shown.extra, sheet.part(layout.status));
    sheet.part(layout.age).lines(0, 0, head);
    verdict_line(shown, sheet.part(layout.verdict));
    for (pane, area) in &layout.panes {
        let mut part = sheet.part(*area);
        part.focused = *pane == shown.panes.focus;
        render_pane(shown, *pane, part);
    }
    if let Some(playback) = shown.scrubber {
        bottom::render_scrubber(playback, sheet.part(layout.scrubber));
    }
    if let Some(page) = &shown.aside {
        page::render(page, sheet.part(place_aside(&layout)));
    }
    if let Some(map) = shown.map {
        cliff::render(map, sheet.part(layout.body));
    }
    if let Some(page) = &shown.page {
        page::render(page, sheet.part(layout.body));
    }
    bottom::render(shown, &layout, sheet);
}

/// Returns the place of a page beside the panes to look at: that of the signal, if there are
/// several.
fn place_aside(layout: &ScreenLayout) -> Rect {
    let mut panes = layout.panes.iter();
    let signal = panes
        .find(|(pane, _)| *pane == Pane::Signal)
        .filter(|_| layout.panes.len() > 1);
    signal.map_or(layout.body, |(_, area)| *area)
}

fn render_pane(shown: &ScreenState<'_>, pane: Pane, sheet: Sheet<'_>) {
    let frame = shown.frame;
    match pane {
        Pane::Graph => graph::render(frame, &shown.knob_focus, sheet),
        Pane::Plant => {
            let robot = shown.system.robot();
            let picture = robot.picture_from(shown.panes.side, &frame.state);
            let fit = if robot.sides() > 1 {
                PictureFit::Robot
            } else {
                PictureFit::Area
            };
            plant::render(picture.as_ref(), fit, &frame.verdict, sheet);
        }
        Pane::Signal => {
            if let Some(trace) = &shown.trace {
                signal::render(trace, frame.plan.as_ref(), frame.now, sheet);
            }
        }
        Pane::Figures => figures::render(frame, sheet),
        Pane::Timeline => match &shown.overlap {
            Some(overlap) => overlap::render(overlap, sheet),
            None => timeline::render(shown.timeline.as_ref(), sheet),
        },
        Pane::Events => events::render(&frame.verdict, &shown.events, shown.notice, sheet),
    }
}

/// The verdict, or the notice, if no pane shows it.
fn verdict_line(shown: &ScreenState<'_>, mut sheet: Sheet<'_>) {
    let line = match shown.notice {
        Some(notice) => Line::raw(notice),
        None => events::headline(&shown.frame.verdict, sheet.theme),
    };
    sheet.line(0, 0, &line);
}

fn too_small(mut sheet: Sheet<'_>) {
    let (least, is) = (layout::MIN_SIZE, sheet.area);
    let text = format!(
        "ratelab needs {}x{}, this is {}x{}",
        least.width, least.height, is.width, is.height
    );
    let lines = broken(&text, sheet.width(), sheet.theme);
    sheet.lines(0, 0, lines.into_iter().map(Line::raw));
}
