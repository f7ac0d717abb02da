//! Pictures of the dashboard at a moment of a run or a recording, as SVG, and text in XML.

use std::{collections::BTreeSet, fmt::Write, sync::Arc, thread, time::Duration};

use ratatui::{
    Terminal,
    backend::TestBackend,
    buffer::{Buffer, Cell},
    layout::Size,
    style::{Color, Modifier},
};
use ratelab::Time;
use ratelab_experiment::Config;
use ratelab_recording::Recording;

use crate::{
    app::App,
    error::ScreenError,
    session::SessionSetup,
    theme::{Look, Theme, rgb},
    view,
};

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

/// Size of a character cell in pixels.
const CELL: (u16, u16) = (8, 17);

/// Returns `buffer` as on a terminal with the background of `look`.
pub fn svg(buffer: &Buffer, look: Look) -> String {
    let rows = (0..buffer.area.height).map(|y| row(buffer, y, look));
    sheet(buffer, look, "", &rows.collect::<String>())
}

/// Returns `frames` one after the other, each for `frame_s` seconds, again and again. A row that
/// stays the same over some frames is in the file once. For readers who prefer no motion it is the
/// last frame.
pub fn moving_svg(frames: &[Buffer], look: Look, frame_s: f64) -> String {
    let Some(last) = frames.last() else {
        return String::new();
    };
    let (count, mut rows, mut spans) = (frames.len(), String::new(), BTreeSet::new());
    for y in 0..last.area.height {
        let drawn: Vec<String> = frames.iter().map(|frame| row(frame, y, look)).collect();
        let mut from = 0;
        for same in drawn.chunk_by(|one, next| one == next) {
            let to = from + same.len();
            let text = &same[0];
            if same.len() == count {
                rows.push_str(text);
            } else if !text.is_empty() {
                let class = if to == count { "f l" } else { "f" };
                let _ = writeln!(
                    rows,
                    "<g class=\"{class}\" style=\"animation-name:f{from}-{to}\">\n{text}</g>"
                );
                spans.insert((from, to));
            }
            from = to;
        }
    }
    let share = |frame: usize| 100.0 * frame as f64 / count as f64;
    let steps = spans.iter().map(|(from, to)| {
        let before = if *from == 0 { "visible" } else { "hidden" };
        let (begin, end) = (share(*from), share(*to));
        let end = if to < &count {
            format!("{end:.3}%{{visibility:hidden}}")
        } else {
            String::new()
        };
        format!(
            "@keyframes f{from}-{to}{{0%{{visibility:{before}}}\
             {begin:.3}%{{visibility:visible}}{end}}}\n"
        )
    });
    let style = format!(
        "<style>\n.f{{visibility:hidden;animation:{:.2}s step-end infinite}}\n{}\
         @media (prefers-reduced-motion:reduce){{.f{{animation:none}}.l{{visibility:visible}}}}\n\
         </style>\n",
        frame_s * count as f64,
        steps.collect::<String>(),
    );
    sheet(last, look, &style, &rows)
}

/// Returns the file around the rows of a screen of the size of `buffer`.
fn sheet(buffer: &Buffer, look: Look, style: &str, rows: &str) -> String {
    let [_, paper] = inks(look);
    let (width, height) = (buffer.area.width, buffer.area.height);
    let (w, h) = (width * CELL.0 + 16, height * CELL.1 + 16);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" \
         font-family=\"DejaVu Sans Mono, Menlo, Consolas, monospace\" font-size=\"13\">\n{style}\
         <rect width=\"{w}\" height=\"{h}\" rx=\"6\" fill=\"{paper}\"/>\n{rows}</svg>\n"
    )
}

/// Row `y` of a screen.
fn row(buffer: &Buffer, y: u16, look: Look) -> String {
    let cells: Vec<&Cell> = (0..buffer.area.width)
        .filter_map(|x| buffer.cell((x, y)))
        .collect();
    let (mut svg, mut x) = (String::new(), 0);
    for run in cells.chunk_by(|a, b| a.style() == b.style()) {
        run_of_one_style(&mut svg, run, (x, y), inks(look));
        x += run.len();
    }
    svg
}

fn run_of_one_style(
    svg: &mut String,
    run: &[&Cell],
    (x, y): (usize, u16),
    [ink, paper]: [&str; 2],
) {
    let text: String = run.iter().map(|cell| cell.symbol()).collect();
    let reversed = run[0].modifier.contains(Modifier::REVERSED);
    if text.trim().is_empty() && !reversed {
        return;
    }
    let left = x * usize::from(CELL.0) + 8;
    let top = y * CELL.1 + 8;
    let width = run.len() * usize::from(CELL.0);
    let mut pen = colour(run[0].fg, ink);
    if reversed {
        let height = CELL.1;
        let _ = writeln!(
            svg,
            "<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" fill=\"{pen}\"/>"
        );
        pen = paper.to_owned();
    }
    let attribute = |of, text| {
        if run[0].modifier.contains(of) {
            text
        } else {
            ""
        }
    };
    let weight = attribute(Modifier::BOLD, " font-weight=\"bold\"");
    let faint = attribute(Modifier::DIM, " opacity=\"0.55\"");
    let _ = writeln!(svg, "<g fill=\"{pen}\"{weight}{faint}>");
    for (index, cell) in run.iter().enumerate() {
        glyph(svg, cell.symbol(), left + index * usize::from(CELL.0), top);
    }
    svg.push_str("</g>\n");
}

/// One character in its cell, of the same width in any font; Braille characters as dots,
/// since fonts draw them differently.
fn glyph(svg: &mut String, symbol: &str, left: usize, top: u16) {
    match symbol.chars().next() {
        None | Some(' ') => {}
        Some(braille @ '\u{2800}'..='\u{28ff}') => {
            let dots = braille as u32 - 0x2800;
            for (bit, (column, row)) in BRAILLE.into_iter().enumerate() {
                if dots >> bit & 1 == 1 {
                    let (x, y) = (left + 2 + 4 * column, usize::from(top) + 2 + 4 * row);
                    let _ = writeln!(svg, "<circle cx=\"{x}\" cy=\"{y}\" r=\"1.4\"/>");
                }
            }
        }
        Some(_) => {
            let symbol = escaped(symbol);
            let y = top + 13;
            let _ = writeln!(svg, "<text x=\"{left}\" y=\"{y}\">{symbol}</text>");
        }
    }
}

/// Column and row of each dot of a Braille character, by bit.
const BRAILLE: [(usize, usize); 8] = [
    (0, 0),
    (0, 1),
    (0, 2),
    (1, 0),
    (1, 1),
    (1, 2),
    (0, 3),
    (1, 3),
];

/// Colours of text and background.
fn inks(look: Look) -> [&'static str; 2] {
    match look {
        Look::Dark => ["#d8dbe0", "#16181d"],
        Look::Light => ["#1f2328", "#ffffff"],
        Look::High => ["#ffffff", "#000000"],
    }
}

fn colour(colour: Color, ink: &str) -> String {
    match colour {
        Color::Indexed(index) => {
            let [red, green, blue] = rgb(index);
            format!("#{red:02x}{green:02x}{blue:02x}")
        }
        _ => ink.to_owned(),
    }
}

/// Returns `text` between two tags, or in an attribute. Control characters, which XML refuses,
/// become blanks.
pub fn escaped(text: &str) -> String {
    let mut xml = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => xml.push_str("&amp;"),
            '<' => xml.push_str("&lt;"),
            '>' => xml.push_str("&gt;"),
            '"' => xml.push_str("&quot;"),
            '\u{fffe}' | '\u{ffff}' => xml.push(' '),
            c if c.is_control() && c != '\n' => xml.push(' '),
            c => xml.push(c),
        }
    }
    xml
}
