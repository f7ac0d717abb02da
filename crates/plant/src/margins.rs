//! What linear theory says of a robot: what it bears, and what nothing holds.

use ratelab::{Hz, sync::lock};
use ratelab_system::Setup;

use crate::{
    RobotPlant,
    late_loop::{LATE, LoopRates},
    nodes::ACTION,
    theory::BearableDelay,
};

impl RobotPlant {
    /// Returns the greatest constant delay of `/action` that linear theory allows a policy at `hz`;
    /// `None` where the controller has no gains.
    pub fn bearable_delay(&self, hz: Hz) -> Option<BearableDelay> {
        let rates = LoopRates {
            policy: hz,
            ..self.rates(&Setup::default())
        };
        self.bearable(ACTION, rates)
    }

    /// Returns the greatest constant delay of `topic` that linear theory allows `lqr` in a run with
    /// `setup`; `None` for a topic of another kind, with chunks, of which theory knows nothing, and where
    /// the controller has no gains.
    pub fn bearable_delay_of(&self, topic: &str, setup: &Setup) -> Option<BearableDelay> {
        let plans = self.chunks(setup).is_some();
        (!plans).then(|| self.bearable(topic, self.rates(setup)))?
    }

    /// Returns the greatest delay of `topic` that theory allows `lqr` at these rates.
    pub(crate) fn bearable(&self, topic: &str, rates: LoopRates) -> Option<BearableDelay> {
        let late = LATE.iter().position(|known| *known == topic)?;
        let gains = self.gains(rates.policy).ok()?;
        self.robot.bearable(&gains, rates, late)
    }

    /// Returns the lowest whole rate (Hz) such that no deviation grows at it, nor at any whole rate from
    /// there up to the policy's in `setup`, each with its own gains; `None` if one grows already at the
    /// policy's.
    pub fn lowest_rate(&self, setup: &Setup) -> Option<f64> {
        let rates = self.rates(setup);
        let is_steady = |rate: &f64| {
            let policy = Hz::new(*rate).ok();
            let grows = policy.and_then(|policy| {
                let gains = self.gains(policy).ok()?;
                self.robot.grows(&gains, LoopRates { policy, ..rates })
            });
            grows == Some(false)
        };
        let tried = (1..=rates.policy.get().ceil() as u64).rev();
        tried.map(|rate| rate as f64).take_while(is_steady).last()
    }

    /// Returns how fast each deviation grows that grows without a controller (1/s), the fastest first.
    pub fn poles(&self) -> Vec<f64> {
        self.robot.poles()
    }

    /// Returns the limit of the coordinates that the file names none for; `None` if it names all.
    pub fn other_limit(&self) -> Option<f64> {
        let (spec, groups) = (&self.robot.spec, self.robot.model.groups());
        let is_named = |group: &&str| spec.limits.iter().any(|(name, _)| name == group);
        let is_complete = groups.iter().all(is_named);
        (!is_complete).then(|| spec.limit("*"))
    }

    /// Returns whether contacts hold the robot: in a run they may open, which theory does not see.
    pub fn is_touching(&self) -> bool {
        self.robot.is_touching()
    }

    /// Returns the notes on what nothing holds under the gains for a policy at `hz`.
    pub(crate) fn notes(&self, hz: Hz) -> Vec<String> {
        let mut known = lock(&self.notes);
        if let Some((_, notes)) = known.iter().find(|(of, _)| *of == hz) {
            return notes.clone();
        }
        let robot = &self.robot;
        let free = self
            .gains(hz)
            .map(|gains| robot.free_coordinates(&gains, hz));
        let notes: Vec<String> = free
            .unwrap_or_default()
            .into_iter()
            .filter(|index| robot.limits[*index].is_finite())
            .map(|index| {
                let group = &robot.model.coordinates[index];
                let name = robot.coordinate(index);
                format!("nothing holds {name}: limits = {{ {group:?} = inf }}")
            })
            .collect();
        known.push((hz, notes.clone()));
        notes
    }
}
