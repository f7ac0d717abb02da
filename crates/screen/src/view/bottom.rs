//! The lines at the bottom and at the top of the screen.

use ratatui::style::Style;
use ratelab::{ClockKind, Speed, Status};

use super::{
    ScreenState, events,
    layout::ScreenLayout,
    sheet::Sheet,
    text::{broken, line, side_by_side, tail, width},
};
use crate::{frame::FrameData, panes::Pane, run::StatusExtra, theme::Theme};

/// Blanks between keys.
const GAP: usize = 2;

/// Draws the last line, and above it the refusal or the words of the input line; in its
/// place a notice that fits nowhere else.
pub fn render(shown: &ScreenState<'_>, layout: &ScreenLayout, mut sheet: Sheet<'_>) {
    let notice = shown.notice.filter(|_| !notice_fits(shown, layout));
    match (shown.prompt.typed(), notice) {
        (Some(text), _) => {
            typed(text, sheet.part(layout.footer));
            let above = match shown.prompt.refusal() {
                Some(refusal) => format!("✖ {refusal}"),
                None => shown.prompt.hint(shown.system),
            };
            at_the_bottom(&above, sheet.part(layout.age.union(layout.body)));
        }
        (None, Some(notice)) => {
            at_the_bottom(notice, sheet.part(layout.body.union(layout.footer)));
        }
        (None, None) => {
            let of_table = shown.hints.iter().map(|(key, what)| (key.as_str(), *what));
            let mut hints: Vec<_> = match &shown.page {
                Some(page) => page.keys.to_vec(),
                None => of_table.collect(),
            };
            if !layout.verdict.is_empty() && hints.len() > 2 {
                hints.insert(2, ("Tab 1-6", "other panes"));
            }
            keys(&hints, sheet.part(layout.footer));
        }
    }
}

/// Returns whether the notice fits into its usual place: the pane of events, or the line of the
/// verdict.
fn notice_fits(shown: &ScreenState<'_>, layout: &ScreenLayout) -> bool {
    let covered = shown.map.is_some() || shown.page.is_some();
    let mut panes = layout.panes.iter();
    let events = panes.find(|(pane, _)| *pane == Pane::Events);
    let line = usize::from(layout.verdict.width);
    let room = events.map_or(line, |(_, area)| events::room(*area));
    !covered && width(shown.notice.unwrap_or_default()) <= room
}

/// Draws as many hints, each a key with its action, as there is room for.
fn keys(hints: &[(&str, &str)], mut sheet: Sheet<'_>) {
    let theme = sheet.theme;
    let hints = hints.iter().map(|(key, what)| {
        line([
            (*key, theme.strong()),
            (" ", Style::new()),
            (*what, theme.faint()),
        ])
    });
    let hints = side_by_side(hints, GAP, sheet.width(), theme);
    sheet.line(0, 0, &hints);
}

/// The input line, with its end visible.
fn typed(text: &str, mut sheet: Sheet<'_>) {
    let tail = tail(text, sheet.width().saturating_sub(3));
    let begin = sheet.put(0, 0, ": ", sheet.theme.strong());
    sheet.put(begin, 0, &format!("{tail}▏"), Style::new());
}

/// A wrapped text at the bottom.
fn at_the_bottom(text: &str, mut sheet: Sheet<'_>) {
    let lines = broken(text, sheet.width(), sheet.theme);
    let first = sheet.height().saturating_sub(lines.len());
    sheet.rows(first, lines.len()).clear();
    for (number, line) in lines.iter().enumerate() {
        sheet.put(0, first + number, line, sheet.theme.strong());
    }
}

/// Blanks between its parts.
const STATUS_GAP: usize = 2;

/// Draws the top line, the name of the system first. If it is too narrow, parts are left
/// out from the right; a loss of measurements has priority.
pub fn render_status(name: &str, frame: &FrameData, extra: &StatusExtra, mut sheet: Sheet<'_>) {
    let (theme, room) = (sheet.theme, sheet.width());
    let usual = |text: String| (text, Style::new());
    let mut parts = vec![
        (name.to_owned(), theme.strong()),
        usual(clock(frame.status, extra.replay)),
        state(frame, extra, theme),
    ];
    parts.extend(extra.recording.map(|lost| match lost {
        0 => ("● rec".to_owned(), theme.strong()),
        lost => (format!("● rec, {lost} lost"), theme.alarm()),
    }));
    let trouble = extra.trouble.iter();
    parts.extend(trouble.map(|what| (format!("✖ {what}"), theme.alarm())));
    parts.push(usual(format!("{:>8.2} s sim", frame.now.as_secs_f64())));
    parts.extend(frame.world.map(|world| usual(world.to_owned())));
    parts.push(usual(format!("seed {}", frame.seed)));
    let texts = extra.clocks.iter().chain(&frame.settings);
    parts.extend(texts.cloned().map(usual));
    // A recording has run time only.
    let wall = (!extra.replay).then(|| usual(format!("{:>5} s wall", frame.wall_s)));
    parts.extend(wall);
    let lost = (frame.telemetry_lost > 0).then(|| {
        let text = format!(" ✖ telemetry lost {} ", frame.telemetry_lost);
        line([(text, theme.alarm())])
    });
    let kept = lost.as_ref().map_or(0, |lost| lost.width() + STATUS_GAP);
    let first = side_by_side(
        parts.into_iter().map(|part| line([part])),
        STATUS_GAP,
        room.saturating_sub(kept),
        theme,
    );
    let whole = [first].into_iter().chain(lost);
    sheet.line(0, 0, &side_by_side(whole, STATUS_GAP, room, theme));
}

/// Returns the clock, with its speed if any; the width is the same for all numeric speeds. A
/// `replay` has a speed of its own.
fn clock(status: Status, replay: bool) -> String {
    let text = match status.clock {
        ClockKind::Virtual if !replay => match status.speed {
            Speed::Unlimited => format!("{} max", status.clock),
            speed => format!("{} {speed}", status.clock),
        },
        clock => clock.to_string(),
    };
    format!("{text:<12}")
}

fn state(frame: &FrameData, extra: &StatusExtra, theme: &Theme) -> (String, Style) {
    if let Some((at, of)) = extra.back {
        let digits = of.to_string().len();
        let text = format!("◀ looking back {at:>digits$} of {of}");
        return (text, theme.strong());
    }
    let (text, style) = if extra.replay {
        ("▷ replay ", theme.strong())
    } else if extra.ended {
        ("■ ended  ", theme.strong())
    } else if frame.status.paused {
        ("‖ paused ", theme.strong())
    } else {
        ("▶ running", theme.active())
    };
    (text.to_owned(), style)
}

#[cfg(test)]
mod tests {
    use super::keys;
    use crate::view::testing::*;

    const HINTS: [(&str, &str); 3] = [("[ ]", "control rate"), ("> <", "depth"), ("q", "quit")];

    #[test]
    fn hints_are_whole() {
        let footer = |width| screen((width, 1), &RICH, |sheet| keys(&HINTS, sheet));
        insta::assert_snapshot!(text(&footer(40)), @"[ ] control rate  > < depth  q quit");
        insta::assert_snapshot!(text(&footer(30)), @"[ ] control rate  > < depth");
        assert_eq!(styled(&footer(40), RICH.strong()), "[ ]> <q");
    }

    #[test]
    fn any_size_will_do() {
        torture(|sheet| keys(&HINTS, sheet));
    }
}

#[cfg(test)]
mod status_tests {
    use super::*;
    use crate::view::testing::*;

    fn line(width: u16, extra: &StatusExtra, theme: &Theme) -> Buffer {
        let mut frame = sample::broken();
        frame.status.clock = ClockKind::Virtual;
        screen((width, 1), theme, |sheet| {
            render_status("cart-pole", &frame, extra, sheet)
        })
    }

    #[test]
    fn parts_go_from_the_right() {
        let extra = StatusExtra::default();
        insta::assert_snapshot!(text(&line(120, &extra, &RICH)), @"cart-pole  virtual 1×    ▶ running      0.84 s sim  seed 0  policy scripted      1 s wall");
        insta::assert_snapshot!(text(&line(70, &extra, &RICH)), @"cart-pole  virtual 1×    ▶ running      0.84 s sim  seed 0");
        insta::assert_snapshot!(text(&line(30, &extra, &POOR)), @"cart-pole  virtual 1x");
    }

    #[test]
    fn states_are_told_apart() {
        let ended = StatusExtra {
            ended: true,
            recording: Some(0),
            ..StatusExtra::default()
        };
        insta::assert_snapshot!(text(&line(120, &ended, &RICH)), @"cart-pole  virtual 1×    ■ ended    ● rec      0.84 s sim  seed 0  policy scripted      1 s wall");
        let back = StatusExtra {
            back: Some((3, 120)),
            ..ended
        };
        insta::assert_snapshot!(text(&line(120, &back, &RICH)), @"cart-pole  virtual 1×    ◀ looking back   3 of 120  ● rec      0.84 s sim  seed 0  policy scripted      1 s wall");
    }

    #[test]
    fn lost_telemetry_is_an_alarm_at_any_width() {
        let mut frame = sample::balanced();
        frame.telemetry_lost = 3;
        let extra = StatusExtra::default();
        let buf = screen((60, 1), &RICH, |sheet| {
            render_status("cart-pole", &frame, &extra, sheet)
        });
        insta::assert_snapshot!(text(&buf), @"cart-pole  real          ▶ running   ✖ telemetry lost 3");
        assert_eq!(styled(&buf, RICH.alarm()), " ✖ telemetry lost 3 ");
    }

    #[test]
    fn any_size_will_do() {
        let frame = sample::broken();
        let extra = StatusExtra::default();
        torture(|sheet| render_status("cart-pole", &frame, &extra, sheet));
    }
}
