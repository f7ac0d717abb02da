//! One process of a run.

use std::process;

use ratelab::{Time, Topology};
use ratelab_experiment::{Config, Experiment, Summary};
use ratelab_metrics::{Observer, TopicAccount};
use ratelab_network::{Bridge, Inlet, SessionEnd, Settings, USUAL, machine, parts};
use ratelab_real_clock::RealClock;
use ratelab_recording::{Destination, ProcessRecord, Recorder, Source, StopReason};

use super::again;
use crate::{
    cli::{ClockArg, GraphArgs, NetworkArgs, NodeArgs, ProcessArgs, RosArgs},
    error::Error,
    options::{self, Defaults},
    output::{note, print_line, print_recorded, record_error},
    program::Program,
    signals::Stop,
    summary::text::{self, ReportContext, line, ms},
};

/// A process runs on the wall's clock until it is stopped.
const DEFAULTS: Defaults = Defaults {
    end: Time::MAX,
    ..options::RUN
};

/// Runs the nodes until the run ends; the process with the plant prints its summary.
pub fn node(program: &Program, args: &NodeArgs) -> Result<(), Error> {
    check_ros(program, &args.process.ros)?;
    let config = config(program, &args.graph)?;
    let part = Part {
        nodes: &args.nodes,
        config,
        command: again::this_one(),
    };
    run(program, &args.graph, &part, &args.process)
}

/// What is run in a process.
pub struct Part<'a> {
    /// The nodes, or groups of them.
    pub nodes: &'a [String],
    /// The configuration of the run.
    pub config: Config,
    /// The command line that starts the process again.
    pub command: String,
}

/// Runs a `part` of this `graph`.
pub fn run(
    program: &Program,
    graph: &GraphArgs,
    part: &Part<'_>,
    args: &ProcessArgs,
) -> Result<(), Error> {
    let Part { config, nodes, .. } = part;
    let (topology, end) = (topology(program, config)?, config.end);
    let here = parts::nodes(&*program.system, &topology, nodes);
    let first = topology.nodes.first();
    let is_first = first.is_some_and(|node| here.contains(&node.name));
    // The others end by the run time of the first.
    let config = Config {
        end: if is_first { end } else { Time::MAX },
        ..config.clone()
    };
    let settings = Settings {
        command: part.command.clone(),
        ..settings(&args.network, is_first)
    };
    let stop = Stop::watch(args.child);
    let mut destination = args.record.clone().map(Destination::from);
    loop {
        let part = Experiment::part(program.system.clone(), &config, &here)?;
        let mut bridge = Bridge::start(&settings, &part, &here, args.ros.domain())?;
        if !is_first && end < Time::MAX {
            bridge.end_at(end, part.commands())?;
        }
        bridge.wait_for_others();
        stop.by(Some(part.commands()));
        let recorder = record(&part, &here, destination.as_mut())?;
        let lost = run_once(program, graph, &here, (part, bridge, recorder), &stop)?;
        if !(args.again && lost) || stop.asked() {
            return Ok(());
        }
    }
}

/// Refuses `--ros` for a graph that has no topic for it.
pub fn check_ros(program: &Program, args: &RosArgs) -> Result<(), Error> {
    let system = &*program.system;
    if args.ros && system.robot().joints().is_empty() {
        return Err(Error::BadInput(format!(
            "--ros: {} has no topic that ROS 2 nodes know, as /obs and /action of the cart-pole: \
             leave --ros out",
            system.name()
        )));
    }
    Ok(())
}

/// Returns the whole graph.
pub fn topology(program: &Program, config: &Config) -> Result<Topology, Error> {
    let whole = Experiment::new(program.system.clone(), config)?;
    Ok(whole.observer().topology())
}

/// Returns the configuration, with the watchdog of the system unless there is another.
pub fn config(program: &Program, args: &GraphArgs) -> Result<Config, Error> {
    if args.clock == Some(ClockArg::Virtual) || args.like.is_some() {
        let why = "several processes share the wall's time: leave --clock and --like out";
        return Err(Error::BadInput(why.to_owned()));
    }
    let mut config = options::graph(program, args, &DEFAULTS)?.0;
    if let Some(watchdog) = program.system.robot().watchdog(&config.setup) {
        let (_, knobs) = options::read_knob(program, "watchdog", &watchdog)?;
        for knob in knobs {
            if !config.setup.iter().any(|set| set.is_of(&knob)) {
                config.setup.set(knob);
            }
        }
    }
    Ok(config)
}

/// Returns the settings of the connection: the first node of the graph listens by default.
fn settings(args: &NetworkArgs, is_first: bool) -> Settings {
    let usual = || vec![USUAL.to_owned()];
    let end = match (args.listen.as_slice(), args.connect.as_slice()) {
        ([], []) if is_first => SessionEnd::Listen(usual()),
        ([], []) => SessionEnd::Connect(usual()),
        ([], connect) => SessionEnd::Connect(connect.to_vec()),
        (listen, _) => SessionEnd::Listen(listen.to_vec()),
    };
    Settings {
        insecure: args.insecure,
        file: args.zenoh_config.clone(),
        wait: args.wait_s,
        ..Settings::new(end, note)
    }
}

/// Starts a recording of what happens in `part`, if there is a destination.
fn record(
    part: &Experiment,
    here: &[String],
    destination: Option<&mut Destination>,
) -> Result<Option<Recorder>, Error> {
    let mut source = Source::for_experiment(part);
    source.origin.processes = vec![ProcessRecord {
        host: machine::host(),
        pid: process::id(),
        nodes: here.to_vec(),
        error_ns: Some(0),
    }];
    destination
        .map(|destination| Recorder::from_the_start(destination, &source))
        .transpose()
        .map_err(record_error)
}

/// Runs to the end and prints the summary; returns whether the run is lost.
fn run_once(
    program: &Program,
    graph: &GraphArgs,
    here: &[String],
    (part, bridge, recorder): (Experiment, Bridge, Option<Recorder>),
    stop: &Stop,
) -> Result<bool, Error> {
    let realtime = options::realtime(graph);
    let mut clock = RealClock::new(realtime.clone().and_then(Result::ok));
    let (observer, system) = (part.observer(), &*program.system);
    let outcome = part.run_with(&mut clock);
    stop.by(None);
    let lines = traffic(&bridge, &observer);
    drop(bridge);
    let recorded = recorder.map(|recorder| {
        recorder.end(StopReason::from_outcome(&outcome));
        recorder.finish()
    });
    let summary = outcome?;
    let topology = observer.topology();
    let state = topology
        .topics
        .iter()
        .find(|topic| Some(&*topic.name) == system.states_topic());
    let is_here = |node: &usize| here.contains(&topology.nodes[*node].name);
    let states_here = state.is_none_or(|topic| topic.publishers.iter().any(is_here));
    let context = ReportContext {
        break_bug: graph.system.broken,
        realtime: realtime.map(|asked| asked.map(drop)),
        ..ReportContext::default()
    };
    let is_lost = states_here && summary.verdict.is_lost();
    if states_here {
        let seen = seen_here(summary, is_here);
        print_line(&text::render(system, &seen, &context))?;
    } else {
        print_line(&ticks(&summary, here))?;
    }
    lines.iter().try_for_each(|line| print_line(line))?;
    recorded.map_or(Ok(()), |recorded| print_recorded(false, &recorded?))?;
    Ok(is_lost)
}

/// Returns the summary without readers of topics that neither begin nor end at nodes that
/// `are_here`: their messages go past this process, so it cannot say how many there were.
fn seen_here(mut summary: Summary, are_here: impl Fn(&usize) -> bool) -> Summary {
    for topic in &mut summary.topics {
        let is_seen = topic.publishers.iter().any(&are_here)
            || topic.readers.iter().any(|reader| are_here(&reader.node));
        if !is_seen {
            topic.readers.clear();
        }
    }
    summary
}

/// Returns what the nodes of a process without the plant did.
fn ticks(summary: &Summary, here: &[String]) -> String {
    let nodes: Vec<String> = summary
        .nodes
        .iter()
        .filter(|node| here.iter().any(|name| **name == *node.name))
        .map(|node| format!("{} {} ticks", node.name, node.ticks))
        .collect();
    let text = format!("{} in {}", nodes.join(" | "), summary.sim_time);
    text::line("nodes", &text)
}

/// Returns a line for each topic that arrived here, with its counters of the run that `observer`
/// reads.
fn traffic(bridge: &Bridge, observer: &Observer) -> Vec<String> {
    let snapshot = observer.snapshot();
    let lines = bridge.inlets().iter().map(|inlet| {
        let (name, node) = (&inlet.name, &inlet.node);
        let (lost, refused) = (inlet.sender().lost, refused(inlet));
        let read = snapshot.topic(name).map(reads).unwrap_or_default();
        line(
            "wire",
            &format!("{name} from {node}: {lost} lost on the way, {refused}{read}"),
        )
    });
    lines.collect()
}

/// Returns the refused messages by reason; those from before the run are none of it.
fn refused(inlet: &Inlet) -> String {
    let counts: Vec<String> = inlet
        .refused
        .read()
        .into_iter()
        .filter(|(why, _)| !why.is_harmless())
        .map(|(why, count)| format!("{count} {why}"))
        .collect();
    if counts.is_empty() {
        "0 refused".to_owned()
    } else {
        format!("refused: {}", counts.join(", "))
    }
}

/// Returns the messages that its link lost or that were evicted unread, and the ages of those that
/// were read.
fn reads(topic: &TopicAccount) -> String {
    let mut text = match topic.lost {
        0 => String::new(),
        lost => format!(", {lost} by its link"),
    };
    text += &format!(", {} dropped", topic.dropped());
    let ages = topic.readers.iter().map(|read| &read.ages);
    let ages = ages.max_by_key(|ages| ages.count());
    let at = |share| Some(ms(ages?.quantile(share)?.as_secs_f64()));
    if let (Some(p50), Some(p99)) = (at(0.5), at(0.99)) {
        text += &format!(", age when read p50 {p50}, p99 {p99}");
    }
    text
}
