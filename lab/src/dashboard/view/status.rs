//! The line at the top of the screen.

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    style::Style,
    text::{Line, Span},
};
use ratelab::{ClockKind, Status};

use super::pane::{self, in_a_row, plain, row};
use crate::{dashboard::frame::FrameData, theme::Theme};

/// Blanks between its parts.
const GAP: usize = 2;

/// Additional parts of the top line.
#[derive(Clone, Debug, Default)]
pub struct StatusExtra {
    /// Number of the visible frame, from one, and the number of frames; `None` for the
    /// newest.
    pub back: Option<(usize, usize)>,
    /// Whether the run is over.
    pub ended: bool,
    /// Number of items lost by the running recording; `None` without a recording.
    pub recording: Option<u64>,
    /// Whether this is the replay of a recording.
    pub replay: bool,
    /// How exact ages across machines are, unless they are exact.
    pub clocks: Option<String>,
    /// What is wrong with the connection to other processes.
    pub trouble: Option<String>,
}

/// Draws the top line, the name of the system first. If it is too narrow, parts are left
/// out from the right; a loss of measurements has priority.
pub fn render(
    name: &str,
    frame: &FrameData,
    extra: &StatusExtra,
    theme: &Theme,
    area: Rect,
    buf: &mut Buffer,
) {
    let line = row(area.intersection(buf.area), 0);
    let mut parts = vec![
        (name.to_owned(), theme.strong()),
        (clock(frame.status), Style::new()),
        state(frame, extra, theme),
    ];
    parts.extend(extra.recording.map(|lost| recording(lost, theme)));
    parts.extend(extra.trouble.as_ref().map(|what| trouble(what, theme)));
    let told = !extra.replay; // A recording has run time only.
    let wall = told.then(|| (format!("{:>5} s wall", frame.wall_s), Style::new()));
    let seconds = frame.now.as_secs_f64();
    parts.push((format!("{seconds:>8.2} s sim"), Style::new()));
    parts.extend(frame.world.map(|world| (world.to_owned(), Style::new())));
    parts.push((format!("seed {}", frame.seed), Style::new()));
    parts.extend(wall);
    parts.extend(extra.clocks.iter().map(|text| (text.clone(), Style::new())));
    let settings = frame.settings.iter().cloned();
    parts.extend(settings.map(|setting| (setting, Style::new())));
    let lost = (frame.telemetry_lost > 0).then(|| {
        let sign = theme.glyph("✖", "!");
        let text = format!(" {sign} telemetry lost {} ", frame.telemetry_lost);
        (text, theme.alarm())
    });
    let kept = lost.as_ref().map_or(0, |(text, _)| pane::width(text) + GAP);
    let room = usize::from(line.width);
    let part = |(text, style): &(String, Style)| {
        Line::from(Span::styled(plain(text, theme).into_owned(), *style))
    };
    let place = (0, room.saturating_sub(kept));
    let end = in_a_row(parts.iter().map(part), GAP, place, line, buf);
    in_a_row(lost.iter().map(part), GAP, (end, room), line, buf);
}

/// The clock, with its speed if it has one; of the same width for all numeric speeds.
fn clock(status: Status) -> String {
    let text = match status.clock {
        ClockKind::Real => status.clock.to_string(),
        ClockKind::Virtual => format!("{} {}", status.clock, status.speed),
    };
    format!("{text:<12}")
}

/// States that a recording is running, with its number of losses.
fn recording(lost: u64, theme: &Theme) -> (String, Style) {
    let sign = theme.glyph("●", "*");
    match lost {
        0 => (format!("{sign} rec"), theme.strong()),
        lost => (format!("{sign} rec, {lost} lost"), theme.alarm()),
    }
}

fn trouble(what: &str, theme: &Theme) -> (String, Style) {
    let sign = theme.glyph("✖", "!");
    (format!("{sign} {what}"), theme.alarm())
}

fn state(frame: &FrameData, extra: &StatusExtra, theme: &Theme) -> (String, Style) {
    if let Some((at, of)) = extra.back {
        let digits = of.to_string().len();
        let sign = theme.glyph("◀", "<");
        let text = format!("{sign} looking back {at:>digits$} of {of}");
        return (text, theme.strong());
    }
    let (sign, word, style) = if extra.replay {
        (theme.glyph("⏵", ">"), "replay", theme.strong())
    } else if extra.ended {
        (theme.glyph("■", "#"), "ended", theme.strong())
    } else if frame.status.paused {
        (theme.glyph("‖", "="), "paused", theme.strong())
    } else {
        (theme.glyph("▶", ">"), "running", theme.active())
    };
    (format!("{sign} {word:<7}"), style)
}

#[cfg(test)]
mod tests {
    use ratatui::buffer::Buffer;
    use ratelab::ClockKind;

    use super::{StatusExtra, render};
    use crate::{
        dashboard::view::{
            pane::testing::{POOR, RICH, screen, styled, text, torture},
            sample,
        },
        theme::Theme,
    };

    fn line(width: u16, extra: &StatusExtra, theme: &Theme) -> Buffer {
        let mut frame = sample::broken();
        frame.status.clock = ClockKind::Virtual;
        screen(width, 1, |area, buf| {
            render("cart-pole", &frame, extra, theme, area, buf)
        })
    }

    #[test]
    fn parts_go_from_the_right() {
        let extra = StatusExtra::default();
        insta::assert_snapshot!(text(&line(120, &extra, &RICH)), @"cart-pole  virtual 1×    ▶ running      0.84 s sim  seed 0      1 s wall  policy scripted");
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
        insta::assert_snapshot!(text(&line(120, &ended, &RICH)), @"cart-pole  virtual 1×    ■ ended    ● rec      0.84 s sim  seed 0      1 s wall  policy scripted");
        let back = StatusExtra {
            back: Some((3, 120)),
            ..ended
        };
        insta::assert_snapshot!(text(&line(120, &back, &RICH)), @"cart-pole  virtual 1×    ◀ looking back   3 of 120  ● rec      0.84 s sim  seed 0      1 s wall  policy scripted");
    }

    #[test]
    fn lost_telemetry_is_an_alarm_at_any_width() {
        let mut frame = sample::balanced();
        frame.telemetry_lost = 3;
        let extra = StatusExtra::default();
        let buf = screen(60, 1, |area, buf| {
            render("cart-pole", &frame, &extra, &RICH, area, buf)
        });
        insta::assert_snapshot!(text(&buf), @"cart-pole  real          ▶ running   ✖ telemetry lost 3");
        assert_eq!(styled(&buf, RICH.alarm()), " ✖ telemetry lost 3 ");
    }

    #[test]
    fn any_size_will_do() {
        let frame = sample::broken();
        let extra = StatusExtra::default();
        torture(|theme, area, buf| {
            render("cart-pole", &frame, &extra, theme, area, buf);
        });
    }
}
