//! A picture of the dashboard at a moment of a run or a recording.

use std::{sync::Arc, thread, time::Duration};

use ratatui::{Terminal, backend::TestBackend, buffer::Buffer, layout::Size};
use ratelab::Time;
use ratelab_experiment::Config;
use ratelab_recording::Recording;

use super::{
    app::App,
    session::SessionSetup,
    svg::{moving_svg, svg},
    view,
};
use crate::{error::ScreenError, theme::Theme};

/// Maximum wait for background computations.
const PATIENCE: Duration = Duration::from_secs(10);

/// Interval between two checks (wall time).
const LOOK: Duration = Duration::from_millis(2);

/// Returns the end of a run of `config`, as an SVG file.
///
/// # Errors
/// [`ScreenError`] if the run fails.
pub fn draw_run(
    config: &Config,
    setup: SessionSetup,
    size: Size,
    theme: &Theme,
) -> Result<String, ScreenError> {
    let mut app = App::new(config, setup)?;
    app.sample()?;
    while !app.ended() {
        thread::sleep(LOOK);
        app.sample()?;
    }
    drawn(&mut app, size, theme)
}

/// Returns a recording at run time `at`, as an SVG file.
///
/// # Errors
/// [`ScreenError`] if it cannot be drawn.
pub fn draw_recording(
    recording: Arc<Recording>,
    setup: SessionSetup,
    at: Time,
    size: Size,
    theme: &Theme,
) -> Result<String, ScreenError> {
    let mut app = App::for_recording(recording, setup);
    app.jump(at);
    drawn(&mut app, size, theme)
}

/// Frames per second of a moving picture, and the most that it has.
const FPS: f64 = 8.0;
const MAX_FRAMES: f64 = 400.0;

/// Frames for which a moving picture rests at its end.
const REST: usize = 16;

/// Returns a recording up to run time `until` as a moving picture, at `speed` times the pace of run
/// time.
///
/// # Errors
/// [`ScreenError`] if it cannot be drawn.
pub fn moving(
    recording: Arc<Recording>,
    setup: SessionSetup,
    until: Time,
    speed: f64,
    size: Size,
    theme: &Theme,
) -> Result<String, ScreenError> {
    let until = until.as_secs_f64();
    let count = (until / speed * FPS).ceil().clamp(1.0, MAX_FRAMES);
    let mut app = App::for_recording(recording, setup);
    app.film(speed);
    let mut frames = Vec::new();
    for number in 0..=count as u32 {
        let at = until * f64::from(number) / count;
        app.jump(Time::from_secs_f64(at).unwrap_or(Time::MAX));
        frames.push(buffer(&mut app, size, theme)?);
    }
    let last = frames.last().cloned();
    frames.extend(last.into_iter().cycle().take(REST));
    let frame_s = until / speed / count;
    Ok(moving_svg(&frames, theme.look, frame_s))
}

fn drawn(app: &mut App, size: Size, theme: &Theme) -> Result<String, ScreenError> {
    Ok(svg(&buffer(app, size, theme)?, theme.look))
}

/// Returns the screen, once the background computations for it are done.
fn buffer(app: &mut App, size: Size, theme: &Theme) -> Result<Buffer, ScreenError> {
    app.sample()?;
    let waits = |app: &App| {
        app.screen()
            .is_some_and(|screen| screen.frame.awaits_limits)
    };
    let mut waited = Duration::ZERO;
    while waits(app) && waited < PATIENCE {
        thread::sleep(LOOK);
        waited += LOOK;
        app.sample()?;
    }
    let Ok(mut terminal) = Terminal::new(TestBackend::new(size.width, size.height));
    let Ok(drawn) = terminal.draw(|frame| view::render(app.screen().as_ref(), theme, frame));
    Ok(drawn.buffer.clone())
}
