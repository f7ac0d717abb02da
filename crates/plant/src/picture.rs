//! A robot as a picture: the outlines of its geoms, seen along an axis of the world.

use std::sync::Mutex;

use mujoco_rs::prelude::MjtTrn;
use ratelab::sync::lock;
use ratelab_system::{GeomRecord, Picture, Shape, Style};

use crate::{
    BodyData,
    geoms::circle,
    hull::hull,
    model::{AXES, JointKind, RobotModel},
    robot::{Robot, SharedRobot},
};

/// How much larger than the robot the frame is.
const ROOM: f64 = 1.12;

/// The distance of the floor, in heights of that, from which it is not in the frame.
const FAR_FLOOR: f64 = 0.6;

/// The cosine between a plane's normal and the line of sight up to which the plane is a line.
const EDGE_ON: f64 = 0.1;

/// Half the length of such a line, in sizes of the frame.
const LONG: f64 = 3.0;

/// How much more an axis must show to be looked along before another one.
const CLEARLY: f64 = 1e-9;

/// The most joints whose deviations are all in the captions.
const FEW: usize = 3;

/// What is seen along an axis of the world: the axes to the right and up.
#[derive(Clone, Copy, Debug)]
struct Sight {
    along: usize,
    right: usize,
    up: usize,
}

/// The sights, the first of several equal ones first.
const SIGHTS: [Sight; 3] = [
    Sight {
        along: 1,
        right: 0,
        up: 2,
    },
    Sight {
        along: 2,
        right: 0,
        up: 1,
    },
    Sight {
        along: 0,
        right: 1,
        up: 2,
    },
];

impl Sight {
    /// Returns the point of the picture for a point of the world.
    fn seen(self, point: [f64; 3]) -> [f64; 2] {
        [point[self.right], point[self.up]]
    }
}

/// The least and the greatest numbers of points: left, bottom, right, top.
#[derive(Clone, Copy, Debug)]
struct Frame([f64; 4]);

impl Frame {
    const EMPTY: Self = Self([
        f64::INFINITY,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NEG_INFINITY,
    ]);

    fn with(self, [x, y]: [f64; 2], radius: f64) -> Self {
        let Self([left, bottom, right, top]) = self;
        Self([
            left.min(x - radius),
            bottom.min(y - radius),
            right.max(x + radius),
            top.max(y + radius),
        ])
    }

    /// Returns the frame around `geom` too.
    fn around(self, data: &BodyData, sight: Sight, geom: &GeomRecord) -> Self {
        points(data, sight, geom).fold(self, |frame, point| frame.with(point, geom.radius))
    }

    fn has(self, [x, y]: [f64; 2]) -> bool {
        let Self([left, bottom, right, top]) = self;
        (left..=right).contains(&x) && (bottom..=top).contains(&y)
    }

    fn size(self) -> [f64; 2] {
        let Self([left, bottom, right, top]) = self;
        [right - left, top - bottom]
    }

    fn centre(self) -> [f64; 2] {
        let Self([left, bottom, right, top]) = self;
        [(left + right) / 2.0, (bottom + top) / 2.0]
    }

    /// Returns the frame with room around, never flat.
    fn roomy(self) -> Self {
        let ([x, y], [width, height]) = (self.centre(), self.size());
        let least = (width.max(height) / 10.0).max(1e-3);
        let half = [width, height].map(|length| (length * ROOM).max(least) / 2.0);
        Self([x - half[0], y - half[1], x + half[0], y + half[1]])
    }
}

/// Draws a robot.
pub(crate) struct RobotPainter {
    robot: SharedRobot,
    data: Mutex<BodyData>,
    /// The sights, the one that shows most of the motion first, each with its frame.
    sights: Vec<(Sight, Frame)>,
    /// The style of each body.
    styles: Vec<Style>,
}

impl RobotPainter {
    /// The number of sides that it draws.
    pub(crate) const SIDES: usize = SIGHTS.len();

    /// Looks at `robot` in its reference; `None` where MuJoCo has no room for it.
    pub(crate) fn new(robot: SharedRobot) -> Option<Self> {
        let mut data = robot.model.body().ok()?;
        robot.at.put_into(&mut data);
        data.kinematics();
        let styles = styles(&robot);
        let mut painter = Self {
            sights: Vec::new(),
            data: Mutex::new(data),
            styles,
            robot,
        };
        let data = lock(&painter.data);
        let shown = SIGHTS.map(|sight| motion(&painter.robot.model, &data, sight));
        let best = (1..SIGHTS.len()).fold(0, |best, index| {
            if shown[index] > shown[best] + CLEARLY {
                index
            } else {
                best
            }
        });
        let framed = (0..SIGHTS.len())
            .map(|turn| SIGHTS[(best + turn) % SIGHTS.len()])
            .map(|sight| (sight, painter.frame(&data, sight)));
        let sights = framed.collect();
        drop(data);
        painter.sights = sights;
        Some(painter)
    }

    /// Draws a row of `/state` from the side with this number.
    pub(crate) fn draw(&self, side: usize, row: &[f64]) -> Option<Picture> {
        let (sight, frame) = *self.sights.get(side % self.sights.len())?;
        let (_, state) = row.split_at_checked(self.robot.half.len())?;
        let deviation = self.robot.deviation(state)?;
        let mut data = lock(&self.data);
        let places = data.qpos_mut();
        places.copy_from_slice(state.get(..places.len())?);
        data.kinematics();
        let shapes = self.robot.model.geoms.iter().filter_map(|geom| {
            let shape = match geom.normal {
                Some(normal) => floor(&data, sight, frame, (geom, normal))?,
                None => outline(&data, sight, geom)?,
            };
            Some((*self.styles.get(geom.body)?, shape))
        });
        let arms = self.arms(&data, sight);
        let view = arms.iter().fold(frame, |frame, (_, arm)| match arm {
            Shape::Segment { from, .. } => frame.with(*from, 0.0),
            _ => frame,
        });
        let shapes = shapes.chain(arms);
        // What stands still is behind all that moves.
        let (still, moving): (Vec<_>, Vec<_>) =
            shapes.partition(|(style, _)| *style == Style::Scenery);
        Some(Picture {
            shapes: still.into_iter().chain(moving).collect(),
            view: view.0,
            focus: self.moving(&data, sight).centre(),
            captions: self.captions(sight, frame, &deviation),
        })
    }

    /// Returns lines to the bodies that are held from outside of their geoms, such as the mass of a
    /// pendulum.
    fn arms(&self, data: &BodyData, sight: Sight) -> Vec<(Style, Shape)> {
        let model = &self.robot.model;
        let hinges = model.joints.iter().zip(model.mujoco.jnt_bodyid());
        let hinges = hinges
            .zip(data.xanchor())
            .filter(|((joint, _), _)| [JointKind::Hinge, JointKind::Ball].contains(&joint.kind));
        let arms = hinges.filter_map(|((_, body), anchor)| {
            let (body, from) = (*body as usize, sight.seen(*anchor));
            let own = |geom: &&GeomRecord| geom.body == body && geom.normal.is_none();
            let around = model.geoms.iter().filter(own);
            let around = around.fold(Frame::EMPTY, |frame, geom| frame.around(data, sight, geom));
            let is_outside = around.size()[0].is_finite() && !around.has(from);
            let line = Shape::Segment {
                from,
                to: around.centre(),
            };
            is_outside.then(|| Some((*self.styles.get(body)?, line)))?
        });
        arms.collect()
    }

    /// Returns what moves, as it is now.
    fn moving(&self, data: &BodyData, sight: Sight) -> Frame {
        self.robot
            .model
            .geoms
            .iter()
            .filter(|geom| self.styles.get(geom.body) != Some(&Style::Scenery))
            .fold(Frame::EMPTY, |frame, geom| frame.around(data, sight, geom))
    }

    /// Returns what moves, with room around it, and the floor if that is near.
    fn frame(&self, data: &BodyData, sight: Sight) -> Frame {
        let moving = self.moving(data, sight);
        if !moving.size().iter().all(|length| length.is_finite()) {
            return Frame([-1.0, -1.0, 1.0, 1.0]);
        }
        let Frame([left, bottom, right, top]) = moving.roomy();
        let floors = self.robot.model.geoms.iter().filter_map(|geom| {
            let up = turned(data, geom, geom.normal?)[sight.up];
            let [_, height] = points(data, sight, geom).next()?;
            (up > 1.0 - EDGE_ON).then_some(height)
        });
        let near = floors
            .filter(|height| *height <= bottom && bottom - height <= FAR_FLOOR * (top - bottom));
        Frame([left, near.fold(bottom, f64::min), right, top])
    }

    /// Returns what is seen, and how far joints are from the reference.
    fn captions(&self, sight: Sight, frame: Frame, deviation: &[f64]) -> Vec<String> {
        let (right, up) = (AXES[sight.right], AXES[sight.up]);
        let mut captions = vec![format!("{right} →, {up} ↑, {:.2} m wide", frame.size()[0])];
        let limits = self.robot.limits.iter().enumerate();
        let limited: Vec<usize> = limits
            .filter(|(_, limit)| limit.is_finite())
            .map(|(index, _)| index)
            .collect();
        let share = |index: usize| (deviation[index] / self.robot.limits[index]).abs();
        let caption = |index: &usize| {
            let (name, unit) = (self.robot.coordinate(*index), self.robot.unit(*index));
            let (percent, limit) = (100.0 * share(*index), self.robot.limits[*index]);
            format!("{name} {percent:.0} % of {limit} {unit}")
        };
        if limited.len() <= FEW {
            captions.extend(limited.iter().map(caption));
        } else {
            let nearest = limited
                .iter()
                .max_by(|a, b| share(**a).total_cmp(&share(**b)));
            captions.extend(nearest.map(caption));
        }
        captions
    }
}

/// Returns how much of the motion of all joints is seen.
fn motion(model: &RobotModel, data: &BodyData, sight: Sight) -> f64 {
    let seen = data
        .xaxis()
        .iter()
        .zip(&*model.joints)
        .map(|(axis, joint)| {
            let along = axis[sight.along].abs();
            match joint.kind {
                JointKind::Hinge => along,
                JointKind::Slide => (1.0 - along) / 2.0,
                JointKind::Free | JointKind::Ball if sight.along == 1 => 0.5,
                JointKind::Free | JointKind::Ball => 0.0,
            }
        });
    seen.sum()
}

/// Returns the style of each body: what stands still, what loses the run, and what moves all else.
fn styles(robot: &Robot) -> Vec<Style> {
    let mujoco = &robot.model.mujoco;
    let driven: Vec<i32> = mujoco
        .actuator_trntype()
        .iter()
        .zip(mujoco.actuator_trnid())
        .filter(|(kind, _)| **kind == MjtTrn::mjTRN_JOINT)
        .map(|(_, [joint, _])| *joint)
        .collect();
    let mut watched = Vec::new();
    for ((index, joint), body) in (0..).zip(&*robot.model.joints).zip(mujoco.jnt_bodyid()) {
        let [_, numbers] = joint.numbers();
        let is_limited = robot.limits[joint.speed..joint.speed + numbers]
            .iter()
            .any(|limit| limit.is_finite());
        if is_limited && !driven.contains(&index) {
            watched.push(*body);
        }
    }
    let roots = mujoco.body_weldid();
    let of_body = |(body, root): (i32, &i32)| {
        let is_still = *root == 0 || mujoco.body_dofnum()[*root as usize] == 0;
        let is_watched = |body| watched.is_empty() || watched.contains(body);
        if is_still {
            Style::Scenery
        } else if is_watched(&body) || is_watched(root) {
            Style::Subject
        } else {
            Style::Body
        }
    };
    (0..).zip(roots).map(of_body).collect()
}

/// Returns a vector in the frame of the body of `geom`, in the world.
fn turned(data: &BodyData, geom: &GeomRecord, vector: [f64; 3]) -> [f64; 3] {
    let rows = data.xmat()[geom.body];
    [0, 3, 6].map(|row| {
        (0..3)
            .map(|column| rows[row + column] * vector[column])
            .sum()
    })
}

/// Returns the points of `geom` in the picture.
fn points<'d>(
    data: &'d BodyData,
    sight: Sight,
    geom: &'d GeomRecord,
) -> impl Iterator<Item = [f64; 2]> + 'd {
    let [x, y, z] = data.xpos()[geom.body];
    geom.points.iter().map(move |point| {
        let [a, b, c] = turned(data, geom, *point);
        sight.seen([a + x, b + y, c + z])
    })
}

/// Returns the outline of `geom`.
fn outline(data: &BodyData, sight: Sight, geom: &GeomRecord) -> Option<Shape> {
    let radius = geom.radius;
    let points: Vec<[f64; 2]> = points(data, sight, geom).collect();
    match points[..] {
        [] => None,
        [centre] if radius > 0.0 => Some(Shape::Circle { centre, radius }),
        _ if radius > 0.0 => {
            let balls = points
                .iter()
                .flat_map(|[x, y]| circle(radius).map(move |[right, up]| [x + right, y + up]));
            let corners = hull(balls.collect());
            Some(Shape::Outline { corners })
        }
        _ => {
            let corners = hull(points);
            Some(Shape::Outline { corners })
        }
    }
}

/// Returns the line of a plane that is seen from its edge.
fn floor(
    data: &BodyData,
    sight: Sight,
    frame: Frame,
    (geom, normal): (&GeomRecord, [f64; 3]),
) -> Option<Shape> {
    let normal = turned(data, geom, normal);
    if normal[sight.along].abs() > EDGE_ON {
        return None;
    }
    let [x, y] = points(data, sight, geom).next()?;
    let [across, up] = sight.seen(normal);
    let length = across.hypot(up);
    let (along, [middle_x, middle_y]) = ([up / length, -across / length], frame.centre());
    // The point of the line that is nearest to the middle of the frame.
    let way = (middle_x - x) * along[0] + (middle_y - y) * along[1];
    let reach = LONG * frame.size().into_iter().fold(0.0, f64::max);
    let [from, to] = [way - reach, way + reach].map(|way| [x + way * along[0], y + way * along[1]]);
    Some(Shape::Segment { from, to })
}
