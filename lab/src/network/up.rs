//! All parts of a graph as processes of this machine, with the dashboard where there is a
//! terminal.

use std::{
    env,
    ffi::OsString,
    io::{self, Read},
    net::TcpListener,
    process::{ChildStdin, ChildStdout, Command, ExitStatus, Stdio},
    thread::{self, JoinHandle},
};

use clap::{Arg, Args};
use ratelab::Time;
use ratelab_study::experiment::Experiment;

use super::{
    node, parts,
    show::{attached, show},
};
use crate::{
    cli::{NodeArgs, RosArgs, UpArgs, take_graph_file},
    dashboard::terminal_is_there,
    error::Error,
    output::print_line,
    program::Program,
    screen::screen,
    signals, stop_signal,
};

/// The port of zenoh's routers, where others on this machine look.
const USUAL_PORT: u16 = 7447;

/// Runs the parts as processes until the one with the first node ends.
pub fn up(program: &Program, args: &UpArgs) -> Result<(), Error> {
    let config = node::config(program, &args.graph)?;
    let whole = Experiment::new(program.system.clone(), &config)?;
    let graph = whole.observer().topology();
    let mut parts = parts::apart(&*program.system, &graph).into_iter();
    let address = format!("tcp/127.0.0.1:{}", free_port(args.port)?);
    let Some(first) = parts.next() else {
        return Err(Error::BadInput("the graph has no nodes".to_owned()));
    };
    drop(whole);
    let again = config.end == Time::MAX;
    let of_up = UpArgs::augment_args(clap::Command::new("up"));
    let of_node = NodeArgs::augment_args(clap::Command::new("node"));
    let knows = |arg: &Arg| {
        of_node
            .get_arguments()
            .any(|known| known.get_id() == arg.get_id())
    };
    let of_up_alone = of_up.get_arguments().filter(|arg| !knows(arg));
    let (graph_file, typed) = take_graph_file(env::args_os());
    let options = without(typed.into_iter().skip(2), of_up_alone);
    let shown = terminal_is_there();
    let start = |part: &str, end: [&str; 2], options: &[OsString], again: bool| {
        let program = env::current_exe();
        let program = program.map_err(|why| Error::Network(format!("cannot start: {why}")))?;
        let mut command = Command::new(program);
        command.args(&graph_file).arg("node").arg(part).args(end);
        command.arg("--child").args(options);
        command.args(again.then_some("--again"));
        ChildProcess::start(part, command, shown)
    };
    let mut hub = start(&first, ["--listen", &address], &options, again)?;
    // The run lasts as long as its first part does, which is the one that ROS sees.
    let of_ros = RosArgs::augment_args(clap::Command::new("ros"));
    let duration = of_up
        .get_arguments()
        .filter(|arg| arg.get_id() == "duration_s");
    let options = without(options.into_iter(), of_ros.get_arguments().chain(duration));
    let others = parts.map(|part| start(&part, ["--connect", &*address], &options, false));
    let others: Vec<ChildProcess> = others.collect::<Result<_, _>>()?;
    if !shown {
        let input = hub.input.take();
        signals::watch(move || drop(input), || ());
        let ended = hub.end();
        drop(others);
        return ended;
    }
    show_all(program, args, &address, hub, others)
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
    let printed = hub.printed.take();
    let ended = hub.end();
    drop(others);
    let printed = printed.and_then(|printed| printed.join().ok());
    let printed = printed.unwrap_or_default();
    if !printed.is_empty() {
        print_line(last_summary(&printed))?;
    }
    left?;
    if ended_before { ended } else { Ok(()) }
}

/// The summary of the last of several runs.
fn last_summary(printed: &str) -> &str {
    let begins = printed.rfind("\nclock ").map_or(0, |before| before + 1);
    printed[begins..].trim_end()
}

/// A child; dropping ends it.
struct ChildProcess {
    part: String,
    /// The child stops when this ends.
    input: Option<ChildStdin>,
    /// What it prints, where the dashboard has the terminal.
    printed: Option<JoinHandle<String>>,
    /// Waits for its end, so that nothing is left of it then.
    ended: Option<JoinHandle<io::Result<ExitStatus>>>,
}

impl ChildProcess {
    fn start(part: &str, mut command: Command, shown: bool) -> Result<Self, Error> {
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
            printed: child
                .stdout
                .take()
                .map(|output| thread::spawn(|| read(output))),
            ended: Some(thread::spawn(move || child.wait())),
        })
    }

    /// Whether it has ended.
    fn has_ended(&self) -> bool {
        self.ended.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Asks it to end, unless its input is elsewhere, and waits for that.
    fn end(&mut self) -> Result<(), Error> {
        drop(self.input.take());
        let Some(Ok(status)) = self.ended.take().map(JoinHandle::join) else {
            return Ok(());
        };
        let why = match status {
            Ok(status) if status.success() || stop_signal::exit_code().is_some() => return Ok(()),
            Ok(status) => status.to_string(),
            Err(why) => why.to_string(),
        };
        Err(Error::Network(format!(
            "the process of {}: {why}",
            self.part
        )))
    }
}

impl Drop for ChildProcess {
    fn drop(&mut self) {
        // Whoever needs its end has asked for it.
        let _ = self.end();
    }
}

/// All that a child prints.
fn read(mut output: ChildStdout) -> String {
    let mut printed = Vec::new();
    let _ = output.read_to_end(&mut printed);
    String::from_utf8_lossy(&printed).into_owned()
}

/// A port that is free; the `asked` one, if there is one.
fn free_port(asked: Option<u16>) -> Result<u16, Error> {
    let port = asked.unwrap_or(USUAL_PORT);
    let tried = TcpListener::bind(("127.0.0.1", port)).and_then(|free| free.local_addr());
    let port = tried.map(|address| address.port());
    port.map_err(|why| {
        Error::BadInput(format!(
            "--port {}: {why}: try another, or 0 for any",
            asked.unwrap_or(USUAL_PORT)
        ))
    })
}

/// The options in `args` without some of them, and without their values.
fn without<'a>(
    args: impl Iterator<Item = OsString>,
    others: impl Iterator<Item = &'a Arg>,
) -> Vec<OsString> {
    let others: Vec<&Arg> = others.collect();
    let (mut options, mut skip) = (Vec::new(), false);
    for arg in args {
        if std::mem::take(&mut skip) {
            continue;
        }
        let text = arg.to_string_lossy();
        let name = text.split('=').next().unwrap_or_default();
        match others.iter().find(|other| is_called(other, name)) {
            Some(other) => skip = other.get_action().takes_values() && !text.contains('='),
            None => options.push(arg),
        }
    }
    options
}

/// Whether `name` with its two dashes is a name of `option`.
fn is_called(option: &Arg, name: &str) -> bool {
    let aliases = option.get_all_aliases().unwrap_or_default();
    let mut names = option.get_long().into_iter().chain(aliases);
    name.strip_prefix("--")
        .is_some_and(|name| names.any(|known| known == name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::ScreenArgs;

    #[test]
    fn the_options_of_the_screen_are_not_for_the_parts() {
        let args = "--seed 3 --fps 10 --ascii --control-hz=20 --theme=dark --port 0 --break";
        let args = args.split(' ').map(OsString::from);
        let screen = ScreenArgs::augment_args(clap::Command::new("screen"));
        let port = [Arg::new("port").long("port")];
        let kept = without(args, screen.get_arguments().chain(&port));
        let kept: Vec<_> = kept.iter().map(|arg| arg.to_string_lossy()).collect();
        assert_eq!(kept.join(" "), "--seed 3 --control-hz=20 --break");
    }
}
