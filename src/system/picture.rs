//! The picture of a plant, as data.

/// A plant seen from one side: lengths in metres, x to the right, y up, angles
/// counter-clockwise in radians.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Its parts, from back to front.
    pub shapes: Vec<(Style, Shape)>,
    /// What is always in sight, if there is room: left, bottom, right, top.
    pub view: [f64; 4],
    /// What must be in sight, where there is less room: a point.
    pub focus: [f64; 2],
    /// Figures to be printed with it, such as `angle +0.12°`.
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
        /// Its middle (m).
        centre: [f64; 2],
        /// Half its width and half its height (m).
        half: [f64; 2],
        /// By how much it is turned (rad).
        angle: f64,
    },
    /// A circle.
    Circle {
        /// Its middle (m).
        centre: [f64; 2],
        /// Its radius (m).
        radius: f64,
    },
    /// A text.
    Label {
        /// What it is of (m): it hangs under this point, in the middle.
        at: [f64; 2],
        /// The text.
        text: String,
    },
}

/// What a part of a [`Picture`] stands for, which decides how it is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// What stands still: a floor, a rail.
    Scenery,
    /// A border that must not be crossed.
    Limit,
    /// The robot.
    Body,
    /// The part to look at, such as the pole: shows whether the run is lost.
    Subject,
    /// What is done to the plant: a force.
    Action,
}
