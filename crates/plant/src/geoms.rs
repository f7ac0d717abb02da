//! What is drawn of a robot: the hulls of its geoms, each on its body.

use std::f64::consts::PI;

use mujoco_rs::{
    prelude::MjModel,
    wrappers::{fun::utility::mju_rot_vec_quat, mj_model::MjtGeomBase},
};
use ratelab_system::GeomRecord;

use crate::rounding::rounded;

/// The last group of geoms that is for the eye.
const LAST_GROUP: i32 = 2;

/// The most points of a geom: as many directions are looked along for its corners.
const MOST_POINTS: usize = 200;

/// The most geoms of a robot.
const MOST_GEOMS: usize = 5000;

/// The corners of a polygon that is drawn for a circle.
pub(crate) const CIRCLE: usize = 24;

/// The colour of geoms that name none: a material comes before it.
const NO_COLOUR: [f32; 4] = [0.5, 0.5, 0.5, 1.0];

/// Returns the geoms to draw: on each body the ones for the eye, or all where it has none.
pub(crate) fn drawn(model: &MjModel) -> Vec<GeomRecord> {
    let bodies = model.geom_bodyid();
    let all = 0..bodies.len();
    let has_shown = |body| {
        all.clone()
            .any(|geom| bodies[geom] == body && is_shown(model, geom))
    };
    all.clone()
        .filter(|geom| is_shown(model, *geom) || !has_shown(bodies[*geom]))
        .filter_map(|geom| hull(model, geom))
        .take(MOST_GEOMS)
        .collect()
}

/// Returns whether geoms of a recording can be drawn on a model with so many bodies.
pub(crate) fn are_sound(geoms: &[GeomRecord], bodies: usize) -> bool {
    let is_sound = |geom: &GeomRecord| {
        let numbers = geom.points.as_flattened().iter();
        let mut numbers = numbers.chain(geom.normal.as_slice().as_flattened());
        geom.body < bodies
            && (1..=MOST_POINTS).contains(&geom.points.len())
            && geom.radius >= 0.0
            && geom.radius.is_finite()
            && numbers.all(|number| number.is_finite())
    };
    geoms.len() <= MOST_GEOMS && geoms.iter().all(is_sound)
}

fn is_shown(model: &MjModel, geom: usize) -> bool {
    let own = model.geom_rgba()[geom];
    let material = usize::try_from(model.geom_matid()[geom]).ok();
    let of_material = material.and_then(|material| model.mat_rgba().get(material));
    let [.., alpha] = *of_material.filter(|_| own == NO_COLOUR).unwrap_or(&own);
    model.geom_group()[geom] <= LAST_GROUP && alpha > 0.0
}

/// Returns the hull of a geom; `None` for one without its points.
fn hull(model: &MjModel, geom: usize) -> Option<GeomRecord> {
    let [x, y, z] = model.geom_size()[geom];
    let mut normal = None;
    let (points, radius) = match model.geom_type()[geom] {
        MjtGeomBase::mjGEOM_PLANE => {
            normal = Some([0.0, 0.0, 1.0]);
            (vec![[0.0; 3]], 0.0)
        }
        MjtGeomBase::mjGEOM_SPHERE => (vec![[0.0; 3]], x),
        MjtGeomBase::mjGEOM_CAPSULE => (vec![[0.0, 0.0, -y], [0.0, 0.0, y]], x),
        MjtGeomBase::mjGEOM_CYLINDER => {
            let rings = [-y, y]
                .into_iter()
                .flat_map(|end| circle(x).map(move |[right, up]| [right, up, end]));
            (rings.collect(), 0.0)
        }
        MjtGeomBase::mjGEOM_BOX => {
            let corner = |number: usize| {
                let side = |bit: usize, half: f64| if number & bit == 0 { -half } else { half };
                [side(1, x), side(2, y), side(4, z)]
            };
            ((0..8).map(corner).collect(), 0.0)
        }
        MjtGeomBase::mjGEOM_ELLIPSOID => {
            let points = directions().map(|[right, ahead, up]| [x * right, y * ahead, z * up]);
            (points.collect(), 0.0)
        }
        MjtGeomBase::mjGEOM_MESH | MjtGeomBase::mjGEOM_SDF => (mesh_corners(model, geom)?, 0.0),
        MjtGeomBase::mjGEOM_HFIELD => (field_corners(model, geom)?, 0.0),
    };
    let (place, turn) = (model.geom_pos()[geom], model.geom_quat()[geom]);
    let in_body = |point: [f64; 3]| {
        let [x, y, z] = rotated(turn, point);
        [x + place[0], y + place[1], z + place[2]].map(short)
    };
    Some(GeomRecord {
        body: usize::try_from(model.geom_bodyid()[geom]).ok()?,
        points: points.into_iter().map(in_body).collect(),
        radius: short(radius),
        normal: normal.map(|normal| rotated(turn, normal).map(short)),
    })
}

/// Returns a length that is exact to a thousandth of a millimetre.
fn short(length: f64) -> f64 {
    rounded(length, -6)
}

/// Returns the corners of a mesh.
fn mesh_corners(model: &MjModel, geom: usize) -> Option<Vec<[f64; 3]>> {
    let mesh = usize::try_from(model.geom_dataid()[geom]).ok()?;
    let first = usize::try_from(*model.mesh_vertadr().get(mesh)?).ok()?;
    let count = usize::try_from(*model.mesh_vertnum().get(mesh)?).ok()?;
    let vertices = model.mesh_vert().get(first..first + count)?;
    Some(corners(
        vertices
            .iter()
            .map(|vertex| vertex.map(f64::from))
            .collect(),
    ))
}

/// Returns the corners of a height field.
fn field_corners(model: &MjModel, geom: usize) -> Option<Vec<[f64; 3]>> {
    let field = usize::try_from(model.geom_dataid()[geom]).ok()?;
    let [half_x, half_y, top, bottom] = *model.hfield_size().get(field)?;
    let number = |list: &[i32]| usize::try_from(*list.get(field)?).ok();
    let (rows, columns) = (number(model.hfield_nrow())?, number(model.hfield_ncol())?);
    let first = number(model.hfield_adr())?;
    let heights = model.hfield_data().get(first..first + rows * columns)?;
    let share = |index: usize, count: usize| 2.0 * index as f64 / (count.max(2) - 1) as f64 - 1.0;
    let points = heights.iter().enumerate().flat_map(|(index, height)| {
        let x = half_x * share(index % columns, columns);
        let y = half_y * share(index / columns, rows);
        [[x, y, top * f64::from(*height)], [x, y, -bottom]]
    });
    Some(corners(points.collect()))
}

/// Returns the points that are farthest along each direction, each once.
fn corners(points: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
    let farthest = |direction: [f64; 3]| {
        let along = |point: &[f64; 3]| point.iter().zip(direction).map(|(x, d)| x * d).sum::<f64>();
        let mut all = points.iter().enumerate();
        let first = all.next().map(|(index, point)| (index, along(point)));
        let farther = all.fold(first, |best, (index, point)| match best {
            Some((_, reach)) if along(point) <= reach => best,
            _ => Some((index, along(point))),
        });
        farther.map(|(index, _)| index)
    };
    let mut indices: Vec<usize> = directions().filter_map(farthest).collect();
    indices.sort_unstable();
    indices.dedup();
    indices.into_iter().map(|index| points[index]).collect()
}

/// Directions that are spread over a sphere, by a spiral of equal areas.
fn directions() -> impl Iterator<Item = [f64; 3]> {
    let turn = PI * (3.0 - 5_f64.sqrt());
    (0..MOST_POINTS).map(move |index| {
        let z = 1.0 - (2 * index + 1) as f64 / MOST_POINTS as f64;
        let (sin, cos) = (turn * index as f64).sin_cos();
        let across = (1.0 - z * z).sqrt();
        [across * cos, across * sin, z]
    })
}

/// Returns the corners of a polygon around a circle at the origin.
pub(crate) fn circle(radius: f64) -> impl Iterator<Item = [f64; 2]> {
    (0..CIRCLE).map(move |corner| {
        let (sin, cos) = (2.0 * PI * corner as f64 / CIRCLE as f64).sin_cos();
        [radius * cos, radius * sin]
    })
}

/// Returns a vector turned by a quaternion.
fn rotated(quaternion: [f64; 4], vector: [f64; 3]) -> [f64; 3] {
    let mut turned = [0.0; 3];
    mju_rot_vec_quat(&mut turned, &vector, &quaternion);
    turned
}
