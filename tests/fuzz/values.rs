//! Values for options: valid ones, the last accepted, the first refused, and random text.

use std::{ffi::OsString, os::unix::ffi::OsStringExt};

use rand::Rng;

use crate::cases::{RandomSource, pick_from};

/// A value for the placeholder `name` in the help: valid, invalid, or not even text.
pub fn value(name: &str, random: &mut RandomSource) -> OsString {
    let known = if name == "DIR" { "FILE" } else { name };
    let mut rows = VALUES.iter();
    let Some((_, good, others)) = rows.find(|(row, ..)| *row == known) else {
        panic!("no values are known for what help calls {name}: add some");
    };
    match random.random_range(0..100) {
        0..75 => pick_from(random, good).into(),
        75..98 => pick_from(random, others).into(),
        98 => OsString::from_vec(vec![b'a', 0xff, 0x1b]),
        _ => "x".repeat(random.next_u32() as usize % 5_000).into(),
    }
}

/// The placeholders in the help with valid values and others, separated by `|`.
const VALUES: [(&str, &str, &str); 27] = [
    (
        "HZ",
        "50|5|7.5|0.001|10000|1e3",
        "0.0009999|10000.1|0|-1|NaN|inf|1e400||fast|5\u{1b}[m",
    ),
    (
        "N",
        "1|2|30|100",
        "0|120|121|1000000|1000001|18446744073709551615|18446744073709551616|-1|1.5|",
    ),
    (
        "POLICY",
        "scripted|lqr|zero|random|policy.pt|turns.knobs",
        "asks.pt|none.pt|rows.csv|folder|zero.pt|LQR||lqr,|\u{1b}[31mred|x.onnx",
    ),
    // Knobs with their value, and names of knobs for a list of values.
    (
        "KNOB",
        "rate policy 10|rate actuator 25|depth /obs 3|send policy lqr|control-hz 7.5|\
         takes policy lognormal:15,45|offset sensor 7.5|wakes actuator 0..3|rate sensor|\
         depth /action|queue_depth",
        "rate planner 10|depth /map 2|send sensor x|send policy none.pt|rate policy|\
         rate policy 0|rate policy 10 20|depth /obs 1000001|send|policy|CONTROL-HZ 5|| |\
         rate \u{1b}[31m 5",
    ),
    (
        "LIST",
        "5|5,10|1..3|1..2:0.5|7",
        "3..1|..|1..|5,,6|1..1000000000000|0..18446744073709551615|scripted,lqr|policy.pt,zero|\
         1..3:0|1..3:-1|1..3:1e-9||,|NaN..1|1..inf|-1..1|\u{1b}",
    ),
    // Names of files and folders, some of which exist: see `command_lines.rs`. None is
    // outside of the folder, because outputs may replace files.
    (
        "FILE",
        "rows.csv|turns.knobs|run.rrd|policy.pt|new.csv|new.rrd",
        "|.|folder|folder/|new/rows.csv|rows.csv/x|none|zero|full|loop|torn.rrd|-|\
         \u{1b}[31mred|a\nb|\u{9b}2J|a b.csv|#|é.csv|../x.csv",
    ),
    (
        "GRAPH",
        "graph.toml|new.toml",
        "|folder|none.toml|rows.csv|\u{1b}.toml",
    ),
    // Short ones, although up to a year is accepted.
    (
        "S",
        "0.05|0.001|0.1|1e-2",
        "0|0.0009|31536001|-1|NaN|inf|1e400||\u{7f}",
    ),
    ("CLOCK", "virtual|real", "|Virtual|both|\u{8}"),
    // At a slow speed or with long ticks a run takes long.
    ("FACTOR", "max|1|100", "0.09|101|MAX|-1|NaN|"),
    ("MS", "0|1|5", "60000.1|-1|NaN||1e400"),
    ("THEME", "dark|light|high", "|Dark|blue|\u{8}"),
    ("WHAT", "age", "|Age|rate"),
    ("WxH", "80x24|160x50", "|0x0|80|x|99999x99999|80x-1"),
    ("TOPIC", "/obs|/action", "|obs|/nowhere|\u{1b}"),
    ("ON-STALE", "hold|zero:20", "|zero|zero:-1|zero:NaN|keep"),
    ("WORLD", "course|own", "|Own|mine|\u{8}"),
    (
        "TEXT",
        "8 because half|0.5 as",
        "|8|-1 x|many|1e400 x|\u{1b}[2J",
    ),
    ("SHELL", "bash|zsh|fish", "|tcsh|\u{1b}"),
    ("N | check", "1|2|5", "0|6|check1|99999999999||\u{1b}"),
    (
        "SPEC",
        "3|0..5|lognormal:1,2",
        "|-1|NaN|5..1|recorded:none.rrd|lognormal:2,1",
    ),
    (
        "NODE=SPEC",
        "policy=30|sensor=0..5|actuator=lognormal:1,2|policy=busy 3",
        "policy|=3|nobody=3|policy=recorded:none.rrd|policy=5..1|world=1",
    ),
    (
        "NODE=MS",
        "sensor=0|policy=7.5|actuator=30",
        "sensor|=1|nobody=1|sensor=-1|sensor=1..2|\u{1b}=1",
    ),
    ("NODE", "sensor|policy", "|nobody|policy,|\u{1b}"),
    (
        "ADDRESS",
        "tcp/127.0.0.1:9|rerun+http://127.0.0.1:9/proxy",
        "|nowhere|tcp/|tcp/0.0.0.0:7447|http://|\u{1b}",
    ),
    ("SPEED", "1|0.2", "|0|-1|NaN|1e9"),
    ("PORT", "0|7447", "|-1|65536|any"),
];
