//! A mark in the environment of a program, by which all that it has started is found again: also
//! what made a session of its own, and whose parent has ended. On Linux, where processes show their
//! environment.

use std::{
    process::{self, Command},
    sync::atomic::{AtomicU64, Ordering},
    time::{SystemTime, UNIX_EPOCH},
};

/// The variable with the mark.
const VARIABLE: &str = "RATELAB_POLICY_PROGRAM";

/// The mark of one program.
pub struct ProcessMark(String);

impl ProcessMark {
    /// Creates a mark that no other program has, now or earlier.
    pub fn new() -> Self {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let now = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default()
            .as_nanos();
        Self(format!("{}-{number}-{now}", process::id()))
    }

    /// Marks a program that is about to be started.
    pub fn put_on(&self, command: &mut Command) {
        command.env(VARIABLE, &self.0);
    }

    /// Kills every process with this mark, and the processes that they start meanwhile.
    pub fn kill_all(&self) {
        #[cfg(target_os = "linux")]
        linux::kill_all(format!("{VARIABLE}={}", self.0).as_bytes());
    }
}

#[cfg(target_os = "linux")]
mod linux {
    use std::{fs, io};

    use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open, pidfd_send_signal};

    /// Maximum number of searches: a process that does not end is found again.
    const LOOKS: usize = 8;

    pub fn kill_all(mark: &[u8]) {
        for _ in 0..LOOKS {
            let all = fs::read_dir("/proc").into_iter().flatten().flatten();
            let names = all.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
            let pids = names.filter_map(Pid::from_raw);
            let killed = pids.filter(|pid| kill_marked(*pid, mark).is_ok());
            if killed.count() == 0 {
                return;
            }
        }
    }

    /// Kills the process `pid` if it has the mark, by a handle: the number may soon be another's.
    fn kill_marked(pid: Pid, mark: &[u8]) -> io::Result<()> {
        let process = pidfd_open(pid, PidfdFlags::empty())?;
        let environment = fs::read(format!("/proc/{pid}/environ"))?;
        if environment.split(|byte| *byte == 0).any(|set| set == mark) {
            Ok(pidfd_send_signal(process, Signal::KILL)?)
        } else {
            Err(io::ErrorKind::NotFound.into())
        }
    }
}
