//! The keys of the lab.

use super::{END, HOME, Key, LEFT, RIGHT, Table, row, screen_with_panes};
use crate::dashboard::{focus::Pane, ladder::Way};

/// What a person can do in the lab.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Change the control rate by a rung.
    ControlRate(Way),
    /// Change the sensor rate by a rung.
    SensorRate(Way),
    /// Change the queue depth by a rung.
    Depth(Way),
    /// Type a knob and an exact value.
    Type,
    /// Slow the policy to 5 Hz.
    Break,
    /// Stop run time, or let it go on.
    Pause,
    /// Run one tick, or look one picture forward.
    StepForward,
    /// Look one picture back.
    StepBack,
    /// Look at the oldest picture.
    Oldest,
    /// Look at the newest picture.
    Newest,
    /// Stop looking back.
    Live,
    /// Change the speed of virtual time by a rung.
    Speed(Way),
    /// Real-time speed.
    SpeedOne,
    /// Hand the running graph to the other clock.
    OtherClock,
    /// Start again with the same seed.
    Restart,
    /// Start again with a neighbouring seed.
    Seed(Way),
    /// Swap the brain for a neighbouring one.
    Policy(Way),
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
pub const LAB: Table<Action> = screen_with_panes![
    Action;
    row(
        &[
            (Key::Char('['), Action::ControlRate(Way::Down)),
            (Key::Char(']'), Action::ControlRate(Way::Up)),
        ],
        "control rate down, up",
        Some("control rate"),
    ),
    row(
        &[
            (Key::Char('<'), Action::Depth(Way::Down)),
            (Key::Char('>'), Action::Depth(Way::Up)),
        ],
        "queue depth down, up",
        Some("depth"),
    ),
    row(
        &[(Key::Char('b'), Action::Break)],
        "break it: the policy decides 5 times a second",
        Some("break"),
    ),
    row(
        &[(Key::Char('r'), Action::Restart)],
        "start again: same seed, knobs as they stand",
        Some("restart"),
    ),
    row(
        &[(Key::Char(' '), Action::Pause)],
        "pause, or go on",
        Some("pause"),
    ),
    row(
        &[
            (Key::Char('.'), Action::StepForward),
            (RIGHT, Action::StepForward),
        ],
        "one tick of one node; looking back, one picture forward",
        Some("step"),
    ),
    row(
        &[(Key::Char(','), Action::StepBack), (LEFT, Action::StepBack)],
        "look back one picture",
        Some("back"),
    ),
    row(
        &[
            (HOME, Action::Oldest),
            (END, Action::Newest),
            (Key::Char('f'), Action::Live),
        ],
        "look at the oldest picture kept, the newest, what is live",
        None,
    ),
    row(
        &[(Key::Char('m'), Action::Map)],
        "the cliff map: which control rates and seeds keep the pole up",
        Some("map"),
    ),
    row(
        &[(Key::Char('w'), Action::Record)],
        "record to a file in the folder recordings, or stop recording",
        Some("record"),
    ),
    row(
        &[(Key::Char('e'), Action::Exercises)],
        "open the exercises: predict, then see",
        Some("exercises"),
    ),
    row(
        &[(Key::Char('c'), Action::OtherClock)],
        "hand the running graph to the other clock",
        Some("clock"),
    ),
    row(
        &[
            (Key::Char('+'), Action::Speed(Way::Up)),
            (Key::Char('-'), Action::Speed(Way::Down)),
            (Key::Char('0'), Action::SpeedOne),
        ],
        "virtual time faster, slower, as fast as the wall's",
        Some("speed"),
    ),
    row(
        &[
            (Key::Char('{'), Action::SensorRate(Way::Down)),
            (Key::Char('}'), Action::SensorRate(Way::Up)),
        ],
        "sensor rate down, up",
        Some("sensor rate"),
    ),
    row(
        &[(Key::Char(':'), Action::Type)],
        "type an exact value, such as control-hz 7.5",
        Some("type a value"),
    ),
    row(
        &[
            (Key::Char('n'), Action::Seed(Way::Up)),
            (Key::Char('N'), Action::Seed(Way::Down)),
        ],
        "start again with the next seed, the previous one",
        Some("seed"),
    ),
    row(
        &[
            (Key::Char('p'), Action::Policy(Way::Up)),
            (Key::Char('P'), Action::Policy(Way::Down)),
        ],
        "swap the brain for the next one, the previous one",
        Some("policy"),
    ),
];
