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

/// One direction of a canvas.
#[derive(Clone, Copy, Debug)]
struct DotAxis {
    /// The values at the middles of the first and the last dot.
    ends: [f64; 2],
    /// The first cell, and the number of cells.
    first: u16,
    cells: u16,
    /// Dots per cell, and dots of a Braille pattern.
    each: u16,
    full: u16,
}

impl DotAxis {
    fn dots(&self) -> f64 {
        f64::from(self.cells) * f64::from(self.each)
    }

    /// Returns the dot at `value`. Distant ones are moved closer, which limits the time to draw a
    /// line.
    fn dot(&self, value: f64) -> f64 {
        let share = (value - self.ends[0]) / (self.ends[1] - self.ends[0]);
        (share.clamp(-FAR, FAR) * (self.dots() - 1.0).max(0.0)).round()
    }

    /// Returns the cell of a dot, and its number there, if it is visible.
    fn place(&self, dot: f64) -> Option<(u16, usize)> {
        let dot = dot.round();
        // Also false for NaN.
        (0.0..self.dots()).contains(&dot).then(|| {
            let dot = dot as u16;
            (self.first + dot / self.each, usize::from(dot % self.each))
        })
    }

    /// Begin and end of dashes `from` one value `to` another, with `on` of every `of` Braille
    /// dots set, or as many fewer ASCII characters as they are larger.
    fn dashes(
        &self,
        [from, to]: [f64; 2],
        [on, of]: [u32; 2],
    ) -> impl Iterator<Item = [f64; 2]> + use<> {
        let scale = u32::from(self.full / self.each);
        let (dots, last) = (self.dots() as u32, self.dots().max(2.0) - 1.0);
        let (on, of) = ((on / scale).max(1), (of / scale).max(1));
        let place = move |dot: u32| from + (to - from) * f64::from(dot.min(dots - 1)) / last;
        (0..dots.div_ceil(of)).map(move |dash| [dash * of, dash * of + on - 1].map(place))
    }
}

/// A part of the screen with coordinates.
#[derive(Clone, Copy, Debug)]
pub struct BrailleCanvas {
    /// From left to right, and from top to bottom.
    x: DotAxis,
    y: DotAxis,
    ascii: bool,
}

impl BrailleCanvas {
    /// Creates a canvas on `area` with `x` from left to right and `y` from bottom to top; the
    /// bounds are the middles of the outermost dots.
    pub fn new(area: Rect, x: [f64; 2], [bottom, top]: [f64; 2], theme: &Theme) -> Self {
        let ascii = theme.ascii;
        let axis = |ends, first, cells, full| DotAxis {
            ends,
            first,
            cells,
            each: if ascii { 1 } else { full },
            full,
        };
        Self {
            x: axis(x, area.x, area.width, 2),
            y: axis([top, bottom], area.y, area.height, 4),
            ascii,
        }
    }

    /// Returns the number of dots across and down `area`.
    pub fn dots(area: Rect, theme: &Theme) -> (f64, f64) {
        let canvas = Self::new(area, [0.0; 2], [0.0; 2], theme);
        (canvas.x.dots(), canvas.y.dots())
    }

    /// Returns the column of the screen at `x`, if it is visible.
    pub fn column(&self, x: f64) -> Option<u16> {
        Some(self.x.place(self.x.dot(x))?.0)
    }

    /// Returns the row of the screen at `y`, if it is visible.
    pub fn row(&self, y: f64) -> Option<u16> {
        Some(self.y.place(self.y.dot(y))?.0)
    }

    /// Returns a dashed horizontal line at `y`, with `on` of every `of` Braille dots set. In whole
    /// dots, so that all dashes look the same.
    pub fn level(&self, y: f64, [on, of]: [u32; 2]) -> impl Iterator<Item = Stroke> {
        let dashes = self.x.dashes(self.x.ends, [on, of]);
        dashes.map(move |[from, to]| [from, y, to, y])
    }

    /// Returns a vertical line at `x`, as [`BrailleCanvas::level`].
    pub fn upright(&self, x: f64, [on, of]: [u32; 2]) -> impl Iterator<Item = Stroke> {
        let [top, bottom] = self.y.ends;
        let dashes = self.y.dashes([bottom, top], [on, of]);
        dashes.map(move |[from, to]| [x, from, x, to])
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
        let from = (self.x.dot(x1), self.y.dot(y1));
        let (across, down) = (self.x.dot(x2) - from.0, self.y.dot(y2) - from.1);
        let length = across.abs().max(down.abs()).ceil().max(1.0);
        for step in 0..=length as u32 {
            let share = f64::from(step) / length;
            self.put(pen, from.0 + across * share, from.1 + down * share, buf);
        }
    }

    /// Sets one dot, if it is visible.
    fn put(&self, pen: Pen, right: f64, below: f64, buf: &mut Buffer) {
        let place = self.x.place(right).zip(self.y.place(below));
        let Some(((column, x), (row, y))) = place else {
            return;
        };
        let cell = &mut buf[(column, row)];
        let dots = u32::from(pattern(cell.symbol())) | DOTS[y][x];
        let sum = char::from_u32(dots).filter(|_| !self.ascii);
        cell.reset();
        cell.set_char(sum.unwrap_or(pen.ascii)).set_style(pen.style);
    }
}

/// Returns the pattern of a cell, or the empty pattern.
fn pattern(symbol: &str) -> char {
    let there = symbol.chars().next();
    there
        .filter(|there| (BRAILLE..BRAILLE + 256).contains(&u32::from(*there)))
        .unwrap_or('\u{2800}')
}

/// Returns `stroke` in `count` dashes, with gaps of the same length.
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
    use crate::view::testing::{RICH, drawn};

    #[test]
    fn dots_of_two_drawings_add_up() {
        let pen = Pen {
            style: Style::new(),
            ascii: '*',
        };
        let drawn = drawn((2, 1), &RICH, |sheet| {
            let canvas = BrailleCanvas::new(sheet.area, [0.0, 3.0], [0.0, 3.0], &RICH);
            for end in [[3.0, 0.0], [0.0, 3.0], [f64::NAN, 3.0]] {
                canvas.draw(pen, [[0.0, 0.0, end[0], end[1]]], sheet.buf);
            }
        });
        insta::assert_snapshot!(drawn, @"⣇⣀");
    }

    #[test]
    fn places_are_found() {
        let canvas = BrailleCanvas::new(Rect::new(5, 2, 10, 4), [0.0, 1.0], [-1.0, 1.0], &RICH);
        let columns = [0.0, 1.0, 1.2].map(|x| canvas.column(x));
        assert_eq!(columns, [Some(5), Some(14), None]);
        let rows = [1.0, -1.0, f64::NAN].map(|y| canvas.row(y));
        assert_eq!(rows, [Some(2), Some(5), None]);
    }

    #[test]
    fn dashes_end_where_the_line_ends() {
        let dashes: Vec<_> = dashed([0.0, 0.0, 3.0, 0.0], 2).collect();
        assert_eq!(dashes, [[0.0, 0.0, 1.0, 0.0], [2.0, 0.0, 3.0, 0.0]]);
        assert_eq!(dashed([0.0; 4], 0).count(), 0);
    }
}
