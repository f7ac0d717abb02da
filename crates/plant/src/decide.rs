//! The policy of a robot, which may be in a file, and be replaced while the robot moves.

use std::{error::Error, sync::Arc, time::Duration};

use ratelab::NodeError;
use ratelab_policy::{
    AnswerKind, Moment, PolicyContext, PolicyError, PolicyFault, PolicyFile, PolicyFiles,
    RowPolicy, RowShape,
};
use ratelab_system::{RecordedAnswers, graph_file::PLANT_POLICIES};
use thiserror::Error;

use crate::{PlantDefect, law::Law, robot::SharedRobot};

/// Makes the policies of a run.
#[derive(Clone)]
pub(crate) struct PolicyMaker {
    pub(crate) robot: SharedRobot,
    /// The laws that there are without a file.
    pub(crate) laws: Vec<Law>,
    pub(crate) files: PolicyFiles,
    pub(crate) context: PolicyContext,
    /// What the program answered when the run was recorded.
    pub(crate) answers: Option<Arc<RecordedAnswers>>,
}

impl PolicyMaker {
    /// Makes the policy called `text`, ready to be asked.
    ///
    /// # Errors
    /// The reason if it does not exist, does not fit or cannot be started.
    pub(crate) fn make(&self, text: &str) -> Result<RobotLaw, Box<dyn Error + Send + Sync>> {
        let name = text.trim();
        if PLANT_POLICIES.contains(&name) {
            let law = self.laws.iter().find(|law| law.name() == name).cloned();
            let law = law.ok_or_else(|| {
                PlantDefect::new("policy", format!("{name} has no gains at this rate"))
            })?;
            return Ok(RobotLaw::Own(law));
        }
        let (robot, answers) = (&self.robot, self.answers.as_ref());
        let shape = robot.shape(self.context);
        let file = PolicyFile::parse(name);
        let started = self.files.start(&file, self.context, shape, answers);
        let (rows, file) = started.map_err(|error| known(name, error))?;
        Ok(RobotLaw::File(Box::new(FileLaw {
            robot: robot.clone(),
            rows,
            last: vec![0.0; robot.half.len()],
            file,
        })))
    }
}

/// Returns an error in a file of a policy; of one that does not exist with the names of other
/// policies.
pub(crate) fn known(name: &str, error: PolicyError) -> PlantDefect {
    match *error.why {
        PolicyFault::Missing => PlantDefect::policy(name),
        _ => PlantDefect::new("policy", error.to_string()),
    }
}

/// What decides on the controls.
pub(crate) enum RobotLaw {
    /// A law that is made from the model.
    Own(Law),
    /// The policy in a file.
    File(Box<FileLaw>),
}

/// Asks the policy in a file.
pub(crate) struct FileLaw {
    robot: SharedRobot,
    rows: Box<dyn RowPolicy>,
    /// Its last answer.
    last: Vec<f64>,
    file: PolicyFile,
}

/// A policy answered with something else than a control.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("the {policy} policy answered {answer}: a control must be finite")]
pub(crate) struct NoControl {
    pub(crate) policy: String,
    pub(crate) answer: f64,
}

impl RobotLaw {
    /// Returns its name, as a message has it.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Own(law) => law.name().to_owned(),
            Self::File(law) => law.file.to_string(),
        }
    }

    /// Returns what its answers are.
    pub(crate) fn kind(&self) -> AnswerKind {
        match self {
            Self::Own(_) => AnswerKind::Action,
            Self::File(law) => law.rows.kind(),
        }
    }

    /// Hears of the tick in which it will be asked.
    pub(crate) fn begin(&mut self, moment: Moment) {
        if let Self::File(law) = self {
            law.rows.begin(moment);
        }
    }

    /// Returns the controls for a reading of `robot`: of a chunk one after the other, of a policy that
    /// has died none.
    pub(crate) fn answer(&mut self, robot: &SharedRobot, reading: &[f64]) -> Vec<f64> {
        match self {
            Self::Own(law) => law.controls(robot, reading),
            Self::File(law) => law.answer(reading),
        }
    }

    /// Returns why it has died in this tick, if it has.
    pub(crate) fn crash(&mut self) -> Option<String> {
        match self {
            Self::Own(_) => None,
            Self::File(law) => law.rows.crash(),
        }
    }

    /// Returns the controls for a reading of `robot`.
    ///
    /// # Errors
    /// [`NodeCrash`](ratelab::NodeCrash) of a program that has died, and any other reason that ends the
    /// run.
    pub(crate) fn controls(
        &mut self,
        robot: &SharedRobot,
        reading: &[f64],
        moment: Moment,
    ) -> Result<Vec<f64>, NodeError> {
        self.begin(moment);
        let controls = self.answer(robot, reading);
        if let Some(why) = self.crash() {
            return Err(ratelab::NodeCrash(why).into());
        }
        match controls.iter().find(|number| !number.is_finite()) {
            Some(answer) => Err(NoControl {
                policy: self.name(),
                answer: *answer,
            }
            .into()),
            None => Ok(controls),
        }
    }
}

impl FileLaw {
    fn answer(&mut self, reading: &[f64]) -> Vec<f64> {
        let robot = &self.robot;
        let answer = match robot.observed(reading, &self.last) {
            Some(observation) => self.rows.answer(&observation).to_vec(),
            None => Vec::new(),
        };
        let controls = if self.file.is_program {
            answer.clone()
        } else {
            let given = robot.given.controls.iter().cycle();
            let pairs = answer.iter().zip(given);
            pairs
                .map(|(output, given)| given + robot.spec.action * output)
                .collect()
        };
        // Of a chunk the first action.
        self.last = answer;
        self.last.resize(robot.half.len(), 0.0);
        controls
    }
}

impl crate::robot::Robot {
    /// Returns what a policy in a file sees, and answers with.
    pub(crate) fn shape(&self, context: PolicyContext) -> RowShape {
        let sees = match self.terms.size() {
            0 => self.model.state_size(),
            size => size,
        };
        RowShape {
            sees,
            acts: Some(self.half.len()),
            action_ns: Duration::as_nanos(&context.control_hz.period()) as u64,
        }
    }

    /// Returns what a policy sees that answered `last`, in a reading of the sensor; `None` for
    /// another amount of numbers.
    fn observed(&self, reading: &[f64], last: &[f64]) -> Option<Vec<f64>> {
        if self.terms.is_empty() {
            return Some(self.state_in(reading).to_vec());
        }
        let terms = reading.get(self.model.state_size()..)?;
        self.terms.whole(terms, last)
    }
}
