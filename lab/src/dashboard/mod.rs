//! The dashboard: draws pictures of a running graph, sends commands to it.
//!
//! ```text
//! session ──► sampler ──► picture ──► view        (down)
//! session ◄── app ◄── keys ◄── terminal           (back)
//! ```

mod app;
mod figures;
mod history;
pub mod keys;
mod ladder;
pub mod picture;
mod sampler;
mod session;
#[cfg(test)]
mod svg;
mod terminal;
#[cfg(test)]
mod tests;
pub mod view;

use std::{
    io::{self, Write},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use crossterm::event::{Event, KeyEventKind};
use ratatui::{Terminal, backend::Backend};
use ratelab::experiment::Config;

use app::App;
pub use app::LabError;
pub use session::{Ended, Setup};
pub use terminal::is_there as terminal_is_there;
use terminal::{Input, Keyboard, Screen};
use view::theme::Theme;

/// How the dashboard is shown.
#[derive(Clone, Debug)]
pub struct Options {
    /// Frames per second at the most.
    pub fps: u32,
    /// Colours and glyphs.
    pub theme: Theme,
    /// What every run is started with.
    pub setup: Setup,
}

/// Shows a session of `config` until the person leaves; what it came to.
///
/// # Errors
/// [`LabError`] if a node, the set-up or the terminal failed; the terminal is
/// back in order by then.
pub fn show(config: &Config, options: &Options) -> Result<Ended, LabError> {
    let quit = quit_on_signal();
    let mut app = App::new(config, options.setup.clone())?;
    let mut screen = Screen::open()?;
    let end = run(&mut screen.0, &mut Keyboard, &mut app, options, &quit);
    drop(screen);
    end?;
    app.finish()
}

/// How long an end in order may take before a signal ends the program all the
/// same.
const GRACE: Duration = Duration::from_secs(2);

/// SIGTERM and the like end the dashboard as the key does. When the terminal
/// itself is gone, reading keys from it may never return (crossterm 0.29 reads
/// its end again and again), and a node may be stuck: then the program just
/// ends.
fn quit_on_signal() -> Arc<AtomicBool> {
    let quit = Arc::new(AtomicBool::new(false));
    let asked = quit.clone();
    // Without the handler a signal ends the program as it always did.
    let _ = ctrlc::set_handler(move || {
        asked.store(true, Ordering::Relaxed);
        std::thread::sleep(GRACE);
        terminal::restore();
        // The terminal may be gone, and then there is nobody to tell.
        let _ = writeln!(
            io::stderr(),
            "error: the run did not end in order: a node is still busy"
        );
        std::process::exit(1);
    });
    quit
}

/// Samples, draws what changed, and obeys keys, until it is told to leave.
fn run<B>(
    terminal: &mut Terminal<B>,
    input: &mut impl Input,
    app: &mut App,
    options: &Options,
    quit: &AtomicBool,
) -> Result<(), LabError>
where
    B: Backend<Error: std::error::Error + Send + Sync + 'static>,
{
    let frame_time = Duration::from_secs(1) / options.fps.max(1);
    let mut touched = true;
    while !app.quit && !quit.load(Ordering::Relaxed) {
        let frame_ends = Instant::now() + frame_time;
        if app.sample()? || touched {
            terminal
                .draw(|frame| view::render(app, &options.theme, frame))
                .map_err(io::Error::other)?;
        }
        touched = obey_until(frame_ends, input, app)?;
    }
    Ok(())
}

/// Obeys what is typed until the frame is over; says whether anything was.
fn obey_until(
    frame_ends: Instant,
    input: &mut impl Input,
    app: &mut App,
) -> Result<bool, LabError> {
    let mut touched = false;
    loop {
        let left = frame_ends.saturating_duration_since(Instant::now());
        match input.next(left)? {
            Some(Event::Key(key)) if key.kind != KeyEventKind::Release => app.key(&key)?,
            Some(_) => {}
            None => return Ok(touched),
        }
        touched = true;
        if app.quit || left.is_zero() {
            return Ok(touched);
        }
    }
}
