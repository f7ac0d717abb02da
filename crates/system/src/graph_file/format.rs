//! The keys of a graph file, for its parser, its schema and its manual.

use ratelab::KnobKind::{
    self, Clock, Depth, Late, Link, Offset, Rate, Read, StampClock, Takes, Wakes,
};

use Form::{Events, Figure, Flag, Knob, List, Milliseconds, Number, Numbers, Remap, Text, Whole};

/// A kind of section, such as `[node.NAME]`.
#[derive(Clone, Copy, Debug)]
pub struct FileSection {
    /// Its first word; empty for the keys before all sections.
    pub name: &'static str,
    /// Whether each section has a name of its own.
    pub named: bool,
    /// Its keys.
    pub keys: &'static [FormatKey],
    /// Those of them of which exactly one must be there, if any.
    pub one_of: &'static [&'static str],
    /// Description.
    pub help: &'static str,
}

/// A key with its values.
#[derive(Clone, Copy, Debug)]
pub struct FormatKey {
    /// Name.
    pub name: &'static str,
    /// The form of its value.
    pub form: Form,
    /// Whether it must be there.
    pub required: bool,
    /// Description.
    pub help: &'static str,
}

/// The form of a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// A text, with what it should be.
    Text(&'static str),
    /// The value of a knob, as a number or as the text that `--knob` takes.
    Knob(KnobKind),
    /// A list of texts, with what it should be.
    List(&'static str),
    /// A whole number from zero on, up to this one.
    Whole(u32),
    /// A number above zero, up to this one.
    Number(f64),
    /// Any finite number.
    Figure,
    /// A number of milliseconds, from [`SHORTEST_MS`] to [`LONGEST_MS`].
    Milliseconds,
    /// A table from topics to topics.
    Remap,
    /// A table from names to numbers, or to lists of numbers.
    Numbers,
    /// `true` or `false`.
    Flag,
    /// A table from times to a knob, or a list of them.
    Events,
}

impl Form {
    /// Returns the expected values, for errors.
    pub fn expected(self) -> String {
        match self {
            Text(what) | List(what) => what.to_owned(),
            Knob(kind) => format!(
                "a number or a text in quotes, as in the knob {}",
                kind.usage()
            ),
            Whole(most) => format!("a whole number from 0 to {most}"),
            Number(most) => format!("a number above 0, up to {most}"),
            Figure => "a number".to_owned(),
            Milliseconds => format!("milliseconds from {SHORTEST_MS} to {LONGEST_MS}"),
            Remap => r#"topics, such as { "/obs" = "/pose" }"#.to_owned(),
            Numbers => "names with numbers, such as { hip = 0.2 }".to_owned(),
            Flag => "true or false".to_owned(),
            Events => r#"times (s) with knobs, such as "20.5" = "crash camera""#.to_owned(),
        }
    }

    /// Returns whether `number` is one of its values.
    pub(super) fn has(self, number: f64) -> bool {
        match self {
            Knob(_) => true,
            Figure => number.is_finite(),
            Whole(most) => number.fract() == 0.0 && (0.0..=f64::from(most)).contains(&number),
            Number(most) => number > 0.0 && number <= most,
            Milliseconds => (SHORTEST_MS..=LONGEST_MS).contains(&number),
            Text(_) | List(_) | Remap | Numbers | Flag | Events => false,
        }
    }
}

const NAME: Form = Text("a name in quotes");

/// A list of topics.
pub(super) const TOPICS: Form = List(r#"a list of topics, such as ["/image"]"#);

/// A list of nodes.
pub(super) const NODES: Form = List(r#"a list of nodes, such as ["camera", "detector"]"#);

/// A list of nodes and topics in turn.
pub(super) const PATH: Form =
    List(r#"a list of nodes and topics, such as ["camera", "/image", "detector"]"#);

/// How messages of several topics are combined.
const MATCH: Form =
    Text(r#""each", "exact:10" with a number of stamps, or "approximate:10" of messages"#);

/// Whose header stamp the messages of a node have.
pub(super) const STAMP: Form = Text(r#""now" or a topic that it reads, such as "/image""#);

/// The model of a robot.
const MJCF: Form = Text(r#"a path in quotes, such as "hopper.xml""#);

/// What joints of a plant are to do.
const MOTIONS: Form = List(r#"a list of motions, such as ["hinge sine 0.1 0.5"]"#);

/// What a plant is controlled by.
const POLICY: Form = Text(r#""lqr", "hold", "zero" or the path of a policy, such as "net.onnx""#);

/// What a policy of a plant sees.
const TERMS: Form = List(r#"a list of terms, such as ["joints", "sensor gyro", "last-action"]"#);

/// The joints of an inner loop.
const JOINTS: Form = List(r#"a list of joints, such as ["pitch"]"#);

/// What loses a run of a plant.
const LOSSES: Form = List(r#"a list such as ["height torso < 0.8", "tilt torso > 45"]"#);

/// A kind of executor.
const EXECUTOR: Form =
    Text(r#""single", "multi:2", "events", "fixed-priority:1", "edf:1" or "let""#);

/// The shortest limit of an age (ms).
pub const SHORTEST_MS: f64 = 1e-3;

/// The longest limit of an age (ms).
pub const LONGEST_MS: f64 = 1e9;

const fn optional(name: &'static str, form: Form, help: &'static str) -> FormatKey {
    FormatKey {
        name,
        form,
        required: false,
        help,
    }
}

const fn required(name: &'static str, form: Form, help: &'static str) -> FormatKey {
    FormatKey {
        required: true,
        ..optional(name, form, help)
    }
}

/// The highest rate of a clock (Hz).
const MOST_CLOCK_HZ: f64 = 1e6;

/// The most triggers of which one makes a tick.
const MOST_EVERY: u32 = 1_000_000;

/// The highest priority number.
const MOST_PRIORITY: u32 = 1_000_000;

/// All sections. The first holds the keys at the beginning of the file.
pub const SECTIONS: [FileSection; 9] = [
    FileSection {
        name: "",
        named: false,
        keys: &[
            required("name", NAME, "Name of the graph"),
            optional(
                "at",
                Events,
                "What happens during a run: seconds with a knob, or a list of knobs, such as `\"20.97\" = \"crash camera\"` in a section `[at]`",
            ),
        ],
        one_of: &[],
        help: "The graph",
    },
    FileSection {
        name: "node",
        named: true,
        keys: &[
            optional(
                "rate",
                Knob(Rate),
                "Ticks per second (Hz), or a fraction of those of another node: \"control / 10\"",
            ),
            optional(
                "trigger",
                TOPICS,
                "The topics whose messages make it tick; it reads them too",
            ),
            optional(
                "match",
                MATCH,
                "What a tick needs of several triggers: each (the newest of each), \
                 exact:10 (equal header stamps; 10 of them wait) or approximate:10 (the closest) [default: each]",
            ),
            optional(
                "every",
                Whole(MOST_EVERY),
                "Only the first of so many triggers makes it tick, as in a throttle [default: 1]",
            ),
            optional(
                "or",
                List(r#"keys in quotes, such as ["rate = 10, offset = 3"]"#),
                "Its other settings that the bag allows: runs with a change try each",
            ),
            optional(
                "only_new",
                Flag,
                "Whether a node at a rate publishes only if it read another header stamp than in the tick before [default: false]",
            ),
            optional(
                "takes",
                Knob(Takes),
                "Duration of a tick (ms): 30, 60..110, lognormal:30,90, recorded:FILE, file:CSV or drawn:CSV, also with a factor: 0.5 * file:CSV; \"busy 30\" keeps a core busy",
            ),
            optional("offset", Knob(Offset), "Due time of the first tick (ms)"),
            optional(
                "wakes",
                Knob(Wakes),
                "Lateness of its ticks in virtual time (ms), as of takes",
            ),
            optional(
                "late",
                Knob(Late),
                "What becomes of due times that pass while it is busy: skip, catch-up or queue:N [default: skip]",
            ),
            optional(
                "clock",
                Knob(Clock),
                "Error of its own clock, OFFSET_MS DRIFT_PPM [STEP_MS]: ticks and stamps follow it [default: as the section clock has it, or none]",
            ),
            optional(
                "stamp",
                STAMP,
                "The header stamp of its messages: that of the message that it read last on a topic, such as \"/image\", \
                 or \"now\", the beginning of its tick by its clock [default: the first of trigger, else the first of reads, else now]",
            ),
            optional(
                "stamp_clock",
                Knob(StampClock),
                "Error of the clock that it stamps by, OFFSET_MS DRIFT_PPM [STEP_MS]; its ticks do not move [default: as clock]",
            ),
            optional(
                "reads",
                TOPICS,
                "Other topics that it reads at the beginning of a tick",
            ),
            optional(
                "publishes",
                TOPICS,
                "The topics that get a message at the end of a tick",
            ),
            optional(
                "priority",
                Whole(MOST_PRIORITY),
                "Its place among nodes that are due together and in a fixed-priority executor, \
                 lowest first [default: its place in the file, from 0]",
            ),
            optional(
                "group",
                NAME,
                "Its callback group in a single, multi or events executor: only one node of a \
                 group ticks at a time, except in the group reentrant [default: a group of its own]",
            ),
            optional(
                "deadline_ms",
                Milliseconds,
                "Its deadline in an edf executor, from the time when it is due (ms) [default: \
                 its period]",
            ),
        ],
        one_of: &["rate", "trigger"],
        help: "A node, which ticks at a rate or on messages",
    },
    FileSection {
        name: "clock",
        named: false,
        keys: &[required(
            "rate",
            Number(MOST_CLOCK_HZ),
            "Messages of a simulator on /clock per second (Hz): between two of them the time of all nodes stands still",
        )],
        one_of: &[],
        help: "The time of the nodes comes from messages, as with use_sim_time",
    },
    FileSection {
        name: "executor",
        named: true,
        keys: &[
            required(
                "kind",
                EXECUTOR,
                "single, multi:THREADS, events, fixed-priority:CORES, edf:CORES or let",
            ),
            optional(
                "nodes",
                NODES,
                "Its nodes, in the order in which they register [default: all nodes of the file \
                 that are in no other executor]",
            ),
        ],
        one_of: &[],
        help: "An executor with threads of its own; other nodes have a thread each",
    },
    FileSection {
        name: "topic",
        named: true,
        keys: &[
            optional(
                "depth",
                Knob(Depth),
                "Number of messages that it keeps [default: 1]",
            ),
            optional(
                "link",
                Knob(Link),
                "Way of a message to its readers: delay:30, delay:5..40, delay:file:CSV, loss:0.1, in-order, ...",
            ),
            optional(
                "read",
                Knob(Read),
                "The message that is read: newest or oldest [default: newest]",
            ),
        ],
        one_of: &[],
        help: "A topic with settings; others need no section",
    },
    FileSection {
        name: "chain",
        named: true,
        keys: &[
            required(
                "path",
                PATH,
                "The way of the data: node, topic, node, topic and so on",
            ),
            optional(
                "age_ms",
                Milliseconds,
                "Limit of the age of the data at the end of the path (ms)",
            ),
            optional(
                "share",
                Number(1.0),
                "Share of the time for which the limit holds [default: 1]",
            ),
            optional(
                "bag_mean_ms",
                Milliseconds,
                "The mean age in the bag that the graph was made of (ms): a run prints it beside its own",
            ),
            optional(
                "bag_p99_ms",
                Milliseconds,
                "The age there that was not exceeded for 99 % of the time (ms)",
            ),
            optional(
                "unsure",
                Text("a text"),
                "What the bag could not tell and no run tries: ages after a change depend on it",
            ),
            optional(
                "open",
                Text("a text"),
                "What the bag could not tell and runs with a change try",
            ),
        ],
        one_of: &[],
        help: "A chain of nodes and topics, whose data age is measured",
    },
    FileSection {
        name: "limit",
        named: true,
        keys: &[
            optional("at_most", Figure, "The most that the figure may be"),
            optional("at_least", Figure, "The least that it may be"),
        ],
        one_of: &["at_most", "at_least"],
        help: "A limit for `ratelab check`, named by a figure of run --json, such as nodes.detector.overruns",
    },
    FileSection {
        name: "system",
        named: false,
        keys: &[
            required("name", NAME, "Name of the system, such as cart-pole"),
            optional(
                "remap",
                Remap,
                "Topics of the system, each with the topic that is read in its place",
            ),
        ],
        one_of: &[],
        help: "A system in the middle of the graph",
    },
    FileSection {
        name: "plant",
        named: false,
        keys: &[
            required(
                "mjcf",
                MJCF,
                "The robot: a model of MuJoCo in the folder of the graph file or below",
            ),
            optional(
                "keyframe",
                NAME,
                "The pose to hold: a keyframe of the model [default: the first]",
            ),
            optional(
                "pose",
                Numbers,
                "The positions of joints in that pose (m, rad), of a free joint 7 numbers, of a ball 4",
            ),
            optional(
                "limits",
                Numbers,
                "The greatest deviations of joints (m, rad) before the run is lost, which are weights of \
                 lqr too; NAME.pos and NAME.rot of a free joint, \"*\" for all others, inf for \
                 none [default: { \"*\" = 0.5 }]",
            ),
            optional(
                "start",
                Figure,
                "The greatest speed of a coordinate at the start (m/s, rad/s) [default: 0.1]",
            ),
            optional(
                "reference",
                MOTIONS,
                "Joints, or sites such as tip.x, that move beside the pose (m, rad), with their limits: \
                 \"NAME step AMOUNT S\", \"NAME sine AMOUNT HZ\" or \"NAME way S:AMOUNT S:AMOUNT\"",
            ),
            optional(
                "policy",
                POLICY,
                "lqr, made from the model; hold, the controls of the pose; zero; or a file [default: lqr]",
            ),
            optional(
                "observe",
                TERMS,
                "What a network or a program sees, in this order [default: the state]",
            ),
            optional(
                "action",
                Figure,
                "The factor from the outputs of a network to controls [default: 1]",
            ),
            optional(
                "chunk",
                Whole(1000),
                "Actions in an answer of the policy, each for a period of rate [default: 0, single ones]",
            ),
            optional("lost", LOSSES, "What loses the run beside the limits"),
            optional(
                "rate",
                Number(MOST_CLOCK_HZ),
                "Ticks per second of sensor, policy and actuator (Hz) [default: 50]",
            ),
            optional(
                "inner",
                JOINTS,
                "Joints that an inner loop holds, with lqr's gains and a sensor of its own",
            ),
            optional(
                "inner_rate",
                Number(MOST_CLOCK_HZ),
                "Ticks per second of the inner loop and the actuator (Hz) [default: 50]",
            ),
            optional(
                "step_ms",
                Number(100.0),
                "Step of physics (ms) [default: as the model has it]",
            ),
            optional(
                "remap",
                Remap,
                "Topics of the plant, each with the topic that is read in its place",
            ),
        ],
        one_of: &[],
        help: "A robot of an MJCF file in the middle of the graph: sensor, policy, actuator",
    },
];
