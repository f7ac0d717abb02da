//! The arguments of runs in several processes.

use std::{path::PathBuf, time::Duration};

use clap::{Args, Command};
use ratelab_system::Setup;

use super::{GraphArgs, ScreenArgs, graph_file, heading, values};
use crate::program::Program;

/// The arguments of one process of a run.
#[derive(Debug, Args)]
pub struct NodeArgs {
    /// The nodes to run here, or the name of a group of them, such as plant.
    #[arg(value_name = "NODE", required = true, value_parser = graph_file::node_name)]
    pub nodes: Vec<String>,

    /// The graph: the same options for all processes of a run.
    #[command(flatten)]
    pub graph: GraphArgs,

    /// The process.
    #[command(flatten)]
    pub process: ProcessArgs,
}

/// The arguments of a process apart from its graph.
#[derive(Debug, Default, Args)]
pub struct ProcessArgs {
    /// The connection.
    #[command(flatten)]
    pub network: NetworkArgs,

    /// ROS 2.
    #[command(flatten)]
    pub ros: RosArgs,

    /// Begin a new run after a lost one, as soon as all nodes are there.
    #[arg(long, help_heading = heading::TIME)]
    pub again: bool,

    /// Record what happens in this process to this file, which must be new; without a
    /// name, to one named after the run, in ./recordings.
    #[arg(long, value_name = "FILE", num_args = 0..=1, help_heading = heading::OUTPUT)]
    pub record: Option<Option<PathBuf>>,

    /// End when the standard input does, as that of a child does with its parent.
    #[arg(long, hide = true)]
    pub child: bool,
}

/// The arguments of a run in several processes of this machine.
#[derive(Debug, Args)]
pub struct UpArgs {
    /// The graph.
    #[command(flatten)]
    pub graph: GraphArgs,

    /// Port for the processes and for others on this machine [default: 7447]
    #[arg(long, value_name = "PORT", help_heading = heading::NETWORK)]
    pub port: Option<u16>,

    /// ROS 2.
    #[command(flatten)]
    pub ros: RosArgs,

    /// Options of the display.
    #[command(flatten)]
    pub screen: ScreenArgs,

    /// Be the child that runs this part, connected at this address.
    #[arg(long, hide = true, num_args = 2, value_names = ["PART", "ADDRESS"])]
    pub part: Option<Vec<String>>,
}

/// The arguments of ROS 2.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = heading::NETWORK)]
pub struct RosArgs {
    /// Show ROS 2 nodes on rmw_zenoh the topics of this process, and take their actions.
    #[arg(long)]
    pub ros: bool,

    /// ROS domain [default: 0]
    #[arg(long, value_name = "N", requires = "ros")]
    pub domain: Option<u32>,
}

impl RosArgs {
    /// Returns the domain, with --ros.
    #[cfg(feature = "network")]
    pub fn domain(&self) -> Option<u32> {
        self.ros.then(|| self.domain.unwrap_or_default())
    }
}

/// The arguments of a connection.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = heading::NETWORK)]
pub struct NetworkArgs {
    /// Wait for other processes at this address; can be given several times [default:
    /// tcp/127.0.0.1:7447 for the first node of the graph]
    #[arg(long, value_name = "ADDRESS", conflicts_with = "connect")]
    pub listen: Vec<String>,

    /// Connect to a process that listens; again and again until it is there [default:
    /// tcp/127.0.0.1:7447 for all other nodes]
    #[arg(long, value_name = "ADDRESS")]
    pub connect: Vec<String>,

    /// Listen on a network without credentials: anybody there can move the plant.
    #[arg(long)]
    pub insecure: bool,

    /// A zenoh configuration (JSON5), for users and access control.
    #[arg(long, value_name = "FILE")]
    pub zenoh_config: Option<PathBuf>,

    /// Longest wait for a connection, in seconds [default: no limit]
    #[arg(long, value_name = "S", value_parser = values::wait, allow_hyphen_values = true)]
    pub wait_s: Option<Duration>,
}

/// Returns the help of `command` where it runs a graph in several processes: without the options of
/// one process, and with the watchdog that is the default there.
pub fn describe(command: Command, program: &Program) -> Command {
    if !matches!(command.get_name(), "up" | "node") {
        return command;
    }
    let command = command.mut_args(|arg| match arg.get_id().as_str() {
        "clock" | "speed" | "like" => arg.hide(true),
        "duration_s" => arg.help("Run time in seconds [default: no end]"),
        _ => arg,
    });
    let watchdog = program.system.robot().watchdog(&Setup::default());
    let Some((name, value)) = watchdog.as_ref().and_then(|knob| knob.split_once(' ')) else {
        return command;
    };
    match program.knobs().alias(name) {
        Some(alias) => {
            let help = format!("{} [default: {value} at the default rate]", alias.help);
            command.mut_arg(alias.name, |arg| arg.help(help))
        }
        None => command,
    }
}
