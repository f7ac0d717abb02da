//! The run of other processes as a dashboard shows it, and what it tells of them.

use std::{sync::Arc, time::Duration};

use ratelab::{Knob, millis};
use ratelab_experiment::{Config, Summary};
use ratelab_metrics::{Lineage, Observer};
use ratelab_screen::{Place, Remote, RunSource, StatusExtra, WatchedRows, watched};
use ratelab_system::System;

use super::{
    RemoteRun, StartCommands,
    processes::{GONE, Process, Processes, total},
};
use crate::{error, machine::Nanos, telemetry::Info};

impl RunSource for RemoteRun {
    fn shared_system(&self) -> &Arc<dyn System> {
        &self.system
    }

    fn config(&self) -> &Config {
        &self.gathered.config
    }

    fn observer(&self) -> &Observer {
        &self.gathered.observer
    }

    fn wall_time(&self) -> Duration {
        self.began.elapsed()
    }

    fn lineage(&self) -> &Lineage {
        self.gathered.lineage()
    }

    fn new_rows(&mut self) -> Vec<WatchedRows> {
        let new = self.gathered.take_rows().into_iter();
        let topics = &self.gathered.topology.topics;
        let new = new.filter_map(|(topic, rows)| {
            let name = &topics.get(topic)?.name;
            let watched = watched(&*self.system).find(|watched| watched == name)?;
            Some((watched, rows))
        });
        new.collect()
    }

    fn lost(&self) -> u64 {
        self.lost_batches
    }

    fn summary(&self) -> Option<&Summary> {
        None
    }

    fn place(&self, node: &str) -> Option<Place> {
        let mut place = self.processes.place(node, &*self.commands);
        // Whoever begins the run may leave after it.
        place.absent = place.absent.filter(|_| !self.has_left_after(node));
        place.absent = self.stranger().or(place.absent);
        Some(place)
    }

    fn status(&self) -> StatusExtra {
        let ended = self.gathered.exit().is_some();
        StatusExtra {
            ended,
            recording: self.recordings().lost(),
            clocks: self.processes.exactness(),
            trouble: self.stranger().or_else(|| self.processes.trouble(ended)),
            ..StatusExtra::default()
        }
    }
}

impl RemoteRun {
    /// Returns the text for a run of another graph, where there is none of this one.
    fn stranger(&self) -> Option<String> {
        if self.processes.hub().is_some() {
            return None;
        }
        let runs: Vec<String> = self
            .follower
            .other_systems()
            .into_iter()
            .map(|system| {
                let command = self.commands.lab(&system);
                format!("this run is of {system}: {command}")
            })
            .collect();
        (!runs.is_empty()).then(|| runs.join(", "))
    }
}

impl Remote for RemoteRun {
    fn update(&mut self) -> bool {
        let new = self.meet();
        self.hear();
        self.advance();
        new
    }

    fn turn(&mut self, knob: Knob) {
        let (order, answers) = (self.follower.commander(), self.answers.0.clone());
        // The answer may take a second.
        let asked = error::spawn("knob", move || {
            let _ = answers.send(order(knob.into()));
        });
        if let Err(why) = asked {
            let _ = self.answers.0.send(Err(why.to_string()));
        }
    }

    fn record(&mut self) -> String {
        if self.processes.hub().is_none() {
            return "there is no run yet".to_owned();
        }
        let source = self.source();
        self.recordings().toggle(source)
    }

    fn refusal(&mut self) -> Option<String> {
        let answers = self.answers.1.try_iter();
        answers.filter_map(Result::err).last()
    }
}

impl Processes {
    /// Returns where `node` runs.
    pub fn place(&self, node: &str, commands: &dyn StartCommands) -> Place {
        let Some(process) = self.with_node(node) else {
            let command = commands.node(node);
            let absent = format!("no process runs the {node}: start one: {command}");
            return Place {
                text: "nowhere".to_owned(),
                absent: Some(absent),
            };
        };
        Place {
            text: format!("{}@{}", process.info.pid, process.info.host),
            absent: self.unheard(process).map(|process| self.absence(process)),
        }
    }

    /// Returns the process whose fault it is that nothing is heard of this one: all others are
    /// heard through the one that listens.
    fn unheard<'a>(&'a self, process: &'a Process) -> Option<&'a Process> {
        let hub = self.hub_process().filter(|hub| self.is_gone(hub));
        hub.filter(|hub| process.heard + GONE >= hub.heard)
            .or_else(|| Some(process).filter(|process| self.is_gone(process)))
    }

    /// Returns why nothing is heard of a process, and what to try.
    fn absence(&self, process: &Process) -> String {
        let Info {
            pid, host, command, ..
        } = &process.info;
        let names = names(process);
        let others = if process.info.is_hub {
            ", through which all others are heard"
        } else {
            ""
        };
        if self.is_present(process) {
            format!(
                "{names}: silent{others}. Process {pid} on {host} hangs, or is stopped: kill \
                 -CONT {pid} goes on"
            )
        } else {
            let again = if command.is_empty() {
                "start it again".to_owned()
            } else {
                format!("start it again with: {command}")
            };
            format!(
                "{names}: gone{others}. Process {pid} on {host} ended, is cut off or stopped: \
                     kill -CONT {pid}, or {again}"
            )
        }
    }

    /// Returns what is wrong, if something is; of a run that is `over`, who is missing for the next
    /// one.
    pub fn trouble(&self, over: bool) -> Option<String> {
        let Some(hub) = &self.hub else {
            return Some("waiting for the process that listens".to_owned());
        };
        if over || (hub.zero.is_none() && !self.lack_hub()) {
            let nodes = hub.topology.nodes.iter().map(|node| &*node.name);
            let is_there = |node| self.with_node(node).is_some_and(|of| self.is_present(of));
            let away: Vec<&str> = nodes.filter(|node| !is_there(node)).collect();
            let away = if away.len() == hub.topology.nodes.len() {
                "all nodes".to_owned()
            } else {
                away.join(", ")
            };
            return (!away.is_empty()).then(|| format!("waiting for {away}"));
        }
        let mut gone: Vec<(String, f64)> = self
            .all
            .values()
            .filter(|process| self.is_gone(process))
            .map(|process| (names(process), process.heard.elapsed().as_secs_f64()))
            .collect();
        gone.sort_by(|one, other| one.0.cmp(&other.0));
        if let (Some((_, seconds)), true) = (gone.first(), gone.len() == self.all.len()) {
            return Some(format!("all nodes gone for {seconds:.1} s"));
        }
        let gone = gone.iter();
        let gone = gone.map(|(names, seconds)| format!("{names} gone for {seconds:.1} s"));
        let counts = self.all.values().flat_map(|process| &process.counts);
        let refused = total(counts.map(|counts| counts.refused));
        let refused = (refused > 0).then(|| format!("{refused} messages refused"));
        let trouble: Vec<String> = gone.chain(refused).collect();
        (!trouble.is_empty()).then(|| trouble.join(", "))
    }

    /// Returns how exact ages between them are; `None` where they share a clock.
    pub fn exactness(&self) -> Option<String> {
        let bounds: Option<Vec<Nanos>> = self
            .all
            .values()
            .filter(|process| !process.info.is_hub)
            .map(|process| process.bound)
            .collect();
        let Some(bounds) = bounds else {
            return Some("ages ?".to_owned());
        };
        let worst = bounds.into_iter().max().filter(|bound| *bound > 0)?;
        Some(format!("ages ±{} ms", millis::text(worst as f64 / 1e6)))
    }
}

/// Returns the nodes of a process.
fn names(process: &Process) -> String {
    process.info.nodes.join(" and ")
}
