//! The cliff map over the dashboard.

use std::{fmt::Display, sync::Arc};

use ratelab_experiment::Config;

use super::App;
use crate::{
    cliff::{CliffMap, MapAxes},
    course::Course,
};

/// The place of a map that shows what an exercise asks for.
const MASKED: &str = "the map is the answer to exercise 1. e: predict first, m: show the map";

/// The map of the lab.
#[derive(Default)]
pub struct LabMap {
    /// The map, after it was first opened.
    map: Option<CliffMap>,
    /// The quantities of its axes.
    axes: MapAxes,
    /// Whether it is open.
    is_open: bool,
    /// The course, if it is to ask for the prediction of what it shows.
    asks_first: Option<Arc<dyn Course>>,
}

impl App {
    /// From now on the map asks for the prediction of exercise 1 first, once, if there is none.
    pub fn ask_before_the_map(&mut self) {
        self.map.asks_first = self.setup.course.clone();
    }

    /// Opens the map, unless it is to ask first.
    pub(super) fn ask_for_map(&mut self) {
        let asks_first = self.map.asks_first.take();
        if asks_first.is_some_and(|course| !course.has_found_cliff()) {
            self.notify(MASKED);
        } else {
            self.open_map();
        }
    }

    /// Opens the map for the session's conditions, at its run; a previous map is kept if
    /// it has that run.
    fn open_map(&mut self) {
        self.map.is_open = true;
        let (config, graph) = (self.wanted(), self.shown.graph());
        self.map.map.take_if(|map| !map.go_to(&graph, &config));
        self.follow_conditions();
    }

    pub(super) fn close_map(&mut self) {
        self.map.is_open = false;
    }

    /// Starts a new map if the conditions have changed.
    fn follow_conditions(&mut self) {
        let (config, graph, axes) = (self.wanted(), self.shown.graph(), self.map.axes);
        let (system, focus) = (&self.setup.system, &self.shown.knob_focus);
        let is_of = |map: &CliffMap| map.is_of(focus, axes, &config);
        if self.map.map.as_ref().is_some_and(is_of) {
            return;
        }
        match CliffMap::around(system, &graph, focus, axes, &config) {
            Ok(map) => self.map.map = Some(map),
            Err(error) => self.no_map(error),
        }
    }

    /// Adds finished runs to the map; returns whether there are any in sight.
    pub(super) fn follow_map(&mut self) -> bool {
        if self.map.is_open {
            self.follow_conditions();
        }
        match self.map.map.as_mut().map_or(Ok(false), CliffMap::follow) {
            Ok(new) => new && self.map.is_open,
            Err(error) => {
                self.no_map(error);
                true
            }
        }
    }

    fn no_map(&mut self, why: impl Display) {
        (self.map.map, self.map.is_open) = (None, false);
        self.notify(format!("no map: {why}"));
    }

    /// Returns the map, if it is in sight.
    pub(super) fn visible_map(&self) -> Option<&CliffMap> {
        let map = self.map.map.as_ref();
        map.filter(|_| self.map.is_open && self.is_live())
    }

    /// Moves within the map.
    pub(super) fn on_map(&mut self, go: impl Fn(&mut CliffMap)) {
        self.map.map.iter_mut().for_each(go);
    }

    /// Shows the map over other quantities.
    pub(super) fn turn_map(&mut self, other: fn(MapAxes) -> MapAxes) {
        self.map.axes = other(self.map.axes);
        self.follow_conditions();
    }

    /// Starts again live, as at the place in the map.
    pub(super) fn run_chosen(&mut self) {
        let Some((knobs, seed)) = self.visible_map().map(CliffMap::chosen) else {
            return;
        };
        self.close_map();
        let mut config = Config {
            seed,
            ..self.wanted()
        };
        config.setup.extend(knobs);
        self.restart(config);
    }
}
