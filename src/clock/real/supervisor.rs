//! The calling thread: it carries out commands and watches the nodes.

use crossbeam_channel::Receiver;

use super::{
    ends::{Report, StretchEnd},
    mailbox::{Mailbox, Wakeup},
};
use crate::{
    clock::{ClockExit, crews, wall::Wall},
    command::Command,
    graph::ControlPlane,
    inbox::{Inbox, Received},
    journal::{End, Entries, Entry},
    sync::Arc,
    time::Time,
};

/// The calling thread: carries out commands and watches the nodes.
pub(super) struct Supervisor<'a> {
    pub(super) control: &'a mut ControlPlane,
    pub(super) inbox: &'a mut Inbox,
    pub(super) until: Time,
    pub(super) mailboxes: &'a [Arc<Mailbox>],
    pub(super) reports: Receiver<Report>,
    /// Number of threads with ticks left before the end.
    pub(super) working: usize,
    pub(super) log: Entries,
}

impl Supervisor<'_> {
    /// Starts the nodes; returns when they are to stop.
    pub(super) fn supervise(&mut self) -> StretchEnd {
        let wall = Wall::starting_at(self.control.now());
        self.control.state.set_zero(wall.zero());
        for mailbox in self.mailboxes {
            mailbox.post(Wakeup::Start(wall));
        }
        while self.working > 0 || wall.now() < self.until {
            match self.next_received(&wall) {
                Received::Command(command) => {
                    let exit = self.obey(command, wall.now());
                    match exit {
                        Some(ClockExit::HandedOver(_)) => return End::HandedOver.into(),
                        Some(_) => return End::Stopped.into(),
                        None if self.control.status.paused => return End::Paused.into(),
                        None => {}
                    }
                }
                Received::Other(None) => self.working -= 1,
                Received::Other(Some(end)) => return end,
                Received::Timeout => {}
            }
        }
        self.control.set_now(self.until);
        let until = self.until;
        End::Completed { until }.into()
    }

    /// A timed command that is due, or else whatever arrives before the next timed one.
    fn next_received(&mut self, wall: &Wall) -> Received<Report> {
        let now = wall.now();
        let timed = self.inbox.next_timed(self.until);
        if timed <= now
            && let Some(timed) = self.inbox.take_timed(self.until)
        {
            return Received::Command(timed.command);
        }
        let end = if now < self.until {
            self.until
        } else {
            Time::MAX
        };
        let deadline = wall.instant_of(timed.min(end));
        self.inbox.receive_or(&self.reports, deadline)
    }

    fn obey(&mut self, command: Command, at: Time) -> Option<ClockExit> {
        let node = command.node().map(|node| self.control.local_index(node));
        if let Some(Ok(index)) = node {
            self.mailboxes[index].post(Wakeup::Command(index, command));
            return None;
        }
        let obeyed = crews::supervise(self.control, &command, at);
        let event = obeyed.event as u64;
        self.log.note(Entry::Obey { at, event });
        obeyed.exit
    }

    /// Combines the reason for the stop with the nodes' reports: a failure has priority,
    /// then an end.
    pub(super) fn settle(&self, mut end: StretchEnd) -> StretchEnd {
        for report in self.reports.try_iter().flatten() {
            if end.fault.is_some() {
                break;
            }
            if report.fault.is_some() || !matches!(end.end, End::Ended { .. }) {
                end = report;
            }
        }
        end
    }
}
