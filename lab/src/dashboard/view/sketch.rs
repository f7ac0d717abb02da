//! Line drawings in a part of the screen, in several styles.
//!
//! ratatui's canvas knows colours but neither bold nor dim, and one drawing
//! hides the other where they share a cell. Here each drawing has a style, and
//! dots of Braille in the same cell add up.

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    style::{Color, Style},
    symbols::Marker,
    widgets::{
        Widget,
        canvas::{Canvas, Line},
    },
};

use super::theme::Theme;

/// The first of the 256 Braille patterns; the others follow in such an order
/// that dots add up by "or".
const BRAILLE: u32 = 0x2800;

/// A straight line: x and y of one end, x and y of the other.
pub type Stroke = [f64; 4];

/// What lines are drawn with.
#[derive(Clone, Copy, Debug)]
pub struct Ink {
    /// Their style.
    pub style: Style,
    /// What they consist of where there is only ASCII.
    pub ascii: char,
}

/// A part of the screen with coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Sketch {
    area: Rect,
    x: [f64; 2],
    y: [f64; 2],
    ascii: bool,
}

impl Sketch {
    /// `area` with `x` from left to right and `y` from bottom to top; the
    /// bounds are the middles of the outermost dots.
    pub fn new(area: Rect, x: [f64; 2], y: [f64; 2], theme: &Theme) -> Self {
        let ascii = theme.ascii;
        Self { area, x, y, ascii }
    }

    /// How many dots fit across and down `area`.
    pub fn dots(area: Rect, theme: &Theme) -> (f64, f64) {
        let (across, down) = if theme.ascii { (1, 1) } else { (2, 4) };
        let dots = |cells: u16, each: u32| f64::from(u32::from(cells) * each);
        (dots(area.width, across), dots(area.height, down))
    }

    /// The column of the screen at `x`, if it is in sight.
    pub fn column(&self, x: f64) -> Option<u16> {
        let place = (x - self.x[0]) / (self.x[1] - self.x[0]);
        Self::cell(place, self.area.width, if self.ascii { 1 } else { 2 }).map(|c| self.area.x + c)
    }

    /// The row of the screen at `y`, if it is in sight.
    pub fn row(&self, y: f64) -> Option<u16> {
        let place = (self.y[1] - y) / (self.y[1] - self.y[0]);
        Self::cell(place, self.area.height, if self.ascii { 1 } else { 4 }).map(|c| self.area.y + c)
    }

    fn cell(place: f64, cells: u16, dots_each: u16) -> Option<u16> {
        let last = f64::from(cells) * f64::from(dots_each) - 1.0;
        let dot = (place * last).round();
        // Also false for what is not a number.
        (0.0..=last)
            .contains(&dot)
            .then(|| (dot / f64::from(dots_each)) as u16)
    }

    /// A horizontal line at `y`, `on` of `of` dots of Braille long, or half as
    /// many letters of ASCII. In whole dots, so that all dashes look the same.
    pub fn level(&self, y: f64, on: u32, of: u32) -> Vec<Stroke> {
        let dashes = self.dashes(self.x, self.area.width * 2, 2, on, of);
        dashes.map(|(from, to)| [from, y, to, y]).collect()
    }

    /// A vertical line at `x`, as [`Sketch::level`].
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

    /// Draws `strokes`, over what is there already.
    pub fn draw(&self, ink: Ink, strokes: impl IntoIterator<Item = Stroke>, buf: &mut Buffer) {
        let strokes: Vec<Stroke> = strokes
            .into_iter()
            .filter(|stroke| stroke.iter().all(|figure| figure.is_finite()))
            .collect();
        let mut layer = Buffer::empty(self.area);
        let marker = if self.ascii {
            Marker::Custom(ink.ascii)
        } else {
            Marker::Braille
        };
        let canvas = Canvas::default()
            .x_bounds(self.x)
            .y_bounds(self.y)
            .marker(marker)
            .paint(|context| {
                for &[x1, y1, x2, y2] in &strokes {
                    context.draw(&Line::new(x1, y1, x2, y2, Color::Reset));
                }
            });
        canvas.render(self.area, &mut layer);
        lay_over(&layer, ink.style, buf);
    }
}

fn lay_over(layer: &Buffer, style: Style, buf: &mut Buffer) {
    for place in layer.area.positions() {
        let symbol = layer[place].symbol();
        if symbol == " " {
            continue;
        }
        if let Some(cell) = buf.cell_mut(place) {
            let symbol = sum_of_dots(symbol, cell.symbol()).unwrap_or_else(|| symbol.to_owned());
            cell.reset();
            cell.set_symbol(&symbol).set_style(style);
        }
    }
}

/// Both patterns in one, if both are Braille.
fn sum_of_dots(one: &str, other: &str) -> Option<String> {
    let pattern = |symbol: &str| {
        let code = u32::from(symbol.chars().next()?);
        (BRAILLE..BRAILLE + 256).contains(&code).then_some(code)
    };
    char::from_u32(pattern(one)? | pattern(other)?).map(String::from)
}

/// `stroke` in `count` dashes, as long as the gaps between them.
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

    use super::{Ink, Sketch, dashed};
    use crate::dashboard::view::pane::testing::{RICH, screen, text};

    #[test]
    fn dots_of_two_drawings_add_up() {
        let ink = Ink {
            style: Style::new(),
            ascii: '*',
        };
        let buf = screen(2, 1, |area, buf| {
            let sketch = Sketch::new(area, [0.0, 3.0], [0.0, 3.0], &RICH);
            sketch.draw(ink, [[0.0, 0.0, 3.0, 0.0]], buf);
            sketch.draw(ink, [[0.0, 0.0, 0.0, 3.0]], buf);
            sketch.draw(ink, [[f64::NAN, 0.0, 0.0, 3.0]], buf);
        });
        insta::assert_snapshot!(text(&buf), @"⣇⣀");
    }

    #[test]
    fn places_are_found() {
        let sketch = Sketch::new(Rect::new(5, 2, 10, 4), [0.0, 1.0], [-1.0, 1.0], &RICH);
        assert_eq!(
            (sketch.column(0.0), sketch.column(1.0)),
            (Some(5), Some(14))
        );
        assert_eq!((sketch.row(1.0), sketch.row(-1.0)), (Some(2), Some(5)));
        assert_eq!((sketch.column(1.2), sketch.row(f64::NAN)), (None, None));
    }

    #[test]
    fn dashes_end_where_the_line_ends() {
        let dashes: Vec<_> = dashed([0.0, 0.0, 3.0, 0.0], 2).collect();
        assert_eq!(dashes, [[0.0, 0.0, 1.0, 0.0], [2.0, 0.0, 3.0, 0.0]]);
        assert_eq!(dashed([0.0; 4], 0).count(), 0);
    }
}
