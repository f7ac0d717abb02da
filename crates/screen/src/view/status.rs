//! The line at the top: the clock, the state of the run, its time and its seed.

use ratatui::style::Style;
use ratelab::{ClockKind, Speed, Status};

use super::{
    sheet::Sheet,
    text::{line, side_by_side},
};
use crate::{frame::FrameData, run::StatusExtra, theme::Theme};

/// Blanks between parts of the line.
const GAP: usize = 2;

/// Draws the top line, the name of the system first. If it is too narrow, parts are left
/// out from the right; a loss of measurements has priority.
pub fn render(name: &str, frame: &FrameData, extra: &StatusExtra, mut sheet: Sheet<'_>) {
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
    let kept = lost.as_ref().map_or(0, |lost| lost.width() + GAP);
    let first = side_by_side(
        parts.into_iter().map(|part| line([part])),
        GAP,
        room.saturating_sub(kept),
        theme,
    );
    let whole = [first].into_iter().chain(lost);
    sheet.line(0, 0, &side_by_side(whole, GAP, room, theme));
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
    use super::*;
    use crate::view::testing::*;

    fn line(width: u16, extra: &StatusExtra, theme: &Theme) -> Buffer {
        let mut frame = sample::broken();
        frame.status.clock = ClockKind::Virtual;
        screen((width, 1), theme, |sheet| {
            render("cart-pole", &frame, extra, sheet)
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
            render("cart-pole", &frame, &extra, sheet)
        });
        insta::assert_snapshot!(text(&buf), @"cart-pole  real          ▶ running   ✖ telemetry lost 3");
        assert_eq!(styled(&buf, RICH.alarm()), " ✖ telemetry lost 3 ");
    }

    #[test]
    fn any_size_will_do() {
        let frame = sample::broken();
        let extra = StatusExtra::default();
        torture(|sheet| render("cart-pole", &frame, &extra, sheet));
    }
}
