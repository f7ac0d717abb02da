//! What is drawn where. One pane per file; each draws a picture and knows
//! nothing of where it comes from.

pub mod theme;

mod angle;
mod events;
mod figures;
mod graph;
mod help;
mod histogram;
mod layout;
mod pane;
mod plant;
#[cfg(test)]
mod sample;
mod sketch;
mod status;
mod table;

use ratatui::{
    Frame,
    buffer::Buffer,
    layout::Rect,
    text::{Line, Span},
    widgets::{Paragraph, Widget, Wrap},
};

use self::{layout::Layout, status::StatusExtra, theme::Theme};
use super::{
    app::{App, Pane},
    keys,
    picture::Picture,
};

/// Draws everything.
pub fn render(app: &App, theme: &Theme, frame: &mut Frame<'_>) {
    let area = frame.area();
    let buf = frame.buffer_mut();
    match (Layout::of(area, app.focus, app.zoomed), app.picture()) {
        (Some(layout), Some(picture)) => render_parts(app, &picture, theme, &layout, buf),
        (None, _) => too_small(area, buf),
        (_, None) => {}
    }
}

fn render_parts(app: &App, picture: &Picture, theme: &Theme, layout: &Layout, buf: &mut Buffer) {
    let extra = StatusExtra {
        back: app.looking_back(),
        ended: app.ended(),
        note: None,
    };
    status::render_status(picture, &extra, theme, layout.status, buf);
    if let Some(area) = layout.verdict {
        verdict_line(app, picture, theme, area, buf);
    }
    for (pane, area) in &layout.panes {
        render_pane(app, picture, *pane, theme, *area, buf);
    }
    match &app.prompt {
        Some(typed) => prompt_line(typed, theme, layout.footer, buf),
        None => {
            let hints = keys::hints();
            let hints: Vec<(&str, &str)> = hints.iter().map(|(k, t)| (k.as_str(), *t)).collect();
            status::render_footer(&hints, theme, layout.footer, buf);
        }
    }
    if app.help {
        help::render(&keys::rows(), theme, layout.body, buf);
    }
}

fn render_pane(
    app: &App,
    picture: &Picture,
    pane: Pane,
    theme: &Theme,
    area: Rect,
    buf: &mut Buffer,
) {
    let focused = pane == app.focus;
    let verdict = &picture.verdict;
    match pane {
        Pane::Graph => graph::render(picture, theme, focused, area, buf),
        Pane::Plant => {
            plant::render(
                picture.plant.as_ref(),
                verdict.kind,
                theme,
                focused,
                area,
                buf,
            );
        }
        Pane::Angle => {
            let trace = app.trace(picture.now);
            angle::render(&trace, picture.now, theme, focused, area, buf);
        }
        Pane::Figures => figures::render(picture, theme, focused, area, buf),
        Pane::Events => {
            let events: Vec<_> = app.events(picture.now).cloned().collect();
            let notice = app.notice.as_deref();
            events::render(verdict, &events, notice, theme, focused, area, buf);
        }
    }
}

/// The verdict, or what the dashboard has to say, where no pane shows it.
fn verdict_line(app: &App, picture: &Picture, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let line = match &app.notice {
        Some(notice) => Line::from(pane::clip(notice, usize::from(area.width), theme)),
        None => events::headline(&picture.verdict, theme),
    };
    line.render(area, buf);
}

/// What is being typed, its end in sight, and what may be typed if there is room.
fn prompt_line(typed: &str, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let room = usize::from(area.width).saturating_sub(3);
    let hidden = typed.chars().count().saturating_sub(room);
    let tail: String = typed.chars().skip(hidden).collect();
    let hint = "   Enter turns it, Esc leaves: control-hz, sensor-hz or queue-depth, and a value";
    let spans = [
        Span::styled(": ", theme.strong()),
        Span::raw(pane::plain(&tail, theme)),
        Span::raw(theme.glyph("▏", "_")),
        Span::styled(hint, theme.faint()),
    ];
    Line::from_iter(spans).render(area, buf);
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
