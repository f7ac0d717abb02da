//! The cliff map over the dashboard.

use std::{
    fmt::Display,
    path::{Path, PathBuf},
};

use ratelab_study::experiment::Config;

use super::App;
use crate::{
    dashboard::{cliff::CliffMap, keys::MapAction},
    error::LabError,
    predictions::is_predicted,
};

/// The place of a map that shows what an exercise asks for.
const MASKED: &str = "the map answers exercise 1: e predicts it, m again shows the map anyway";

impl App {
    /// From now on the map asks for the prediction of exercise 1 first, once, if `answers`
    /// has none.
    pub fn ask_before_the_map(&mut self, answers: PathBuf) {
        self.asks_first = Some(answers).filter(|_| self.setup.course);
    }

    /// Opens the map, unless it is to ask first.
    pub(super) fn ask_for_map(&mut self) {
        let open = |answers: &Path| !is_predicted(answers, 1);
        match self.asks_first.take().is_some_and(|answers| open(&answers)) {
            true => self.desk.notify(MASKED),
            false => self.open_map(),
        }
    }

    /// Opens the map for the session's conditions, at its run; a previous map is kept if
    /// it has that run.
    fn open_map(&mut self) {
        self.mapping = true;
        let (config, graph) = (self.wanted(), self.desk.graph());
        self.map.take_if(|map| !map.go_to(&graph, &config));
        self.follow_conditions();
    }

    /// Starts a new map if the conditions have changed.
    fn follow_conditions(&mut self) {
        let (config, focus, axes) = (self.wanted(), &self.desk.knob_focus, self.map_axes);
        if self
            .map
            .as_ref()
            .is_some_and(|map| map.is_of(focus, axes, &config))
        {
            return;
        }
        match CliffMap::around(&self.setup.system, &self.desk.graph(), focus, axes, &config) {
            Ok(map) => self.map = Some(map),
            Err(error) => self.no_map(error),
        }
    }

    /// Adds finished runs to the map; returns whether there are any.
    pub(super) fn follow_map(&mut self) -> bool {
        if self.mapping {
            self.follow_conditions();
        }
        match self.map.as_mut().map_or(Ok(false), CliffMap::follow) {
            Ok(new) => new && self.mapping,
            Err(error) => {
                self.no_map(error);
                true
            }
        }
    }

    fn no_map(&mut self, why: impl Display) {
        (self.map, self.mapping) = (None, false);
        self.desk.notify(format!("no map: {why}"));
    }

    /// The map, if it is open.
    pub(super) fn open(&self) -> Option<&CliffMap> {
        self.map.as_ref().filter(|_| self.mapping)
    }

    /// Handles a key of the map.
    pub(super) fn act_on_map(&mut self, action: MapAction) -> Result<(), LabError> {
        let Some(map) = &mut self.map else {
            return Ok(());
        };
        match action {
            MapAction::Rate(direction) => map.move_rate(direction),
            MapAction::Seed(direction) => map.move_seed(direction),
            MapAction::Close => self.mapping = false,
            MapAction::Columns => {
                self.map_axes = self.map_axes.other_columns();
                self.follow_conditions();
            }
            MapAction::Rows => {
                self.map_axes = self.map_axes.other_rows();
                self.follow_conditions();
            }
            MapAction::Run => {
                let (knobs, seed) = map.chosen();
                self.mapping = false;
                let mut config = Config {
                    seed,
                    ..self.wanted()
                };
                config.setup.extend(knobs);
                return self.restart(config);
            }
        }
        Ok(())
    }
}
