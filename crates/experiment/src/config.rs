//! The configuration of a run.

use ratelab::{ClockKind, Knob, Speed, Time, TimedKnob};
use serde::{Deserialize, Serialize};

use ratelab_system::{About, BuildError, Setup, System, WorldKind};

/// All inputs of a run of a system. Under the virtual clock the same configuration gives
/// the same run, bit for bit.
///
/// ```
/// use ratelab_experiment::Config;
/// use ratelab_system::KnobText;
///
/// let config = Config {
///     knobs: KnobText::default().parse_list("5 rate camera 200")?,
///     ..Config::default()
/// };
/// assert_eq!(config.end.as_secs_f64(), 10.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Seed of the initial state and of every random number.
    pub seed: u64,
    /// The clock at the start of the run.
    pub clock: ClockKind,
    /// Speed of virtual time.
    pub speed: Speed,
    /// Run time at the end; [`Time::MAX`] for an endless run.
    pub end: Time,
    /// Whether the plant waits for the robot.
    #[serde(default, skip_serializing_if = "WorldKind::is_course")]
    pub world: WorldKind,
    /// Knobs set before the run begins.
    pub setup: Setup,
    /// Timed changes of knobs during the run.
    pub knobs: Vec<TimedKnob>,
}

impl Config {
    /// Returns the same run with the settings of the system that it does not replace, and with its
    /// messages in recordable form; see
    /// [`SystemKnobs::resolve`](ratelab_system::SystemKnobs::resolve).
    ///
    /// # Errors
    /// [`BuildError::Setting`] if the system refuses a message.
    pub fn resolved(&self, system: &dyn System) -> Result<Self, BuildError> {
        let mut resolved = self.clone();
        let about = system.about();
        let mut setup = about.setup();
        setup.extend(about.with_followers(self.setup.iter()));
        let recordable = |knob: &Knob| {
            let resolved = system.resolved(self.seed, &setup, knob.clone());
            resolved.map_err(BuildError::Setting)
        };
        resolved.setup = setup.iter().map(recordable).collect::<Result<_, _>>()?;
        resolved.knobs = self.followed(&about);
        for timed in &mut resolved.knobs {
            timed.knob = recordable(&timed.knob)?;
        }
        Ok(resolved)
    }

    /// Returns the timed changes, each with what follows from it unless that is among them.
    fn followed(&self, about: &About<'_>) -> Vec<TimedKnob> {
        let is_known = |follower: &TimedKnob| {
            self.knobs
                .iter()
                .any(|timed| timed.at == follower.at && timed.knob.is_of(&follower.knob))
        };
        let with_followers = |timed: &TimedKnob| {
            let at = timed.at;
            let new: Vec<TimedKnob> = about
                .followers(&timed.knob)
                .map(|knob| TimedKnob { at, knob })
                .filter(|knob| !is_known(knob))
                .collect();
            [vec![timed.clone()], new].concat()
        };
        self.knobs.iter().flat_map(with_followers).collect()
    }
}

impl Default for Config {
    /// Seed 0, ten seconds of virtual time without pacing, and the system's defaults for
    /// the rest.
    fn default() -> Self {
        Self {
            seed: 0,
            clock: ClockKind::Virtual,
            speed: Speed::Unlimited,
            end: Time::from_nanos(10_000_000_000),
            world: WorldKind::Course,
            setup: Setup::default(),
            knobs: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use ratelab_system::{KnobText, graph_file::GraphFile};

    use super::*;

    const ROBOT: &str = "
        name = 'robot'
        node.camera = { rate = 40, publishes = ['/image'] }
        node.planner = { rate = 'camera / 4', reads = ['/image'] }
    ";

    #[test]
    fn a_timed_change_brings_what_follows_from_it_unless_that_is_listed() {
        let system = GraphFile::parse(ROBOT).expect("a graph");
        let system = system.system(&[]).expect("a system");
        for (knobs, expected) in [
            ("1 rate camera 20", "1 rate camera 20\n1 rate planner 5"),
            (
                "1 rate camera 20\n1 rate planner 7",
                "1 rate camera 20\n1 rate planner 7",
            ),
            (
                "1 rate camera 20\n2 rate planner 7",
                "1 rate camera 20\n1 rate planner 5\n2 rate planner 7",
            ),
            ("1 depth /image 2", "1 depth /image 2"),
        ] {
            let text = KnobText::default();
            let config = Config {
                knobs: text.parse_list(knobs).expect(knobs),
                ..Config::default()
            };
            let resolved = config.resolved(&system).expect("a configuration");
            assert_eq!(text.lines(&resolved.knobs).join("\n"), expected);
        }
    }
}
