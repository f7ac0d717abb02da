//! Programs in recordings: their mark, and their answers.

use std::{
    process::{self, Command},
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::{SystemTime, UNIX_EPOCH},
};

use ratelab_system::RecordedAnswers;

use crate::{AnswerKind, Moment, RowPolicy};

/// Answers as a program did when the run was recorded. An answer that was never released, for the
/// run or the node ended before, is none that matters.
pub struct RecordedPolicy {
    answers: Arc<RecordedAnswers>,
    moment: Moment,
    answer: Vec<f64>,
}

impl RecordedPolicy {
    /// Creates one with answers of so many numbers.
    pub fn new(answers: Arc<RecordedAnswers>, count: usize) -> Self {
        Self {
            answers,
            moment: Moment::default(),
            answer: vec![0.0; count],
        }
    }
}

impl RowPolicy for RecordedPolicy {
    fn begin(&mut self, moment: Moment) {
        self.moment = moment;
    }

    /// Returns the actions: the last numbers of the message, which is an action or a chunk.
    fn answer(&mut self, _: &[f64]) -> &[f64] {
        let answer = self.answers.get(&self.moment.now);
        let row = answer.and_then(|answer| answer.as_ref().ok());
        let count = self.answer.len();
        match row.and_then(|row| row.get(row.len().checked_sub(count)?..)) {
            Some(actions) => self.answer.copy_from_slice(actions),
            None => self.answer.fill(0.0),
        }
        &self.answer
    }

    fn kind(&self) -> AnswerKind {
        AnswerKind::WholeChunk
    }

    fn crash(&mut self) -> Option<String> {
        let answer = self.answers.get(&self.moment.now)?;
        answer.as_ref().err().cloned()
    }
}

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
            let killed = all
                .filter_map(|entry| entry.file_name().to_str()?.parse().ok())
                .filter_map(Pid::from_raw)
                .filter(|pid| kill_marked(*pid, mark).is_ok());
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
