//! Ends a part of a run by the run time of the process that began it.

use std::{sync::Arc, time::Duration};

use crossbeam_channel::Sender;
use ratelab::{Command, Time};

use crate::{
    error::NetworkError,
    machine::{self, ClockMoment, Nanos},
    part::LocalPart,
    threads::Beat,
};

/// Time between two looks.
const PAUSE: Duration = Duration::from_millis(20);

/// The end of a part.
pub(crate) struct PartEnd {
    part: Arc<LocalPart>,
    /// Run time there.
    end: Time,
    commands: Sender<Command>,
    /// The process that listens, and run time zero there.
    hub: Option<(u64, ClockMoment)>,
    is_over: bool,
}

impl PartEnd {
    /// Stops the part by its `commands` at run time `end`.
    pub(crate) fn begin(
        part: &Arc<LocalPart>,
        end: Time,
        commands: Sender<Command>,
    ) -> Result<Beat, NetworkError> {
        let mut part_end = Self {
            part: part.clone(),
            end,
            commands,
            hub: None,
            is_over: false,
        };
        Beat::begin("end", PAUSE, move || part_end.look())
    }

    fn look(&mut self) {
        let end = Nanos::try_from(self.end.as_nanos()).unwrap_or(Nanos::MAX);
        if !self.is_over && self.passed().is_some_and(|passed| passed >= end) {
            self.is_over = true;
            // A run that has ended takes no command.
            let _ = self.commands.send(Command::Stop);
        }
    }

    /// Run time of the process that listens; `None` before its run. One that is gone counts on, until
    /// another one takes its place.
    fn passed(&mut self) -> Option<Nanos> {
        let peers = &self.part.peers;
        if let Some(hub) = peers.find(|info| info.is_hub)
            && self.hub.is_none_or(|(known, _)| known != hub.incarnation)
        {
            self.hub = peers.zero_of(hub.incarnation).map(|at| {
                let clock = hub.clock;
                (hub.incarnation, ClockMoment { clock, at })
            });
        }
        let (_, zero) = self.hub?;
        let estimate = self.part.times.offsets.estimate(zero.clock)?;
        Some(machine::now().saturating_sub(estimate.ours(zero.at)))
    }
}
