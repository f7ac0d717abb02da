//! From what a sweep is asked for to the sweep.

use ratelab::{
    experiment::{Config, sweep::Sweep},
    policy::{PolicyCache, PolicySpec},
};

use crate::{cli::SweepArgs, error::Error};

impl SweepArgs {
    /// The sweep that the options describe.
    ///
    /// Its policies are read into `cache`.
    pub fn sweep(&self, cache: &PolicyCache) -> Result<Sweep, Error> {
        let lists = self.policy.iter();
        let policies: Vec<&PolicySpec> = lists.flat_map(|list| &list.0).collect();
        let twice = |(place, policy)| policies[..place].contains(policy);
        if let Some((_, policy)) = policies.iter().enumerate().find(|entry| twice(*entry)) {
            let why = format!("--policy lists {policy} twice: give each policy once");
            return Err(Error::BadInput(why));
        }
        let policies = policies.iter().map(|policy| cache.pin(policy));
        let policies = policies.collect::<Result<_, _>>();
        let policies = policies.map_err(|error| Error::BadInput(format!("--policy {error}")))?;
        let usual = Config::default();
        Ok(Sweep {
            policies,
            sensor_hz: self.sensor_hz.clone().into(),
            queue_depths: self.queue_depth.clone().into(),
            control_hz: self.control_hz.clone().into(),
            seeds: self.seeds.clone().into(),
            base: Config {
                end: self.duration_s.unwrap_or(usual.end),
                ..usual
            },
        })
    }
}
