//! The graph of a run: sensor, policy and actuator around the robot, and the inner loop of a cascade.

use nalgebra::DMatrix;
use ratelab::{Tick, Topic, Wiring};
use ratelab_policy::chunk::{ChunkNodes, ChunkPlanner, ChunkSettings};
use ratelab_system::{BuildError, Builder, SharedWorld, graph_file::PLANT_POLICIES};

use crate::{
    RobotPlant,
    cascade::{COMMAND, INNER, INNER_OBS, INNER_SENSOR, RobotInner},
    decide::{PolicyMaker, RobotLaw},
    law::Law,
    nodes::{
        ACTION, ACTUATOR, NOISE, OBS, POLICY, RobotActuator, RobotPolicy, RobotSensor,
        SENSE_TO_ACT, SENSOR, STATE, SensorNoise,
    },
    planned::{PlannedRobot, RobotCopy},
    system::setting,
    target::{RobotTarget, TARGET, TARGET_NODE, TargetReader},
    world::{FreeRobot, JUDGED_NS, RobotRow},
};

/// The policy of a run at first.
struct FirstPolicy {
    name: String,
    law: RobotLaw,
    maker: PolicyMaker,
}

impl RobotPlant {
    /// Adds the nodes of a run.
    pub(crate) fn graph(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let policy = self.policy(builder)?;
        let controls = self.robot.model.control_names();
        let observed = self.robot.state_names().into_iter();
        let observed: Vec<String> = observed.chain(self.robot.terms.names()).collect();
        let readings = rows(builder, OBS, &observed);
        let actions = rows(builder, ACTION, &controls);
        let plant = self.plant(builder)?;
        self.sensor(builder, SENSOR, &plant, &readings)?;
        let readings = builder.through(&readings, 0)?;
        let targets = self.targets(builder)?;
        let commands = match &self.robot.spec.inner {
            Some(_) => rows(builder, COMMAND, &controls),
            None => actions.clone(),
        };
        let mut last = self.policy_node(builder, policy, &targets, [&readings, &commands])?;
        if self.robot.spec.inner.is_some() {
            let commands = builder.through(&commands, last)?;
            last += 1;
            self.inner(builder, (&plant, last), targets, [&commands, &actions])?;
        }
        let actions = builder.through(&actions, last)?;
        let robot = self.robot.clone();
        let hz = self.robot.rate_of(ACTUATOR);
        builder.node(ACTUATOR, hz.get(), last + 1, move |wiring| RobotActuator {
            robot: robot.clone(),
            plant: plant.clone(),
            actions: wiring.subscription(&actions),
            sense_to_act: wiring.meter(SENSE_TO_ACT),
            command: None,
        })
    }

    /// Adds the sensor called `node`.
    fn sensor(
        &self,
        builder: &mut Builder<'_>,
        node: &str,
        plant: &SharedWorld<FreeRobot>,
        readings: &Topic<RobotRow>,
    ) -> Result<(), BuildError> {
        let noise = builder
            .parameter(node, NOISE)
            .map(str::parse::<SensorNoise>)
            .transpose()
            .map_err(setting)?
            .unwrap_or_default();
        let (robot, plant) = (self.robot.clone(), plant.clone());
        let (readings, seed) = (readings.clone(), builder.seed());
        let hz = self.robot.rate_of(node);
        builder.node(node, hz.get(), 0, move |wiring| RobotSensor {
            robot: robot.clone(),
            plant: plant.clone(),
            topic: readings.name().to_owned(),
            readings: wiring.publisher(&readings),
            noise,
            seed,
        })
    }

    /// Adds the inner loop, with its sensor, between the policy's commands and the actions.
    fn inner(
        &self,
        builder: &mut Builder<'_>,
        (plant, priority): (&SharedWorld<FreeRobot>, u32),
        targets: Option<Topic<RobotRow>>,
        [commands, actions]: [&Topic<RobotRow>; 2],
    ) -> Result<(), BuildError> {
        let readings = rows(builder, INNER_OBS, &self.robot.state_names());
        self.sensor(builder, INNER_SENSOR, plant, &readings)?;
        let readings = builder.through(&readings, 0)?;
        let gains = self.inner_gains(builder)?;
        let robot = self.robot.clone();
        let (commands, actions) = (commands.clone(), actions.clone());
        let rate = self.robot.rate_of(INNER);
        builder.node(INNER, rate.get(), priority, move |wiring| RobotInner {
            robot: robot.clone(),
            gains: gains.clone(),
            commands: wiring.subscription(&commands),
            readings: wiring.subscription(&readings),
            actions: wiring.publisher(&actions),
            target: TargetReader(targets.as_ref().map(|targets| wiring.subscription(targets))),
        })
    }

    /// Returns the gains of the inner loop of a run.
    fn inner_gains(&self, builder: &Builder<'_>) -> Result<DMatrix<f64>, BuildError> {
        let hz = self.rates(builder.setup()).policy;
        let [_, inner] = self.robot.split(&self.gains(hz).map_err(setting)?);
        Ok(inner)
    }

    /// Adds the robot that moves by itself, with the topic of its states.
    fn plant(&self, builder: &mut Builder<'_>) -> Result<SharedWorld<FreeRobot>, BuildError> {
        let robot = &self.robot;
        let fields = [
            robot.model.control_names(),
            robot.state_names(),
            robot.moving_names(),
        ];
        let rows = builder.internal_topic::<RobotRow>(STATE);
        builder.record_as(rows.clone(), fields.concat());
        let world = FreeRobot::new(robot.clone(), builder.seed()).map_err(setting)?;
        let judged_hz = 1e9 / JUDGED_NS as f64;
        builder.own_world(world, judged_hz, |wiring| {
            let rows = wiring.publisher(&rows);
            move |plant: &FreeRobot, tick: &mut Tick| plant.judge(tick, &rows)
        })
    }

    /// Adds the node that moves the reference, if it moves; returns what the policy reads of it.
    fn targets(&self, builder: &mut Builder<'_>) -> Result<Option<Topic<RobotRow>>, BuildError> {
        if !self.robot.is_moving() {
            return Ok(None);
        }
        let targets = builder.internal_topic::<RobotRow>(TARGET);
        builder.record_as(targets.clone(), self.robot.target_names());
        let (robot, published) = (self.robot.clone(), targets.clone());
        let rate = self.robot.spec.rate;
        builder.node(TARGET_NODE, rate.get(), 0, move |wiring| RobotTarget {
            robot: robot.clone(),
            targets: wiring.publisher(&published),
        })?;
        builder.through(&targets, 0).map(Some)
    }

    /// Returns the policy of a run at first, with its name.
    fn policy(&self, builder: &mut Builder<'_>) -> Result<FirstPolicy, BuildError> {
        let maker = self.maker(builder);
        let own = Some(&*self.robot.spec.policy).filter(|name| PLANT_POLICIES.contains(name));
        let name = match (builder.message(POLICY), own) {
            (Some(text), _) => text.to_owned(),
            (None, own) => own.unwrap_or(Law::Hold.name()).to_owned(),
        };
        if PLANT_POLICIES.contains(&&*name) {
            self.law(&name, maker.context.control_hz).map_err(setting)?;
        }
        let law = maker.make(&name).map_err(setting)?;
        Ok(FirstPolicy { name, law, maker })
    }

    /// Adds the node that decides, between topics of readings and actions, with the player of its chunks;
    /// returns the priority of the last of them.
    fn policy_node(
        &self,
        builder: &mut Builder<'_>,
        first: FirstPolicy,
        targets: &Option<Topic<RobotRow>>,
        [readings, actions]: [&Topic<RobotRow>; 2],
    ) -> Result<u32, BuildError> {
        let rate = self.robot.spec.rate;
        if let Some(settings) = ChunkSettings::take(builder, self.robot.actions(), &[])? {
            if targets.is_some() {
                return Err(setting("chunk is for a robot whose reference stands still"));
            }
            let nodes = ChunkNodes {
                settings,
                names: self.robot.model.control_names(),
                rate,
                paced: "it plays an action in each period of the rate in the file",
                observations: readings,
                actions,
            };
            return self.planned(builder, first, nodes);
        }
        let FirstPolicy { name, law, maker } = first;
        let (readings, actions) = (readings.clone(), actions.clone());
        let read = targets.clone();
        let policy = move |wiring: &mut Wiring<'_>, law| RobotPolicy {
            law,
            first: name.clone(),
            maker: maker.clone(),
            readings: wiring.subscription(&readings),
            actions: wiring.publisher(&actions),
            target: TargetReader(read.as_ref().map(|targets| wiring.subscription(targets))),
        };
        match law {
            RobotLaw::Own(law) => builder.node(POLICY, rate.get(), 1, move |wiring| {
                policy(wiring, RobotLaw::Own(law.clone()))
            }),
            law => builder.single_node(POLICY, rate.into(), 1, |wiring| policy(wiring, law)),
        }?;
        Ok(1)
    }

    /// Adds the nodes of a policy that answers with chunks.
    fn planned(
        &self,
        builder: &mut Builder<'_>,
        first: FirstPolicy,
        nodes: ChunkNodes<'_, RobotRow, RobotRow>,
    ) -> Result<u32, BuildError> {
        let robot = &self.robot;
        let inner = match &robot.spec.inner {
            Some(inner) => Some((self.inner_gains(builder)?, robot.steps_in(inner.rate))),
            None => None,
        };
        let model = RobotCopy {
            robot: robot.clone(),
            inner,
            plant: FreeRobot::new(robot.clone(), 0).map_err(setting)?,
            steps: robot.steps_in(robot.spec.rate),
        };
        let none = robot.at.controls.iter().map(|control| *control as f32);
        let planner = ChunkPlanner::new(&nodes.settings, model, none.collect());
        let FirstPolicy { name, law, maker } = first;
        let policy = PlannedRobot {
            law,
            first: name,
            maker,
        };
        nodes.add(builder, policy, planner)?;
        Ok(ChunkNodes::<RobotRow, RobotRow>::PRIORITY)
    }

    /// Returns what makes the policies of a run.
    fn maker(&self, builder: &Builder<'_>) -> PolicyMaker {
        let context = self.context(builder.seed(), builder.setup());
        let law = |name: &&str| self.law(name, context.control_hz).ok();
        PolicyMaker {
            robot: self.robot.clone(),
            laws: PLANT_POLICIES.iter().filter_map(law).collect(),
            files: self.files.clone(),
            context,
            answers: builder.answers(POLICY),
        }
    }
}

/// Creates a topic of rows whose numbers have these names.
fn rows(builder: &mut Builder<'_>, name: &str, fields: &[String]) -> Topic<RobotRow> {
    let topic = builder.internal_topic::<RobotRow>(name);
    builder.record_as(topic.clone(), fields.iter().cloned());
    topic
}
