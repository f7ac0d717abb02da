//! The tables: for a run here, its cliff map, a recording, and a run of other processes.

use ratelab::Time;

use super::{
    Does::{DownUp, Each, This, UpDown},
    KeyRow, KeyTable, Need,
};
use crate::{
    app::{
        App,
        knobs::{DELAY, DEPTH, LOSS},
    },
    cliff::MapAxes,
    knobs::Direction::{Down, Up},
    panes::{OverlayContent, Pane},
};

/// Rows: keys, what they do, in words, in the footer, and what there must be for them.
macro_rules! rows {
    ($($keys:literal => $does:expr,
        $help:literal $(, footer $footer:literal)? $(, needs $need:ident)?;)+) => {
        &[$(KeyRow {
            keys: $keys,
            does: $does,
            help: $help,
            footer: [$($footer,)? ""][0],
            needs: [$(Need::$need,)? Need::Nothing][0],
        }),+]
    };
}

/// The first rows of each screen.
const HELP: &[KeyRow] = rows! {
    "?" => This(|app| app.open_page(OverlayContent::Keys)),
        "show or hide this help", footer "keys";
    "i" => This(|app| app.open_page(OverlayContent::Explained)),
        "explain the pane in focus, with its figures", footer "explain";
    "G" => This(|app| app.open_page(OverlayContent::Glossary)),
        "the words on the screen, in one line each";
};

pub(super) const QUIT: &[KeyRow] = rows! {
    "q Ctrl-C" => Each(&[App::close, App::leave]), "quit", footer "quit";
};

/// The rows of the panes, the same on each screen.
const PANES: &[KeyRow] = rows! {
    "Tab 1 2 3 4 5 6" => Each(&[
        App::focus_next,
        |app| app.focus(Pane::Graph),
        |app| app.focus(Pane::Plant),
        |app| app.focus(Pane::Signal),
        |app| app.focus(Pane::Figures),
        |app| app.focus(Pane::Events),
        |app| app.focus(Pane::Timeline),
    ]),
        "next pane; graph, plant, signal, figures, events, timeline";
    "s" => This(App::turn_plant),
        "plant: look at it from the next side", footer "side", needs Sides;
    "( )" => DownUp(App::select_push),
        "timeline: select the push before, the next one";
    "v V" => DownUp(|app, by| app.shown.panes.timeline.zoom(by == Down)),
        "timeline: a shorter stretch, a longer one";
    "z" => This(|app| app.shown.panes.zoomed ^= true),
        "show the focused pane on the whole screen, or not", footer "zoom";
};

const RATE: &[KeyRow] = rows! {
    "[ ]" => DownUp(App::turn_rate),
        "rate of the marked node down, up", footer "rate";
};

const DEPTH_OF_TOPICS: &[KeyRow] = rows! {
    "< >" => DownUp(|app, by| app.turn_topics(&DEPTH, by)),
        "depth of the marked topics down, up", footer "depth";
};

const RECORD: &[KeyRow] = rows! {
    "w" => This(App::record),
        "record to a file in the folder recordings, or stop that", footer "record";
};

const TYPE: &[KeyRow] = rows! {
    ":" => This(|app| app.prompt.open(None)),
        "type a knob and its exact value, such as rate NODE 7.5", footer "type a value";
};

const BRANCH: &[KeyRow] = rows! {
    "B" => This(App::ask_for_branch),
        "branch: run again up to here, then change one knob", footer "branch";
};

/// All keys of a run here, the most needed first.
pub const LAB: KeyTable = KeyTable(&[
    HELP,
    QUIT,
    RATE,
    rows! {
        "r" => This(App::restart_as_it_stands),
            "start again: same seed, same knobs", footer "restart";
        "Space" => This(App::pause), "pause, or go on", footer "pause";
        "e" => This(App::open_exercises),
            "open the exercises: predict, then see", footer "exercises", needs Course;
        "m" => This(App::ask_for_map),
            "the cliff map: with which rates and seeds it stays up", footer "map";
        "b" => This(App::break_it),
            "break it, as --break does; again: undo that", footer "break", needs Breakable;
        "c" => This(App::other_clock),
            "change to the other clock, virtual or real", footer "clock";
    },
    DEPTH_OF_TOPICS,
    rows! {
        "d D" => UpDown(|app, by| app.turn_topics(&DELAY, by)),
            "delay of the marked topics up, down", footer "delay";
        "l L" => UpDown(|app, by| app.turn_topics(&LOSS, by)),
            "losses of the marked topics up, down", footer "loss";
    },
    PANES,
    rows! {
        ". →" => This(App::step_forward),
            "one tick of one node; in the past, one picture forward", footer "step";
        ", ←" => This(App::look_back),
            "one picture back; of a paused real run, one tick back", footer "back";
        "Home End f" => Each(&[
            |app| app.shown.frames.oldest(),
            |app| app.shown.frames.live(),
            |app| app.shown.frames.live(),
        ]),
            "the oldest picture, the newest one, the live run", footer "live again";
    },
    RECORD,
    rows! {
        "g" => This(App::toggle_tour),
            "begin the guided tour of five minutes, or leave it", needs Course;
        "a" => This(App::toggle_limits),
            "show the limits of the push age (press twice), or hide them", needs Course;
        "+ - 0" => Each(SPEED),
            "virtual time faster, slower, at normal speed", footer "speed";
        "↑ ↓" => DownUp(App::mark_node),
            "mark the node before, the next one", footer "node";
        "t T" => UpDown(App::mark_topic),
            "mark the next topic, the one before", footer "topic";
        "o" => This(App::other_world),
            "start again: the plant waits for the actuator, or not", footer "world",
            needs OwnWorld;
        "{ }" => DownUp(App::turn_second_rate),
            "second rate, such as sensor-hz, down, up", footer "second rate",
            needs SecondRate;
    },
    TYPE,
    rows! {
        "n N" => UpDown(App::change_seed),
            "start again with the next seed, the previous one", footer "seed";
        "p P" => UpDown(App::choose),
            "swap the policy for the next one, the previous one", footer "policy", needs Choices;
    },
    BRANCH,
]);

const SPEED: &[fn(&mut App)] = &[
    |app| app.change_speed(Up),
    |app| app.change_speed(Down),
    |app| app.set_speed(1.0),
];

/// All keys of the cliff map. All others do what they do in the lab.
pub const MAP: KeyTable = KeyTable(&[rows! {
    "← →" => DownUp(|app, by| app.on_map(|map| map.move_rate(by))),
        "to the next lower rate, the next higher", footer "rate";
    "↑ ↓" => DownUp(|app, by| app.on_map(|map| map.move_seed(by))),
        "to the previous seed, the next", footer "seed";
    "x" => This(|app| app.turn_map(MapAxes::other_columns)),
        "columns of another knob: rate, delay, loss, cost", footer "columns";
    "y" => This(|app| app.turn_map(MapAxes::other_rows)),
        "rows of another knob, or of seeds", footer "rows";
    "Enter" => This(App::run_chosen),
        "start again live, as at this place", footer "run it live";
    "Esc m" => This(App::close_map), "close the map", footer "close";
}]);

/// All keys of a recording that plays.
pub const REPLAY: KeyTable = KeyTable(&[
    HELP,
    QUIT,
    rows! {
        "Space" => This(App::play), "play, or stand still", footer "play";
        ", . ← →" => DownUp(App::step),
            "to the messages before, to the next messages", footer "step";
    },
    PANES,
    rows! {
        "O o" => DownUp(App::operate),
            "overlapping ticks: to the operation before, to the next", footer "operation";
        "PgUp PgDn" => DownUp(App::skip), "a second back, a second on";
        "N n" => DownUp(App::seek_event),
            "to the event before, to the next event", footer "event";
        "a" => This(App::toggle_limits),
            "show the limits of the push age (press twice), or hide them", needs Course;
        "Home End" => Each(&[|app| app.jump(Time::ZERO), |app| app.jump(Time::MAX)]),
            "to the beginning, to the end";
        "+ - 0" => Each(SPEED),
            "play faster, slower, as fast as it was", footer "speed";
    },
    BRANCH,
]);

/// All keys of a run of other processes: some of the lab's. Who leaves does not end the run.
pub const REMOTE: KeyTable = KeyTable(&[HELP, QUIT, RATE, DEPTH_OF_TOPICS, PANES, TYPE, RECORD]);

/// The keys, each the first of its row, that the footer shows while looking back.
pub const BACK: [&str; 6] = [",", ".", "Home", "B", "?", "q"];
