//! Line drawings in a part of the screen, in several styles.
//!
//! ratatui's canvas has colours but neither bold nor dim, and where two drawings share a
//! cell, one hides the other. Here each drawing has a style, Braille dots in the same
//! cell add up, and only the dots are drawn.

use ratatui::{buffer::Buffer, layout::Rect, style::Style};

use crate::theme::Theme;

/// The first of the 256 Braille patterns; the others follow in an order in which dots add
/// up by "or".
const BRAILLE: u32 = 0x2800;

/// The bit of each dot of a pattern, by row and column.
const DOTS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];

/// Maximum distance of the end of a line outside the canvas, in widths and heights of the
/// canvas.
const FAR: f64 = 20.0;

/// A straight line: x and y of one end, x and y of the other.
pub type Stroke = [f64; 4];

/// Style and glyph of lines.
#[derive(Clone, Copy, Debug)]
pub struct Pen {
    /// The style.
    pub style: Style,
    /// The glyph in ASCII.
    pub ascii: char,
}

/// A part of the screen with coordinates.
#[derive(Clone, Copy, Debug)]
pub struct BrailleCanvas {
    area: Rect,
    x: [f64; 2],
    y: [f64; 2],
    ascii: bool,
}

impl BrailleCanvas {
    /// A canvas on `area` with `x` from left to right and `y` from bottom to top; the
    /// bounds are the middles of the outermost dots.
    pub fn new(area: Rect, x: [f64; 2], y: [f64; 2], theme: &Theme) -> Self {
        let ascii = theme.ascii;
        Self { area, x, y, ascii }
    }

    /// Number of dots across and down `area`.
    pub fn dots(area: Rect, theme: &Theme) -> (f64, f64) {
        let (across, down) = dots_each(theme.ascii);
        let dots = |cells: u16, each: u16| f64::from(cells) * f64::from(each);
        (dots(area.width, across), dots(area.height, down))
    }

    /// The column of the screen at `x`, if it is visible.
    pub fn column(&self, x: f64) -> Option<u16> {
        let each = dots_each(self.ascii).0;
        let dot = visible(self.right(x), self.area.width, each)?;
        Some(self.area.x + dot / each)
    }

    /// The row of the screen at `y`, if it is visible.
    pub fn row(&self, y: f64) -> Option<u16> {
        let each = dots_each(self.ascii).1;
        let dot = visible(self.below(y), self.area.height, each)?;
        Some(self.area.y + dot / each)
    }

    /// The dot at `x`, counted from the left.
    fn right(&self, x: f64) -> f64 {
        let share = (x - self.x[0]) / (self.x[1] - self.x[0]);
        dot(share, self.area.width, dots_each(self.ascii).0)
    }

    /// The dot at `y`, counted from the top.
    fn below(&self, y: f64) -> f64 {
        let share = (self.y[1] - y) / (self.y[1] - self.y[0]);
        dot(share, self.area.height, dots_each(self.ascii).1)
    }

    /// A dashed horizontal line at `y`, with `on` of every `of` Braille dots set, or half
    /// as many ASCII characters. In whole dots, so that all dashes look the same.
    pub fn level(&self, y: f64, on: u32, of: u32) -> Vec<Stroke> {
        let dashes = self.dashes(self.x, self.area.width * 2, 2, on, of);
        dashes.map(|(from, to)| [from, y, to, y]).collect()
    }

    /// A vertical line at `x`, as [`BrailleCanvas::level`].
    pub fn upright(&self, x: f64, on: u32, of: u32) -> Vec<Stroke> {
        let dashes = self.dashes(self.y, self.area.height * 4, 4, on, of);
        dashes.map(|(from, to)| [x, from, x, to]).collect()
    }

    fn dashes(
        &self,
        [from, to]: [f64; 2],
        dots: u16,
        each: u32,
        on: u32,
        of: u32,
    ) -> impl Iterator<Item = (f64, f64)> {
        let scale = if self.ascii { each } else { 1 };
        let dots = u32::from(dots) / scale;
        let (on, of) = ((on / scale).max(1), (of / scale).max(1));
        let last = f64::from(dots.max(2) - 1);
        let place = move |dot: u32| from + (to - from) * f64::from(dot.min(dots - 1)) / last;
        (0..dots.div_ceil(of)).map(move |dash| (place(dash * of), place(dash * of + on - 1)))
    }

    /// Draws `strokes` over the existing drawing.
    pub fn draw(&self, pen: Pen, strokes: impl IntoIterator<Item = Stroke>, buf: &mut Buffer) {
        for stroke in strokes {
            if stroke.iter().all(|figure| figure.is_finite()) {
                self.stroke(pen, stroke, buf);
            }
        }
    }

    /// Draws a line dot by dot, one for each step in its longer direction.
    fn stroke(&self, pen: Pen, [x1, y1, x2, y2]: Stroke, buf: &mut Buffer) {
        let from = (self.right(x1), self.below(y1));
        let (across, down) = (self.right(x2) - from.0, self.below(y2) - from.1);
        let length = across.abs().max(down.abs()).ceil().max(1.0);
        for step in 0..=length as u32 {
            let share = f64::from(step) / length;
            self.put(pen, from.0 + across * share, from.1 + down * share, buf);
        }
    }

    /// Sets one dot, if it is visible.
    fn put(&self, pen: Pen, right: f64, below: f64, buf: &mut Buffer) {
        let (across, down) = dots_each(self.ascii);
        let x = visible(right, self.area.width, across);
        let Some((x, y)) = x.zip(visible(below, self.area.height, down)) else {
            return;
        };
        let place = (self.area.x + x / across, self.area.y + y / down);
        if let Some(cell) = buf.cell_mut(place) {
            let there = if self.ascii {
                ' '
            } else {
                pattern(cell.symbol())
            };
            let dot = DOTS[usize::from(y % down)][usize::from(x % across)];
            let sum = char::from_u32(u32::from(there) | dot).filter(|_| !self.ascii);
            cell.reset();
            cell.set_char(sum.unwrap_or(pen.ascii)).set_style(pen.style);
        }
    }
}

/// Dots per cell, across and down.
fn dots_each(ascii: bool) -> (u16, u16) {
    if ascii { (1, 1) } else { (2, 4) }
}

/// The dot at `share` of a number of cells. Distant ones are moved closer, which limits the
/// time to draw a line.
fn dot(share: f64, cells: u16, each: u16) -> f64 {
    let last = (f64::from(cells) * f64::from(each) - 1.0).max(0.0);
    (share.clamp(-FAR, FAR) * last).round()
}

/// The number of a dot, if it is in one of the cells.
fn visible(dot: f64, cells: u16, each: u16) -> Option<u16> {
    let (dot, dots) = (dot.round(), f64::from(cells) * f64::from(each));
    // Also false for NaN.
    (0.0..dots).contains(&dot).then_some(dot as u16)
}

/// The pattern of a cell, or the empty pattern.
fn pattern(symbol: &str) -> char {
    let there = symbol.chars().next();
    there
        .filter(|there| (BRAILLE..BRAILLE + 256).contains(&u32::from(*there)))
        .unwrap_or('\u{2800}')
}

/// `stroke` in `count` dashes, with gaps of the same length.
pub fn dashed(stroke: Stroke, count: u32) -> impl Iterator<Item = Stroke> {
    let [x1, y1, x2, y2] = stroke;
    let at = move |share: f64| (x1 + (x2 - x1) * share, y1 + (y2 - y1) * share);
    let length = 1.0 / f64::from((2 * count).max(2) - 1);
    (0..count).map(move |dash| {
        let begin = f64::from(2 * dash) * length;
        let ((a, b), (c, d)) = (at(begin), at(begin + length));
        [a, b, c, d]
    })
}

#[cfg(test)]
mod tests {
    use ratatui::{layout::Rect, style::Style};

    use super::{BrailleCanvas, Pen, dashed};
    use crate::dashboard::view::pane::testing::{RICH, screen, text};

    #[test]
    fn dots_of_two_drawings_add_up() {
        let pen = Pen {
            style: Style::new(),
            ascii: '*',
        };
        let buf = screen(2, 1, |area, buf| {
            let canvas = BrailleCanvas::new(area, [0.0, 3.0], [0.0, 3.0], &RICH);
            canvas.draw(pen, [[0.0, 0.0, 3.0, 0.0]], buf);
            canvas.draw(pen, [[0.0, 0.0, 0.0, 3.0]], buf);
            canvas.draw(pen, [[f64::NAN, 0.0, 0.0, 3.0]], buf);
        });
        insta::assert_snapshot!(text(&buf), @"⣇⣀");
    }

    #[test]
    fn places_are_found() {
        let canvas = BrailleCanvas::new(Rect::new(5, 2, 10, 4), [0.0, 1.0], [-1.0, 1.0], &RICH);
        assert_eq!(
            (canvas.column(0.0), canvas.column(1.0)),
            (Some(5), Some(14))
        );
        assert_eq!((canvas.row(1.0), canvas.row(-1.0)), (Some(2), Some(5)));
        assert_eq!((canvas.column(1.2), canvas.row(f64::NAN)), (None, None));
    }

    #[test]
    fn dashes_end_where_the_line_ends() {
        let dashes: Vec<_> = dashed([0.0, 0.0, 3.0, 0.0], 2).collect();
        assert_eq!(dashes, [[0.0, 0.0, 1.0, 0.0], [2.0, 0.0, 3.0, 0.0]]);
        assert_eq!(dashed([0.0; 4], 0).count(), 0);
    }
}
