//! The keys of the lab.

use super::{END, HOME, Key, KeyTable, LEFT, RIGHT, row, screen_with_panes};
use crate::dashboard::{focus::Pane, presets::Direction};

/// What a person can do in the lab.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LabAction {
    /// Change the control rate by a preset.
    ControlRate(Direction),
    /// Change the sensor rate by a preset.
    SensorRate(Direction),
    /// Change the queue depth by a preset.
    Depth(Direction),
    /// Type a knob and an exact value.
    Type,
    /// Slow the policy to 5 Hz.
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
    /// Start again with a neighbouring seed.
    Seed(Direction),
    /// Swap the policy for a neighbouring one.
    Policy(Direction),
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
            (Key::Char('['), LabAction::ControlRate(Direction::Down)),
            (Key::Char(']'), LabAction::ControlRate(Direction::Up)),
        ],
        "control rate down, up",
        Some("control rate"),
    ),
    row(
        &[
            (Key::Char('<'), LabAction::Depth(Direction::Down)),
            (Key::Char('>'), LabAction::Depth(Direction::Up)),
        ],
        "queue depth down, up",
        Some("depth"),
    ),
    row(
        &[(Key::Char('b'), LabAction::Break)],
        "break it: the policy decides 5 times a second",
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
        "the cliff map: which control rates and seeds keep the pole up",
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
            (Key::Char('{'), LabAction::SensorRate(Direction::Down)),
            (Key::Char('}'), LabAction::SensorRate(Direction::Up)),
        ],
        "sensor rate down, up",
        Some("sensor rate"),
    ),
    row(
        &[(Key::Char(':'), LabAction::Type)],
        "type an exact value, such as control-hz 7.5",
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
            (Key::Char('p'), LabAction::Policy(Direction::Up)),
            (Key::Char('P'), LabAction::Policy(Direction::Down)),
        ],
        "swap the policy for the next one, the previous one",
        Some("policy"),
    ),
];
