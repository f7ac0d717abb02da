//! Cart and pole in space: x along the rail, z up, metres.

use ratelab::{
    cartpole::{CART_LIMIT_M, ControlStep, POLE_LIMIT_RAD},
    runtime::Message,
};
use rerun::{
    AlbedoFactor, Arrows3D, AsComponents, Boxes3D, Capsules3D, FillMode, LineStrips3D, Mesh3D,
    Quaternion, RecordingStream, RecordingStreamResult, Transform3D, ViewCoordinates,
};

use super::palette::{BLUE, GREY, ORANGE, WHITE, translucent};
use crate::recording::timeline::Stamps;

/// Everything in space.
pub const WORLD: &str = "world";

const RAIL: &str = "world/rail";
const CART: &str = "world/cart";
const LIMITS: &str = "world/cart/fall_limits";

/// Half the size of the cart (m).
const CART_HALF: [f32; 3] = [0.1, 0.05, 0.05];

/// Length and radius of the pole (m).
const POLE_LENGTH: f32 = 1.0;
const POLE_RADIUS: f32 = 0.02;

/// Length of the arrow of the motor's full force (m).
const FORCE_ARROW: f32 = 0.6;

/// How far in front of the cart the arrow is, so that the cart does not hide
/// it (m).
const FRONT: f32 = -0.08;

/// Where the fall limits meet: behind the pole, which is round.
const HUB: [f32; 3] = [0.0, 0.08, 0.0];

/// What does not move, and how what moves looks.
pub fn begin(rec: &RecordingStream) -> RecordingStreamResult<()> {
    rec.log_static(WORLD, &ViewCoordinates::RIGHT_HAND_Z_UP())?;
    rec.log_static(RAIL, &[&rail() as &dyn AsComponents, &end_stops()])?;
    let cart = solid(Boxes3D::from_half_sizes([CART_HALF])).with_colors([BLUE]);
    let pole = Capsules3D::from_lengths_and_radii([POLE_LENGTH], [POLE_RADIUS])
        .with_fill_mode(FillMode::Solid)
        .with_colors([WHITE]);
    let force = Arrows3D::update_fields()
        .with_origins([[0.0, FRONT, 0.0]])
        .with_radii([0.03])
        .with_colors([ORANGE]);
    rec.log_static(CART, &[&cart as &dyn AsComponents, &pole, &force])?;
    rec.log_static(LIMITS, &[&fall_edges() as &dyn AsComponents, &fall_wedge()])
}

/// Where `steps` moved cart and pole, and by what force. One entity: what a
/// cart carries moves with it, and the pole turns about the cart's middle.
pub fn add(
    rec: &RecordingStream,
    stamps: &Stamps,
    steps: &[Message<ControlStep>],
) -> RecordingStreamResult<()> {
    let steps = steps.iter().map(|message| &message.data);
    let places = steps.clone().map(|step| [step.qpos[0] as f32, 0.0, 0.0]);
    let turns = steps.clone().map(|step| about_y(step.qpos[1]));
    let forces = steps.map(|step| [FORCE_ARROW * step.action.0, 0.0, 0.0]);
    let cart = Transform3D::update_fields()
        .with_many_translation(places)
        .columns_of_unit_batches()?;
    let pole = Capsules3D::update_fields()
        .with_quaternions(turns)
        .columns_of_unit_batches()?;
    let force = Arrows3D::update_fields()
        .with_vectors(forces)
        .columns_of_unit_batches()?;
    rec.send_columns(CART, stamps.columns(), cart.chain(pole).chain(force))
}

/// The rotation by `angle` (rad) about +y, which leans +z towards +x.
fn about_y(angle: f64) -> Quaternion {
    let (sin, cos) = (angle / 2.0).sin_cos();
    Quaternion::from_xyzw([0.0, sin as f32, 0.0, cos as f32])
}

fn rail() -> LineStrips3D {
    let end = CART_LIMIT_M as f32;
    let strip = [[-end, 0.0, 0.0], [end, 0.0, 0.0]];
    LineStrips3D::new([strip])
        .with_colors([GREY])
        .with_radii([0.01])
}

fn end_stops() -> Boxes3D {
    let [x, y, z] = CART_HALF;
    // A cart is lost when its middle is beyond the limit.
    let places = [-1.0, 1.0].map(|side| [side * CART_LIMIT_M as f32, 0.0, 0.0]);
    let stops = Boxes3D::from_centers_and_half_sizes(places, [[0.2 * x, 1.5 * y, 1.5 * z]]);
    solid(stops).with_colors([ORANGE])
}

fn solid(boxes: Boxes3D) -> Boxes3D {
    boxes.with_fill_mode(FillMode::Solid)
}

/// The edges of the sector that the pole must not leave.
fn fall_edges() -> LineStrips3D {
    LineStrips3D::new([[rim(-1.0), HUB, rim(1.0)]])
        .with_colors([ORANGE])
        .with_radii([0.006])
}

/// The sector itself.
fn fall_wedge() -> Mesh3D {
    let rims = (-4..=4).map(|step| rim(f64::from(step) / 4.0));
    Mesh3D::new(std::iter::once(HUB).chain(rims))
        .with_triangle_indices((1..9).map(|first| [0, first, first + 1]))
        .with_albedo_factor(AlbedoFactor(*translucent(ORANGE, 40)))
}

/// A point on the sector's rim, at a share of the limit (−1 to 1).
fn rim(share: f64) -> [f32; 3] {
    let reach = f64::from(1.1 * POLE_LENGTH);
    let (sin, cos) = (share * POLE_LIMIT_RAD).sin_cos();
    [(reach * sin) as f32, HUB[1], (reach * cos) as f32]
}
