//! The verdict with its reasons, and the events of the run.

use ratatui::{
    layout::Rect,
    style::Style,
    text::{Line, Span},
};
use ratelab::{Event, EventKind};

use super::{
    sheet::Sheet,
    text::{broken, clip, line},
};
use crate::{
    frame::{Standing, VerdictData},
    theme::Theme,
};

/// Columns of the run time of an event: up to 9999.999 s.
const TIME_COLUMNS: usize = 10;

/// Number of events with priority over the last lines of an explanation.
const MIN_EVENTS: usize = 1;

/// Draws the verdict, then events with the newest last, then the notice. The line of the
/// notice is always reserved, for a stable layout.
pub fn render(verdict: &VerdictData, events: &[Event], notice: Option<&str>, sheet: Sheet<'_>) {
    let pane = sheet.boxed("5 events", Span::default());
    let margin = margin(pane.width());
    let mut inside = pane.inset(margin);
    let (theme, height) = (inside.theme, inside.height());
    inside.line(0, 0, &headline(verdict, theme));
    let bottom = height.saturating_sub(1);
    let reserved = usize::from(height >= 4 || (notice.is_some() && height >= 2));
    if let Some(notice) = notice.filter(|_| reserved > 0) {
        inside.put(0, bottom, notice, theme.strong());
    }
    let free = bottom.saturating_sub(reserved);
    let room = free.saturating_sub(MIN_EVENTS.min(events.len()));
    let why = explanation(&verdict.why, inside.width(), room, theme);
    let explained = why.len();
    inside.lines(2, 1, why.into_iter().map(Line::raw));
    let blank = usize::from(explained + events.len() < free);
    let shown = events.len().min(free - explained - blank);
    let events = events[events.len() - shown..].iter();
    inside.lines(0, 1 + explained + blank, events.map(|of| event(of, theme)));
}

/// Returns the width of a line in a pane of the size of `area`.
pub fn room(area: Rect) -> usize {
    let inner = usize::from(area.width.saturating_sub(2));
    inner - 2 * margin(inner)
}

fn margin(width: usize) -> usize {
    usize::from(width > 20)
}

/// Returns the verdict in a line.
pub fn headline(verdict: &VerdictData, theme: &Theme) -> Line<'static> {
    let (glyph, style) = match verdict.standing {
        Standing::Good => ("✓", theme.good()),
        Standing::Warned => ("⚠", theme.alarm_line()),
        Standing::Done => ("■", theme.strong()),
        Standing::Lost => ("✖", theme.alarm()),
    };
    line([(format!("{glyph} {}", verdict.headline), style)])
}

/// At most `most` lines of explanation, wrapped to the width below the headline; a cut one
/// ends with a sign.
fn explanation(why: &[String], width: usize, most: usize, theme: &Theme) -> Vec<String> {
    let room = width.saturating_sub(2);
    let mut lines: Vec<String> = why
        .iter()
        .flat_map(|text| broken(text, room, theme))
        .collect();
    let cut = lines.len() > most;
    lines.truncate(most);
    if let Some(last) = lines.last_mut().filter(|_| cut) {
        *last = clip(&format!("{last} …"), room, theme);
    }
    lines
}

/// Returns an event with its time in a column of its own.
fn event(event: &Event, theme: &Theme) -> Line<'static> {
    let text = event.to_string();
    let (time, what) = text.split_once(": ").unwrap_or(("", &text));
    let (sign, style) = match event.what {
        EventKind::Refused { .. }
        | EventKind::Faulted { .. }
        | EventKind::Crashed { .. }
        | EventKind::Presence { present: false, .. } => ("✖ ", theme.alarm()),
        EventKind::Applied { .. } | EventKind::Ended { .. } | EventKind::Presence { .. } => {
            ("", Style::new())
        }
    };
    let time = format!("{time:>TIME_COLUMNS$}  ");
    line([(time, theme.faint()), (format!("{sign}{what}"), style)])
}

#[cfg(test)]
mod tests {
    use ratelab::Command;

    use super::*;
    use crate::view::testing::*;

    const NOTICE: &str = "control rate is at its lowest, 1 Hz";

    fn events() -> Vec<Event> {
        let applied = EventKind::Applied {
            command: Command::Set("rate policy 5".parse().expect("a knob")),
            was: Some("50 Hz".to_owned()),
        };
        let refused = EventKind::Refused {
            command: Command::Step,
            reason: "only the virtual clock steps".to_owned(),
        };
        let node = "actuator".to_owned();
        let events = [
            (0, applied),
            (400, refused),
            (840, EventKind::Ended { node }),
        ];
        let event = |(at, what)| Event {
            at: sample::ms(at),
            what,
        };
        events.map(event).into()
    }

    fn pane(size: (u16, u16), theme: &Theme) -> Buffer {
        let verdict = sample::broken().verdict;
        screen(size, theme, |sheet| {
            render(&verdict, &events(), Some(NOTICE), sheet);
        })
    }

    #[test]
    fn a_fall_is_explained() {
        let buf = pane((62, 11), &RICH);
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
        let alarms = "✖ FELL at 0.84 s✖ step refused: only the virtual clock steps";
        assert_eq!(styled(&buf, RICH.alarm()), alarms);
    }

    #[test]
    fn what_is_cut_is_marked() {
        insta::assert_snapshot!(text(&pane((42, 7), &POOR)), @r"
        +5 events--------------------------------+
        | x FELL at 0.84 s                       |
        |   policy decides 5 times a second; the |
        |   pole needs about 20 ...              |
        |    0.840 s  actuator ended the run     |
        | control rate is at its lowest, 1 Hz    |
        +----------------------------------------+
        ");
    }

    #[test]
    fn a_good_run_is_no_alarm() {
        let verdict = sample::balanced().verdict;
        let buf = screen((40, 6), &RICH, |sheet| {
            render(&verdict, &events()[..1], None, sheet);
        });
        assert_eq!(styled(&buf, RICH.alarm()), "");
        assert_eq!(styled(&buf, RICH.good()), "✓ BALANCED so far");
    }

    #[test]
    fn any_size_will_do() {
        let (frame, events) = (sample::broken(), events());
        torture(|sheet| render(&frame.verdict, &events, Some(NOTICE), sheet));
    }
}
