//! What is known of a robot and its plant beside the graph: what they look like, and how their
//! states are written.

use ratelab::Time;
use serde::{Deserialize, Serialize};

use crate::{Planning, Setup};

/// The robot of a [`System`](crate::System), which returns it from
/// [`System::robot`](crate::System::robot).
pub trait RobotInfo {
    /// Draws the plant, from the newest message on the topic of [states](crate::About::state).
    fn picture(&self, state: &[f64]) -> Option<Picture> {
        let _ = state;
        None
    }

    /// Returns the number of sides from which the plant can be seen.
    fn sides(&self) -> usize {
        1
    }

    /// Draws the plant from the side with this number, counted from 0: that of
    /// [`picture`](Self::picture).
    fn picture_from(&self, side: usize, state: &[f64]) -> Option<Picture> {
        let _ = side;
        self.picture(state)
    }

    /// Returns the table format of its states, if it differs from run time and numbers.
    fn table(&self) -> Option<StateTable> {
        None
    }

    /// Returns the engine of its plant, with the version, such as `MuJoCo` and `3.9.0`: another
    /// version may compute other bits. Recordings contain it.
    fn engine(&self) -> Option<(&str, &str)> {
        None
    }

    /// Returns the topics whose messages are joint states for other robot software.
    fn joints(&self) -> &'static [Joints] {
        &[]
    }

    /// Returns where its plans are, if it plans ahead.
    fn planning(&self) -> Option<Planning> {
        None
    }

    /// Returns a knob, as text, that keeps the plant safe where an action may cease to arrive: a
    /// setting of runs in several processes. `setup` is that of the run.
    fn watchdog(&self, setup: &Setup) -> Option<String> {
        let _ = setup;
        None
    }
}

/// The format of a system's states as comma-separated values, for systems with a format
/// of their own.
#[derive(Clone, Copy, Debug)]
pub struct StateTable {
    /// Comma-separated names of the columns.
    pub header: &'static str,
    /// Writes a row from run time and state.
    pub row: fn(Time, &[f64]) -> String,
    /// Comma-separated names of columns that stand behind all others.
    pub more: &'static str,
    /// Writes the cells of these columns from a state.
    pub more_cells: fn(&[f64]) -> String,
}

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
    /// A closed line.
    Outline {
        /// Its corners (m).
        corners: Vec<[f64; 2]>,
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

/// The numbers of a joint state.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointValues {
    /// Positions (rad or m).
    pub position: Vec<f64>,
    /// Velocities (rad/s or m/s).
    pub velocity: Vec<f64>,
    /// Efforts (Nm or N).
    pub effort: Vec<f64>,
}

impl JointValues {
    /// Returns whether all numbers are finite.
    pub fn is_finite(&self) -> bool {
        let all = [&self.position, &self.velocity, &self.effort];
        all.into_iter().flatten().all(|number| number.is_finite())
    }
}

/// The messages of a topic as joint states, and back.
#[derive(Clone, Copy, Debug)]
pub struct Joints {
    /// Name of the topic.
    pub topic: &'static str,
    /// Names of the joints.
    pub names: &'static [&'static str],
    /// The joint state of a message, given as the numbers of
    /// [`Fields`](ratelab_metrics::Fields).
    pub of_row: fn(&[f64]) -> Option<JointValues>,
    /// The numbers of the message with this joint state; `None` if values are missing or
    /// not finite.
    pub to_row: fn(&JointValues) -> Option<Vec<f64>>,
}

/// A robot of an MJCF file with the reference that its runs begin at.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlantRecord {
    /// Step of physics (ms).
    pub step_ms: f64,
    /// The compiled physics, as text.
    pub model: String,
    /// The positions of the reference.
    pub positions: Vec<f64>,
    /// The controls there.
    pub controls: Vec<f64>,
    /// The activations there.
    pub activations: Vec<f64>,
    /// What is drawn of the robot: none in recordings of early versions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub geoms: Vec<GeomRecord>,
}

/// A part of a robot as it is drawn: the hull of its points, on a body that moves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GeomRecord {
    /// Index of its body in the model.
    pub body: usize,
    /// Points in the frame of that body (m); one of a plane.
    pub points: Vec<[f64; 3]>,
    /// Radius of the ball around each point (m).
    #[serde(default)]
    pub radius: f64,
    /// The normal of a plane, in the same frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<[f64; 3]>,
}
