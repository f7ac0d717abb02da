//! The cart-pole, drawn to scale.

use ratatui::{buffer::Buffer, layout::Rect, style::Style, text::Span};
use ratelab::cartpole::{CART_LIMIT_M, POLE_LIMIT_RAD, Pose};

use super::{
    canvas::{BrailleCanvas, Pen, Stroke, dashed},
    pane::{self, border, clamp, put, row, rows, signed},
    theme::Theme,
};
use crate::dashboard::frame::{PlantData, VerdictKind};

/// What the pane is called.
const TITLE: &str = "2 plant";

/// Length of the pole (m).
const POLE_M: f64 = 1.0;

/// Height of the end stops and length of the longest push (m).
const STOP_M: f64 = 0.15;
const PUSH_M: f64 = 0.5;

/// Half the width and half the height of the cart (m).
const CART_HALF_M: (f64, f64) = (0.1, 0.05);

/// What is in sight if the screen is wide enough: rail and a little more (m).
const SIGHT_HALF_M: f64 = 2.6;

/// Dots from hinge to tip below which a pole is too short to see it lean. Then
/// the view follows the cart instead of showing the whole rail.
const SHORTEST_POLE: f64 = 16.0;

/// Force of a full push (N): the model's motor.
const FULL_PUSH_N: f64 = 10.0;

/// Draws the cart-pole, and its figures in the last line.
pub fn render(
    plant: Option<&PlantData>,
    verdict: VerdictKind,
    theme: &Theme,
    focused: bool,
    area: Rect,
    buf: &mut Buffer,
) {
    let lost = plant.filter(|_| verdict == VerdictKind::Lost);
    let word = lost.map_or_else(Span::default, |plant| {
        Span::styled(word(&plant.pose, theme), theme.alarm())
    });
    let inner = border(TITLE, word, theme, focused, area, buf);
    let last = usize::from(inner.height.saturating_sub(1));
    figures(plant, theme, row(inner, last), buf);
    if let Some(scene) = PlantDrawing::new(plant, theme, rows(inner, 0, last)) {
        scene.draw(plant, lost.is_some(), theme, buf);
    }
}

/// How it was lost.
fn word(pose: &Pose, theme: &Theme) -> String {
    let what = if pose.pole_angle.abs() > POLE_LIMIT_RAD {
        "pole fell"
    } else if pose.cart_position.abs() > CART_LIMIT_M {
        "off the rail"
    } else {
        "lost"
    };
    format!(" {} {what} ", theme.glyph("✖", "!"))
}

/// Angle, place and push, as many as fit.
fn figures(plant: Option<&PlantData>, theme: &Theme, row: Rect, buf: &mut Buffer) {
    let Some(plant) = plant else {
        put("no control step yet", theme.faint(), 1, row, buf);
        return;
    };
    let degrees = signed(plant.pose.pole_angle.to_degrees(), 7, 2, theme);
    let push = f64::from(plant.action);
    let parts = [
        format!("angle {degrees}{}", theme.glyph("°", " deg")),
        format!("cart {} m", signed(plant.pose.cart_position, 5, 2, theme)),
        format!(
            "push {} ({} N)",
            signed(push, 5, 2, theme),
            signed(push * FULL_PUSH_N, 0, 1, theme)
        ),
    ];
    let mut x = 1;
    for part in parts {
        let wide = pane::width(&part);
        if x + wide <= usize::from(row.width) {
            put(&part, Style::new(), x, row, buf);
        }
        x += wide + 3;
    }
}

/// A view with equal scale on both axes. Everything that stands still or moves
/// as a whole is on whole dots, so that it does not change its shape.
struct PlantDrawing {
    canvas: BrailleCanvas,
    labels: Rect,
    /// Size of a dot (m).
    dot: (f64, f64),
    /// Where the middle of the cart is (m), on a whole dot.
    cart: f64,
    /// Half the cart in dots.
    cart_dots: (f64, f64),
}

impl PlantDrawing {
    fn new(plant: Option<&PlantData>, theme: &Theme, area: Rect) -> Option<Self> {
        let spare = usize::from(area.height > 7);
        let canvas = rows(area, 0, usize::from(area.height) - spare);
        let labels = row(area, usize::from(canvas.height));
        let (wide, high) = BrailleCanvas::dots(canvas, theme);
        // A terminal cell is about twice as high as wide; so is a dot of ASCII,
        // while a cell of Braille is two dots by four.
        let shape = if theme.ascii { 2.0 } else { 1.0 };
        let below = if theme.ascii { 1.5 } else { 4.5 };
        if wide < 6.0 || high < below + 2.0 {
            return None;
        }
        let by_height = 1.1 * POLE_M / (high - 1.0 - below);
        let by_width = 2.0 * SIGHT_HALF_M / (wide - 1.0) * shape;
        let whole_rail = by_height.max(by_width);
        let down = if POLE_M / whole_rail * if theme.ascii { 4.0 } else { 1.0 } >= SHORTEST_POLE {
            whole_rail
        } else {
            by_height
        };
        let dot = (down / shape, down);
        let cart_dots = (
            (CART_HALF_M.0 / dot.0).round().max(1.0),
            (CART_HALF_M.1 / dot.1).round(),
        );
        let position = plant.map_or(0.0, |plant| plant.pose.cart_position);
        let cart = (position / dot.0).round() * dot.0;
        let span = (wide - 1.0) * dot.0;
        let slack = (SIGHT_HALF_M - span / 2.0).max(0.0);
        let middle = if cart.is_finite() {
            cart.clamp(-slack, slack)
        } else {
            0.0
        };
        let left = ((middle - span / 2.0) / dot.0).round() * dot.0;
        let bottom = -(cart_dots.1 + if theme.ascii { 1.0 } else { 3.0 }) * dot.1;
        let y = [bottom, bottom + (high - 1.0) * dot.1];
        Some(Self {
            canvas: BrailleCanvas::new(canvas, [left, left + span], y, theme),
            labels,
            dot,
            cart,
            cart_dots,
        })
    }

    fn draw(&self, plant: Option<&PlantData>, lost: bool, theme: &Theme, buf: &mut Buffer) {
        self.rail(theme, buf);
        let Some(plant) = plant else { return };
        let pen = |style, ascii| Pen { style, ascii };
        let (style, ascii) = if lost {
            // Reversed, thin lines would turn into blocks.
            (theme.alarm_line(), 'X')
        } else {
            (theme.good(), '*')
        };
        for side in [-1.0, 1.0] {
            let edge = self.arm(side * POLE_LIMIT_RAD, 1.08 * POLE_M, 0.0);
            self.canvas
                .draw(pen(theme.faint(), '.'), dashed(edge, 14), buf);
        }
        let push = f64::from(plant.action).clamp(-1.0, 1.0);
        let arrow = if push < 0.0 { '<' } else { '>' };
        self.canvas
            .draw(pen(theme.active(), arrow), self.push(push), buf);
        self.canvas
            .draw(pen(Style::new(), '#'), self.box_of_cart(), buf);
        // Two dots thick, but where a dot is a letter.
        let thick = if theme.ascii { 0.0 } else { self.dot.0 / 2.0 };
        let pole = [-thick, thick].map(|aside| self.arm(plant.pose.pole_angle, POLE_M, aside));
        self.canvas.draw(pen(style, ascii), pole, buf);
    }

    /// From the hinge `length` metres at `angle` from upright.
    fn arm(&self, angle: f64, length: f64, aside: f64) -> Stroke {
        let hinge = self.cart + aside;
        [
            hinge,
            0.0,
            hinge + length * angle.sin(),
            length * angle.cos(),
        ]
    }

    fn box_of_cart(&self) -> Vec<Stroke> {
        let (x, y) = self.cart_dots;
        let (left, right) = (self.cart - x * self.dot.0, self.cart + x * self.dot.0);
        let lines = (-y as i32)..=(y as i32);
        lines
            .map(|line| f64::from(line) * self.dot.1)
            .map(|y| [left, y, right, y])
            .collect()
    }

    /// A bar on the side to which the cart is pushed.
    fn push(&self, push: f64) -> Option<Stroke> {
        let begin = (self.cart_dots.0 + 2.0) * self.dot.0;
        let length = push.abs() * PUSH_M;
        (length > self.dot.0).then(|| {
            let side = push.signum();
            [
                self.cart + side * begin,
                0.0,
                self.cart + side * (begin + length),
                0.0,
            ]
        })
    }

    /// The rail with its end stops, a tick at every metre, and labels.
    fn rail(&self, theme: &Theme, buf: &mut Buffer) {
        let pen = |ascii| Pen {
            style: theme.faint(),
            ascii,
        };
        let y = -(self.cart_dots.1 + 1.0) * self.dot.1;
        let line = [-CART_LIMIT_M, y, CART_LIMIT_M, y];
        self.canvas.draw(pen('-'), [line], buf);
        let ticks = (-2..=2).map(f64::from).map(|x| [x, y - self.dot.1, x, y]);
        self.canvas.draw(pen('+'), ticks, buf);
        let stops = [-CART_LIMIT_M, CART_LIMIT_M].map(|x| [x, y, x, STOP_M]);
        self.canvas.draw(pen('|'), stops, buf);
        for at in [-CART_LIMIT_M, -1.0, 0.0, 1.0, CART_LIMIT_M] {
            let text = if at == 0.0 {
                "0 m".to_owned()
            } else {
                signed(at, 0, usize::from(at.fract() != 0.0), theme) + " m"
            };
            self.label(at, &text, theme, buf);
        }
    }

    /// `text` under `x`, moved as little as it takes to be whole.
    fn label(&self, x: f64, text: &str, theme: &Theme, buf: &mut Buffer) {
        let wide = clamp(pane::width(text));
        let Some(room) = self.labels.width.checked_sub(wide) else {
            return;
        };
        let Some(column) = self.canvas.column(x) else {
            return;
        };
        let start = (column - self.labels.x).saturating_sub(wide / 2).min(room);
        put(text, theme.faint(), usize::from(start), self.labels, buf);
    }
}

#[cfg(test)]
mod tests {
    use ratatui::{buffer::Buffer, style::Modifier};

    use super::render;
    use crate::dashboard::{
        frame::FrameData,
        view::{
            pane::testing::{POOR, RICH, screen, styled, text, torture},
            sample,
            theme::Theme,
        },
    };

    fn pane(frame: &FrameData, width: u16, height: u16, theme: &Theme) -> Buffer {
        let (plant, verdict) = (frame.plant.as_ref(), frame.verdict.kind);
        screen(width, height, |area, buf| {
            render(plant, verdict, theme, false, area, buf)
        })
    }

    #[test]
    fn the_whole_rail_is_in_sight() {
        insta::assert_snapshot!(text(&pane(&sample::balanced(), 62, 13, &RICH)), @r"
        ┌2 plant─────────────────────────────────────────────────────┐
        │                                                            │
        │                           ⢀    ⢀                           │
        │                           ⠸⡄⢸⡇ ⡼                           │
        │                            ⢇⢸⡇⢀⠇                           │
        │                            ⠸⣸⡇⡸                            │
        │                             ⡇⣿⡇                            │
        │                             ⢱⣿⠁                            │
        │  ⡇                          ⣬⣿⡄⣀⡀                       ⡇  │
        │  ⠓⠒⠒⠒⠲⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠖⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠻⠛⠓⠒⠒⠒⠒⠒⠒⠒⠒⠒⠖⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠲⠒⠒⠒⠒⠃  │
        │−2.4 m          −1 m        0 m        +1 m           +2.4 m│
        │ angle   −0.69°   cart +0.04 m   push +0.18 (+1.8 N)        │
        └────────────────────────────────────────────────────────────┘
        ");
        insta::assert_snapshot!(text(&pane(&sample::balanced(), 62, 13, &POOR)), @r"
        +2 plant-----------------------------------------------------+
        |                                                            |
        |                           .. * ..                          |
        |                            . * .                           |
        |                            . * .                           |
        |                             .*.                            |
        |                             .*.                            |
        |   |                         .*.                         |  |
        |   |                         #*# >>                      |  |
        |   |---+-----------+----------+----------+-----------+---|  |
        |-2.4 m           -1 m        0 m       +1 m           +2.4 m|
        | angle   -0.69 deg   cart +0.04 m   push +0.18 (+1.8 N)     |
        +------------------------------------------------------------+
        ");
    }

    #[test]
    fn a_narrow_view_follows_the_cart() {
        insta::assert_snapshot!(text(&pane(&sample::broken(), 34, 10, &RICH)), @r"
        ┌2 plant──────────── ✖ pole fell ┐
        │             ⠐⡄   ⣔             │
        │              ⢇  ⢠⡟             │
        │              ⢸  ⣸⠇             │
        │               ⡇ ⣿              │
        │               ⢱⢸⡇              │
        │         ⣀⣀⣀⣀⣀⡀⣼⣾⡅              │
        │⠒⠒⠒⠒⠒⠒⠒⠒⠒⠖⠒⠒⠒⠒⠒⠛⠛⠓⠒⠖⠒⠒⠒⠒⠒⠒⠒⠒⠒⠖⠒⠒│
        │ angle  +12.32°   cart −0.31 m  │
        └────────────────────────────────┘
        ");
        let mut far = sample::balanced();
        far.plant.as_mut().expect("a plant").pose.cart_position = 2.3;
        insta::assert_snapshot!(text(&pane(&far, 34, 10, &RICH)), @"
        ┌2 plant─────────────────────────┐
        │                          ⢢ ⣀ ⢠⠂│
        │                          ⠸⡀⣿ ⡸ │
        │                           ⡇⣿ ⡇ │
        │                           ⢸⢹⢸  │
        │                           ⠈⣾⡎  │
        │                           ⢠⣿⣿⢀⣀│
        │⠒⠒⠒⠒⠒⠖⠒⠒⠒⠒⠒⠒⠒⠒⠒⠖⠒⠒⠒⠒⠒⠒⠒⠒⠒⠲⠒⠚⠛⠛  │
        │ angle   −0.69°   cart +2.30 m  │
        └────────────────────────────────┘
        ");
    }

    #[test]
    fn a_fall_is_said_and_seen() {
        let buf = pane(&sample::broken(), 62, 13, &RICH);
        assert_eq!(styled(&buf, RICH.alarm()), " ✖ pole fell ");
        // Above the cart, the pole is what is in this style.
        let pole = buf.content[..62 * 8].iter();
        let pole = pole.filter(|cell| {
            cell.style().fg == RICH.alarm().fg && !cell.modifier.contains(Modifier::REVERSED)
        });
        assert!(pole.count() >= 6);
        let good = pane(&sample::balanced(), 62, 13, &RICH);
        assert!(styled(&good, RICH.alarm_line()).is_empty());
    }

    #[test]
    fn angles_look_true() {
        let mut frame = sample::balanced();
        let plant = frame.plant.as_mut().expect("a plant");
        plant.pose.pole_angle = 45_f64.to_radians();
        plant.pose.cart_position = 0.0;
        plant.action = 0.0;
        let buf = pane(&frame, 90, 20, &POOR);
        let star = |x: &u16, y: &u16| buf[(*x, *y)].symbol() == "*";
        let wide = (0..90).filter(|x| (0..20).any(|y| star(x, &y))).count();
        let high = (0..20).filter(|y| (0..90).any(|x| star(&x, y))).count();
        // A cell is twice as high as wide.
        assert!(high > 4 && wide.abs_diff(2 * high) <= 2, "{wide} x {high}");
    }

    #[test]
    fn any_size_and_any_pose_will_do() {
        let mut frame = sample::broken();
        for (cart, angle) in [(-0.3, 0.2), (9.0, -3.1), (f64::NAN, f64::INFINITY)] {
            let plant = frame.plant.as_mut().expect("a plant");
            (plant.pose.cart_position, plant.pose.pole_angle) = (cart, angle);
            plant.action = angle as f32;
            let plant = frame.plant.as_ref();
            torture(|theme, area, buf| {
                render(plant, frame.verdict.kind, theme, true, area, buf);
            });
        }
        torture(|theme, area, buf| render(None, frame.verdict.kind, theme, true, area, buf));
    }
}
