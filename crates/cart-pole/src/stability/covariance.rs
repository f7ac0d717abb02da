//! The covariance of a loop's state under message loss and disturbances: whether it shrinks, and the
//! mean cost of deviations.

use nalgebra::{DMatrix, DVector};
use ratelab::Time;

use super::{
    control_loop::{Loop, StabilityError},
    frequency::{ACTION, Disturbances, NEWEST, Passage},
    monodromy::log_spectral_radius,
    schedule::{ScheduleEvent, events},
    span::{Noise, Weights},
    timing::TimedPush,
};

/// Bisection steps over the probability.
const HALVINGS: u32 = 40;

/// The action in force after a message of `/action` is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lost {
    /// The previous action.
    Hold,
    /// No force.
    Zero,
}

/// Independent loss of each message of `/action` with the same probability.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    /// The probability, 0 to 1.
    pub probability: f64,
    /// The action after a loss.
    pub lost: Lost,
}

impl Loss {
    /// No loss.
    pub const NONE: Self = Self {
        probability: 0.0,
        lost: Lost::Hold,
    };
}

impl Loop {
    /// Returns the rate at which the expected square of a small deviation grows (1/s), with random
    /// loss of messages on `/action`; negative if it shrinks, and then the deviation shrinks in
    /// almost every single run too.
    ///
    /// A jump linear system with independent jumps: the largest modulus of the
    /// eigenvalues of `E[M ⊗ M]`, `M` the product over one hyper-period. Costa,
    /// Fragoso and Marques, *Discrete-Time Markov Jump Linear Systems*, chapter 3.
    ///
    /// # Errors
    /// [`StabilityError`], as for [`Loop::stability`]. The work grows with the sixth
    /// power of the number of readings in flight.
    pub fn mean_square_growth(&self, loss: Loss) -> Result<f64, StabilityError> {
        let (passage, schedule) = Passage::new(self)?;
        let squares = Covariance {
            passage: &passage,
            loss,
        };
        Ok(log_spectral_radius(squares.matrix()) / schedule.period.as_secs_f64())
    }

    /// Returns the least probability of loss at which the expected square of a small deviation does
    /// not shrink, by bisection: 0 if it never does, 1 if it always does.
    ///
    /// # Errors
    /// [`StabilityError`], as for [`Loop::stability`].
    pub fn loss_margin(&self, lost: Lost) -> Result<f64, StabilityError> {
        let shrinks = |probability| {
            let growth = self.mean_square_growth(Loss { probability, lost })?;
            Ok::<_, StabilityError>(growth < 0.0)
        };
        let (mut stable, mut margin) = (0.0, 1.0);
        if !shrinks(stable)? {
            return Ok(stable);
        }
        for _ in 0..HALVINGS {
            let middle = (stable + margin) / 2.0;
            if shrinks(middle)? {
                stable = middle;
            } else {
                margin = middle;
            }
        }
        Ok(margin)
    }

    /// Returns the expected cost per second of the loop in its steady state, with disturbances
    /// `noise` and random loss of messages on `/action`. `None` if it grows without bound.
    ///
    /// The covariance of the state passes through the same product of maps as a deviation
    /// in [`Loop::stability`]. Nilsson, *Real-Time Control Systems with Delays* (1998);
    /// Lincoln and Cervin, *Jitterbug*, CDC 2002.
    ///
    /// # Errors
    /// [`StabilityError`], as for [`Loop::stability`].
    pub fn expected_cost(
        &self,
        noise: &Noise,
        weights: &Weights,
        loss: Loss,
    ) -> Result<Option<f64>, StabilityError> {
        let (passage, schedule) = Passage::new(self)?;
        if self.mean_square_growth(loss)? >= 0.0 {
            return Ok(None);
        }
        let covariance = Covariance {
            passage: &passage,
            loss,
        };
        let disturbances = Disturbances::new(&passage, self, noise, weights);
        let size = passage.size();
        // The covariance that disturbances add in one period, and the map of the
        // covariance over a period.
        let mut added = DMatrix::zeros(size, size);
        covariance.cost(&disturbances, &mut added);
        let remembered = covariance.matrix();
        let identity = DMatrix::identity(remembered.nrows(), remembered.ncols());
        let steady = (identity - remembered).lu().solve(&flat(&added));
        Ok(steady.map(|steady| {
            let cost = covariance.cost(&disturbances, &mut symmetric(&steady, size));
            cost / schedule.period.as_secs_f64()
        }))
    }

    /// Returns the expected cost per second, from rest until the last of these pushes is applied,
    /// with disturbances `noise`: for drawn or recorded timing. Each push must be based on the same
    /// reading as the previous one or on a newer one; the loop's own timing is ignored.
    ///
    /// The method of JitterTime: Cervin, Pazzaglia, Barzegaran and Mahfouzi, *Using
    /// JitterTime to analyze transient performance in adaptive and reconfigurable control
    /// systems*, ETFA 2019.
    pub fn cost_along(&self, pushes: &[TimedPush], noise: &Noise, weights: &Weights) -> f64 {
        let end = pushes
            .iter()
            .map(|push| push.applied)
            .max()
            .unwrap_or(Time::ZERO);
        let events = events(pushes, self.world, Time::ZERO, Time::ZERO, end);
        let passage = Passage::through(self, events);
        let disturbances = Disturbances::new(&passage, self, noise, weights);
        let covariance = Covariance {
            passage: &passage,
            loss: Loss::NONE,
        };
        let mut rest = DMatrix::zeros(passage.size(), passage.size());
        covariance.cost(&disturbances, &mut rest) / end.as_secs_f64()
    }
}

/// A passage with message loss.
struct Covariance<'a> {
    passage: &'a Passage,
    loss: Loss,
}

impl Covariance<'_> {
    /// Applies `event` to a covariance, averaged over the loss, without disturbances.
    fn happen(&self, event: ScheduleEvent, covariance: &mut DMatrix<f64>) {
        let lost =
            (matches!(event, ScheduleEvent::Apply(_))).then(|| self.without_action(covariance));
        twice(covariance, |states| self.passage.happen(event, states));
        if let Some(lost) = lost {
            let Loss { probability, .. } = self.loss;
            *covariance *= 1.0 - probability;
            *covariance += lost * probability;
        }
    }

    fn without_action(&self, covariance: &DMatrix<f64>) -> DMatrix<f64> {
        let mut lost = covariance.clone();
        if self.loss.lost == Lost::Zero {
            lost.row_mut(ACTION).fill(0.0);
            lost.column_mut(ACTION).fill(0.0);
        }
        lost
    }

    /// Takes `covariance` through the passage with these disturbances. Returns its cost.
    fn cost(&self, disturbances: &Disturbances, covariance: &mut DMatrix<f64>) -> f64 {
        let mut cost = 0.0;
        for event in &self.passage.events {
            match *event {
                ScheduleEvent::Advance(units) => {
                    let span = &disturbances.spans[&units];
                    let before = covariance.fixed_view::<NEWEST, NEWEST>(0, 0);
                    cost += (span.cost * before).trace() + span.noise_cost;
                    self.happen(*event, covariance);
                    let mut moved = covariance.fixed_view_mut::<NEWEST, NEWEST>(0, 0);
                    moved += span.noise;
                }
                ScheduleEvent::Sense => {
                    self.happen(*event, covariance);
                    covariance[(NEWEST, NEWEST)] += disturbances.reading;
                }
                ScheduleEvent::Apply(_) => self.happen(*event, covariance),
            }
        }
        cost
    }

    /// Returns the effect of the passage on a covariance, as a matrix that acts on stacked upper
    /// triangles.
    fn matrix(&self) -> DMatrix<f64> {
        let size = self.passage.size();
        let columns: Vec<_> = triangle(size)
            .map(|(row, column)| {
                let mut covariance = DMatrix::zeros(size, size);
                covariance[(row, column)] = 1.0;
                covariance[(column, row)] = 1.0;
                for event in &self.passage.events {
                    self.happen(*event, &mut covariance);
                }
                flat(&covariance)
            })
            .collect();
        DMatrix::from_columns(&columns)
    }
}

/// Applies the linear map `map` of states to a covariance, from both sides.
pub(super) fn twice(covariance: &mut DMatrix<f64>, map: impl Fn(&mut DMatrix<f64>)) {
    map(covariance);
    covariance.transpose_mut();
    map(covariance);
}

/// Returns the indices of the upper triangle.
fn triangle(size: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..size).flat_map(|column| (0..=column).map(move |row| (row, column)))
}

/// Returns the upper triangle as a vector.
fn flat(covariance: &DMatrix<f64>) -> DVector<f64> {
    let places = triangle(covariance.nrows());
    let entries: Vec<_> = places.map(|place| covariance[place]).collect();
    DVector::from_vec(entries)
}

/// Returns the covariance with this upper triangle.
fn symmetric(flat: &DVector<f64>, size: usize) -> DMatrix<f64> {
    let mut covariance = DMatrix::zeros(size, size);
    for ((row, column), entry) in triangle(size).zip(flat.iter()) {
        covariance[(row, column)] = *entry;
        covariance[(column, row)] = *entry;
    }
    covariance
}
