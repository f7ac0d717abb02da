//! What linear theory says of a constant delay.

use nalgebra::{Complex, ComplexField, DMatrix, DVector, Schur};
use ratelab::Hz;

use crate::{
    encirclement::OpenLoop,
    late_loop::{LoopGains, LoopRates, LoopTimes},
    robot::Robot,
};

/// The growth of deviations that still counts as none (1/s).
const STEADY: f64 = 0.02;

/// The longest delay that is looked at (ms).
const LONGEST_MS: u64 = 1000;

/// A mode shrinks by less than this where nothing holds it: one per cent a second.
const HELD: f64 = -0.010_050_335_853_501_45;

/// The smallest part of a mode on a coordinate, beside its greatest, that counts.
const PART: f64 = 1e-7;

/// The greatest constant delay of controls that linear theory allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BearableDelay {
    /// Deviations grow without any delay.
    None,
    /// So many whole milliseconds.
    Ms(u64),
    /// Whatever the delay, up to a second at least.
    Any,
}

impl BearableDelay {
    /// Returns the whole milliseconds, where there is a limit.
    pub fn ms(self) -> Option<f64> {
        match self {
            Self::Ms(ms) => Some(ms as f64),
            Self::None | Self::Any => None,
        }
    }
}

/// A mode of the closed loop: how fast it grows, and what moves in it.
struct LoopMode {
    /// Growth (1/s); negative if it shrinks.
    growth: f64,
    value: Complex<f64>,
}

/// The closed loop with a constant delay, over one period of the policy.
struct DelayedLoop<'r> {
    robot: &'r Robot,
    matrix: DMatrix<f64>,
    period_s: f64,
}

impl Robot {
    /// Returns the greatest constant delay of the topic `LATE[late]` that deviations do not grow with,
    /// under these gains; `None` where the loops meet too rarely.
    pub(crate) fn bearable(
        &self,
        gains: &DMatrix<f64>,
        rates: LoopRates,
        late: usize,
    ) -> Option<BearableDelay> {
        let mut times = self.times(rates)?;
        let mut alone = match rates.inner {
            None => OpenLoop::new(&self.linear, gains, times, STEADY),
            Some(_) => None,
        };
        let mut steps = None;
        for ms in 0..=LONGEST_MS {
            times.late[late] = (ms * 1_000_000).div_ceil(self.model.step_ns);
            if steps.replace(times.late[late]) == Some(times.late[late]) {
                continue;
            }
            let open = alone.as_mut();
            let is_steady = open.is_some_and(|open| open.is_steady(times.late[late]));
            if !is_steady && self.delayed(gains, times).grows() {
                let before = ms.checked_sub(1);
                return Some(before.map_or(BearableDelay::None, BearableDelay::Ms));
            }
        }
        Some(BearableDelay::Any)
    }

    /// Returns whether deviations grow without a delay, under these gains; `None` where the loops meet
    /// too rarely.
    pub(crate) fn grows(&self, gains: &DMatrix<f64>, rates: LoopRates) -> Option<bool> {
        Some(self.delayed(gains, self.times(rates)?).grows())
    }

    /// Returns how fast each deviation grows that grows without a controller (1/s), the fastest first.
    pub(crate) fn poles(&self) -> Vec<f64> {
        let free = DelayedLoop {
            robot: self,
            matrix: self.linear.a.clone(),
            period_s: self.model.step_ns as f64 / 1e9,
        };
        free.growths()
    }

    /// Returns the coordinates that nothing holds, by their indices.
    pub(crate) fn free_coordinates(&self, gains: &DMatrix<f64>, hz: Hz) -> Vec<usize> {
        let here = self.delayed(gains, LoopTimes::alone(hz, self.steps_in(hz)));
        let mut free: Vec<usize> = here
            .modes(HELD)
            .into_iter()
            .filter_map(|mode| {
                let shape = here.shape(mode.value)?;
                let of_coordinates = shape.iter().take(self.limits.len()).enumerate();
                let (index, _) = of_coordinates.max_by(|(_, a), (_, b)| a.total_cmp(b))?;
                Some(index)
            })
            .collect();
        free.sort_unstable();
        free.dedup();
        free
    }

    /// Returns when loops with these rates decide, without a delay.
    fn times(&self, rates: LoopRates) -> Option<LoopTimes> {
        let policy = LoopTimes::alone(rates.policy, self.steps_in(rates.policy));
        match rates.inner {
            Some(inner) => policy.around(self.steps_in(inner)),
            None => Some(policy),
        }
    }

    /// Returns the closed loop with these gains and delays.
    fn delayed(&self, gains: &DMatrix<f64>, times: LoopTimes) -> DelayedLoop<'_> {
        let gains = match self.split(gains) {
            [outer, _] if self.inner.is_empty() => LoopGains {
                outer: None,
                inner: outer,
            },
            [outer, inner] => LoopGains {
                outer: Some(outer),
                inner,
            },
        };
        DelayedLoop {
            robot: self,
            matrix: gains.closed(&self.linear, times),
            period_s: times.all_s,
        }
    }
}

impl DelayedLoop<'_> {
    /// Returns whether a deviation grows that is seen on a coordinate with a limit.
    fn grows(&self) -> bool {
        !self.growths().is_empty()
    }

    /// Returns the growths of such deviations (1/s), the fastest first.
    fn growths(&self) -> Vec<f64> {
        let seen = self.modes(STEADY).into_iter().filter(|mode| {
            let seen = self.shape(mode.value).is_some_and(|shape| {
                self.robot
                    .limits
                    .iter()
                    .zip(shape.iter())
                    .filter(|(limit, _)| limit.is_finite())
                    .map(|(_, part)| *part)
                    .fold(0.0, f64::max)
                    > PART * shape.amax()
            });
            seen && mode.growth > STEADY
        });
        let mut growths: Vec<f64> = seen.map(|mode| mode.growth).collect();
        growths.sort_by(|a, b| b.total_cmp(a));
        growths
    }

    /// Returns the modes that grow faster than `growth`, those above the real axis only.
    fn modes(&self, growth: f64) -> Vec<LoopMode> {
        let schur = Schur::try_new(self.matrix.clone(), f64::EPSILON, 10_000);
        let values = schur.map(|schur| schur.complex_eigenvalues());
        let values =
            values.unwrap_or_else(|| DVector::from_element(1, Complex::new(f64::INFINITY, 0.0)));
        let modes = values
            .iter()
            .filter(|value| value.im >= 0.0)
            .map(|value| LoopMode {
                growth: value.modulus().ln() / self.period_s,
                value: *value,
            });
        modes.filter(|mode| mode.growth > growth).collect()
    }

    /// Returns how much of each number is in the mode of this eigenvalue; `None` for one that is
    /// not finite.
    fn shape(&self, value: Complex<f64>) -> Option<DVector<f64>> {
        let size = self.matrix.nrows();
        let near = value + Complex::new(1e-9, 1e-10) * value.modulus().max(1.0);
        let shifted = self.matrix.map(|entry| Complex::new(entry, 0.0));
        let shifted = shifted - DMatrix::from_diagonal_element(size, size, near);
        let lu = shifted.lu();
        // Inverse iteration, from a start that is in no mode by chance.
        let mut shape = DVector::from_fn(size, |row, _| Complex::new(1.0 + 0.01 * row as f64, 0.0));
        for _ in 0..3 {
            shape = lu.solve(&shape)?;
            let norm = shape.norm();
            shape /= Complex::new(norm, 0.0);
        }
        let moduli = shape.map(ComplexField::modulus);
        moduli.iter().all(|part| part.is_finite()).then_some(moduli)
    }
}
