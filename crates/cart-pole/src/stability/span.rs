//! Spans of time with one action, and the motion in them.

use std::time::Duration;

use nalgebra::{Matrix4, Matrix5, Vector4, Vector5};

use crate::{CART_LIMIT_M, CONTROL_HZ, LinearPlant, POLE_LIMIT_RAD, PlantError, SUBSTEPS};

/// Number of terms of the series, for a stretch so short that each term is less than a
/// tenth of the previous one.
const TERMS: i32 = 16;

/// Largest product of the dynamics and a stretch for which the series is used.
const SHORT: f64 = 0.1;

/// Random disturbance of a loop, white and with mean zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Noise {
    /// Intensity of the disturbance added to the action in force (actions² · s): over a
    /// time `t` its integral has the variance `intensity · t`. In a world of steps it is
    /// constant during each.
    pub push: f64,
    /// Variance of the error of each coordinate in a reading: cart position
    /// (m²), pole angle (rad²), cart velocity (m²/s²), pole velocity (rad²/s²).
    pub reading: [f64; 4],
}

/// The cost of a deviation per second: the sum of weighted squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// Weights of cart position (1/m²), pole angle (1/rad²), cart velocity (s²/m²) and
    /// pole velocity (s²/rad²).
    pub state: [f64; 4],
    /// Weight of the action in force.
    pub action: f64,
}

impl Default for Weights {
    /// Creates the weights of the regulator `lqr`: each of cart position, pole angle and action
    /// costs 1 per second at the limit of a lost run or at the motor's full force.
    fn default() -> Self {
        // Not by `powi`: its last bit depends on whether the compiler or the machine computes it.
        let of = |most: f64| 1.0 / (most * most);
        Self {
            state: [of(CART_LIMIT_M), of(POLE_LIMIT_RAD), 0.0, 0.0],
            action: 1.0,
        }
    }
}

/// A stretch of time for `z`: the plant's state `x` and the action in force `u`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Span {
    /// `z` afterwards is `motion · z`; the action stays.
    pub motion: Matrix5<f64>,
    /// The covariance that disturbances add to `z`.
    pub noise: Matrix5<f64>,
    /// The cost of the stretch is `zᵀ · cost · z`, with the `z` at its beginning,
    pub cost: Matrix5<f64>,
    /// plus this, for the disturbances during it.
    pub noise_cost: f64,
}

impl Span {
    /// Returns the motion alone of a stretch of `seconds` in continuous time.
    pub fn motion(dynamics: &Dynamics, seconds: f64) -> Matrix5<f64> {
        let f = extended(dynamics);
        let doublings = doublings(&f, seconds);
        let seconds = seconds / 2.0_f64.powi(doublings);
        let mut power = Matrix5::identity();
        let mut short = power;
        for term in 1..TERMS {
            power = f * power * (seconds / f64::from(term));
            short += power;
        }
        (0..doublings).fold(short, |motion, _| motion * motion)
    }

    /// Creates a stretch of length zero.
    fn nothing() -> Self {
        Self {
            motion: Matrix5::identity(),
            noise: Matrix5::zeros(),
            cost: Matrix5::zeros(),
            noise_cost: 0.0,
        }
    }

    /// Creates a stretch of `seconds` in continuous time.
    ///
    /// Motion, covariance and costs are integrals of exponentials: a power series for a
    /// stretch that is short enough, then doubled. Source of the integrals: Van Loan,
    /// *Computing integrals involving the matrix exponential*, IEEE Trans. Automatic
    /// Control 23 (1978).
    pub fn flow(dynamics: &Dynamics, seconds: f64, noise: &Noise, weights: &Weights) -> Self {
        let f = extended(dynamics);
        let doublings = doublings(&f, seconds);
        let short = series(&f, seconds / 2.0_f64.powi(doublings), noise, weights);
        (0..doublings).fold(short, |span, _| span.then(&span))
    }

    /// Returns one physics step. Its cost is that of the state at its beginning.
    pub fn step(dynamics: &Dynamics, step: Duration, noise: &Noise, weights: &Weights) -> Self {
        let seconds = step.as_secs_f64();
        let LinearPlant { a, b } = dynamics.step(step);
        let mut span = Self::nothing();
        span.motion.fixed_view_mut::<4, 4>(0, 0).copy_from(&a);
        span.motion.fixed_view_mut::<4, 1>(0, 4).copy_from(&b);
        let disturbed = b * b.transpose() * (noise.push / seconds);
        span.noise
            .fixed_view_mut::<4, 4>(0, 0)
            .copy_from(&disturbed);
        span.cost = quadratic(weights) * seconds;
        span
    }

    /// This stretch followed by another.
    fn then(&self, next: &Self) -> Self {
        Self {
            motion: next.motion * self.motion,
            noise: next.motion * self.noise * next.motion.transpose() + next.noise,
            cost: self.cost + self.motion.transpose() * next.cost * self.motion,
            noise_cost: self.noise_cost + next.noise_cost + (next.cost * self.noise).trace(),
        }
    }

    /// Returns the effect of the state on the state.
    pub fn a(&self) -> Matrix4<f64> {
        self.motion.fixed_view::<4, 4>(0, 0).into()
    }

    /// Returns the effect of the action on the state.
    pub fn b(&self) -> Vector4<f64> {
        self.motion.fixed_view::<4, 1>(0, 4).into()
    }

    /// Returns the covariance that disturbances add to the state.
    pub fn disturbance(&self) -> Matrix4<f64> {
        self.noise.fixed_view::<4, 4>(0, 0).into()
    }

    /// This stretch, repeated `times` times.
    pub fn times(&self, times: u64) -> Self {
        let (mut all, mut power, mut left) = (Self::nothing(), *self, times);
        while left > 0 {
            if left % 2 == 1 {
                all = all.then(&power);
            }
            power = power.then(&power);
            left /= 2;
        }
        all
    }
}

/// Returns the number of halvings after which a stretch is short.
fn doublings(f: &Matrix5<f64>, seconds: f64) -> i32 {
    (f.norm() * seconds / SHORT).log2().ceil().max(0.0) as i32
}

/// Returns the dynamics of `z`: the action is constant.
fn extended(dynamics: &Dynamics) -> Matrix5<f64> {
    let mut f = Matrix5::zeros();
    f.fixed_view_mut::<4, 4>(0, 0).copy_from(&dynamics.f);
    f.fixed_view_mut::<4, 1>(0, 4).copy_from(&dynamics.g);
    f
}

/// Returns the cost per second as a quadratic form of `z`.
fn quadratic(weights: &Weights) -> Matrix5<f64> {
    let [cart, angle, cart_velocity, pole_velocity] = weights.state;
    Matrix5::from_diagonal(&Vector5::new(
        cart,
        angle,
        cart_velocity,
        pole_velocity,
        weights.action,
    ))
}

/// Returns the integrals by their power series; `f · seconds` is small.
fn series(f: &Matrix5<f64>, seconds: f64, noise: &Noise, weights: &Weights) -> Span {
    let g = f.column(4);
    let cost = quadratic(weights);
    let mut span = Span::nothing();
    let mut motion = Matrix5::identity();
    let mut disturbed = g * g.transpose() * (noise.push * seconds);
    let mut costs = cost * seconds;
    for term in 1..TERMS {
        motion = f * motion * (seconds / f64::from(term));
        let next = seconds / f64::from(term + 1);
        span.motion += motion;
        span.noise += disturbed;
        span.cost += costs;
        span.noise_cost += (cost * disturbed).trace() * next;
        disturbed = (f * disturbed + disturbed * f.transpose()) * next;
        costs = (f.transpose() * costs + costs * f) * next;
    }
    span
}

/// The motion of a small deviation from rest: `dx/dt = F·x + G·u`.
///
/// The state `x` is two positions and their two velocities: for the cart-pole cart
/// position (m), pole angle (rad), cart velocity (m/s) and pole velocity (rad/s); `u` is
/// an action.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dynamics {
    /// F: the effect of the state (1/s).
    pub f: Matrix4<f64>,
    /// G: the effect of the action.
    pub g: Vector4<f64>,
}

impl Dynamics {
    /// Creates the dynamics of the cart-pole, from one physics step of MuJoCo.
    ///
    /// A step first updates the velocities, then the positions with the new velocities,
    /// and at rest no force depends on a velocity. Therefore the change of the velocities
    /// in a step is the acceleration times the step, for any length of step.
    ///
    /// # Errors
    /// [`PlantError`] if MuJoCo refuses the model or is out of memory.
    pub fn cart_pole() -> Result<Self, PlantError> {
        let step_s = 1.0 / (CONTROL_HZ * f64::from(SUBSTEPS));
        let LinearPlant { a, b } = LinearPlant::physics_step(1.0)?;
        let mut f = Matrix4::zeros();
        let mut g = Vector4::zeros();
        for position in 0..2 {
            let velocity = position + 2;
            f[(position, velocity)] = 1.0;
            f[(velocity, 0)] = a[(velocity, 0)] / step_s;
            f[(velocity, 1)] = a[(velocity, 1)] / step_s;
            g[velocity] = b[velocity] / step_s;
        }
        Ok(Self { f, g })
    }

    /// Returns one physics step of this length: first the velocities, then the positions.
    pub fn step(&self, step: Duration) -> LinearPlant {
        let step_s = step.as_secs_f64();
        let (mut a, mut b) = (Matrix4::identity(), Vector4::zeros());
        for velocity in 2..4 {
            let faster = a.row(velocity) + self.f.row(velocity) * step_s;
            a.set_row(velocity, &faster);
            b[velocity] = self.g[velocity] * step_s;
        }
        for position in 0..2 {
            let moved = a.row(position) + a.row(position + 2) * step_s;
            a.set_row(position, &moved);
            b[position] = b[position + 2] * step_s;
        }
        LinearPlant { a, b }
    }
}
