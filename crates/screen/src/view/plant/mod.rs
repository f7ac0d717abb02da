//! The plant, drawn to scale.

use ratatui::{
    layout::Rect,
    style::Style as CellStyle,
    text::{Line, Span},
};
use ratelab_system::{Picture, Shape, Style};

use super::{
    canvas::{BrailleCanvas, Pen, Stroke, dashed},
    sheet::{Sheet, rows},
    text::{plain, side_by_side, width},
};
use crate::{
    frame::{Standing, VerdictData},
    theme::Theme,
};

/// Length (Braille dots) below which one side of a view is too short to show motion, and the
/// share of the pane below which it wastes room. The shorter side then fills the pane, and the
/// view follows the focus.
const SHORTEST_SIDE: f64 = 20.0;
const MIN_SHARE: f64 = 0.5;

/// Number of rows above which one is for labels below the view.
const WITH_LABELS: u16 = 7;

/// Blanks between captions.
const CAPTION_GAP: usize = 3;

/// Maximum number of strokes of a shape.
const MAX_STROKES: f64 = 400.0;

/// How a picture is fitted into the pane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFit {
    /// Around the preferred area; where one side of that is short, around the focus.
    Area,
    /// Around all of the robot, wherever it goes.
    Robot,
}

/// Draws a picture, and its captions in the last line.
pub fn render(picture: Option<&Picture>, fit: PictureFit, verdict: &VerdictData, sheet: Sheet<'_>) {
    let theme = sheet.theme;
    let lost = picture.is_some() && verdict.standing == Standing::Lost;
    let word = if lost {
        Span::styled(format!(" ✖ {} ", verdict.word), theme.alarm())
    } else {
        Span::default()
    };
    let mut pane = sheet.boxed("2 plant", word);
    let last = pane.height().saturating_sub(1);
    let Some(picture) = picture else {
        pane.put(1, last, "no state yet", theme.faint());
        return;
    };
    let captions = picture
        .captions
        .iter()
        .map(|caption| Line::raw(with_signs(caption)));
    let room = pane.width().saturating_sub(1);
    pane.line(1, last, &side_by_side(captions, CAPTION_GAP, room, theme));
    if let Some(drawing) = Drawing::new(picture, fit, lost, theme, rows(pane.area, 0, last)) {
        drawing.draw(picture, &mut pane);
    }
}

/// Returns `text` with minus signs as wide as plus signs.
fn with_signs(text: &str) -> String {
    let letters: Vec<char> = text.chars().collect();
    let is_minus = |at: usize| {
        let number = letters.get(at + 1).is_some_and(char::is_ascii_digit);
        let alone = at == 0 || !letters[at - 1].is_alphanumeric();
        letters[at] == '-' && number && alone
    };
    let letter = |at: usize| if is_minus(at) { '−' } else { letters[at] };
    (0..letters.len()).map(letter).collect()
}

/// A view with equal scale on both axes. Moving parts are aligned to whole dots, so that
/// they keep their shape.
struct Drawing<'t> {
    canvas: BrailleCanvas,
    /// The rows of labels: the rows of the canvas, and one below if there is room.
    labels: Rect,
    /// Size of a dot (m).
    dot: [f64; 2],
    /// Shift of moving parts that puts the focus on a whole dot (m).
    shift: [f64; 2],
    lost: bool,
    theme: &'t Theme,
}

impl<'t> Drawing<'t> {
    fn new(
        picture: &Picture,
        fit: PictureFit,
        lost: bool,
        theme: &'t Theme,
        area: Rect,
    ) -> Option<Self> {
        let spare = usize::from(area.height > WITH_LABELS);
        let canvas = rows(area, 0, usize::from(area.height) - spare);
        let (wide, high) = BrailleCanvas::dots(canvas, theme);
        let [left, bottom, right, top] = picture.view;
        let (width, height) = (right - left, top - bottom);
        let sound = width > 0.0 && height > 0.0 && (width + height).is_finite();
        if !sound || wide < 6.0 || high < 3.0 {
            return None;
        }
        // A Braille dot is as high as wide; a character is twice as high.
        let (aspect, across, down) = if theme.ascii {
            (2.0, 2.0, 4.0)
        } else {
            (1.0, 1.0, 1.0)
        };
        let (by_width, by_height) = (width / (wide - 1.0) * aspect, height / (high - 1.0));
        let all = by_width.max(by_height);
        let shorter = (width * aspect * across).min(height * down) / all;
        let filled = by_width.min(by_height);
        let moving = Some(picture)
            .filter(|_| fit == PictureFit::Robot)
            .and_then(extent);
        let has_room = moving.is_none_or(|[left, bottom, right, top]| {
            (right - left) * aspect <= (wide - 1.0) * filled
                && top - bottom <= (high - 1.0) * filled
        });
        let size = if has_room && (shorter < SHORTEST_SIDE || filled < MIN_SHARE * all) {
            filled
        } else {
            all
        };
        let dot = [size / aspect, size];
        let [fx, fy] = picture.focus;
        let span = [(wide - 1.0) * dot[0], (high - 1.0) * dot[1]];
        let mut x = window([left, right], fx, span[0], dot[0], 0.5);
        let mut y = window([bottom, top], fy, span[1], dot[1], 0.0);
        if let Some([left, bottom, right, top]) = moving {
            x = followed(x, [left, right], fx, span[0], dot[0]);
            y = followed(y, [bottom, top], fy, span[1], dot[1]);
        }
        Some(Self {
            canvas: BrailleCanvas::new(canvas, [x, x + span[0]], [y, y + span[1]], theme),
            labels: area,
            dot,
            shift: [to_dot(fx - x, dot[0]), to_dot(fy - y, dot[1])],
            lost,
            theme,
        })
    }

    fn draw(&self, picture: &Picture, sheet: &mut Sheet<'_>) {
        for (style, shape) in &picture.shapes {
            let (line, strokes) = self.strokes(*style, shape);
            self.canvas.draw(self.pen(*style, line), strokes, sheet.buf);
        }
        // Characters hide what is behind them.
        for (style, shape) in &picture.shapes {
            if let Shape::Label { at, text } = shape {
                self.label(*style, *at, text, sheet.part(self.labels));
            }
        }
    }

    /// Returns the direction of a shape, and its lines.
    fn strokes(&self, style: Style, shape: &Shape) -> (Stroke, Vec<Stroke>) {
        match shape {
            Shape::Segment { from, to } => {
                let ([x1, y1], [x2, y2]) = (self.placed(style, *from), self.placed(style, *to));
                let line = [x1, y1, x2, y2];
                (line, self.line(style, line))
            }
            Shape::Box {
                centre,
                half,
                angle,
            } => {
                let centre = self.placed(style, *centre);
                ([0.0; 4], self.filled_box(centre, *half, *angle))
            }
            Shape::Circle { centre, radius } => {
                ([0.0; 4], self.circle(self.placed(style, *centre), *radius))
            }
            Shape::Outline { corners } => ([0.0; 4], self.outline(style, corners)),
            Shape::Label { .. } => ([0.0; 4], Vec::new()),
        }
    }

    /// Returns the position of a point on the drawing.
    fn placed(&self, style: Style, [x, y]: [f64; 2]) -> [f64; 2] {
        match style {
            Style::Scenery => [x, y],
            _ => [x + self.shift[0], y + self.shift[1]],
        }
    }

    /// Returns the pen for `style`; in ASCII the character that best fits the direction of `line`.
    fn pen(&self, style: Style, [x1, y1, x2, y2]: Stroke) -> Pen {
        let (right, up) = (x2 - x1, y2 - y1);
        let level = right.abs() >= up.abs();
        let (cell, ascii) = match style {
            Style::Scenery => (self.theme.faint(), if level { '-' } else { '|' }),
            Style::Limit => (self.theme.faint(), '.'),
            Style::Body => (CellStyle::new(), '#'),
            // Reversed, thin lines would become blocks.
            Style::Subject if self.lost => (self.theme.alarm_line(), 'X'),
            Style::Subject => (self.theme.good(), '*'),
            Style::Action => (
                self.theme.active(),
                match (level, right < 0.0, up < 0.0) {
                    (true, true, _) => '<',
                    (true, false, _) => '>',
                    (false, _, true) => 'v',
                    (false, _, false) => '^',
                },
            ),
        };
        Pen { style: cell, ascii }
    }

    /// Returns the strokes of a line: dashed for a limit, two dots thick for the subject.
    fn line(&self, style: Style, line: Stroke) -> Vec<Stroke> {
        let [x1, y1, x2, y2] = line;
        let dots = [(x2 - x1) / self.dot[0], (y2 - y1) / self.dot[1]].map(f64::abs);
        match style {
            Style::Limit => {
                let dashes = (dots[0].max(dots[1]) / 2.0).clamp(1.0, MAX_STROKES);
                dashed(line, dashes as u32).collect()
            }
            // Where a dot is a character, one is thick enough.
            Style::Subject if !self.theme.ascii => {
                let aside = if dots[0] > dots[1] {
                    [0.0, self.dot[1] / 2.0]
                } else {
                    [self.dot[0] / 2.0, 0.0]
                };
                let moved = |by: f64| {
                    let [x, y] = aside.map(|aside| aside * by);
                    [x1 + x, y1 + y, x2 + x, y2 + y]
                };
                vec![moved(-1.0), moved(1.0)]
            }
            _ => vec![line],
        }
    }

    /// Returns a box in lines from side to side, its edges on whole dots where it is level.
    fn filled_box(&self, [x, y]: [f64; 2], half: [f64; 2], angle: f64) -> Vec<Stroke> {
        let half = [
            (half[0] / self.dot[0]).round().max(1.0) * self.dot[0],
            (half[1] / self.dot[1]).round() * self.dot[1],
        ];
        // Turned lines have no gaps at twice the density.
        let dense = if angle == 0.0 { 2.0 } else { 4.0 };
        let lines = (half[1] / self.dot[1] * dense)
            .round()
            .clamp(0.0, MAX_STROKES) as u32;
        let (sin, cos) = angle.sin_cos();
        let corner = |right: f64, up: f64| [x + right * cos - up * sin, y + right * sin + up * cos];
        let level = |line: u32| {
            let up = half[1] * (2.0 * f64::from(line) / f64::from(lines.max(1)) - 1.0);
            let ([x1, y1], [x2, y2]) = (corner(-half[0], up), corner(half[0], up));
            [x1, y1, x2, y2]
        };
        (0..=lines).map(level).collect()
    }

    fn circle(&self, [x, y]: [f64; 2], radius: f64) -> Vec<Stroke> {
        let edges = (4.0 * radius / self.dot[0]).clamp(8.0, MAX_STROKES) as u32;
        let point = |edge: u32| {
            let angle = f64::from(edge) / f64::from(edges) * std::f64::consts::TAU;
            (x + radius * angle.cos(), y + radius * angle.sin())
        };
        let edge = |edge: u32| {
            let ((x1, y1), (x2, y2)) = (point(edge), point(edge + 1));
            [x1, y1, x2, y2]
        };
        (0..edges).map(edge).collect()
    }

    fn outline(&self, style: Style, corners: &[[f64; 2]]) -> Vec<Stroke> {
        let corner = |corner: &[f64; 2]| self.placed(style, *corner);
        let next = corners.iter().cycle().skip(1);
        let edges = corners.iter().zip(next).map(|(from, to)| {
            let ([x1, y1], [x2, y2]) = (corner(from), corner(to));
            [x1, y1, x2, y2]
        });
        edges.collect()
    }

    /// `text` below its place, moved as little as needed to fit.
    fn label(&self, style: Style, at: [f64; 2], text: &str, mut sheet: Sheet<'_>) {
        let text = with_signs(text);
        let wide = width(&plain(&text, self.theme));
        let [x, y] = self.placed(style, at);
        let place = self.canvas.column(x).zip(self.canvas.row(y));
        let room = sheet.width().checked_sub(wide);
        if let Some(((column, above), room)) = place.zip(room) {
            let start = usize::from(column - sheet.area.x).saturating_sub(wide / 2);
            let row = usize::from(above - sheet.area.y) + 1;
            let pen = self.pen(style, [0.0; 4]);
            sheet.put(start.min(room), row, &text, pen.style);
        }
    }
}

/// Returns the beginning of a window of `span` metres, on a whole dot: with everything between the
/// ends visible and the share `before` of the spare room in front, or else around `focus`.
fn window([from, to]: [f64; 2], focus: f64, span: f64, dot: f64, before: f64) -> f64 {
    let spare = span - (to - from);
    let begin = if spare >= 0.0 {
        from - spare * before
    } else if focus.is_finite() {
        (focus - span / 2.0).clamp(from, to - span)
    } else {
        from - spare / 2.0
    };
    (begin / dot).round() * dot
}

/// Returns the beginning of a window, moved by as many whole dots as keep what moves in sight; around
/// `focus` where that is larger.
fn followed(begin: f64, [from, to]: [f64; 2], focus: f64, span: f64, dot: f64) -> f64 {
    let over = |way: f64| (way.max(0.0) / dot).ceil() * dot;
    if to - from <= span {
        begin - over(begin - from) + over(to - begin - span)
    } else if focus.is_finite() && !(begin..=begin + span).contains(&focus) {
        ((focus - span / 2.0) / dot).round() * dot
    } else {
        begin
    }
}

/// Left, bottom, right and top of the robot; `None` where its place is unknown.
fn extent(picture: &Picture) -> Option<[f64; 4]> {
    let is_robot = |style: &Style| matches!(style, Style::Body | Style::Subject);
    let corners = picture
        .shapes
        .iter()
        .filter(|(style, _)| is_robot(style))
        .flat_map(|(_, shape)| match shape {
            Shape::Segment { from, to } => vec![*from, *to],
            Shape::Box { centre, half, .. } => around(*centre, half[0].hypot(half[1])),
            Shape::Circle { centre, radius } => around(*centre, *radius),
            Shape::Outline { corners } => corners.clone(),
            Shape::Label { .. } => Vec::new(),
        });
    let all = corners.map(|[x, y]| [x, y, x, y]).reduce(
        |[left, bottom, right, top], [x1, y1, x2, y2]| {
            [left.min(x1), bottom.min(y1), right.max(x2), top.max(y2)]
        },
    );
    all.filter(|extent| extent.iter().all(|number| number.is_finite()))
}

/// Two corners of a square around a circle.
fn around([x, y]: [f64; 2], radius: f64) -> Vec<[f64; 2]> {
    vec![[x - radius, y - radius], [x + radius, y + radius]]
}

/// Distance from `length` to a whole dot.
fn to_dot(length: f64, dot: f64) -> f64 {
    let way = (length / dot).round() * dot - length;
    if way.is_finite() { way } else { 0.0 }
}

#[cfg(test)]
mod tests;
