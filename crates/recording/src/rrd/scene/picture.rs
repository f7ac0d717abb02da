//! The plant as its system draws it: two dimensions, metres, x to the right.

use std::{f64::consts::TAU, sync::Arc, time::Duration};

use ratelab::Time;
use ratelab_metrics::Rows;
use ratelab_system::{Shape, Style, System};
use rerun::{AsComponents, Color, LineStrips2D, Points2D, Radius, RecordingStream};

use super::lines::{BLUE, GREY, ORANGE, WHITE};
use crate::rrd::timeline::{BatchStream, Written};

/// The picture.
pub const PICTURE: &str = "picture";

/// Its parts that do not move.
const SCENERY: &str = "picture/scenery";

/// Run time between two pictures, at the least: 25 in a second look smooth.
const PERIOD: Duration = Duration::from_millis(40);

/// Sides of the polygon that is drawn for a circle.
const SIDES: u32 = 24;

/// Draws the states of a plant.
pub struct PictureScene {
    system: Arc<dyn System>,
    /// Run time of the next picture; `None` before the first.
    next: Option<Time>,
}

impl PictureScene {
    /// Nothing is drawn yet.
    pub fn new(system: Arc<dyn System>) -> Self {
        Self { system, next: None }
    }

    /// Draws `states`.
    pub fn add(&mut self, stream: &BatchStream, states: &Rows) -> Written {
        let mut times = Vec::new();
        let mut drawing = SceneDrawing::default();
        for (head, row) in states.iter() {
            if self.next.is_some_and(|next| head.at < next) {
                continue;
            }
            let Some(picture) = self.system.robot().picture(row) else {
                continue;
            };
            let first = self.next.replace(head.at + PERIOD).is_none();
            let (still, moving): (Vec<_>, Vec<_>) = picture
                .shapes
                .iter()
                .partition(|(style, _)| *style == Style::Scenery);
            if first {
                let mut scenery = SceneDrawing::default();
                scenery.add(&still);
                scenery.log(&stream.rec)?;
            }
            drawing.add(&moving);
            times.push(head.at);
        }
        drawing.send(stream, &times)
    }
}

/// Lines and labels, picture after picture.
#[derive(Default)]
struct SceneDrawing {
    lines: Vec<Vec<[f32; 2]>>,
    colours: Vec<Color>,
    widths: Vec<Radius>,
    texts: Vec<String>,
    places: Vec<[f32; 2]>,
    /// Lines and labels in each picture.
    counts: Vec<[usize; 2]>,
}

impl SceneDrawing {
    /// Adds a picture of `shapes`.
    fn add(&mut self, shapes: &[&(Style, Shape)]) {
        let before = [self.lines.len(), self.texts.len()];
        for (style, shape) in shapes {
            if let Shape::Label { at, text } = shape {
                self.places.push(point(*at));
                self.texts.push(text.clone());
            } else {
                let (colour, width) = look(*style);
                self.lines.push(outline(shape));
                self.colours.push(colour);
                self.widths.push(Radius::new_ui_points(width));
            }
        }
        let after = [self.lines.len(), self.texts.len()];
        self.counts
            .push([after[0] - before[0], after[1] - before[1]]);
    }

    fn archetypes(self) -> (LineStrips2D, Points2D) {
        let lines = LineStrips2D::new(self.lines)
            .with_colors(self.colours)
            .with_radii(self.widths);
        (lines, Points2D::new(self.places).with_labels(self.texts))
    }

    /// Logs what does not change.
    fn log(self, rec: &RecordingStream) -> Written {
        let (lines, labels) = self.archetypes();
        rec.log_static(SCENERY, &[&lines as &dyn AsComponents, &labels])
    }

    /// Logs a picture for each of `times`.
    fn send(self, stream: &BatchStream, times: &[Time]) -> Written {
        let of_lines: Vec<usize> = self.counts.iter().map(|[lines, _]| *lines).collect();
        let of_labels: Vec<usize> = self.counts.iter().map(|[_, labels]| *labels).collect();
        let (lines, labels) = self.archetypes();
        let (lines, labels) = (lines.columns(of_lines)?, labels.columns(of_labels)?);
        stream.send(PICTURE, times, lines.chain(labels))
    }
}

/// Colour and width (points).
fn look(style: Style) -> (Color, f32) {
    match style {
        Style::Scenery => (GREY, 1.0),
        Style::Limit => (ORANGE, 1.0),
        Style::Body => (BLUE, 2.0),
        Style::Subject => (WHITE, 3.0),
        Style::Action => (ORANGE, 3.0),
    }
}

/// Returns the line around `shape`, or along it; a label has none.
fn outline(shape: &Shape) -> Vec<[f32; 2]> {
    match shape {
        Shape::Segment { from, to } => vec![point(*from), point(*to)],
        Shape::Box {
            centre: [x, y],
            half: [width, height],
            angle,
        } => {
            let (sin, cos) = angle.sin_cos();
            let sides = [
                (1.0, 1.0),
                (-1.0, 1.0),
                (-1.0, -1.0),
                (1.0, -1.0),
                (1.0, 1.0),
            ];
            let corners = sides.map(|(right, up)| {
                let (dx, dy) = (right * width, up * height);
                point([x + dx * cos - dy * sin, y + dx * sin + dy * cos])
            });
            corners.to_vec()
        }
        Shape::Circle {
            centre: [x, y],
            radius,
        } => (0..=SIDES)
            .map(|side| TAU * f64::from(side) / f64::from(SIDES))
            .map(|turn| point([x + radius * turn.cos(), y + radius * turn.sin()]))
            .collect(),
        Shape::Outline { corners } => corners
            .iter()
            .chain(corners.first())
            .copied()
            .map(point)
            .collect(),
        Shape::Label { .. } => Vec::new(),
    }
}

/// Returns a point as the viewer has it: y down.
fn point([x, y]: [f64; 2]) -> [f32; 2] {
    [x as f32, -y as f32]
}
