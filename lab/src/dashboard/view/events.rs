//! The verdict with its reasons, and the events of the run.

use ratatui::{
    buffer::Buffer,
    layout::{Margin, Rect},
    style::Style,
    text::{Line, Span},
};
use ratelab::{Event, EventKind};

use super::pane::{border, broken, clip, plain, put, row};
use crate::{
    dashboard::frame::{Standing, VerdictData},
    theme::Theme,
};

/// Title of the pane.
const TITLE: &str = "5 events";

/// Columns of the run time of an event: up to 9999.999 s.
const TIME_COLUMNS: usize = 10;

/// Number of events with priority over the last lines of an explanation.
const LEAST_EVENTS: usize = 1;

/// Draws the verdict, then events with the newest last, then the notice. The line of the
/// notice is always reserved, for a stable layout.
pub fn render(
    verdict: &VerdictData,
    events: &[Event],
    notice: Option<&str>,
    theme: &Theme,
    focused: bool,
    area: Rect,
    buf: &mut Buffer,
) {
    let inner = border(TITLE, Span::default(), theme, focused, area, buf);
    let inner = inner.inner(Margin::new(inset(inner.width), 0));
    let height = usize::from(inner.height);
    for part in headline(verdict, theme).spans {
        let text = clip(&part.content, usize::from(inner.width), theme);
        put(&text, part.style, 0, row(inner, 0), buf);
    }
    let bottom = height.saturating_sub(1);
    let reserved = usize::from(height >= 4 || (notice.is_some() && height >= 2));
    if let Some(notice) = notice.filter(|_| reserved > 0) {
        let text = clip(notice, usize::from(inner.width), theme);
        put(&text, theme.strong(), 0, row(inner, bottom), buf);
    }
    let free = bottom.saturating_sub(reserved);
    let room = free.saturating_sub(LEAST_EVENTS.min(events.len()));
    let lines = explanation(&verdict.why, inner.width, room, theme);
    let explained = lines.len();
    for (at, line) in lines.iter().enumerate() {
        put(line, Style::new(), 2, row(inner, 1 + at), buf);
    }
    let blank = usize::from(explained + events.len() < free);
    let begin = 1 + explained + blank;
    let shown = events.len().min(free - explained - blank);
    for (at, event) in events[events.len() - shown..].iter().enumerate() {
        draw_event(event, theme, row(inner, begin + at), buf);
    }
}

/// Width of a line in a pane of the size of `area`.
pub fn room(area: Rect) -> u16 {
    let inner = area.width.saturating_sub(2);
    inner - 2 * inset(inner)
}

/// Width of the margin at either edge.
fn inset(width: u16) -> u16 {
    u16::from(width > 20)
}

/// The verdict in a line.
pub fn headline(verdict: &VerdictData, theme: &Theme) -> Line<'static> {
    let (glyph, style) = match verdict.standing {
        Standing::Good => (theme.glyph("✓", "+"), theme.good()),
        Standing::Warned => (theme.glyph("⚠", "!"), theme.alarm_line()),
        Standing::Done => (theme.glyph("■", "="), theme.strong()),
        Standing::Lost => (theme.glyph("✖", "!"), theme.alarm()),
    };
    let text = format!("{glyph} {}", plain(&verdict.headline, theme));
    Line::from(Span::styled(text, style))
}

/// At most `most` lines of explanation, wrapped to the width below the headline; a cut one
/// ends with a sign.
fn explanation(why: &[String], width: u16, most: usize, theme: &Theme) -> Vec<String> {
    let room = usize::from(width).saturating_sub(2).max(1);
    let lines = why
        .iter()
        .flat_map(|text| broken(&plain(text, theme), room));
    let mut lines: Vec<String> = lines.collect();
    if lines.len() > most {
        lines.truncate(most);
        if let Some(last) = lines.last_mut() {
            *last = clip(&format!("{last} …"), room, theme);
        }
    }
    lines
}

/// An event with its time in a column of its own.
fn draw_event(event: &Event, theme: &Theme, row: Rect, buf: &mut Buffer) {
    let text = event.to_string();
    let (time, what) = text.split_once(": ").unwrap_or(("", &text));
    let bad = match event.what {
        EventKind::Refused { .. }
        | EventKind::Faulted { .. }
        | EventKind::Presence { present: false, .. } => true,
        EventKind::Applied { .. } | EventKind::Ended { .. } | EventKind::Presence { .. } => false,
    };
    let begin = TIME_COLUMNS + 2;
    let time = format!("{time:>TIME_COLUMNS$}");
    put(&time, theme.faint(), 0, row, buf);
    let (text, style) = if bad {
        let sign = theme.glyph("✖", "!");
        (format!("{sign} {what}"), theme.alarm())
    } else {
        (what.to_owned(), Style::new())
    };
    let room = usize::from(row.width).saturating_sub(begin);
    put(&clip(&text, room, theme), style, begin, row, buf);
}

#[cfg(test)]
mod tests {
    use ratatui::buffer::Buffer;
    use ratelab::{Command, Event, EventKind, Hz, Knob, Time};

    use super::render;
    use crate::{
        dashboard::{
            frame::FrameData,
            view::{
                pane::testing::{POOR, RICH, screen, styled, text, torture},
                sample,
            },
        },
        theme::Theme,
    };

    const NOTICE: &str = "control rate is at its lowest, 1 Hz";

    fn events() -> Vec<Event> {
        let event = |millis: u64, what| Event {
            at: Time::from_nanos(millis * 1_000_000),
            what,
        };
        let rate = |hz: f64| {
            Command::Set(Knob::Rate {
                node: "policy".to_owned(),
                hz: Hz::new(hz).expect("a valid rate"),
            })
        };
        let applied = EventKind::Applied {
            command: rate(5.0),
            was: Some("50 Hz".to_owned()),
        };
        let refused = EventKind::Refused {
            command: Command::Step,
            reason: "only the virtual clock steps".to_owned(),
        };
        let node = "actuator".to_owned();
        vec![
            event(0, applied),
            event(400, refused),
            event(840, EventKind::Ended { node }),
        ]
    }

    fn pane(frame: &FrameData, width: u16, height: u16, theme: &Theme) -> Buffer {
        let (verdict, events) = (&frame.verdict, events());
        screen(width, height, |area, buf| {
            render(verdict, &events, Some(NOTICE), theme, false, area, buf);
        })
    }

    #[test]
    fn a_fall_is_explained() {
        let buf = pane(&sample::broken(), 62, 11, &RICH);
        insta::assert_snapshot!(text(&buf), @"
        ┌5 events────────────────────────────────────────────────────┐
        │ ✖ FELL at 0.84 s                                           │
        │   policy decides 5 times a second; the pole needs about 20 │
        │   37 of 43 observations on /obs were never read            │
        │                                                            │
        │    0.000 s  policy at 5 Hz (was 50 Hz)                     │
        │    0.400 s  ✖ step refused: only the virtual clock steps   │
        │    0.840 s  actuator ended the run                         │
        │                                                            │
        │ control rate is at its lowest, 1 Hz                        │
        └────────────────────────────────────────────────────────────┘
        ");
        let alarms = styled(&buf, RICH.alarm());
        assert_eq!(
            alarms,
            "✖ FELL at 0.84 s✖ step refused: only the virtual clock steps"
        );
    }

    #[test]
    fn what_is_cut_is_marked() {
        insta::assert_snapshot!(text(&pane(&sample::broken(), 42, 7, &POOR)), @r"
        +5 events--------------------------------+
        | ! FELL at 0.84 s                       |
        |   policy decides 5 times a second; the |
        |   pole needs about 20 ...              |
        |    0.840 s  actuator ended the run     |
        | control rate is at its lowest, 1 Hz    |
        +----------------------------------------+
        ");
    }

    #[test]
    fn a_good_run_is_no_alarm() {
        let frame = sample::balanced();
        let buf = screen(40, 6, |area, buf| {
            render(&frame.verdict, &events()[..1], None, &RICH, true, area, buf);
        });
        insta::assert_snapshot!(text(&buf), @"
        ┌5 events──────────────────────────────┐
        │ ✓ BALANCED so far                    │
        │                                      │
        │    0.000 s  policy at 5 Hz (was 50 … │
        │                                      │
        └──────────────────────────────────────┘
        ");
        assert_eq!(styled(&buf, RICH.alarm()), "");
        assert_eq!(styled(&buf, RICH.good()), "✓ BALANCED so far");
    }

    #[test]
    fn any_size_will_do() {
        let (frame, events) = (sample::broken(), events());
        torture(|theme, area, buf| {
            render(
                &frame.verdict,
                &events,
                Some(NOTICE),
                theme,
                true,
                area,
                buf,
            );
        });
    }
}
