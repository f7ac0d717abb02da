//! The numbers of a robot by name, and its plots.

use ratelab_system::{Signal, SignalValue};

use crate::{
    model::JointKind,
    nodes::STATE,
    reach::SiteReach,
    robot::{Robot, SharedRobot},
    target::site_errors,
};

/// The distance of a site up to which a plot reaches at the least (m).
const WIDEST: f64 = 0.1;

impl Robot {
    /// Returns the plots: distances from a reference that moves, joints with one coordinate, then
    /// the controls.
    pub(crate) fn signals(&self) -> Vec<Signal> {
        let controls = self.half.len();
        let [_, count, ..] = self.model.sizes();
        let entry =
            |index: usize| SignalValue::new(move |row| row.get(index).copied().unwrap_or(f64::NAN));
        let moving = &self.moving;
        let joints = self
            .model
            .joints
            .iter()
            .filter(|joint| joint.is_single())
            .filter_map(|joint| {
                let index =
                    (0..count).find(|index| self.model.coordinates[*index] == joint.name)?;
                let (limit, here) = (self.limits[index], self.at.positions[joint.position]);
                let is_angle = joint.kind == JointKind::Hinge;
                let widest = if limit.is_finite() { 1.2 * limit } else { 1.0 };
                Some(Signal {
                    name: joint.name.clone().into(),
                    unit: if is_angle { "rad" } else { "m" }.into(),
                    topic: STATE.into(),
                    value: entry(controls + joint.position),
                    limits: (limit.is_finite() && !moving.contains(&index))
                        .then_some([here - limit, here + limit]),
                    range: [here - widest, here + widest],
                })
            });
        let pushes = self
            .model
            .control_names()
            .into_iter()
            .enumerate()
            .map(|(index, name)| {
                let (at, half) = (self.at.controls[index], self.half[index]);
                let range = self.model.range(index);
                Signal {
                    name: name.into(),
                    unit: "".into(),
                    topic: STATE.into(),
                    value: entry(index),
                    limits: None,
                    range: range.unwrap_or([at - half, at + half]),
                }
            });
        self.errors()
            .into_iter()
            .chain(joints)
            .chain(pushes)
            .collect()
    }

    /// Returns the plots of the distances from a reference that moves.
    fn errors(&self) -> Vec<Signal> {
        let controls = self.half.len();
        let behind = controls + self.model.state_size();
        let errors = self
            .moving
            .iter()
            .enumerate()
            .filter_map(|(number, &index)| {
                let name = &self.model.coordinates[index];
                let joint = self.model.joints.iter().find(|joint| joint.name == *name)?;
                let (place, here) = (controls + joint.position, self.at.positions[joint.position]);
                let error = move |row: &[f64]| {
                    let [now, moved] =
                        [place, behind + number].map(|index| row.get(index).copied());
                    now.zip(moved)
                        .map_or(f64::NAN, |(now, moved)| now - here - moved)
                };
                let limit = Some(self.limits[index]).filter(|limit| limit.is_finite());
                let widest = 1.2 * limit.unwrap_or(1.0);
                Some(Signal {
                    name: format!("{name} error").into(),
                    unit: self.unit(index).into(),
                    topic: STATE.into(),
                    value: SignalValue::new(error),
                    limits: limit.map(|limit| [-limit, limit]),
                    range: [-widest, widest],
                })
            });
        errors.collect()
    }

    /// Returns the names of what a state has behind its numbers where the reference moves.
    pub(crate) fn moving_names(&self) -> Vec<String> {
        let name = |index: &usize| {
            let (group, unit) = (&self.model.coordinates[*index], self.unit(*index));
            format!("{group} reference ({unit})")
        };
        self.moving.iter().map(name).collect()
    }

    /// Returns the names of the numbers of a target.
    pub(crate) fn target_names(&self) -> Vec<String> {
        let groups = 0..self.limits.len();
        let amounts = groups.clone().map(|index| self.coordinate(index));
        let speeds = groups.map(|index| format!("{} speed", self.coordinate(index)));
        amounts.chain(speeds).collect()
    }

    /// Returns the unit of a coordinate.
    pub(crate) fn unit(&self, index: usize) -> &'static str {
        let mut joints = self.model.joints.iter();
        let mut left = index;
        let joint = joints.find(|joint| {
            let count = joint.numbers()[1];
            let is_here = left < count;
            if !is_here {
                left -= count;
            }
            is_here
        });
        match joint.map(|joint| joint.kind) {
            Some(JointKind::Slide) => "m",
            Some(JointKind::Free) if left < 3 => "m",
            _ => "rad",
        }
    }

    /// Returns the names of the numbers of a state.
    pub(crate) fn state_names(&self) -> Vec<String> {
        let [positions, coordinates, activations, _] = self.model.sizes();
        let joints = || self.model.joints.iter();
        let mut names = Vec::new();
        for (joint, speeds) in joints()
            .map(|joint| (joint, false))
            .chain(joints().map(|joint| (joint, true)))
        {
            let [of_positions, of_speeds] = joint.numbers();
            let count = if speeds { of_speeds } else { of_positions };
            let unit = match (joint.kind, speeds) {
                (JointKind::Slide, false) => " (m)",
                (JointKind::Slide, true) => " (m/s)",
                (JointKind::Hinge, false) => " (rad)",
                (JointKind::Hinge | JointKind::Ball, true) => " (rad/s)",
                _ => "",
            };
            let what = if speeds { "speed" } else { "position" };
            for number in 1..=count {
                let number = if count == 1 {
                    String::new()
                } else {
                    format!(" {number}")
                };
                names.push(format!("{} {what}{number}{unit}", joint.name));
            }
        }
        debug_assert_eq!(names.len(), positions + coordinates);
        names.extend((1..=activations).map(|number| format!("activation {number}")));
        names
    }
}

/// Returns the plots of the distances of sites from where they are to be.
pub(crate) fn site_signals(robot: &SharedRobot) -> Vec<Signal> {
    let signals = robot
        .reach
        .iter()
        .flat_map(SiteReach::names)
        .enumerate()
        .map(|(number, name)| {
            let owner = robot.clone();
            let error = move |row: &[f64]| {
                let errors = owner
                    .reach
                    .as_ref()
                    .and_then(|reach| site_errors(reach, &owner, row));
                errors
                    .and_then(|errors| errors.get(number).copied())
                    .unwrap_or(f64::NAN)
            };
            Signal {
                name: format!("{name} error").into(),
                unit: "m".into(),
                topic: STATE.into(),
                value: SignalValue::new(error),
                limits: None,
                range: [-WIDEST, WIDEST],
            }
        });
    signals.collect()
}
