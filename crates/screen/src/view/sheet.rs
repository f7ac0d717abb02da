//! A part of the screen to write on. What is written is in ASCII where the theme asks for
//! that, and is cut at the edge.

use ratatui::{
    buffer::Buffer,
    layout::{Margin, Rect},
    style::Style,
    text::{Line, Span},
    widgets::{Block, Clear, Widget},
};

use super::text::{clip, plain, width};
use crate::theme::Theme;

/// A part of the screen.
pub struct Sheet<'a> {
    /// Colours and glyphs.
    pub theme: &'a Theme,
    /// Whether it has the focus.
    pub focused: bool,
    /// The part, all of it on the screen.
    pub area: Rect,
    /// The screen.
    pub buf: &'a mut Buffer,
}

impl<'a> Sheet<'a> {
    /// Clips `area` to the screen.
    pub fn new(theme: &'a Theme, focused: bool, area: Rect, buf: &'a mut Buffer) -> Self {
        Self {
            theme,
            focused,
            area: area.intersection(buf.area),
            buf,
        }
    }

    /// Returns the number of columns.
    pub fn width(&self) -> usize {
        usize::from(self.area.width)
    }

    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        usize::from(self.area.height)
    }

    /// Returns the part in `area`.
    pub fn part(&mut self, area: Rect) -> Sheet<'_> {
        Sheet::new(self.theme, self.focused, area, self.buf)
    }

    /// At most `count` rows, from row `first` on.
    pub fn rows(&mut self, first: usize, count: usize) -> Sheet<'_> {
        self.part(rows(self.area, first, count))
    }

    /// At most `count` columns of row `y`, from column `x` on.
    pub fn cells(&mut self, x: usize, y: usize, count: usize) -> Sheet<'_> {
        self.part(columns(rows(self.area, y, 1), x, count))
    }

    /// Without a margin on the left and on the right.
    pub fn inset(self, margin: usize) -> Self {
        let area = self.area.inner(Margin::new(clamp(margin), 0));
        Self { area, ..self }
    }

    /// Draws a box and returns its inside. `right` is left out if it would touch the title.
    pub fn boxed(mut self, title: &str, right: Span<'_>) -> Self {
        let style = if self.focused {
            self.theme.strong()
        } else {
            self.theme.faint()
        };
        let room = self.width().saturating_sub(2);
        let title = clip(title, room, self.theme);
        let right = Span::styled(plain(&right.content, self.theme), right.style);
        let both = width(&title) + right.width() + 2;
        let mut block = Block::bordered()
            .border_style(self.theme.faint())
            .title(Span::styled(title, style));
        if right.width() > 0 && both <= room {
            block = block.title(Line::from(right).right_aligned());
        }
        let area = block.inner(self.area);
        self.widget(block);
        Self { area, ..self }
    }

    /// Returns whether it is not empty and all its cells show `symbol`.
    pub fn shows(&self, symbol: &str) -> bool {
        let symbol = plain(symbol, self.theme);
        let mut cells = self.area.positions().map(|at| &self.buf[at]);
        !self.area.is_empty() && cells.all(|cell| cell.symbol() == symbol)
    }

    /// Draws a widget.
    pub fn widget(&mut self, widget: impl Widget) {
        widget.render(self.area, self.buf);
        for at in self.area.positions().filter(|_| self.theme.ascii) {
            let cell = &mut self.buf[at];
            let symbol = plain(cell.symbol(), self.theme).into_owned();
            cell.set_symbol(symbol.get(..1).unwrap_or(" "));
        }
    }

    /// Wipes it.
    pub fn clear(&mut self) {
        Clear.render(self.area, self.buf);
    }

    /// Writes `text` from column `x` of row `y` on; returns the column after it.
    pub fn put(&mut self, x: usize, y: usize, text: &str, style: Style) -> usize {
        let room = self.width().saturating_sub(x);
        if y >= self.height() || room == 0 {
            return x;
        }
        let end = x + width(&plain(text, self.theme));
        let text = clip(text, room, self.theme);
        let (left, top) = (self.area.x + clamp(x), self.area.y + clamp(y));
        self.buf.set_stringn(left, top, &text, room, style);
        end
    }

    /// Writes `line` from column `x` of row `y` on.
    pub fn line(&mut self, mut x: usize, y: usize, line: &Line<'_>) {
        for span in &line.spans {
            x = self.put(x, y, &span.content, span.style);
        }
    }

    /// Writes `lines` below each other, from row `y` on.
    pub fn lines<'l>(&mut self, x: usize, y: usize, lines: impl IntoIterator<Item = Line<'l>>) {
        for (line, row) in lines.into_iter().zip(y..) {
            self.line(x, row, &line);
        }
    }
}

/// At most `count` rows of `area`, from row `first` on.
pub fn rows(area: Rect, first: usize, count: usize) -> Rect {
    let first = clamp(first).min(area.height);
    let height = clamp(count).min(area.height - first);
    let y = area.y + first;
    Rect { y, height, ..area }
}

/// At most `count` columns of `area`, from column `first` on.
pub fn columns(area: Rect, first: usize, count: usize) -> Rect {
    let first = clamp(first).min(area.width);
    let width = clamp(count).min(area.width - first);
    let x = area.x + first;
    Rect { x, width, ..area }
}

/// Returns a length on the screen, which cannot exceed `u16`.
pub fn clamp(length: usize) -> u16 {
    u16::try_from(length).unwrap_or(u16::MAX)
}
