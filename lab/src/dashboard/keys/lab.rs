//! The keys of the lab.

use LabAction::*;

use super::{
    Binding, DOWN, END, HOME,
    Key::{Char, Ctrl},
    KeyTable, LEFT, OverlayContent, PaneAction, RIGHT, TAB, UP, row, screen_with_panes,
};
use crate::dashboard::{
    focus::Pane,
    presets::Direction::{self, Down, Up},
};

/// Actions in the lab.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LabAction {
    /// Change the rate of the node in focus by a preset.
    Rate(Direction),
    /// Change the rate of the second alias of one by a preset.
    SecondRate(Direction),
    /// Change the depth of the topics in focus by a preset.
    Depth(Direction),
    /// Change the delay of the topics in focus by a preset.
    Delay(Direction),
    /// Change the losses of the topics in focus by a preset.
    Loss(Direction),
    /// Choose the node whose rate is changed.
    Node(Direction),
    /// Choose the topic whose depth is changed.
    Topic(Direction),
    /// Type a knob and an exact value.
    Type,
    /// Turn the knob that is known to break the system.
    Break,
    /// Stop run time, or let it go on.
    Pause,
    /// Run one tick, or look one frame forward.
    StepForward,
    /// Look one frame back.
    StepBack,
    /// Look at the oldest frame.
    Oldest,
    /// Look at the newest frame.
    Newest,
    /// Stop looking back.
    Live,
    /// Change the speed of virtual time by a preset.
    Speed(Direction),
    /// Real-time speed.
    SpeedOne,
    /// Hand the running graph to the other clock.
    OtherClock,
    /// Start again with the same seed.
    Restart,
    /// Start again in the other world.
    OtherWorld,
    /// Start again with a neighbouring seed.
    Seed(Direction),
    /// Send the neighbouring one of the messages to choose from, such as a policy.
    Choice(Direction),
    /// An action on the panes.
    Panes(PaneAction),
    /// Open the cliff map.
    Map,
    /// Leave the run at the visible moment, with a knob turned.
    Branch,
    /// Record to a file, or stop recording.
    Record,
    /// Open the exercises.
    Exercises,
    /// Begin the guided tour, or end it.
    Tour,
    /// Leave.
    Quit,
}

pub(super) const RATE: Binding<LabAction> = row(
    &[(Char('['), Rate(Down)), (Char(']'), Rate(Up))],
    "rate of the marked node down, up",
    Some("rate"),
);

pub(super) const DEPTH: Binding<LabAction> = row(
    &[(Char('<'), Depth(Down)), (Char('>'), Depth(Up))],
    "depth of the marked topics down, up",
    Some("depth"),
);

pub(super) const RECORD: Binding<LabAction> = row(
    &[(Char('w'), Record)],
    "record to a file in the folder recordings, or stop recording",
    Some("record"),
);

pub(super) const TYPE: Binding<LabAction> = row(
    &[(Char(':'), Type)],
    "type a knob and its exact value, such as rate NODE 7.5",
    Some("type a value"),
);

/// All keys of the lab, help and quit first.
pub const LAB: KeyTable<LabAction> = screen_with_panes![
    RATE,
    DEPTH,
    row(&[(Char('d'), Delay(Up)), (Char('D'), Delay(Down))],
        "delay of the marked topics up, down", Some("delay")),
    row(&[(Char('l'), Loss(Up)), (Char('L'), Loss(Down))],
        "losses of the marked topics up, down", Some("loss")),
    row(&[(Char('b'), Break)],
        "break it, as --break does; again: undo that", Some("break")),
    row(&[(Char('r'), Restart)],
        "start again: same seed, knobs as they stand", Some("restart")),
    row(&[(Char(' '), Pause)],
        "pause, or go on", Some("pause"));
    row(&[(Char('.'), StepForward), (RIGHT, StepForward)],
        "one tick of one node; looking back, one picture forward", Some("step")),
    row(&[(Char(','), StepBack), (LEFT, StepBack)],
        "look back one picture; at a real run at rest, tick by tick", Some("back")),
    row(&[(HOME, Oldest), (END, Newest), (Char('f'), Live)],
        "look at the oldest picture kept, the newest, what is live", None),
    row(&[(Char('m'), Map)],
        "the cliff map: which rates and seeds go well", Some("map")),
    RECORD,
    row(&[(Char('e'), Exercises)],
        "open the exercises: predict, then see", Some("exercises")),
    row(&[(Char('g'), Tour)],
        "begin the guided tour of five minutes, or leave it", None),
    row(&[(Char('c'), OtherClock)],
        "hand the running graph to the other clock", Some("clock")),
    row(&[(Char('+'), Speed(Up)), (Char('-'), Speed(Down)), (Char('0'), SpeedOne)],
        "virtual time faster, slower, as fast as the wall's", Some("speed")),
    row(&[(UP, Node(Down)), (DOWN, Node(Up))],
        "mark the node before, the next one", Some("node")),
    row(&[(Char('t'), Topic(Up)), (Char('T'), Topic(Down))],
        "mark the next topic, the one before", Some("topic")),
    row(&[(Char('o'), OtherWorld)],
        "start again in the world that does not wait, or that waits",
        Some("world")),
    row(&[(Char('{'), SecondRate(Down)), (Char('}'), SecondRate(Up))],
        "rate of the second alias, such as sensor-hz, down, up", Some("second rate")),
    TYPE,
    row(&[(Char('n'), Seed(Up)), (Char('N'), Seed(Down))],
        "start again with the next seed, the previous one", Some("seed")),
    row(&[(Char('p'), Choice(Up)), (Char('P'), Choice(Down))],
        "swap the policy for the next one, the previous one", Some("policy")),
    row(&[(Char('B'), Branch)],
        "branch: this run again up to here, then with a knob turned", Some("branch")),
];
