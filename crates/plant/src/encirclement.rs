//! Whether a loop with a delay is surely steady, by the argument principle.
//!
//! The delay changes the loop's gain on a circle, but not what was computed of the robot there: so a
//! thousand delays cost little more than one.

use std::{
    collections::{BTreeMap, btree_map::Entry},
    f64::consts::PI,
};

use nalgebra::{Complex, ComplexField, DMatrix, Schur};

use crate::{late_loop::LoopTimes, linear::LinearRobot};

/// The greatest change of the logarithm from one point of the circle to the next.
const SMOOTH: f64 = 0.5;

/// How often the way between two points is halved at most.
const HALVINGS: u32 = 40;

/// The points of half of the circle at first, for each period that the loop is late.
const POINTS: u64 = 16;

/// How far from whole a number of turns may be.
const WHOLE: f64 = 0.1;

type ComplexMatrix = DMatrix<Complex<f64>>;

/// A loop that is open at the actions, seen from a circle.
pub(crate) struct OpenLoop {
    /// The radius of the circle: the growth per period that is looked for.
    radius: f64,
    /// The number of its modes that grow faster.
    outside: i64,
    /// The motion over a period, triangular, and the gains in its coordinates.
    triangular: ComplexMatrix,
    gains: ComplexMatrix,
    /// The effect of controls that hold for so many steps, in these coordinates.
    held: Vec<ComplexMatrix>,
    /// The gains on what comes of the state, by the place on the circle: 0 to 1 for half of it, as bits.
    known: BTreeMap<u64, ComplexMatrix>,
}

impl OpenLoop {
    /// Opens the loop of a robot with these `gains` and `times`; `None` where its modes were not found.
    pub(crate) fn new(
        robot: &LinearRobot,
        gains: &DMatrix<f64>,
        times: LoopTimes,
        growth: f64,
    ) -> Option<Self> {
        let complex = |matrix: &DMatrix<f64>| matrix.map(|entry| Complex::new(entry, 0.0));
        let period = robot.times(times.policy);
        let schur = Schur::try_new(complex(&period.a), f64::EPSILON, 10_000)?;
        let (modes, triangular) = schur.unpack();
        let radius = (growth * times.all_s).exp();
        let back = modes.adjoint();
        let mut so_far = DMatrix::zeros(robot.b.nrows(), robot.b.ncols());
        let held = (0..=times.policy).map(|_| {
            let here = &back * complex(&so_far);
            so_far = &robot.a * &so_far + &robot.b;
            here
        });
        Some(Self {
            radius,
            held: held.collect(),
            outside: triangular
                .diagonal()
                .iter()
                .filter(|mode| mode.modulus() > radius)
                .count() as i64,
            gains: complex(gains) * &modes,
            triangular,
            known: BTreeMap::new(),
        })
    }

    /// Returns whether no mode of the closed loop grows faster, with actions that are `late` steps late;
    /// `false` where that is not sure.
    pub(crate) fn is_steady(&mut self, late: u64) -> bool {
        let count = POINTS * (late / (self.held.len() as u64 - 1) + 2);
        let place = |index| index as f64 / count as f64;
        let mut turns = 0.0;
        let Some(mut before) = self.at(0.0, late) else {
            return false;
        };
        for index in 1..=count {
            let ends = [place(index - 1), place(index)];
            let Some(here) = self.at(ends[1], late) else {
                return false;
            };
            match self.turned(ends, [before, here], late, HALVINGS) {
                Some(more) => turns += more / PI,
                None => return false,
            }
            before = here;
        }
        let whole = turns.round();
        (turns - whole).abs() < WHOLE && self.outside == whole as i64
    }

    /// Returns by how much the value turns on the way between two places (rad); `None` near a mode.
    fn turned(
        &mut self,
        places: [f64; 2],
        values: [Complex<f64>; 2],
        late: u64,
        halvings: u32,
    ) -> Option<f64> {
        let between = (places[0] + places[1]) / 2.0;
        let value = self.at(between, late)?;
        let ways = [value / values[0], values[1] / value].map(ComplexField::ln);
        if ways.iter().all(|way| way.modulus() < SMOOTH) {
            return Some(ways[0].im + ways[1].im);
        }
        let left = halvings.checked_sub(1)?;
        let first = self.turned([places[0], between], [values[0], value], late, left)?;
        let second = self.turned([between, places[1]], [value, values[1]], late, left)?;
        Some(first + second)
    }

    /// Returns the determinant of one plus the loop's gain at a place on half of the circle; `None` at a
    /// mode.
    fn at(&mut self, place: f64, late: u64) -> Option<Complex<f64>> {
        let (sin, cos) = (PI * place).sin_cos();
        let z = Complex::new(cos, sin) * Complex::new(self.radius, 0.0);
        let rows = match self.known.entry(place.to_bits()) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(empty) => {
                let size = self.triangular.nrows();
                let open = DMatrix::from_diagonal_element(size, size, z) - &self.triangular;
                let solved = open.tr_solve_upper_triangular(&self.gains.transpose())?;
                empty.insert(solved.transpose())
            }
        };
        let steps = self.held.len() - 1;
        let (periods, rest) = (late as usize / steps, late as usize % steps);
        let [new, all] = [&self.held[steps - rest], &self.held[steps]];
        let effect = new + (all - new) / z;
        let gain = &*rows * effect * z.powi(-(periods as i32));
        let size = gain.nrows();
        let value = (DMatrix::identity(size, size) + gain).determinant();
        (value.modulus() > 0.0 && value.is_finite()).then_some(value)
    }
}
