//! The screen: a run in the terminal, drawn frame by frame, and what keys do to it.
//!
//! Shows a run here, a recording, or a run of other processes, all as a [`RunSource`]; draws
//! pictures of the same screen as SVG files. Besides plain runs it shows branches, manual rescues
//! and the cliff map, with exercises and the tour as overlays.
//!
//! Stands on `ratelab`, `ratelab-metrics`, `ratelab-real-clock`, `ratelab-re-execution`,
//! `ratelab-experiment`, `ratelab-system` and `ratelab-recording`; knows no robot and no command
//! line, and of a course a trait. Begin with [`show`] below, then `app/` for keys, `sampler/` for
//! what a frame gathers, `view/` for panes.
//!
//! ```text
//! session ──► sampler ──► frame ──► view        (down)
//! session ◄── app ◄── keys ◄── terminal           (back)
//! ```

#![warn(clippy::print_stderr, clippy::print_stdout)]

mod age;
mod app;
mod asked;
mod background;
mod cause;
mod cliff;
mod course;
mod error;
mod explain;
mod frame;
mod knobs;
mod lineage_taps;
mod overlap;
mod panes;
pub mod picture;
mod plan;
mod playback;
mod prompt;
mod push_age;
mod run;
mod sampler;
mod session;
mod terminal;
#[cfg(test)]
mod tests;
mod theme;
mod timeline;
mod tour;
mod view;

use std::{
    io,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::{Terminal, backend::Backend};
use ratelab_experiment::Config;
use ratelab_recording::Recording;

use app::App;
pub use app::{LabOutcome, keys};
pub use course::{Course, CoursePanel, PanelAction, Rescue, RescueAdvice};
pub use error::ScreenError;
pub use frame::Place;
pub use panes::{JUMP, Page, scrolled};
pub use picture::escaped;
pub use run::{Remote, RunDigest, RunSource, StatusExtra, WatchedRows, watched};
pub use session::{BeginRows, OpenRows, SessionResult, SessionSetup};
use terminal::{BACKLOG, Input, Keyboard, Screen, ShellRequest};
pub use terminal::{is_there as terminal_is_there, restore as restore_terminal};
pub use theme::{Look, SurvivalLevel, Theme};
pub use tour::Guide;

/// How the dashboard is shown.
#[derive(Clone, Debug)]
pub struct Options {
    /// Maximum frames per second.
    pub fps: u32,
    /// Colours and glyphs.
    pub theme: Theme,
    /// Whether the background that the terminal reports has priority over that of the
    /// theme.
    pub ask_background: bool,
    /// Called before the first file and the screen open: what it returns becomes true when a signal
    /// asks to leave.
    pub quit_on_signal: fn() -> Arc<AtomicBool>,
}

/// Shows sessions, beginning with one of `config`, until the person leaves; returns
/// their results, with the terminal given back. The `guide` waits in the first.
///
/// # Errors
/// [`ScreenError`] if the first session cannot be started.
pub fn show(
    config: &Config,
    setup: SessionSetup,
    options: &Options,
    guide: Guide,
) -> Result<LabOutcome, ScreenError> {
    let quit = (options.quit_on_signal)();
    let mut app = App::new(config, setup)?;
    app.guide(guide);
    app.ask_before_the_map();
    until_left(app, options, &quit)?.ok_or(ScreenError::Panicked)
}

/// Shows a recording, paused at its start, until the person leaves, and then its branch, if the
/// person branched it; returns the results of the branch.
///
/// # Errors
/// [`ScreenError`] if the terminal failed.
pub fn play(
    recording: Arc<Recording>,
    setup: SessionSetup,
    options: &Options,
) -> Result<Option<LabOutcome>, ScreenError> {
    let quit = (options.quit_on_signal)();
    let mut app = App::for_recording(recording, setup);
    app.suggest_playing();
    app.execute_again();
    until_left(app, options, &quit)
}

/// Shows a run of other processes until the person leaves.
///
/// # Errors
/// [`ScreenError`] if the terminal failed.
pub fn watch(run: impl Remote + 'static, options: &Options) -> Result<(), ScreenError> {
    let quit = (options.quit_on_signal)();
    until_left(App::for_others(run), options, &quit).map(drop)
}

/// Shows `app` on the terminal until the person leaves, and restores the terminal in any case;
/// returns the results of its last session, if any.
///
/// # Errors
/// [`ScreenError`] if the terminal failed without a session.
fn until_left(
    mut app: App,
    options: &Options,
    quit: &AtomicBool,
) -> Result<Option<LabOutcome>, ScreenError> {
    let end = on_screen(&mut app, options, quit);
    let Some(outcome) = app.finish() else {
        return end.map(|()| None);
    };
    Ok(Some(LabOutcome {
        ended: end.and(outcome.ended),
        ..outcome
    }))
}

fn on_screen(app: &mut App, options: &Options, quit: &AtomicBool) -> Result<(), ScreenError> {
    match drawn(app, options, quit) {
        // A terminal that is closed fails a moment before its signal comes.
        Err(ScreenError::Terminal(_)) if comes_soon(quit) => Ok(()),
        end => end,
    }
}

/// Time from the failure of a terminal to its signal.
const HANG_UP: Duration = Duration::from_millis(500);

/// Waits until `quit` is set, for [`HANG_UP`] at most; returns whether it is.
fn comes_soon(quit: &AtomicBool) -> bool {
    let failed = Instant::now();
    while !quit.load(Ordering::Relaxed) && failed.elapsed() < HANG_UP {
        thread::sleep(Duration::from_millis(1));
    }
    quit.load(Ordering::Relaxed)
}

fn drawn(app: &mut App, options: &Options, quit: &AtomicBool) -> Result<(), ScreenError> {
    let mut screen = Screen::open()?;
    let mut keyboard = Keyboard::open()?;
    if options.ask_background {
        keyboard.ask_background()?;
    }
    run(&mut screen.0, &mut keyboard, app, options, quit)
}

/// Samples, draws changes and handles keys until the person leaves.
fn run<B>(
    terminal: &mut Terminal<B>,
    input: &mut impl Input,
    app: &mut App,
    options: &Options,
    quit: &AtomicBool,
) -> Result<(), ScreenError>
where
    B: Backend<Error: std::error::Error + Send + Sync + 'static>,
{
    let frame_time = Duration::from_secs(1) / options.fps.max(1);
    let mut theme = options.theme;
    let mut touched = true;
    while !app.quit && !quit.load(Ordering::Relaxed) {
        let frame_ends = Instant::now() + frame_time;
        touched |= obey_shell(terminal, input, app)?;
        if let Some(look) = input.look() {
            theme.look = look;
            touched = true;
        }
        if app.sample()? || touched {
            terminal
                .draw(|frame| view::render(app.screen().as_ref(), &theme, frame))
                .map_err(io::Error::other)?;
        }
        touched = obey_until(frame_ends, input, app)?;
    }
    Ok(())
}

/// Stops or continues at the shell's request; returns whether all must be drawn again.
fn obey_shell<B>(
    terminal: &mut Terminal<B>,
    input: &mut impl Input,
    app: &mut App,
) -> Result<bool, ScreenError>
where
    B: Backend<Error: std::error::Error + Send + Sync + 'static>,
{
    let request = input.request();
    match request {
        ShellRequest::Stay => return Ok(false),
        ShellRequest::Stop => app.rest(),
        ShellRequest::GoOn => {}
    }
    input.obey(request)?;
    app.go_on();
    let size = terminal.size().map_err(io::Error::other)?;
    terminal.resize(size.into()).map_err(io::Error::other)?;
    Ok(true)
}

/// Handles keys until the frame is over, and all that wait then; returns whether there were any.
fn obey_until(
    frame_ends: Instant,
    input: &mut impl Input,
    app: &mut App,
) -> Result<bool, ScreenError> {
    let mut touched = false;
    // A limit for a flood of keys, which must not keep the next frame from being drawn.
    let mut late = 0;
    loop {
        let left = frame_ends.saturating_duration_since(Instant::now());
        match input.next(left)? {
            Some(Event::Key(key)) if is_stop(&key) => {
                input.ask_to_stop();
                return Ok(true);
            }
            Some(Event::Key(key)) if key.kind != KeyEventKind::Release => app.key(&key),
            Some(Event::Paste(text)) => app.paste(&text),
            Some(_) => {}
            None => return Ok(touched),
        }
        touched = true;
        late += usize::from(left.is_zero());
        if app.quit || late >= BACKLOG {
            return Ok(touched);
        }
    }
}

/// Returns whether a key is Ctrl-Z, which always belongs to the shell.
fn is_stop(key: &KeyEvent) -> bool {
    key.code == KeyCode::Char('z') && key.modifiers == KeyModifiers::CONTROL
}
