//! The keys of the lab.

use super::{DOWN, END, HOME, Key, KeyTable, LEFT, RIGHT, UP, row, screen_with_panes};
use crate::dashboard::{focus::Pane, presets::Direction};

/// What a person can do in the lab.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LabAction {
    /// Change the rate of the node in focus by a preset.
    Rate(Direction),
    /// Change the rate of the second alias of one by a preset.
    SecondRate(Direction),
    /// Change the depth of the topics in focus by a preset.
    Depth(Direction),
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
    /// Focus the next pane.
    NextPane,
    /// Focus a pane.
    Focus(Pane),
    /// Open the cliff map.
    Map,
    /// Record to a file, or stop recording.
    Record,
    /// Open the exercises.
    Exercises,
    /// Give the focused pane the whole screen, or take it back.
    Zoom,
    /// Explain the pane in focus.
    Explain,
    /// Show or hide the keys.
    Help,
    /// Leave.
    Quit,
}

/// All keys of the lab, the way out first.
pub const LAB: KeyTable<LabAction> = screen_with_panes![
    LabAction;
    row(
        &[
            (Key::Char('['), LabAction::Rate(Direction::Down)),
            (Key::Char(']'), LabAction::Rate(Direction::Up)),
        ],
        "rate of the marked node down, up",
        Some("rate"),
    ),
    row(
        &[
            (Key::Char('<'), LabAction::Depth(Direction::Down)),
            (Key::Char('>'), LabAction::Depth(Direction::Up)),
        ],
        "depth of the marked topics down, up",
        Some("depth"),
    ),
    row(
        &[(Key::Char('b'), LabAction::Break)],
        "break it, as --break does",
        Some("break"),
    ),
    row(
        &[(Key::Char('r'), LabAction::Restart)],
        "start again: same seed, knobs as they stand",
        Some("restart"),
    ),
    row(
        &[(Key::Char(' '), LabAction::Pause)],
        "pause, or go on",
        Some("pause"),
    ),
    row(
        &[
            (Key::Char('.'), LabAction::StepForward),
            (RIGHT, LabAction::StepForward),
        ],
        "one tick of one node; looking back, one picture forward",
        Some("step"),
    ),
    row(
        &[(Key::Char(','), LabAction::StepBack), (LEFT, LabAction::StepBack)],
        "look back one picture",
        Some("back"),
    ),
    row(
        &[
            (HOME, LabAction::Oldest),
            (END, LabAction::Newest),
            (Key::Char('f'), LabAction::Live),
        ],
        "look at the oldest picture kept, the newest, what is live",
        None,
    ),
    row(
        &[(Key::Char('m'), LabAction::Map)],
        "the cliff map: which rates and seeds go well",
        Some("map"),
    ),
    row(
        &[(Key::Char('w'), LabAction::Record)],
        "record to a file in the folder recordings, or stop recording",
        Some("record"),
    ),
    row(
        &[(Key::Char('e'), LabAction::Exercises)],
        "open the exercises: predict, then see",
        Some("exercises"),
    ),
    row(
        &[(Key::Char('c'), LabAction::OtherClock)],
        "hand the running graph to the other clock",
        Some("clock"),
    ),
    row(
        &[
            (Key::Char('+'), LabAction::Speed(Direction::Up)),
            (Key::Char('-'), LabAction::Speed(Direction::Down)),
            (Key::Char('0'), LabAction::SpeedOne),
        ],
        "virtual time faster, slower, as fast as the wall's",
        Some("speed"),
    ),
    row(
        &[
            (UP, LabAction::Node(Direction::Down)),
            (DOWN, LabAction::Node(Direction::Up)),
        ],
        "mark the node before, the next one",
        Some("node"),
    ),
    row(
        &[
            (Key::Char('t'), LabAction::Topic(Direction::Up)),
            (Key::Char('T'), LabAction::Topic(Direction::Down)),
        ],
        "mark the next topic, the one before, or those of the beginning",
        Some("topic"),
    ),
    row(
        &[(Key::Char('o'), LabAction::OtherWorld)],
        "start again in the other world: one that waits for the actuator, or does not",
        Some("world"),
    ),
    row(
        &[
            (Key::Char('{'), LabAction::SecondRate(Direction::Down)),
            (Key::Char('}'), LabAction::SecondRate(Direction::Up)),
        ],
        "rate of the second alias, such as sensor-hz, down, up",
        Some("second rate"),
    ),
    row(
        &[(Key::Char(':'), LabAction::Type)],
        "type a knob and its exact value, such as rate NODE 7.5",
        Some("type a value"),
    ),
    row(
        &[
            (Key::Char('n'), LabAction::Seed(Direction::Up)),
            (Key::Char('N'), LabAction::Seed(Direction::Down)),
        ],
        "start again with the next seed, the previous one",
        Some("seed"),
    ),
    row(
        &[
            (Key::Char('p'), LabAction::Choice(Direction::Up)),
            (Key::Char('P'), LabAction::Choice(Direction::Down)),
        ],
        "swap the policy for the next one, the previous one",
        Some("policy"),
    ),
];
