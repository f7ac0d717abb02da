//! Random pushes on the joints of a robot.

use std::sync::Arc;

use ratelab::Chance;

use crate::{BodyData, PlantDefect, robot::Robot};

/// Name of the actuator's parameter for pushes.
pub(crate) const DISTURB: &str = "disturb";

/// The greatest standard deviation of a push (N, N·m).
const STRONGEST: f64 = 1e6;

/// No pushes, as text.
const NONE: &str = "0";

/// Random forces on coordinates, others every 20 ms.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct JointPushes {
    /// Their standard deviations (N, N·m).
    sigmas: Arc<[f64]>,
    text: Arc<str>,
}

impl JointPushes {
    /// None, until they are set.
    pub(crate) fn none() -> Self {
        Self {
            sigmas: [].into(),
            text: NONE.into(),
        }
    }

    /// Reads joints of `robot` with a standard deviation each, such as `low 0.1`; 0 for none.
    pub(crate) fn parse(robot: &Robot, text: &str) -> Result<Self, PlantDefect> {
        let groups = &robot.model.coordinates;
        let mut sigmas = vec![0.0; groups.len()];
        let words: Vec<&str> = text.split_whitespace().collect();
        if words == [NONE] {
            return Ok(Self::none());
        }
        let refused = || {
            let what = format!(
                "{text:?} is not a disturbance: expected a joint and a standard deviation, 0 to \
                 {STRONGEST} N or N m, such as {} 0.1",
                groups[0]
            );
            PlantDefect::new(DISTURB, what)
        };
        if words.is_empty() {
            return Err(refused());
        }
        for pair in words.chunks(2) {
            let sigma = pair.get(1).and_then(|sigma| sigma.parse().ok());
            let sigma = sigma.filter(|sigma| (0.0..=STRONGEST).contains(sigma));
            let sigma = sigma.ok_or_else(refused)?;
            let known = robot.model.groups();
            if !known.contains(&pair[0]) {
                return Err(PlantDefect::unknown(DISTURB, "joint", pair[0], &known));
            }
            let pushed = groups.iter().zip(&mut sigmas);
            for (_, own) in pushed.filter(|(group, _)| **group == pair[0]) {
                *own = sigma;
            }
        }
        if sigmas.iter().all(|sigma| *sigma == 0.0) {
            return Ok(Self::none());
        }
        Ok(Self {
            sigmas: sigmas.into(),
            text: words.join(" ").into(),
        })
    }

    /// Returns the text that gives the same pushes.
    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    pub(crate) fn is_none(&self) -> bool {
        self.sigmas.is_empty()
    }

    /// Pushes the robot in the 20 ms with this number of the run of `seed`.
    pub(crate) fn push(&self, data: &mut BodyData, seed: u64, stretch: u64) {
        let chance = Chance {
            seed,
            what: DISTURB,
            name: "plant",
        };
        let forces = data.qfrc_applied_mut();
        forces.fill(0.0);
        for (index, (force, sigma)) in forces.iter_mut().zip(&*self.sigmas).enumerate() {
            if *sigma > 0.0 {
                *force = sigma * chance.normal(format!("{stretch}.{index}"));
            }
        }
    }
}
