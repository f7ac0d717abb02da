//! The run of other processes as a dashboard shows it and turns its knobs.

use std::{sync::Arc, thread, time::Duration};

use ratelab::Knob;
use ratelab_experiment::{Config, Summary};
use ratelab_metrics::{Lineage, Observer};
use ratelab_screen::{Place, Remote, RunSource, StatusExtra, WatchedRows, watched};
use ratelab_system::System;

use super::RemoteRun;

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
        let mut place = self.processes.place(node, &self.commands);
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
    /// The text for a run of another graph, where there is none of this one.
    fn stranger(&self) -> Option<String> {
        if self.processes.hub().is_some() {
            return None;
        }
        let systems = self.follower.other_systems().into_iter();
        let runs = systems.map(|system| {
            let command = self.commands.lab(&system);
            format!("this run is of {system}: {command}")
        });
        let runs: Vec<String> = runs.collect();
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
        thread::spawn(move || {
            let _ = answers.send(order(knob.into()));
        });
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
