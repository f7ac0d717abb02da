//! The kinds of executors, as text.

use std::str::FromStr;

/// The accepted texts.
const EXPECTED: &str =
    "expected single, multi:THREADS, events, fixed-priority:CORES, edf:CORES or let";

/// The most threads of an executor.
const MOST_THREADS: usize = 1024;

/// Decides which of the nodes that are due ticks next, and where. A node without an
/// executor has a thread of its own, always ready.
///
/// | text | | order |
/// |---|---|---|
/// | `single` | one thread, `rclcpp::executors::SingleThreadedExecutor` | by windows |
/// | `multi:N` | N threads, `rclcpp::executors::MultiThreadedExecutor` | by windows |
/// | `events` | one thread, `rclcpp::experimental::executors::EventsExecutor` | first in, first out |
/// | `fixed-priority:N` | N cores, preemptive | by the priority of the node, lowest number first |
/// | `edf:N` | N cores, preemptive | by the deadline, earliest first |
/// | `let` | a core for each node, logical execution time | reads when due, publishes at the end of the period |
///
/// The rules of the first three are those of rclcpp 29.3.0 (`a0a2a06`) and rcl 9.2.0
/// (`c19dab5`). By windows: when nothing is ready any more, all that is ready by then is
/// looked up at once, and served in the order timers, subscriptions, each in the order of
/// registration, one message each (`executor.cpp:774-914`); what gets ready later waits
/// for the next look-up. (rclcpp promises no order within a kind since 28.0.1; here it is
/// the order of registration.) A timer is due one period after its start for the first
/// time (`timer.c:199`), and skips the instants that have passed when it is called, that of
/// the call included (`timer.c:298-319`): these are the overruns. A mutually exclusive
/// group runs one callback at a time: with several threads, a callback of a busy group
/// leaves the window, unless it is a timer (`executor.cpp:774-894`). The events executor
/// queues a timer when it is due and every message when it arrives
/// (`timers_manager.cpp:206-294`).
///
/// Preemptive executors follow the kernel of TrueTime (`63ae017`): jobs that are released
/// while the one before is unfinished queue up, with their release and deadline
/// (`ttkernel.cpp:323-344`), and of equals the first released runs. A job reads when it
/// begins and publishes when it is complete.
///
/// In virtual time all is exact: what happens at an instant happens before an executor
/// looks at it.
///
/// ```
/// use ratelab_effects::Executor;
///
/// assert_eq!("multi:2".parse(), Ok(Executor::Multi { threads: 2 }));
/// assert_eq!(
///     "multi".parse::<Executor>().unwrap_err(),
///     "\"multi\" is not an executor: expected single, multi:THREADS, events, \
///      fixed-priority:CORES, edf:CORES or let"
/// );
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::Display)]
#[strum(serialize_all = "kebab-case")]
pub enum Executor {
    /// One thread, by windows.
    Single,
    /// Several threads, by windows.
    #[strum(to_string = "multi:{threads}")]
    Multi {
        /// Their number, 1 to 1024.
        threads: usize,
    },
    /// One thread, in the order of the events.
    Events,
    /// Preemptive, by the priorities of the nodes.
    #[strum(to_string = "fixed-priority:{cores}")]
    FixedPriority {
        /// Number of cores, 1 to 1024.
        cores: usize,
    },
    /// Preemptive, by deadlines.
    #[strum(to_string = "edf:{cores}")]
    Edf {
        /// Number of cores, 1 to 1024.
        cores: usize,
    },
    /// Logical execution time.
    Let,
}

impl FromStr for Executor {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let refusal = |expected: &str| format!("{text:?} is not an executor: {expected}");
        let (name, number) = match text.trim().split_once(':') {
            Some((name, number)) => (name, Some(number)),
            None => (text.trim(), None),
        };
        let count = || {
            let count = number.and_then(|number| number.parse().ok());
            count
                .filter(|count| (1..=MOST_THREADS).contains(count))
                .ok_or_else(|| {
                    refusal(&format!(
                        "expected {name}:N with N from 1 to {MOST_THREADS}"
                    ))
                })
        };
        Ok(match (name, number) {
            ("single", None) => Self::Single,
            ("multi", Some(_)) => Self::Multi { threads: count()? },
            ("events", None) => Self::Events,
            ("fixed-priority", Some(_)) => Self::FixedPriority { cores: count()? },
            ("edf", Some(_)) => Self::Edf { cores: count()? },
            ("let", None) => Self::Let,
            _ => return Err(refusal(EXPECTED)),
        })
    }
}
