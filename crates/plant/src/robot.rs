//! A robot with its reference, its controller and its limits: what all runs of a plant share.

use std::sync::Arc;

use mujoco_rs::prelude::MjtObjBase;
use nalgebra::DMatrix;
use ratelab::{Chance, Hz};
use ratelab_policy::chunk::ActionShape;
use ratelab_system::{PlantRecord, graph_file::PlantSpec};

use crate::{
    BodyData, PlantDefect,
    defect::parse_items,
    gains::gains,
    linear::LinearRobot,
    losses::LossRule,
    model::{JointKind, RobotModel},
    model_error::RobotModelError,
    motion::{JointMotion, Motions, motions},
    reach::SiteReach,
    reference::{Reference, found},
    terms::ObservedTerms,
};

/// The size of a position or a speed from which a run is lost, whatever its limits.
const FINITE: f64 = 1e10;

/// The distance from the end of its range at which a joint counts as being there (m, rad).
const NEAR_THE_END: f64 = 0.01;

/// A robot with its reference and its limits.
pub struct Robot {
    pub(crate) model: RobotModel,
    /// The equilibrium that runs begin at.
    pub(crate) at: Reference,
    /// The pose as given, from which networks count.
    pub(crate) given: Reference,
    /// What a policy sees.
    pub(crate) terms: ObservedTerms,
    /// What loses a run beside the limits.
    pub(crate) rules: Vec<LossRule>,
    pub(crate) limits: Vec<f64>,
    /// The coordinates that an inner loop holds.
    pub(crate) inner: Vec<usize>,
    /// Half of the range of each control.
    pub(crate) half: Vec<f64>,
    /// The greatest speed of a coordinate at the start.
    start: f64,
    pub(crate) spec: PlantSpec,
    /// What moves of the reference.
    pub(crate) motions: Vec<JointMotion>,
    /// The sites that move, if any.
    pub(crate) reach: Option<SiteReach>,
    /// The coordinates that these move, each once.
    pub(crate) moving: Vec<usize>,
    /// One step of physics near the reference.
    pub(crate) linear: LinearRobot,
    /// What a recording keeps.
    pub(crate) record: PlantRecord,
}

impl Robot {
    /// Finds the equilibrium of `model` next to the pose in `spec`.
    ///
    /// # Errors
    /// [`PlantDefect`] for unknown names, and where nothing holds the pose.
    pub(crate) fn new(model: RobotModel, spec: &PlantSpec) -> Result<Self, PlantDefect> {
        let given = given(&model, spec)?;
        let at = found(&model, &given)?;
        Self::at(model, spec, [given, at])
    }

    /// Returns the robot of a recording.
    ///
    /// # Errors
    /// [`PlantDefect`] for a damaged record.
    pub(crate) fn recorded(record: &PlantRecord, spec: &PlantSpec) -> Result<Self, PlantDefect> {
        let model = RobotModel::from_text(&record.model)?.with_geoms(record.geoms.clone());
        let [positions, _, activations, controls] = model.sizes();
        let at = Reference {
            positions: record.positions.clone(),
            controls: record.controls.clone(),
            activations: record.activations.clone(),
        };
        let sizes = [&at.positions, &at.controls, &at.activations].map(Vec::len);
        if sizes != [positions, controls, activations] {
            return Err(RobotModelError::Damaged.into());
        }
        let given = given(&model, spec)?;
        Self::at(model, spec, [given, at])
    }

    fn at(
        model: RobotModel,
        spec: &PlantSpec,
        [given, at]: [Reference; 2],
    ) -> Result<Self, PlantDefect> {
        let groups = model.groups();
        let known = |name: &str| name == "*" || groups.contains(&name);
        if let Some((name, _)) = spec.limits.iter().find(|(name, _)| !known(name)) {
            return Err(PlantDefect::unknown("limits", "joint", name, &groups));
        }
        let limits = model.coordinates.iter().map(|group| spec.limit(group));
        let inner = spec.inner.as_ref().map_or(&[][..], |inner| &inner.joints);
        let inner = parse_items(inner, |name| coordinates(&model, name))?;
        let Motions { joints, sites } = motions(&model, &spec.reference)?;
        let reach = (!sites.is_empty())
            .then(|| SiteReach::new(&model, &at, sites))
            .transpose()?;
        Ok(Self {
            terms: ObservedTerms::parse(&spec.observe, &model)?,
            rules: LossRule::parse(&spec.lost, &model)?,
            given,
            limits: limits.collect(),
            inner: inner.concat(),
            half: model.half_ranges(),
            start: spec.start,
            linear: LinearRobot::step(&model, &at)?,
            record: PlantRecord {
                step_ms: model.step_ns as f64 / 1e6,
                model: model.text().to_owned(),
                positions: at.positions.clone(),
                controls: at.controls.clone(),
                activations: at.activations.clone(),
                geoms: model.geoms.to_vec(),
            },
            spec: spec.clone(),
            moving: moving(&joints, reach.as_ref()),
            motions: joints,
            reach,
            model,
            at,
        })
    }

    /// Returns the number of whole steps of physics that is nearest to a period, at least one.
    pub(crate) fn steps_in(&self, hz: Hz) -> u64 {
        let period = hz.period().as_nanos() as f64;
        let steps = (period / self.model.step_ns as f64).round_ties_even();
        steps.max(1.0) as u64
    }

    /// Returns what its actions are.
    pub(crate) fn actions(&self) -> ActionShape {
        ActionShape {
            width: self.half.len(),
            period: self.spec.rate.period(),
        }
    }

    /// Returns the gains of the controller for a policy at `hz`; `None` where they cannot be
    /// computed.
    pub(crate) fn gains(&self, hz: Hz) -> Option<DMatrix<f64>> {
        // The result of `powf` in the C library matches the compiler's constant folding.
        let weight = |limit: &f64| limit.powf(-2.0);
        let mut q: Vec<f64> = self.limits.iter().map(weight).collect();
        q.resize(self.linear.a.nrows(), 0.0);
        let r: Vec<f64> = self.half.iter().map(weight).collect();
        let period = self.linear.times(self.steps_in(hz));
        gains(&period, [&q, &r], hz.period().as_secs_f64())
    }

    /// Returns the joints that are at the end of their range in the reference.
    pub(crate) fn at_the_end(&self) -> Vec<&str> {
        let mujoco = &self.model.mujoco;
        let ranges = mujoco.jnt_limited().iter().zip(mujoco.jnt_range());
        let at_end = self
            .model
            .joints
            .iter()
            .zip(ranges)
            .filter(|(joint, (limited, range))| {
                let here = self.at.positions[joint.position];
                joint.is_single()
                    && **limited
                    && range.iter().any(|end| (here - end).abs() < NEAR_THE_END)
            });
        at_end.map(|(joint, _)| &*joint.name).collect()
    }

    /// Returns the name of a coordinate, with its number in its group.
    pub(crate) fn coordinate(&self, index: usize) -> String {
        let group = &self.model.coordinates[index];
        let first = self
            .model
            .coordinates
            .iter()
            .position(|other| other == group)
            .unwrap_or(index);
        let is_alone = self.model.coordinates.get(first + 1) != Some(group);
        if is_alone {
            group.clone()
        } else {
            format!("{group} {}", index - first + 1)
        }
    }

    /// Returns whether contacts hold the robot in its reference: in a run they may open.
    pub(crate) fn is_touching(&self) -> bool {
        let has_free = self
            .model
            .joints
            .iter()
            .any(|joint| joint.kind == JointKind::Free);
        has_free
            && self.begin(0).is_ok_and(|mut data| {
                data.forward();
                data.contact().iter().any(|contact| contact.dist <= 0.0)
            })
    }

    /// Places the robot at the start for `seed`.
    pub(crate) fn begin(&self, seed: u64) -> Result<BodyData, RobotModelError> {
        let mut data = self.model.body()?;
        self.at.put_into(&mut data);
        let chance = Chance {
            seed,
            what: "start",
            name: "plant",
        };
        let spread = self.start;
        for (index, speed) in data.qvel_mut().iter_mut().enumerate() {
            *speed = -spread + (spread - -spread) * chance.uniform(index);
        }
        Ok(data)
    }

    /// Returns the state in a reading, without the terms behind it.
    pub(crate) fn state_in<'r>(&self, reading: &'r [f64]) -> &'r [f64] {
        reading.get(..self.model.state_size()).unwrap_or(reading)
    }

    /// Returns the deviation of a state from the reference: coordinates, speeds, activations.
    /// `None` for another number of positions, speeds and activations.
    pub(crate) fn deviation(&self, state: &[f64]) -> Option<Vec<f64>> {
        let [positions, coordinates, activations, _] = self.model.sizes();
        let (places, rest) = state.split_at_checked(positions)?;
        let (speeds, rest) = rest.split_at_checked(coordinates)?;
        let active = rest.get(..activations)?;
        let mujoco = &self.model.mujoco;
        let mut deviation = mujoco
            .differentiate_pos(1.0, &self.at.positions, places)
            .into_vec();
        // What the reference has moved by stands behind a state.
        let moved = rest.get(activations..).unwrap_or_default();
        for (index, by) in self.moving.iter().zip(moved) {
            deviation[*index] -= by;
        }
        deviation.extend(speeds);
        let pairs = active.iter().zip(&self.at.activations);
        deviation.extend(pairs.map(|(active, at)| active - at));
        Some(deviation)
    }

    /// Returns why a state loses the run, if it does. A robot is placed there in `copy`, if that is
    /// needed.
    pub(crate) fn loss(&self, state: &[f64], copy: &mut Option<BodyData>) -> Option<LossCause> {
        let [positions, coordinates, ..] = self.model.sizes();
        let mut moving = state.iter().take(positions + coordinates);
        if !moving.all(|number| number.abs() < FINITE) {
            return Some(LossCause::NotFinite);
        }
        let deviation = self.deviation(state)?;
        let beyond = |(x, limit): (&f64, &f64)| x.abs() > *limit;
        let first = deviation.iter().zip(&self.limits).position(beyond);
        first
            .map(LossCause::Coordinate)
            .or_else(|| self.broken_rule(state, copy))
    }

    /// Returns the first rule that loses the run in a state.
    fn broken_rule(&self, state: &[f64], copy: &mut Option<BodyData>) -> Option<LossCause> {
        if self.rules.is_empty() {
            return None;
        }
        let data = match copy {
            Some(data) => data,
            None => copy.insert(self.model.body().ok()?),
        };
        let [positions, ..] = self.model.sizes();
        data.qpos_mut().copy_from_slice(state.get(..positions)?);
        data.fwd_position();
        let first = self.rules.iter().position(|rule| rule.holds(data));
        first.map(LossCause::Rule)
    }

    /// Returns what a row of `/state` costs: squares of deviations and controls, over their limits.
    pub(crate) fn cost(&self, row: &[f64]) -> Option<f64> {
        let (controls, state) = row.split_at_checked(self.half.len())?;
        let deviation = self.deviation(state)?;
        let mut sum = 0.0;
        for (x, limit) in deviation.iter().zip(&self.limits) {
            let share = x / limit;
            sum += share * share;
        }
        for ((control, at), half) in controls.iter().zip(&self.at.controls).zip(&self.half) {
            let share = (control - at) / half;
            sum += share * share;
        }
        Some(sum)
    }
}

/// Why a run is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LossCause {
    /// A number grew beyond all bounds.
    NotFinite,
    /// The coordinate with this index went beyond its limit.
    Coordinate(usize),
    /// The rule with this index says so.
    Rule(usize),
}

/// Returns the coordinates of a group in the key `inner`.
fn coordinates(model: &RobotModel, name: &str) -> Result<Vec<usize>, PlantDefect> {
    let all = model.coordinates.iter().enumerate();
    let own: Vec<usize> = all
        .filter(|(_, group)| *group == name)
        .map(|(index, _)| index)
        .collect();
    if own.is_empty() {
        return Err(PlantDefect::unknown(
            "inner",
            "joint",
            name,
            &model.groups(),
        ));
    }
    Ok(own)
}

/// Returns the coordinates that move with these joints and sites, each once.
fn moving(joints: &[JointMotion], sites: Option<&SiteReach>) -> Vec<usize> {
    let joints = joints.iter().map(|motion| motion.index);
    let sites = sites.into_iter().flat_map(SiteReach::coordinates);
    let mut indices: Vec<usize> = joints.chain(sites.copied()).collect();
    indices.sort_unstable();
    indices.dedup();
    indices
}

/// Returns the pose as the file gives it, with the controls there.
fn given(model: &RobotModel, spec: &PlantSpec) -> Result<Reference, PlantDefect> {
    let [positions, _, activations, controls] = model.sizes();
    let mujoco = &model.mujoco;
    let count = mujoco.ffi().nkey as usize;
    let names: Vec<&str> = (0..count)
        .map(|key| mujoco.id_to_name(MjtObjBase::mjOBJ_KEY, key))
        .map(Option::unwrap_or_default)
        .collect();
    let key = match &spec.keyframe {
        None => (count > 0).then_some(0),
        Some(name) => match names.iter().position(|known| known == name) {
            None => return Err(PlantDefect::unknown("keyframe", "keyframe", name, &names)),
            known => known,
        },
    };
    let of_key = |all: &[f64], size: usize| {
        let rows = key.and_then(|key| all.get(key * size..(key + 1) * size));
        rows.map(<[f64]>::to_vec)
    };
    let mut given = Reference {
        positions: of_key(mujoco.key_qpos(), positions).unwrap_or_else(|| mujoco.qpos0().to_vec()),
        activations: of_key(mujoco.key_act(), activations).unwrap_or(vec![0.0; activations]),
        controls: of_key(mujoco.key_ctrl(), controls).unwrap_or(vec![0.0; controls]),
    };
    if given.controls.iter().all(|control| *control == 0.0) {
        for (index, control) in given.controls.iter_mut().enumerate() {
            *control = model
                .range(index)
                .map_or(0.0, |[low, high]| (low + high) / 2.0);
        }
    }
    for (name, numbers) in &spec.pose {
        let Some(joint) = model.joints.iter().find(|joint| joint.name == *name) else {
            let names: Vec<&str> = model.joints.iter().map(|joint| &*joint.name).collect();
            return Err(PlantDefect::unknown("pose", "joint", name, &names));
        };
        let [size, _] = joint.numbers();
        if numbers.len() != size || !numbers.iter().all(|number| number.abs() < FINITE) {
            let what = if size == 1 {
                "one number"
            } else {
                &format!("{size} numbers")
            };
            return Err(PlantDefect::new("pose", format!("{name}: {what} expected")));
        }
        given.positions[joint.position..joint.position + size].copy_from_slice(numbers);
    }
    mujoco.normalize_quat(&mut given.positions);
    Ok(given)
}

/// A robot that all runs share.
pub(crate) type SharedRobot = Arc<Robot>;
