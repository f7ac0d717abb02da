//! The way of a key: to the input line, the page over the panes, the exercises, the tour, or
//! to what the table of keys says.

use crossterm::event::KeyEvent;
use ratelab_experiment::Config;
use ratelab_system::WorldKind;

use super::{
    App,
    keys::{LAB, is_chord, quits},
};
use crate::{
    explain::{Explained, explained},
    frame::FrameData,
    knobs::{Direction, at_end},
    panes::{OverlayContent, Page, Pane},
    prompt::Vocabulary,
    run::{signal, signal_is_push_age},
    view::glossary,
};

impl App {
    /// Handles a key.
    pub fn key(&mut self, key: &KeyEvent) {
        if self.next.is_some() {
            // A session that is ending ignores other keys.
            self.quit |= quits(key);
            return;
        }
        self.notice = None;
        let live = self.is_live();
        let taken = self.is_typed(key)
            || (live && !is_chord(key) && self.is_for_the_panel(key))
            || (live && self.is_for_the_tour(key));
        if !taken {
            let warned = self.course.warned;
            let _ = self.keys().obey(self, key) || (live && LAB.obey(self, key));
            self.course.warned = self.course.warned.filter(|of| Some(*of) != warned);
        }
    }

    /// Sends `key` to the input line or to the page over the panes, unless it is to quit;
    /// returns whether one of them was open. Enter turns the typed knobs.
    fn is_typed(&mut self, key: &KeyEvent) -> bool {
        if !self.prompt.is_open() || is_chord(key) {
            return !quits(key) && self.shown.panes.scroll(key);
        }
        let vocabulary = Vocabulary {
            system: self.shown.run.system(),
            graph: self.shown.graph(),
            choices: &self.choices,
        };
        if let Some(text) = self.prompt.key(key, &vocabulary) {
            let entered = match self.prompt.branch {
                Some(at) => self.branch(at, &text),
                None => self.parsed(&text).and_then(|knobs| self.try_to_turn(knobs)),
            };
            if let Err(reason) = entered {
                self.prompt.refuse(reason.to_string());
            }
        }
        true
    }

    /// Takes pasted text. A pasted line break does not count as Enter.
    pub fn paste(&mut self, text: &str) {
        let text = text.replace(char::is_control, " ");
        if self.prompt.is_open() {
            self.prompt.edit(|typed| typed.push_str(&text));
        } else if let Some(panel) = self.course.panel.as_mut() {
            panel.paste(&text);
        }
    }

    /// Opens a page over the panes.
    pub(super) fn open_page(&mut self, content: OverlayContent) {
        self.shown.panes.overlay = Some((content, 0));
    }

    fn has(&self, pane: Pane) -> bool {
        self.screen().is_some_and(|screen| screen.has(pane))
    }

    /// Focuses `pane`.
    pub(super) fn focus(&mut self, pane: Pane) {
        if self.has(pane) {
            self.shown.panes.focus = pane;
        } else {
            self.notify("this system has nothing to show there")
        }
    }

    /// Focuses the next pane.
    pub(super) fn focus_next(&mut self) {
        let focus = self.shown.panes.focus;
        self.shown.panes.focus = focus.next(|pane| self.has(pane));
    }

    /// Selects another push in the timeline, and there focuses it in the lab.
    pub(super) fn select_push(&mut self, direction: Direction) {
        let Some(now) = self.shown.now() else {
            return;
        };
        if self.is_live() {
            self.shown.panes.focus = Pane::Timeline;
        }
        self.shown.select_push(now, direction == Direction::Up);
    }

    /// Marks another node, whose knobs keys turn.
    pub(super) fn mark_node(&mut self, direction: Direction) {
        let graph = self.shown.graph();
        self.shown.knob_focus.move_node(&graph, direction);
    }

    /// Marks other topics.
    pub(super) fn mark_topic(&mut self, direction: Direction) {
        let (graph, system) = (self.shown.graph(), self.shown.run.system());
        let focus = &mut self.shown.knob_focus;
        focus.move_topic(system, &graph, direction);
    }

    /// Returns whether the graph can still be changed; gives notice if not.
    pub(super) fn alive(&mut self) -> bool {
        if self.ended() {
            self.notify("the run is over: r starts again");
        }
        !self.ended()
    }

    /// Starts again in the other world.
    pub(super) fn other_world(&mut self) {
        let Some(own) = self.own_world else {
            return self.notify("this system has no world of its own");
        };
        let world = match self.config.world {
            WorldKind::Course => own,
            WorldKind::Own { .. } => WorldKind::Course,
        };
        self.restart(Config {
            world,
            ..self.wanted()
        });
    }

    /// Starts again with a neighbouring seed.
    pub(super) fn change_seed(&mut self, direction: Direction) {
        let seed = self.config.seed;
        let next = match direction {
            Direction::Up => seed.checked_add(1),
            Direction::Down => seed.checked_sub(1),
        };
        match next {
            Some(seed) => self.restart(Config {
                seed,
                ..self.wanted()
            }),
            None => self.notify(at_end("seed", direction, seed)),
        }
    }
}

/// The keys of a page over the panes, for the bottom line.
const HINTS: &[(&str, &str)] = &[
    ("↑ ↓ PgUp PgDn", "scroll"),
    ("Esc", "close"),
    ("any other key", "close"),
];

impl App {
    /// Returns the open page, if any.
    pub(super) fn page(&self, frame: &FrameData) -> Option<Page> {
        let Some((content, scroll)) = self.shown.panes.overlay else {
            let panel = self.course.panel.as_ref().filter(|_| self.is_live());
            return panel.map(|panel| panel.page());
        };
        let page = match content {
            OverlayContent::Keys => {
                Page::rows("keys", self.keys().rows(|need| self.has_what(need)))
            }
            OverlayContent::Glossary => {
                Page::rows("words", glossary(frame.plan.is_some()).collect())
            }
            OverlayContent::Explained => {
                let mut events = self.shown.events.iter();
                let signal = signal(self.system());
                let about = Explained {
                    signal: signal.as_ref().map(|signal| &*signal.name),
                    signal_is_push_age: signal_is_push_age(self.system()),
                    has_sides: self.sides() > 1,
                    any_event: events.any(|event| event.at <= frame.now),
                };
                let (title, text) = explained(self.shown.panes.focus, about, frame);
                Page::text(title, text, "any other key closes")
            }
        };
        Some(Page {
            keys: HINTS,
            scroll,
            ..page
        })
    }
}
