//! The equilibrium next to a pose: the reference that a controller holds.

use nalgebra::{DMatrix, DVector};

use crate::{
    BodyData, PlantDefect,
    model::{JointKind, RobotModel},
    model_error::RobotModelError,
    rounding::{digit, rounded},
};

/// What is missing of the weight at most, at a place that counts as held.
const HELD: f64 = 1e-2;

/// What may be missing before the pose is lowered to the ground.
const NEARLY: f64 = 1e-4;

/// The most rounds of a search.
const ROUNDS: usize = 100;

/// A pose with its controls and activations.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Reference {
    pub(crate) positions: Vec<f64>,
    pub(crate) controls: Vec<f64>,
    pub(crate) activations: Vec<f64>,
}

/// Finds the equilibrium next to `given`, rounded.
///
/// # Errors
/// [`PlantDefect`] where nothing holds the pose.
pub(crate) fn found(model: &RobotModel, given: &Reference) -> Result<Reference, PlantDefect> {
    let mut search = ReferenceSearch::new(model)?;
    let first = search.from(given.clone());
    let mut best = first;
    if best.missing() > NEARLY
        && let Some(lowered) = search.lowered(given)
    {
        let second = search.from(lowered);
        if second.missing() < best.missing() {
            best = second;
        }
    }
    if !best.missing().is_finite() {
        let what =
            "MuJoCo finds no finite force in this pose: look at its masses, gears and gravity";
        return Err(PlantDefect::new("mjcf", what));
    }
    if best.missing() > HELD {
        let coordinates = best.forces.iter().take(model.coordinates.len()).enumerate();
        let most = coordinates.max_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs()));
        let joint = most
            .and_then(|(index, _)| model.coordinates.get(index))
            .map_or("", String::as_str);
        let what = format!(
            "nothing holds this pose: {:.0} % of the weight is missing, most at {joint}; try another pose",
            100.0 * best.missing()
        );
        return Err(PlantDefect::new("pose", what));
    }
    let Reference {
        mut positions,
        mut controls,
        mut activations,
    } = best.at;
    for number in positions.iter_mut().chain(&mut activations) {
        *number = rounded(*number, -6);
    }
    for (control, half) in controls.iter_mut().zip(&search.half) {
        *control = rounded(*control, digit(*half, 5));
    }
    model.clip(&mut controls);
    model.mujoco.normalize_quat(&mut positions);
    Ok(Reference {
        positions,
        controls,
        activations,
    })
}

/// A place that a search has reached.
struct Reached {
    at: Reference,
    /// The forces that are missing, as shares of the weight, and the changes of activations.
    forces: DVector<f64>,
}

impl Reached {
    /// Returns the length of all that is missing.
    fn missing(&self) -> f64 {
        self.forces.norm_squared().sqrt()
    }
}

/// A search by Levenberg and Marquardt.
struct ReferenceSearch<'m> {
    model: &'m RobotModel,
    data: BodyData,
    half: Vec<f64>,
    /// The weight, in the unit of forces.
    weight: f64,
}

impl<'m> ReferenceSearch<'m> {
    fn new(model: &'m RobotModel) -> Result<Self, RobotModelError> {
        let gravity = DVector::from_row_slice(&model.mujoco.opt().gravity);
        let mass: f64 = model.mujoco.body_mass().iter().sum();
        Ok(Self {
            model,
            data: model.body()?,
            half: model.half_ranges(),
            weight: mass * gravity.norm().max(1.0),
        })
    }

    /// Goes downhill from `start` for as long as it pays.
    fn from(&mut self, start: Reference) -> Reached {
        let mut here = self.reach(start);
        let mut lambda = 1e-3;
        for _ in 0..ROUNDS {
            let square = here.forces.norm_squared();
            if square < 1e-22 {
                break;
            }
            let slope = self.slope(&here.at);
            let (normal, gradient) = (slope.tr_mul(&slope), slope.tr_mul(&here.forces));
            let scale = slope.amax().powi(2).max(1e-12);
            let mut better = None;
            while better.is_none() && lambda <= 1e9 {
                let damping = lambda * 1e-3 * scale;
                let damped = &normal + DMatrix::identity(normal.nrows(), normal.ncols()) * damping;
                let step = damped.lu().solve(&gradient).map(|step| -step);
                let next = step.map(|step| {
                    let shrink = (0.5 / step.amax()).min(1.0);
                    self.reach(self.moved(&here.at, &(step * shrink)))
                });
                better = next.filter(|next| next.forces.norm_squared() < square);
                lambda = match better {
                    Some(_) => f64::max(lambda / 3.0, 1e-12),
                    None => 4.0 * lambda,
                };
            }
            let Some(next) = better else { break };
            let gain = (square - next.forces.norm_squared()) / square;
            here = next;
            if gain < 1e-10 {
                break;
            }
        }
        here
    }

    /// Returns the place that is `step` away.
    fn moved(&self, from: &Reference, step: &DVector<f64>) -> Reference {
        let [_, coordinates, _, controls] = self.model.sizes();
        let mut to = from.clone();
        let turned: Vec<f64> = step
            .iter()
            .take(coordinates)
            .map(|step| 0.1 * step)
            .collect();
        let mujoco = &self.model.mujoco;
        mujoco.integrate_pos(&mut to.positions, &turned, 1.0);
        let rest = step.as_slice().get(coordinates..).unwrap_or_default();
        let (of_controls, of_activations) = rest.split_at(controls);
        for ((control, step), half) in to.controls.iter_mut().zip(of_controls).zip(&self.half) {
            *control += half * step;
        }
        self.model.clip(&mut to.controls);
        for (activation, step) in to.activations.iter_mut().zip(of_activations) {
            *activation += step;
        }
        to
    }

    /// Returns the forces that are missing at a place.
    fn reach(&mut self, at: Reference) -> Reached {
        self.place(&at);
        self.data.qacc_mut().fill(0.0);
        self.data.inverse();
        let needed = DVector::from_row_slice(self.data.qfrc_inverse());
        self.data.forward();
        let given = DVector::from_row_slice(self.data.qfrc_actuator());
        let missing = (needed - given) / self.weight;
        let changes = self.data.act_dot().iter().copied();
        let forces = missing.iter().copied().chain(changes).collect::<Vec<f64>>();
        Reached {
            at,
            forces: DVector::from_vec(forces),
        }
    }

    fn place(&mut self, at: &Reference) {
        self.data.qpos_mut().copy_from_slice(&at.positions);
        self.data.qvel_mut().fill(0.0);
        self.data.act_mut().copy_from_slice(&at.activations);
        self.data.ctrl_mut().copy_from_slice(&at.controls);
    }

    /// Returns the changes of the missing forces with a step, by centred differences.
    fn slope(&mut self, at: &Reference) -> DMatrix<f64> {
        const SMALL: f64 = 1e-6;
        let [_, coordinates, activations, controls] = self.model.sizes();
        let size = coordinates + controls + activations;
        let columns: Vec<DVector<f64>> = (0..size)
            .map(|index| {
                let mut step = DVector::zeros(size);
                step[index] = SMALL;
                let plus = self.reach(self.moved(at, &step)).forces;
                let minus = self.reach(self.moved(at, &-step)).forces;
                (plus - minus) / (2.0 * SMALL)
            })
            .collect();
        DMatrix::from_columns(&columns)
    }

    /// Returns the pose lowered until it touches the ground; `None` where nothing is below.
    fn lowered(&mut self, given: &Reference) -> Option<Reference> {
        let mut joints = self.model.joints.iter();
        let free = joints.find(|joint| joint.kind == JointKind::Free);
        let axes = self.model.mujoco.jnt_axis();
        let (height, down) = match free {
            Some(joint) => (joint.position + 2, -1.0),
            None => {
                let (index, joint) =
                    self.model
                        .joints
                        .iter()
                        .enumerate()
                        .find(|(index, joint)| {
                            let [x, y, z] = axes[*index];
                            joint.kind == JointKind::Slide && [x, y, z.abs()] == [0.0, 0.0, 1.0]
                        })?;
                (joint.position, -axes[index][2])
            }
        };
        let by = |distance: f64| {
            let mut lowered = given.clone();
            lowered.positions[height] += down * distance;
            lowered
        };
        if !self.touches(&by(1.0)) {
            return None;
        }
        let [mut above, mut below] = [0.0, 1.0];
        for _ in 0..30 {
            let middle = (above + below) / 2.0;
            if self.touches(&by(middle)) {
                below = middle;
            } else {
                above = middle;
            }
        }
        Some(by(below))
    }

    /// Returns whether a geom touches a body that is welded to the world.
    fn touches(&mut self, at: &Reference) -> bool {
        self.place(at);
        self.data.forward();
        let (bodies, welds) = (
            self.model.mujoco.geom_bodyid(),
            self.model.mujoco.body_weldid(),
        );
        let is_fixed = |geom: i32| {
            let body = usize::try_from(geom).ok().and_then(|geom| bodies.get(geom));
            body.is_some_and(|body| welds[*body as usize] == 0)
        };
        self.data
            .contact()
            .iter()
            .any(|contact| contact.dist <= 0.0 && contact.geom.iter().any(|geom| is_fixed(*geom)))
    }
}
