//! All parts of a graph as processes of this machine, with the dashboard where there is a
//! terminal.

use std::{
    env,
    ffi::OsString,
    io::Read,
    net::TcpListener,
    process::{Child, Command, Stdio},
    thread::{self, JoinHandle},
};

use clap::{Arg, Args};
use ratelab::{experiment::Experiment, runtime::Time};

use super::{
    node, parts,
    show::{attached, show},
};
use crate::{
    cli::{NodeArgs, RosArgs, UpArgs},
    dashboard::terminal_is_there,
    error::Error,
    output::print_line,
    program::Program,
    screen::screen,
    signals,
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
    let options = without(env::args_os().skip(2), of_up_alone);
    let shown = terminal_is_there();
    let mut hub = ChildProcess::start(&first, &["--listen", &address], &options, (again, shown))?;
    // The run lasts as long as its first part does, which is the one that ROS sees.
    let of_ros = RosArgs::augment_args(clap::Command::new("ros"));
    let duration = of_up
        .get_arguments()
        .filter(|arg| arg.get_id() == "duration_s");
    let options = without(options.into_iter(), of_ros.get_arguments().chain(duration));
    let others = parts.map(|part| {
        let end = ["--connect", &*address];
        ChildProcess::start(&part, &end, &options, (false, shown))
    });
    let others: Vec<ChildProcess> = others.collect::<Result<_, _>>()?;
    if shown {
        let printed = hub.printed();
        let left = show(
            program,
            attached(&address, None),
            None,
            &screen(&args.screen),
        );
        // The plant ends first: it would miss the policy.
        drop((hub, others));
        let printed = printed.and_then(|printed| printed.join().ok());
        print_line(last_summary(&printed.unwrap_or_default()))?;
        return left.map(drop);
    }
    let input = hub.0.stdin.take();
    signals::watch(move || drop(input), || ());
    let ended = hub.0.wait();
    drop(others);
    match ended {
        Ok(status) if status.success() || signals::exit_code().is_some() => Ok(()),
        Ok(status) => Err(Error::Network(format!("the process of {first}: {status}"))),
        Err(why) => Err(Error::Network(format!("the process of {first}: {why}"))),
    }
}

/// The summary of the last of several runs.
fn last_summary(printed: &str) -> &str {
    let begins = printed.rfind("\nclock ").map_or(0, |before| before + 1);
    printed[begins..].trim_end()
}

/// A child; dropping ends it.
struct ChildProcess(Child);

impl ChildProcess {
    fn start(
        part: &str,
        end: &[&str],
        options: &[OsString],
        (again, shown): (bool, bool),
    ) -> Result<Self, Error> {
        let cannot = |why| Error::Network(format!("cannot start a process: {why}"));
        let program = env::current_exe().map_err(cannot)?;
        let mut command = Command::new(program);
        command.arg("node").arg(part).args(end).arg("--child");
        command.args(options).args(again.then_some("--again"));
        if shown {
            // The dashboard has the terminal.
            command.stdout(Stdio::piped()).stderr(Stdio::null());
        }
        let child = command.stdin(Stdio::piped()).spawn().map_err(cannot)?;
        Ok(Self(child))
    }

    /// Collects what it prints until it ends.
    fn printed(&mut self) -> Option<JoinHandle<String>> {
        let mut output = self.0.stdout.take()?;
        Some(thread::spawn(move || {
            let mut printed = Vec::new();
            let _ = output.read_to_end(&mut printed);
            String::from_utf8_lossy(&printed).into_owned()
        }))
    }
}

impl Drop for ChildProcess {
    fn drop(&mut self) {
        // The child stops when its standard input ends.
        drop(self.0.stdin.take());
        let _ = self.0.wait();
    }
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
