//! Timed knobs as text: what is written is read again, and what cannot be read
//! is refused with its line, its value and what is accepted.

mod support;

use proptest::prelude::*;
use ratelab::{
    experiment::{Knob, TimedKnob, parse_knobs},
    runtime::Time,
};
use support::{depth, hz, secs};

fn any_knob() -> impl Strategy<Value = Knob> {
    let rate = || (1_000..=10_000_000_000_u64).prop_map(|micro| hz(micro as f64 / 1e6));
    prop_oneof![
        rate().prop_map(Knob::ControlHz),
        rate().prop_map(Knob::SensorHz),
        (1..=1_000_000_usize).prop_map(|messages| Knob::QueueDepth(depth(messages))),
        r"[a-z./#\\]{1,9}( [a-z#\\]{1,5})?"
            .prop_map(|text| Knob::Policy(text.parse().expect("a policy"))),
    ]
}

fn any_timed_knob() -> impl Strategy<Value = TimedKnob> {
    // Seconds are read in double precision: to the nanosecond for fifty days.
    let time = (0..1u64 << 52).prop_map(Time::from_nanos);
    (time, any_knob()).prop_map(|(at, knob)| TimedKnob { at, knob })
}

/// Something close enough to a list of knobs to get past the first checks.
fn almost_knobs() -> impl Strategy<Value = String> {
    let word = "[0-9a-z#.eE_+-]{0,8}|control-hz|queue_depth|NaN|inf|-0|1e400|[ \n]";
    proptest::collection::vec(word, 0..20).prop_map(|words| words.join(" "))
}

proptest! {
    #[test]
    fn a_list_of_knobs_that_is_written_is_read_again(
        knobs in proptest::collection::vec(any_timed_knob(), 0..20),
    ) {
        let text: String = knobs.iter().map(|knob| format!("{knob}\n")).collect();
        prop_assert_eq!(parse_knobs(&text), Ok(knobs));
    }

    #[test]
    fn any_text_is_read_or_refused(text in ".*") {
        let _ = parse_knobs(&text);
    }

    #[test]
    fn any_text_that_resembles_knobs_is_read_or_refused(text in almost_knobs()) {
        let _ = parse_knobs(&text);
    }
}

fn knob(seconds: f64, knob: Knob) -> TimedKnob {
    let at = secs(seconds);
    TimedKnob { at, knob }
}

#[test]
fn comments_and_empty_lines_do_not_count() {
    let text =
        "# all of it\n\n  0 control-hz 10 # slow\r\n\t\n2.5\tsensor-hz  33.3\n#3 queue-depth 0";
    let expected = vec![
        knob(0.0, Knob::ControlHz(hz(10.0))),
        knob(2.5, Knob::SensorHz(hz(33.3))),
    ];
    assert_eq!(parse_knobs(text), Ok(expected));
    assert_eq!(parse_knobs(""), Ok(Vec::new()));
}

#[test]
fn underscores_are_as_good_as_dashes() {
    let text = "1 control_hz 10\n1 sensor_hz 20\n1 queue_depth 3";
    assert_eq!(parse_knobs(text), parse_knobs(&text.replace('_', "-")));
    assert_eq!(parse_knobs(text).map(|knobs| knobs.len()), Ok(3));
}

#[test]
fn a_knob_is_written_as_it_is_given() {
    for line in [
        "0 control-hz 10",
        "2.5 sensor-hz 33.3",
        "0.000000001 queue-depth 100",
        "3 policy lqr",
        "3.5 policy my policies/first.pt",
    ] {
        let knob: TimedKnob = line.parse().expect(line);
        assert_eq!(knob.to_string(), line);
    }
}

#[test]
fn what_is_no_knob_is_refused_with_its_line_its_value_and_what_is_accepted() {
    let shape = "is not a timed knob: expected seconds, knob and value, such as 2.5 control-hz 10";
    let time = "is not a time: expected seconds, zero or more";
    let name = "is not a knob: expected control-hz, sensor-hz, queue-depth or policy";
    let rate = "is not a rate: expected 0.001 to 10000 ticks per second";
    let depth = "is not a queue depth: expected a whole number from 1 to 1000000";
    let cases = [
        ("1 control-hz", "1 control-hz", shape),
        ("1 control-hz 10 20", "1 control-hz 10 20", shape),
        ("now control-hz 10", "now", time),
        ("-1 control-hz 10", "-1", time),
        ("NaN control-hz 10", "NaN", time),
        ("inf control-hz 10", "inf", time),
        ("1e300 control-hz 10", "1e300", time),
        ("1 policy-hz 10", "policy-hz", name),
        ("1 control-hz 0", "0", rate),
        ("1 control-hz NaN", "NaN", rate),
        ("1 sensor-hz 1e9", "1e9", rate),
        ("1 sensor-hz fast", "fast", rate),
        ("1 queue-depth 0", "0", depth),
        ("1 queue-depth 1.5", "1.5", depth),
        ("1 queue-depth -1", "-1", depth),
    ];
    for (line, value, expected) in cases {
        let error = parse_knobs(&format!("# first\n0 control-hz 10\n{line}")).expect_err(line);
        assert_eq!(error.to_string(), format!("line 3: {value:?} {expected}"));
    }
}

#[test]
fn a_comment_begins_at_a_hash_at_the_start_or_after_white_space() {
    let policy = |path: &str| knob(2.5, Knob::Policy(path.parse().expect("a policy")));
    for (line, path) in [
        ("2.5 policy ./a#b.pt", "./a#b.pt"),
        ("2.5 policy ./a#b.pt # ./c.pt", "./a#b.pt"),
        ("2.5 policy ./a.pt\t#b.pt", "./a.pt"),
        (r"2.5 policy ./a \#b.pt # c", "./a #b.pt"),
        (r"2.5 policy \#a", "#a"),
        (r"2.5 policy ./a\#b \\#c", r"./a\#b \#c"),
    ] {
        assert_eq!(parse_knobs(line), Ok(vec![policy(path)]), "{line}");
        assert_eq!(
            parse_knobs(&policy(path).to_string()),
            Ok(vec![policy(path)])
        );
    }
    assert_eq!(policy("./a#b.pt").to_string(), "2.5 policy ./a#b.pt");
}
