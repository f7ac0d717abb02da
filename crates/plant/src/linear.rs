//! A robot near its reference, linearised by steps of the physics itself.

use mujoco_rs::mujoco_c::mjtState;
use nalgebra::DMatrix;

use crate::{BodyData, model::RobotModel, model_error::RobotModelError, reference::Reference};

/// The deviation in the differences, in the unit of each number.
const SMALL: f64 = 1e-6;

/// What is set back before each step.
const KEPT: u32 = mjtState::mjSTATE_FULLPHYSICS as u32
    | mjtState::mjSTATE_WARMSTART as u32
    | mjtState::mjSTATE_CTRL as u32;

/// The motion of a small deviation in some steps: `x' = A·x + B·u`.
///
/// The state `x` is coordinates, speeds and activations.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearRobot {
    /// A: the effect of the state.
    pub a: DMatrix<f64>,
    /// B: the effect of the controls.
    pub b: DMatrix<f64>,
}

impl LinearRobot {
    /// Returns one step of physics at `reference`.
    pub(crate) fn step(model: &RobotModel, reference: &Reference) -> Result<Self, RobotModelError> {
        let mut data = model.body()?;
        reference.put_into(&mut data);
        data.forward();
        let kept = data.state(KEPT);
        let mut steps = Steps { model, data, kept };
        let [_, coordinates, activations, controls] = model.sizes();
        let of_state: Vec<_> = (0..2 * coordinates + activations)
            .map(|index| steps.by_state(index))
            .collect();
        let of_controls: Vec<_> = (0..controls).map(|index| steps.by_control(index)).collect();
        let rows = 2 * coordinates + activations;
        Ok(Self {
            a: DMatrix::from_vec(rows, rows, of_state.concat()),
            b: DMatrix::from_vec(rows, controls, of_controls.concat()),
        })
    }

    /// Returns `times` such steps with constant controls; no motion for zero.
    pub fn times(&self, times: u64) -> Self {
        let rows = self.a.nrows();
        let still = Self {
            a: DMatrix::identity(rows, rows),
            b: DMatrix::zeros(rows, self.b.ncols()),
        };
        (0..times).fold(still, |so_far, _| Self {
            b: &self.a * so_far.b + &self.b,
            a: &self.a * so_far.a,
        })
    }
}

impl Reference {
    /// Places a robot there, at rest and with nothing left of what was before.
    pub(crate) fn put_into(&self, data: &mut BodyData) {
        data.reset();
        data.qpos_mut().copy_from_slice(&self.positions);
        data.act_mut().copy_from_slice(&self.activations);
        data.ctrl_mut().copy_from_slice(&self.controls);
    }
}

/// Steps from one state, each with a small deviation.
struct Steps<'m> {
    model: &'m RobotModel,
    data: BodyData,
    kept: Box<[f64]>,
}

/// A state after a step: positions, speeds and activations.
type After = [Vec<f64>; 3];

impl Steps<'_> {
    /// Returns the state after a step from the kept one, changed by `change`.
    fn after(&mut self, change: impl FnOnce(&RobotModel, &mut BodyData)) -> After {
        // Its length is that of the same model.
        let _ = self.data.set_state(&self.kept, KEPT);
        change(self.model, &mut self.data);
        self.data.step();
        let data = &self.data;
        [data.qpos(), data.qvel(), data.act()].map(<[f64]>::to_vec)
    }

    /// Returns the difference of two states, over `width`.
    fn difference(&self, minus: &After, plus: &After, width: f64) -> Vec<f64> {
        let mujoco = &self.model.mujoco;
        let mut column = mujoco
            .differentiate_pos(width, &minus[0], &plus[0])
            .into_vec();
        for (minus, plus) in minus.iter().zip(plus).skip(1) {
            let pairs = plus.iter().zip(minus);
            column.extend(pairs.map(|(plus, minus)| (plus - minus) / width));
        }
        column
    }

    /// Returns the effect of number `index` of the state.
    fn by_state(&mut self, index: usize) -> Vec<f64> {
        let [_, coordinates, ..] = self.model.sizes();
        let [minus, plus] = [-SMALL, SMALL].map(|by| {
            self.after(|model, data| match index.checked_sub(coordinates) {
                None => {
                    let mut along = vec![0.0; coordinates];
                    along[index] = 1.0;
                    model.mujoco.integrate_pos(data.qpos_mut(), &along, by);
                }
                Some(speed) if speed < coordinates => data.qvel_mut()[speed] += by,
                Some(other) => data.act_mut()[other - coordinates] += by,
            })
        });
        self.difference(&minus, &plus, 2.0 * SMALL)
    }

    /// Returns the effect of control number `index`: on one side only at an end of its range.
    fn by_control(&mut self, index: usize) -> Vec<f64> {
        let range = self.model.range(index);
        let here = self.data.ctrl()[index];
        let fits = |by: f64| range.is_none_or(|[low, high]| (low..=high).contains(&(here + by)));
        let sides = [-SMALL, SMALL].map(|by| if fits(by) { by } else { 0.0 });
        let [minus, plus] =
            sides.map(|by| self.after(|_, data| data.ctrl_mut()[index] = here + by));
        let width = if sides.contains(&0.0) {
            SMALL
        } else {
            2.0 * SMALL
        };
        self.difference(&minus, &plus, width)
    }
}
