//! A picture of the dashboard at a moment of a run or a recording.

use std::{sync::Arc, thread, time::Duration};

use ratatui::{Terminal, backend::TestBackend, layout::Size};
use ratelab::{experiment::Config, runtime::Time, system::System};

use super::{
    app::App,
    error::LabError,
    model::Model,
    player::Player,
    session::Setup,
    svg::svg,
    view::{self, theme::Theme},
};
use crate::recording::Recording;

/// Maximum wait for background computations.
const PATIENCE: Duration = Duration::from_secs(10);

/// Interval between two checks (wall time).
const LOOK: Duration = Duration::from_millis(2);

/// The end of a run of `config`, as an SVG file.
///
/// # Errors
/// [`LabError`] if the run fails.
pub fn of_run(
    config: &Config,
    setup: Setup,
    size: Size,
    theme: &Theme,
) -> Result<String, LabError> {
    let mut app = App::new(config, setup)?;
    app.sample()?;
    while !app.ended() {
        thread::sleep(LOOK);
        app.sample()?;
    }
    drawn(&mut app, size, theme)
}

/// A recording at run time `at`, as an SVG file; `system` is the program's system.
///
/// # Errors
/// [`LabError`] if it cannot be drawn.
pub fn of_recording(
    recording: Arc<Recording>,
    system: &Arc<dyn System>,
    at: Time,
    size: Size,
    theme: &Theme,
) -> Result<String, LabError> {
    drawn(&mut Player::still(recording, system, at), size, theme)
}

fn drawn(model: &mut impl Model, size: Size, theme: &Theme) -> Result<String, LabError> {
    model.sample()?;
    let limited = |model: &_| {
        let screen = Model::screen(model);
        let age = screen.and_then(|screen| screen.frame.age);
        age.is_none_or(|age| age.limit().is_some())
    };
    let mut waited = Duration::ZERO;
    while !limited(model) && waited < PATIENCE {
        thread::sleep(LOOK);
        waited += LOOK;
        model.sample()?;
    }
    let Ok(mut terminal) = Terminal::new(TestBackend::new(size.width, size.height));
    let Ok(drawn) = terminal.draw(|frame| view::render(model.screen().as_ref(), theme, frame));
    Ok(svg(drawn.buffer, theme.look))
}
