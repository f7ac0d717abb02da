//! The screen. One pane per file; each draws a frame, from any source.

mod age;
mod bottom;
mod canvas;
mod cliff;
mod events;
mod figures;
mod glossary;
mod graph;
mod histogram;
mod layout;
mod overlap;
mod page;
mod pane;
mod plant;
mod scrubber;
mod signal;
mod status;
mod table;
mod timeline;

use ratatui::{
    Frame,
    buffer::Buffer,
    layout::Rect,
    text::Line,
    widgets::{Paragraph, Widget, Wrap},
};
use ratelab::Event;
use ratelab_study::system::System;

use self::layout::ScreenLayout;
#[cfg(test)]
pub use self::page::render as render_page;
#[cfg(test)]
pub use self::pane::testing;
pub use self::{
    bottom::{Bottom, PromptLine},
    glossary::glossary,
    page::Page,
    scrubber::Scrubber,
    status::StatusExtra,
};
#[cfg(test)]
pub use super::tests::sample;
use super::{
    cliff::CliffMap,
    frame::{FrameData, SignalTrace},
    knobs::KnobFocus,
    overlap::Overlap,
    panes::Pane,
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
    pub overlap: Option<Overlap>,
    /// The node and the topics of the knob keys.
    pub knob_focus: KnobFocus,
    /// Events up to that moment.
    pub events: Vec<Event>,
    /// More parts of the top line.
    pub extra: StatusExtra,
    /// The focused pane.
    pub focus: Pane,
    /// Whether the focused pane is zoomed.
    pub zoomed: bool,
    /// The line above the last one.
    pub scrubber: Option<Scrubber>,
    /// The cliff map, over the panes.
    pub map: Option<&'a CliffMap>,
    /// A page over everything else.
    pub page: Option<Page>,
    /// A page beside the panes to look at: a step of the tour.
    pub aside: Option<Page>,
    /// The last line.
    pub bottom: Bottom<'a>,
}

impl ScreenState<'_> {
    /// Whether `pane` has content.
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

    /// The state of the run and its cause, across a screen of the size of `area`, if the
    /// pane of events is too small. Beside several panes always the same number of lines,
    /// for a stable layout: a long cause takes the line of the push. A
    /// single pane has the verdict below it.
    fn verdict_lines(&self, area: Rect, theme: &Theme) -> Vec<Line<'static>> {
        let single = layout::is_single(area, self.zoomed);
        if !self.has_age() || (layout::is_roomy(area) && !single) {
            return Vec::new();
        }
        let room = usize::from(area.width).saturating_sub(1);
        let verdict = &self.frame.verdict;
        let why = verdict.why.iter();
        let why = why.flat_map(|why| pane::broken(&pane::plain(why, theme), room));
        let why = why.map(Line::from);
        match single {
            true if self.focus == Pane::Events => Vec::new(),
            true => why.take(VERDICT_LINES - 1).collect(),
            false => {
                let mut lines = vec![events::headline(verdict, theme)];
                lines.extend(why);
                let more = usize::from(self.has_push(area));
                lines.resize(
                    lines.len().clamp(VERDICT_LINES, VERDICT_LINES + more),
                    Line::default(),
                );
                lines
            }
        }
    }

    /// Whether a screen of the size of `area` has room for the parts of an age.
    fn has_push(&self, area: Rect) -> bool {
        self.has_age() && area.height >= LEAST_FOR_PARTS
    }

    /// Whether there is an age, or will be one.
    fn has_age(&self) -> bool {
        self.frame.age.is_some() || self.system.latency().is_some()
    }

    /// Whether the system has a picture, or may have one after the first state.
    fn has_picture(&self) -> bool {
        let state = &self.frame.state;
        self.system.state().is_some() && (state.is_empty() || self.system.picture(state).is_some())
    }
}

/// Minimum height of a screen with the parts of an age.
const LEAST_FOR_PARTS: u16 = 20;

/// Lines of a verdict and its cause on a small screen.
const VERDICT_LINES: usize = 3;

/// Draws everything, or only the size of a screen that is too small.
pub fn render(shown: Option<&ScreenState<'_>>, theme: &Theme, frame: &mut Frame<'_>) {
    let area = frame.area();
    let buf = frame.buffer_mut();
    if !layout::is_enough(area) {
        too_small(area, buf);
    } else if let Some(shown) = shown {
        let (panes, scrubber) = ((shown.focus, shown.zoomed), shown.scrubber.is_some());
        let verdict = shown.verdict_lines(area, theme).len();
        let push = shown.has_push(area) && verdict <= VERDICT_LINES;
        let age = [shown.has_age(), push].map(usize::from);
        let age = pane::clamp(age.iter().sum::<usize>() + verdict);
        let layout = ScreenLayout::of(area, panes, [age, u16::from(scrubber)], |pane| {
            shown.has(pane)
        });
        render_parts(shown, theme, &layout, buf);
    }
}

fn render_parts(shown: &ScreenState<'_>, theme: &Theme, layout: &ScreenLayout, buf: &mut Buffer) {
    let name = shown.system.name();
    status::render(name, shown.frame, &shown.extra, theme, layout.status, buf);
    render_age(shown, theme, layout.age, buf);
    if let Some(area) = layout.verdict {
        verdict_line(shown, theme, area, buf);
    }
    for (pane, area) in &layout.panes {
        render_pane(shown, *pane, theme, *area, buf);
    }
    if let (Some(scrubber), Some(area)) = (&shown.scrubber, layout.scrubber) {
        scrubber::render(scrubber, theme, area, buf);
    }
    if let Some(page) = &shown.aside {
        let signal = layout.panes.iter().find(|(pane, _)| *pane == Pane::Signal);
        let several = layout.panes.len() > 1;
        let place = signal
            .filter(|_| several)
            .map_or(layout.body, |(_, area)| *area);
        page::render(page, theme, place, buf);
    }
    if let Some(map) = shown.map {
        cliff::render(map, theme, layout.body, buf);
    }
    if let Some(page) = &shown.page {
        page::render(page, theme, layout.body, buf);
    }
    bottom::render(shown, layout, theme, buf);
}

/// The push age with its parts, and the cause of a loss.
fn render_age(shown: &ScreenState<'_>, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let lines = shown.verdict_lines(buf.area, theme);
    let has_push = shown.has_push(buf.area);
    let parts = shown.frame.push.as_ref().filter(|_| has_push);
    if shown.has_age() {
        age::render(shown.frame.age.as_ref(), parts, theme, area, buf);
    }
    let push_line = has_push && lines.len() <= VERDICT_LINES;
    let above = usize::from(shown.has_age());
    if let Some(push) = parts.filter(|_| push_line) {
        age::push_line(push, theme, pane::row(area, above + lines.len()), buf);
    }
    for (number, line) in lines.into_iter().enumerate() {
        line.render(pane::from(pane::row(area, above + number), 1), buf);
    }
}

fn render_pane(shown: &ScreenState<'_>, pane: Pane, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let focused = pane == shown.focus;
    let frame = shown.frame;
    let verdict = &frame.verdict;
    match pane {
        Pane::Graph => graph::render(frame, &shown.knob_focus, theme, focused, area, buf),
        Pane::Plant => {
            let picture = shown.system.picture(&frame.state);
            plant::render(picture.as_ref(), verdict, theme, focused, area, buf);
        }
        Pane::Signal => {
            if let Some(trace) = &shown.trace {
                signal::render(trace, frame.now, theme, focused, area, buf);
            }
        }
        Pane::Figures => figures::render(frame, theme, focused, area, buf),
        Pane::Timeline => match &shown.overlap {
            Some(overlap) => overlap::render(overlap, theme, focused, area, buf),
            None => timeline::render(shown.timeline.as_ref(), theme, focused, area, buf),
        },
        Pane::Events => {
            let (events, notice) = (&shown.events, shown.bottom.notice);
            events::render(verdict, events, notice, theme, focused, area, buf);
        }
    }
}

/// The verdict, or the notice, if no pane shows it.
fn verdict_line(shown: &ScreenState<'_>, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let line = match shown.bottom.notice {
        Some(notice) => Line::from(pane::clip(notice, usize::from(area.width), theme)),
        None => events::headline(&shown.frame.verdict, theme),
    };
    line.render(area, buf);
}

fn too_small(area: Rect, buf: &mut Buffer) {
    let text = format!(
        "ratelab needs {}x{}, this is {}x{}",
        layout::LEAST.width,
        layout::LEAST.height,
        area.width,
        area.height
    );
    let paragraph = Paragraph::new(text).wrap(Wrap { trim: true });
    paragraph.render(area, buf);
}
