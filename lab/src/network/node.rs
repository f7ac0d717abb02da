//! One process of a run.

use std::{
    collections::BTreeSet,
    path::Path,
    process, thread,
    time::{Duration, Instant},
};

use ratelab::{RealClock, Time};
use ratelab_study::experiment::{Config, Experiment, Summary};
use ratelab_wire::{Bridge, SessionEnd, Settings, USUAL, host};

use super::{line, parts, stop::Stop, wire_error};
use crate::{
    cli::{ClockArg, GraphArgs, NetworkArgs, NodeArgs},
    error::Error,
    options::{self, Defaults},
    output::{note, print_line, print_recorded, record_error},
    program::Program,
    recording::{Destination, ProcessRecord, Recorder, Source, StopReason},
    report::{self, ReportContext},
};

/// A process runs on the wall's clock until it is stopped.
const DEFAULTS: Defaults = Defaults {
    end: Time::MAX,
    ..options::RUN
};

/// Time between two looks for processes that do not fit.
const SETTLED: Duration = Duration::from_secs(1);

/// Time between two looks for the other nodes.
const PAUSE: Duration = Duration::from_millis(10);

/// Runs the nodes until the run ends; the process with the plant prints its summary.
pub fn node(program: &Program, args: &NodeArgs) -> Result<(), Error> {
    let config = config(program, &args.graph)?;
    let whole = Experiment::new(program.system.clone(), &config)?;
    let graph = whole.observer().topology();
    let here = parts::nodes(&*program.system, &graph, &args.nodes);
    let is_first = graph
        .nodes
        .first()
        .is_some_and(|node| here.contains(&node.name));
    let part = LocalPart {
        settings: settings(&args.network, is_first),
        ros: args.ros.domain(),
        here,
        is_first,
    };
    drop(whole);
    let stop = Stop::watch(args.child);
    let mut destination = args.record.clone().map(Destination::new);
    loop {
        let run = ConnectedRun::connect(program, &config, &part, &stop)?;
        let lost = run.finish(args, destination.as_mut(), &stop)?;
        if !(args.again && lost) || stop.asked() {
            return Ok(());
        }
    }
}

/// The configuration, with the watchdog of the system unless there is another.
pub fn config(program: &Program, args: &GraphArgs) -> Result<Config, Error> {
    if args.clock == Some(ClockArg::Virtual) || args.like.is_some() {
        let why = "several processes share the wall's time: leave --clock and --like out";
        return Err(Error::BadInput(why.to_owned()));
    }
    let mut config = options::graph(program, args, &DEFAULTS)?.0;
    if let Some(watchdog) = program.system.watchdog(&config.setup) {
        let (_, knobs) = options::read_knob(program, "watchdog", &watchdog)?;
        for knob in knobs {
            if !config.setup.iter().any(|set| set.is_of(&knob)) {
                config.setup.set(knob);
            }
        }
    }
    Ok(config)
}

/// The settings of the connection: the first node of the graph listens by default.
fn settings(args: &NetworkArgs, is_first: bool) -> Settings {
    let usual = || vec![USUAL.to_owned()];
    let end = match (args.listen.as_slice(), args.connect.as_slice()) {
        ([], []) if is_first => SessionEnd::Listen(usual()),
        ([], []) => SessionEnd::Connect(usual()),
        ([], connect) => SessionEnd::Connect(connect.to_vec()),
        (listen, _) => SessionEnd::Listen(listen.to_vec()),
    };
    Settings {
        end,
        insecure: args.insecure,
        file: args.zenoh_config.clone(),
        wait: args.wait_s,
        notice: note,
    }
}

/// The part of a graph that runs in this process.
struct LocalPart {
    here: Vec<String>,
    /// Whether the first node of the graph is one of them: the run begins with it.
    is_first: bool,
    settings: Settings,
    /// The domain of ROS, with `--ros`.
    ros: Option<u32>,
}

/// A connected part of a run.
struct ConnectedRun<'a> {
    program: &'a Program,
    part: &'a LocalPart,
    experiment: Experiment,
    bridge: Bridge,
}

impl<'a> ConnectedRun<'a> {
    /// Connects, and waits until all other nodes are there where this end listens.
    fn connect(
        program: &'a Program,
        config: &Config,
        part: &'a LocalPart,
        stop: &Stop,
    ) -> Result<Self, Error> {
        let (here, settings) = (&part.here, &part.settings);
        let experiment = Experiment::part(program.system.clone(), config, here)?;
        settings.check().map_err(wire_error)?;
        if let SessionEnd::Connect(addresses) = &settings.end {
            note(&format!("connecting to {}", addresses.join(", ")));
        }
        let bridge = Bridge::start(settings, &experiment, here, part.ros);
        let bridge = bridge.map_err(wire_error)?;
        let run = Self {
            program,
            part,
            experiment,
            bridge,
        };
        if let SessionEnd::Listen(addresses) = &settings.end {
            note(&format!("listening on {}", addresses.join(", ")));
        }
        if part.is_first {
            run.wait_for_others();
        }
        stop.by(Some(run.experiment.commands()));
        Ok(run)
    }

    /// Waits until each node runs somewhere, or a ROS node is there.
    fn wait_for_others(&self) {
        let nodes = self.experiment.observer().topology().nodes.into_iter();
        let nodes = nodes.map(|node| node.name);
        let away: Vec<String> = nodes
            .filter(|node| !self.part.here.contains(node))
            .collect();
        let (mut looked, mut noted) = (Instant::now(), BTreeSet::new());
        loop {
            let others = self.bridge.others();
            let is_away = |node: &&String| !others.iter().any(|info| info.nodes.contains(node));
            let missing: Vec<&str> = away.iter().filter(is_away).map(|node| &**node).collect();
            let ready = missing.is_empty() && self.bridge.have_begun(&others);
            if ready || self.bridge.has_ros_nodes() {
                note("all nodes are there: the run begins");
                return;
            }
            let waits =
                (!missing.is_empty()).then(|| format!("waiting for {}", missing.join(", ")));
            let mut texts: Vec<String> = waits.into_iter().collect();
            if looked.elapsed() > SETTLED {
                texts.extend(self.bridge.misfits());
                looked = Instant::now();
            }
            for text in texts {
                if noted.insert(text.clone()) {
                    note(&text);
                }
            }
            thread::sleep(PAUSE);
        }
    }

    /// Starts a recording of what happens here, if there is a destination.
    fn record(&self, destination: Option<&mut Destination>) -> Result<Option<Recorder>, Error> {
        let mut source = Source::of(&self.experiment);
        source.origin.processes = vec![ProcessRecord {
            host: host(),
            pid: process::id(),
            nodes: self.part.here.clone(),
            error_ns: Some(0),
        }];
        let begin = |path: &Path| Recorder::from_the_start(path, &source);
        let begun = destination.map(|destination| destination.claim(&source.origin, begin));
        let begun = begun.transpose();
        let begun = begun.map_err(|(path, why)| record_error(&path, &why))?;
        Ok(begun.map(|(_, recorder)| recorder))
    }

    /// Runs to the end and prints the summary; returns whether the run is lost.
    fn finish(
        self,
        args: &NodeArgs,
        destination: Option<&mut Destination>,
        stop: &Stop,
    ) -> Result<bool, Error> {
        let realtime = options::realtime(&args.graph);
        let mut clock = RealClock::new(realtime.clone().and_then(Result::ok));
        let (observer, here) = (self.experiment.observer(), &self.part.here);
        let recorder = self.record(destination)?;
        let outcome = self.experiment.run_with(&mut clock);
        stop.by(None);
        let lines = line::lines(&self.bridge, &observer);
        drop(self.bridge);
        let recorded = recorder.map(|recorder| {
            recorder.end(StopReason::of(&outcome));
            recorder.finish()
        });
        let summary = outcome?;
        let context = ReportContext {
            break_bug: args.graph.system.broken,
            smoke: false,
            realtime: realtime.map(|asked| asked.map(drop)),
            csv_lost: 0,
            open: None,
        };
        let (state, graph) = (self.program.system.state(), observer.topology());
        let state = graph
            .topics
            .iter()
            .find(|topic| Some(&*topic.name) == state);
        let states_here = state.is_none_or(|topic| {
            let mut publishers = topic.publishers.iter();
            publishers.any(|node| here.contains(&graph.nodes[*node].name))
        });
        match states_here {
            true => print_line(&report::text(&*self.program.system, &summary, &context))?,
            false => print_line(&ticks(&summary, here))?,
        }
        lines.iter().try_for_each(|line| print_line(line))?;
        recorded.map_or(Ok(()), |recorded| print_recorded(false, &recorded?))?;
        Ok(states_here && summary.verdict.is_lost())
    }
}

/// What the nodes of a process without the plant did.
fn ticks(summary: &Summary, here: &[String]) -> String {
    let nodes = summary
        .nodes
        .iter()
        .filter(|node| here.contains(&node.name));
    let nodes = nodes.map(|node| format!("{} {} ticks", node.name, node.ticks));
    let nodes: Vec<String> = nodes.collect();
    let text = format!("{} in {}", nodes.join(" | "), summary.sim_time);
    report::line("nodes", &text)
}
