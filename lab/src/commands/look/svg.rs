//! A bag as lanes: for each topic when its messages came, and when none did.

use std::fmt::Write;

use ratelab_bag::{Analysis, Bag, GapVerdict};
use ratelab_screen::escaped;

/// Pixels: width of the names, of the lanes, height of a lane, and of the scale.
const NAMES: f64 = 260.0;
const LANE: f64 = 900.0;
const HEIGHT: f64 = 22.0;
const SCALE: f64 = 28.0;

/// The most topics that are drawn.
const MAX_TOPICS: usize = 500;

/// The columns in which messages are counted.
const COLUMNS: usize = 900;

/// The longest name that is drawn (characters).
const MAX_NAME: usize = 36;

/// Returns the drawing as SVG.
pub fn drawing(bag: &Bag, analysis: &Analysis) -> String {
    let topics = bag.topics.len().min(MAX_TOPICS);
    let [width, height] = [NAMES + LANE + 20.0, SCALE + HEIGHT * (topics as f64 + 1.0)];
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\" font-family=\"DejaVu Sans Mono, Menlo, Consolas, monospace\" font-size=\"11\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n"
    );
    let span = bag.span().max(1) as f64;
    let x = |time: i64| NAMES + LANE * time as f64 / span;
    // Into a string: it cannot fail.
    for pause in &analysis.pauses {
        let _ = writeln!(
            svg,
            "<rect x=\"{:.2}\" y=\"{SCALE}\" width=\"{:.2}\" height=\"{:.1}\" fill=\"#eeeeee\"><title>the \
             recorder stood still</title></rect>",
            x(pause.at),
            x(pause.length) - NAMES,
            height - SCALE
        );
    }
    for tenth in 0..=10 {
        let at = span * f64::from(tenth) / 10.0;
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"16\" text-anchor=\"middle\" fill=\"#555555\">{:.1} s</text>",
            NAMES + LANE * f64::from(tenth) / 10.0,
            at / 1e9
        );
    }
    for place in 0..topics {
        let y = SCALE + HEIGHT * place as f64;
        lane(&mut svg, bag, analysis, place, y, &x);
    }
    svg + "</svg>\n"
}

/// Draws the lane of the topic at `place`, from `y` on.
fn lane(
    svg: &mut String,
    bag: &Bag,
    analysis: &Analysis,
    place: usize,
    y: f64,
    x: &impl Fn(i64) -> f64,
) {
    let (topic, figures) = (&bag.topics[place], &analysis.figures[place]);
    let rate = figures
        .rate_hz
        .map_or_else(String::new, |rate| format!(" {rate:.1} Hz"));
    let name: String = topic.name.chars().take(MAX_NAME).collect();
    let _ = writeln!(
        svg,
        "<text x=\"4\" y=\"{:.1}\">{}<tspan fill=\"#777777\">{rate}</tspan></text>",
        y + 15.0,
        escaped(&name)
    );
    // Columns with messages, joined: a lane of many messages is a few lines.
    let mut counts = vec![0_u32; COLUMNS];
    for message in &topic.messages {
        let column = (x(message.log) - NAMES) / LANE * COLUMNS as f64;
        counts[(column.max(0.0) as usize).min(COLUMNS - 1)] += 1;
    }
    let most = f64::from(counts.iter().copied().max().unwrap_or(1).max(1));
    let mut path = String::new();
    for (column, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let tall = 4.0 + 10.0 * f64::from(*count) / most;
        let at = NAMES + LANE * (column as f64 + 0.5) / COLUMNS as f64;
        let _ = write!(path, "M{at:.1} {:.1}v-{tall:.1}", y + 18.0);
    }
    let _ = writeln!(
        svg,
        "<path d=\"{path}\" stroke=\"#2f6fab\" stroke-width=\"{:.2}\" fill=\"none\"/>",
        LANE / COLUMNS as f64
    );
    for gap in &figures.gaps {
        let (colour, why) = match gap.verdict {
            GapVerdict::Late => ("#e0a030", "came late"),
            GapVerdict::Silent => ("#c0392b", "none were sent, or they were lost"),
            GapVerdict::Unknown => ("#999999", "none came"),
        };
        let _ = writeln!(
            svg,
            "<rect x=\"{:.2}\" y=\"{:.1}\" width=\"{:.2}\" height=\"3\" fill=\"{colour}\"><title>{:.1} ms: \
             {why}</title></rect>",
            x(gap.at),
            y + 17.0,
            (x(gap.length) - NAMES).max(0.5),
            gap.length as f64 / 1e6
        );
    }
}
