//! A loop whose policy answers with chunks, which it plans by a model that may err, among
//! disturbances that no plan knows of.

use std::{
    f64::consts::{PI, SQRT_2},
    time::Duration,
};

use nalgebra::{DMatrix, DVector, Matrix5};
use ratelab::Time;
use ratelab_policy::chunk::{ChunkSettings, ExpectedDelay, PlanKind};

use super::{
    control_loop::Loop, covariance::twice, frequency::ACTION, monodromy::log_spectral_radius,
};
use crate::{
    CART_LIMIT_M, LinearPlant, POLE_LIMIT_RAD, PlantError, START_SPREAD,
    chunk::{ACTION_PERIOD, CartChunks},
};

/// Ticks of the player in the ten seconds that are looked at.
const TICKS: u64 = 500;

/// First row of the newest plan's estimate of the plant's state; the rows of earlier plans
/// are below.
const NEWEST: usize = 5;

/// The coordinates that have a limit; the row of its velocity is two below.
const LIMITS: [(usize, f64); 2] = [(0, CART_LIMIT_M), (1, POLE_LIMIT_RAD)];

/// What linear theory says of a run with chunks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedOutlook {
    /// The rate at which small deviations grow (1/s), negative if they shrink.
    pub growth: f64,
    /// The share of starts that stand for ten seconds.
    pub stands: f64,
}

/// Plant, action in force and the last plans, from tick to tick of the player.
///
/// A plan is a model of the plant, moved from the reading on by the actions that it takes to be
/// committed, then by its own. The plant leaves it by what disturbances and the model's error
/// come to since the reading, and by nothing else.
struct PlannedLoop<'a> {
    control: &'a Loop,
    holds: bool,
    horizon: u64,
    /// The motion of the plant in a tick, and that of the plans' model.
    plant: Matrix5<f64>,
    model: LinearPlant,
    chunks: Vec<PlanTimes>,
    /// Number of plans that matter at a time.
    plans: usize,
}

/// The times of a chunk (ticks): of its reading, of its taking, and from when on its actions are
/// its own.
#[derive(Clone, Copy)]
struct PlanTimes {
    read: u64,
    taken: u64,
    own: u64,
}

impl PlanTimes {
    /// Returns from when on it is played.
    fn played(&self) -> u64 {
        self.own.max(self.taken)
    }
}

impl Loop {
    /// Returns what becomes of the loop if its policy answers with these `chunks`, of which the player takes the newest by time. The player has the timing of the actuator, and
    /// the disturbance this standard deviation (as an action), new in each of its ticks.
    ///
    /// The share that stands is that of a Gaussian process which passes its limits as rarely as
    /// Rice's formula says, each time on its own; and never more than are within them at any
    /// tick. (Rice, *Mathematical analysis of random noise*, Bell System Technical Journal 24,
    /// 1945.) Starts are as in a run.
    ///
    /// # Errors
    /// [`PlantError`] if MuJoCo refuses the plan's model.
    pub fn planned(
        &self,
        chunks: &CartChunks,
        disturbance: f64,
    ) -> Result<PlannedOutlook, PlantError> {
        let planned = PlannedLoop::new(self, chunks)?;
        Ok(PlannedOutlook {
            growth: planned.growth(),
            stands: planned.stands(disturbance),
        })
    }
}

impl<'a> PlannedLoop<'a> {
    fn new(control: &'a Loop, of: &CartChunks) -> Result<Self, PlantError> {
        let settings = &of.settings;
        let units = ACTION_PERIOD.as_nanos() / control.world.unit().as_nanos();
        let mut planned = Self {
            control,
            holds: settings.plan == PlanKind::Hold,
            horizon: settings.horizon.get() as u64,
            plant: control.world.motion(&control.dynamics, units as u64),
            model: LinearPlant::for_model(of.model.length)?,
            chunks: chunks(control, settings),
            plans: 1,
        };
        let needed = (0..2 * TICKS).map(|at| {
            let known = planned.known(at);
            known
                - planned
                    .newest(known, at, PlanTimes::played)
                    .unwrap_or(known)
        });
        planned.plans = needed.max().unwrap_or(1);
        Ok(planned)
    }

    /// Returns the number of chunks whose reading is made by tick `at`.
    fn known(&self, at: u64) -> usize {
        self.chunks.partition_point(|chunk| chunk.read <= at)
    }

    /// Returns the newest of the first `known` chunks that has come by tick `at`.
    fn newest(&self, known: usize, at: u64, comes: fn(&PlanTimes) -> u64) -> Option<usize> {
        self.chunks[..known]
            .iter()
            .rposition(|chunk| comes(chunk) <= at)
    }

    fn size(&self) -> usize {
        NEWEST + 4 * self.plans
    }

    /// Takes each column of `states` through a tick.
    fn tick(&self, at: u64, states: &mut DMatrix<f64>) {
        let known = self.known(at);
        for _ in self.chunks[..known].iter().filter(|chunk| chunk.read == at) {
            for row in (NEWEST + 4..states.nrows()).rev() {
                states.swap_rows(row, row - 4);
            }
            let read = states.rows(0, 4).clone_owned();
            states.rows_mut(NEWEST, 4).copy_from(&read);
        }
        let gains = nalgebra::RowVector4::from(self.control.gains);
        let place = |chunk: usize| NEWEST + 4 * (known - 1 - chunk);
        // Beyond the end of a chunk its last action holds.
        let lasts = |chunk: &usize| at < self.chunks[*chunk].read + self.horizon;
        let played = self.newest(known, at, PlanTimes::played);
        if let Some(played) = played.filter(lasts) {
            let action = gains * states.rows(place(played), 4);
            states.set_row(ACTION, &action);
        }
        if !self.holds {
            let live = known.saturating_sub(self.plans)..known;
            let actions = live.clone().map(|chunk| {
                let mover = if self.chunks[chunk].own <= at {
                    Some(chunk)
                } else {
                    self.newest(chunk, at, |chunk| chunk.own)
                };
                match mover.filter(lasts).filter(|mover| live.contains(mover)) {
                    Some(mover) => gains * states.rows(place(mover), 4),
                    None => states.row(ACTION).clone_owned(),
                }
            });
            for (chunk, action) in live.clone().zip(actions.collect::<Vec<_>>()) {
                let mut plan = states.rows_mut(place(chunk), 4);
                let moved = self.model.a * &plan + self.model.b * action;
                plan.copy_from(&moved);
            }
        }
        let moved = self.plant * states.rows(0, NEWEST);
        states.rows_mut(0, NEWEST).copy_from(&moved);
    }

    /// That of the map over ten seconds, after the start is over.
    fn growth(&self) -> f64 {
        let mut states = DMatrix::identity(self.size(), self.size());
        (TICKS / 2..TICKS * 3 / 2).for_each(|at| self.tick(at, &mut states));
        log_spectral_radius(states) / (ACTION_PERIOD * TICKS as u32).as_secs_f64()
    }

    fn stands(&self, disturbance: f64) -> f64 {
        let mut start = DVector::zeros(self.size());
        start.rows_mut(0, 4).fill(START_SPREAD * START_SPREAD / 3.0);
        let mut covariance = DMatrix::from_diagonal(&start);
        let pushed = self.plant.fixed_view::<4, 1>(0, ACTION) * disturbance;
        let (mut passed, mut within) = (0.0, 1.0_f64);
        for at in 0..TICKS {
            twice(&mut covariance, |states| self.tick(at, states));
            let mut moved = covariance.fixed_view_mut::<4, 4>(0, 0);
            moved += pushed * pushed.transpose();
            for (row, limit) in LIMITS {
                let [place, speed] = [row, row + 2].map(|row| covariance[(row, row)].sqrt());
                let limit = limit / place;
                passed += speed / place / PI * (-limit * limit / 2.0).exp();
                within = within.min(libm::erf(limit / SQRT_2));
            }
        }
        (-passed * ACTION_PERIOD.as_secs_f64()).exp().min(within)
    }
}

/// Returns the chunks of twenty seconds.
fn chunks(control: &Loop, settings: &ChunkSettings) -> Vec<PlanTimes> {
    let timing = control.timing;
    let tick = |time: Time| time.as_nanos().div_ceil(ACTION_PERIOD.as_nanos() as u64);
    let chunks = timing.pushes().enumerate().map(|(number, (start, push))| {
        let last = match number {
            0 => Duration::ZERO,
            _ => timing.policy_takes,
        };
        let expected = match settings.expected {
            ExpectedDelay::Constant(delay) => delay,
            ExpectedDelay::Last(margin) | ExpectedDelay::Max(margin) => last + margin,
        };
        let read = tick(push.sensed);
        PlanTimes {
            read,
            taken: tick(push.applied),
            own: match settings.plan {
                PlanKind::Committed => read.max(tick(start + expected)),
                PlanKind::Hold | PlanKind::Rollout => read,
            },
        }
    });
    chunks.take_while(|chunk| chunk.read < 2 * TICKS).collect()
}
