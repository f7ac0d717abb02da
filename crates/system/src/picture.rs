//! The picture of a plant, as data.

use serde::Serialize;

/// A plant seen from one side: lengths in metres, x to the right, y up, angles
/// counterclockwise in radians.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Its parts, from back to front.
    pub shapes: Vec<(Style, Shape)>,
    /// The preferred visible area: left, bottom, right, top.
    pub view: [f64; 4],
    /// The point that stays visible where there is less room.
    pub focus: [f64; 2],
    /// Figures printed with it, such as `angle +0.12°`.
    pub captions: Vec<String>,
}

/// A part of a [`Picture`].
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A straight line.
    Segment {
        /// One end (m).
        from: [f64; 2],
        /// The other end (m).
        to: [f64; 2],
    },
    /// A rectangle.
    Box {
        /// Centre (m).
        centre: [f64; 2],
        /// Half its width and half its height (m).
        half: [f64; 2],
        /// Rotation (rad).
        angle: f64,
    },
    /// A circle.
    Circle {
        /// Centre (m).
        centre: [f64; 2],
        /// Radius (m).
        radius: f64,
    },
    /// A text.
    Label {
        /// Anchor (m): the text hangs centred below this point.
        at: [f64; 2],
        /// The text.
        text: String,
    },
}

/// The role of a part of a [`Picture`], which decides how it is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Style {
    /// A fixed part: a floor, a rail.
    Scenery,
    /// A border that the plant must not cross.
    Limit,
    /// The robot.
    Body,
    /// The part to watch, such as the pole: shows whether the run is lost.
    Subject,
    /// An action on the plant: a force.
    Action,
}
