//! Runs in several processes: `node`, `up` with all parts of a graph on this machine, and the
//! dashboard over them.

mod again;
mod node;

use std::{
    env, io,
    net::TcpListener,
    path::PathBuf,
    process::{ChildStdin, Command, Output, Stdio},
    slice,
    sync::{Arc, Mutex},
    thread::{self, JoinHandle},
    time::Duration,
};

use ratelab::{Time, sync::lock};
use ratelab_experiment::{Config, Experiment, Summary};
use ratelab_network::{
    Follower, NetworkError, Recordings, RemoteRun, SessionEnd, Settings, USUAL, parts,
};
use ratelab_recording::{Destination, FinishedRecording, RecordError};
use ratelab_screen::{Options, terminal_is_there};

pub use node::node;

use crate::{
    cli::{ProcessArgs, UpArgs},
    error::Error,
    output::{note, print_line, record_error},
    program::Program,
    screen::screen,
    signals,
};
use node::Part;

impl From<NetworkError> for Error {
    fn from(error: NetworkError) -> Self {
        match error {
            NetworkError::Setting(why) => Self::BadInput(why),
            NetworkError::Taken(why) | NetworkError::Network(why) => Self::Network(why),
        }
    }
}

/// Returns the connection of a dashboard to the process that listens at `address`.
pub fn attached(address: &str, file: Option<PathBuf>, wait: Option<Duration>) -> Settings {
    let end = SessionEnd::Connect(vec![address.to_owned()]);
    Settings {
        file,
        wait,
        ..Settings::new(end, note)
    }
}

/// Returns the address of the process that listens.
fn address(settings: &Settings) -> &str {
    let (SessionEnd::Connect(addresses) | SessionEnd::Listen(addresses)) = &settings.end;
    addresses.first().map_or(USUAL, String::as_str)
}

/// What a dashboard leaves.
pub struct SeenRuns {
    /// The summary of the last run, and whether that run ended.
    pub last: Option<(Summary, bool)>,
    /// The recordings.
    pub recorded: Vec<Result<FinishedRecording, RecordError>>,
}

/// Opens the dashboard until the person leaves; the run goes on. Records what it shows to
/// `destination`, if there is one.
pub fn show(
    program: &Program,
    settings: Settings,
    destination: Option<Destination>,
    options: &Options,
) -> Result<SeenRuns, Error> {
    let experiment = Experiment::new(Arc::clone(&program.system), &Config::default())?;
    let follower = Follower::connect(&settings, program.system.name())?;
    let recordings = Arc::new(Mutex::new(Recordings::new(destination)));
    let commands = again::CommandLines::new(address(&settings), program.built_in.name());
    let run = RemoteRun::new(
        follower,
        &experiment,
        recordings.clone(),
        Box::new(commands),
    );
    drop(experiment);
    let left = ratelab_screen::watch(run, options).map_err(Error::from);
    let mut recordings = lock(&recordings);
    let recorded = recordings.finish().map_err(record_error)?;
    left.map(|()| SeenRuns {
        last: recordings.last.take(),
        recorded,
    })
}

/// The port of zenoh's routers, where others on this machine look.
const USUAL_PORT: u16 = 7447;

/// Runs the parts as processes until the one with the first node ends. A child has the same
/// command line, and its part.
pub fn up(program: &Program, args: &UpArgs) -> Result<(), Error> {
    node::check_ros(program, &args.ros)?;
    let config = node::config(program, &args.graph)?;
    let graph = node::topology(program, &config)?;
    let parts = parts::apart(&*program.system, &graph);
    let Some(first) = parts.first() else {
        return Err(Error::BadInput("the graph has no nodes".to_owned()));
    };
    if let Some([part, address]) = args.part.as_deref() {
        return child(program, args, config, (part, part == first), address);
    }
    let address = format!("tcp/127.0.0.1:{}", free_port(args.port)?);
    let shown = terminal_is_there();
    let start = |part: &String| ChildProcess::start(part, &address, shown);
    let mut hub = start(first)?;
    let others: Vec<ChildProcess> = parts.iter().skip(1).map(start).collect::<Result<_, _>>()?;
    if shown {
        return show_all(program, args, &address, hub, others);
    }
    let input = hub.input.take();
    signals::watch(move || drop(input), || ());
    let (_, ended) = hub.end();
    drop(others);
    ended
}

/// Runs one part. The run lasts as long as its first part does, which is the one that ROS sees.
fn child(
    program: &Program,
    args: &UpArgs,
    mut config: Config,
    (part, is_first): (&String, bool),
    address: &str,
) -> Result<(), Error> {
    let mut process = ProcessArgs {
        child: true,
        ..ProcessArgs::default()
    };
    let command = if is_first {
        process.network.listen = vec![address.to_owned()];
        process.ros = args.ros.clone();
        process.again = config.end == Time::MAX;
        again::up_line()
    } else {
        process.network.connect = vec![address.to_owned()];
        config.end = Time::MAX;
        again::part_line(part, address)
    };
    let part = Part {
        nodes: slice::from_ref(part),
        config,
        command,
    };
    node::run(program, &args.graph, &part, &process)
}

/// Shows the run until the person leaves, then ends all parts.
fn show_all(
    program: &Program,
    args: &UpArgs,
    address: &str,
    mut hub: ChildProcess,
    others: Vec<ChildProcess>,
) -> Result<(), Error> {
    let settings = attached(address, None, None);
    let left = show(program, settings, None, &screen(&args.screen));
    let ended_before = hub.has_ended();
    // The plant ends first: it would miss the policy.
    let (printed, ended) = hub.end();
    drop(others);
    if !printed.is_empty() {
        print_line(last_summary(&printed))?;
    }
    left?;
    if ended_before { ended } else { Ok(()) }
}

/// Returns the summary of the last of several runs.
fn last_summary(printed: &str) -> &str {
    let begins = printed.rfind("\nclock ").map_or(0, |before| before + 1);
    printed[begins..].trim_end()
}

/// A child; dropping ends it.
struct ChildProcess {
    part: String,
    /// The child stops when this ends.
    input: Option<ChildStdin>,
    /// Waits for its end, so that nothing is left of it then; takes what it prints, where the
    /// dashboard has the terminal.
    ended: Option<JoinHandle<io::Result<Output>>>,
}

impl ChildProcess {
    fn start(part: &str, address: &str, shown: bool) -> Result<Self, Error> {
        let program =
            env::current_exe().map_err(|why| Error::Network(format!("cannot start: {why}")))?;
        let mut command = Command::new(program);
        command.args(env::args_os().skip(1));
        command.args(["--part", part, address]);
        if shown {
            // The dashboard has the terminal.
            command.stdout(Stdio::piped()).stderr(Stdio::null());
        }
        let child = command.stdin(Stdio::piped()).spawn();
        let mut child =
            child.map_err(|why| Error::Network(format!("cannot start a process: {why}")))?;
        Ok(Self {
            part: part.to_owned(),
            input: child.stdin.take(),
            ended: Some(thread::spawn(move || child.wait_with_output())),
        })
    }

    /// Returns whether it has ended.
    fn has_ended(&self) -> bool {
        self.ended.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Asks it to end, unless its input is elsewhere, and waits for that; returns what it
    /// printed, and how it ended.
    fn end(&mut self) -> (String, Result<(), Error>) {
        drop(self.input.take());
        let Some(Ok(ended)) = self.ended.take().map(JoinHandle::join) else {
            return (String::new(), Ok(()));
        };
        let printed = ended.as_ref().map(|output| &output.stdout[..]);
        let printed = String::from_utf8_lossy(printed.unwrap_or_default()).into_owned();
        let why = match ended {
            Ok(output) if output.status.success() => return (printed, Ok(())),
            _ if signals::exit_code().is_some() => return (printed, Ok(())),
            Ok(output) => output.status.to_string(),
            Err(why) => why.to_string(),
        };
        let why = format!("the process of {}: {why}", self.part);
        (printed, Err(Error::Network(why)))
    }
}

impl Drop for ChildProcess {
    fn drop(&mut self) {
        // Whoever needs its end has asked for it.
        let _ = self.end();
    }
}

/// Returns a port that is free; the `asked` one, unless that is `None`.
fn free_port(asked: Option<u16>) -> Result<u16, Error> {
    let port = asked.unwrap_or(USUAL_PORT);
    TcpListener::bind(("127.0.0.1", port))
        .and_then(|free| free.local_addr())
        .map(|address| address.port())
        .map_err(|why| {
            Error::BadInput(format!(
                "--port {}: {why}: try another, or 0 for any",
                asked.unwrap_or(USUAL_PORT)
            ))
        })
}
