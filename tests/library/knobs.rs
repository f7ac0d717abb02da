//! Timed knobs as text: written knobs parse again, and invalid ones are refused with the
//! line, the value and the expected form.

use proptest::prelude::*;
use ratelab::{Knob, Time, TimedKnob};
use ratelab_cart_pole::CartPole;
use ratelab_study::system::{KnobText, KnobTextError};

use crate::support::{depth, hz, knobs, secs};

/// Knobs with the aliases of the cart-pole.
const KNOBS: KnobText = CartPole::KNOBS;

fn parse(text: &str) -> Result<Vec<TimedKnob>, KnobTextError> {
    KNOBS.parse_list(text)
}

/// Nodes and topics in the aliases of the cart-pole.
const KNOWN: &[&str] = &["policy", "sensor", "/obs", "/action"];

/// Names of nodes and topics, including those in [`KNOWN`].
fn any_name() -> impl Strategy<Value = String> {
    prop_oneof![
        proptest::sample::select(KNOWN).prop_map(str::to_owned),
        r"[a-z/#\\]{1,6}",
    ]
}

fn any_knob() -> impl Strategy<Value = Knob> {
    let rate = (1_000..=10_000_000_000_u64).prop_map(|micro| hz(micro as f64 / 1e6));
    let depth = (1..=1_000_000_usize).prop_map(depth);
    let text = r"[a-z./#\\]{1,9}( [a-z#\\]{1,5})?";
    prop_oneof![
        (any_name(), rate).prop_map(|(node, hz)| Knob::Rate { node, hz }),
        (any_name(), depth).prop_map(|(topic, depth)| Knob::Depth { topic, depth }),
        (any_name(), text).prop_map(|(node, text)| Knob::Send { node, text }),
    ]
}

fn any_timed_knob() -> impl Strategy<Value = TimedKnob> {
    // Seconds are parsed in double precision: exact to the nanosecond for fifty days.
    let time = (0..1u64 << 52).prop_map(Time::from_nanos);
    (time, any_knob()).prop_map(|(at, knob)| TimedKnob { at, knob })
}

/// Knobs with a common time, some of them covered by one alias.
fn turned_together() -> impl Strategy<Value = Vec<TimedKnob>> {
    let topics = proptest::sample::subsequence(vec!["/obs", "/action"], 1..=2);
    (any_timed_knob(), topics, 1..3_usize).prop_map(|(first, topics, messages)| {
        let deep = topics.into_iter().map(|topic| Knob::Depth {
            topic: topic.to_owned(),
            depth: depth(messages),
        });
        let at = first.at;
        let deep = deep.map(|knob| TimedKnob { at, knob });
        deep.chain([first.clone()]).collect()
    })
}

/// A text similar enough to a list of knobs to pass the first checks.
fn almost_knobs() -> impl Strategy<Value = String> {
    let word = "[0-9a-z#.eE_+-]{0,8}|control-hz|queue_depth|rate|send|/obs|NaN|inf|-0|1e400|[ \n]";
    proptest::collection::vec(word, 0..20).prop_map(|words| words.join(" "))
}

proptest! {
    #[test]
    fn a_list_of_knobs_that_is_written_is_read_again(
        groups in proptest::collection::vec(turned_together(), 0..10),
    ) {
        let knobs = groups.concat();
        let text = KNOBS.lines(&knobs).join("\n");
        prop_assert_eq!(parse(&text), Ok(knobs.clone()), "{}", text);
        let plain = KnobText::default().lines(&knobs).join("\n");
        prop_assert_eq!(parse(&plain), Ok(knobs), "{}", plain);
    }

    #[test]
    fn any_text_is_read_or_refused(text in ".*") {
        let _ = parse(&text);
    }

    #[test]
    fn any_text_that_resembles_knobs_is_read_or_refused(text in almost_knobs()) {
        let _ = parse(&text);
    }
}

fn rate(seconds: f64, node: &str, rate: f64) -> TimedKnob {
    let (node, hz) = (node.to_owned(), hz(rate));
    TimedKnob {
        at: secs(seconds),
        knob: Knob::Rate { node, hz },
    }
}

#[test]
fn comments_and_empty_lines_are_ignored() {
    let text =
        "# all of it\n\n  0 control-hz 10 # slow\r\n\t\n2.5\tsensor-hz  33.3\n#3 queue-depth 0";
    let expected = vec![rate(0.0, "policy", 10.0), rate(2.5, "sensor", 33.3)];
    assert_eq!(parse(text), Ok(expected));
    assert_eq!(parse(""), Ok(Vec::new()));
}

#[test]
fn underscores_are_accepted_for_dashes() {
    let text = "1 control_hz 10\n1 sensor_hz 20\n1 queue_depth 3";
    assert_eq!(parse(text), parse(&text.replace('_', "-")));
    assert_eq!(parse(text).map(|knobs| knobs.len()), Ok(4));
}

#[test]
fn a_knob_is_written_by_its_alias_where_it_has_one() {
    for (line, written) in [
        ("0 control-hz 10", "0 control-hz 10"),
        ("2.5 rate sensor 33.3", "2.5 sensor-hz 33.3"),
        ("0.000000001 queue-depth 100", "0.000000001 queue-depth 100"),
        ("3 send policy lqr", "3 policy lqr"),
        (
            "3.5 policy my policies/first.pt",
            "3.5 policy my policies/first.pt",
        ),
        ("4 rate actuator 100", "4 rate actuator 100"),
        ("5 depth /obs 2", "5 depth /obs 2"),
        ("6 send sensor be quiet", "6 send sensor be quiet"),
    ] {
        assert_eq!(KNOBS.lines(&knobs(line)), [written], "{line}");
    }
}

#[test]
fn knobs_are_written_as_one_alias_only_with_the_same_time_and_value() {
    for (list, written) in [
        ("1 depth /obs 8\n1 depth /action 8", "1 queue-depth 8"),
        (
            "1 depth /obs 8\n2 depth /action 8",
            "1 depth /obs 8\n2 depth /action 8",
        ),
        (
            "1 depth /obs 8\n1 depth /action 9",
            "1 depth /obs 8\n1 depth /action 9",
        ),
        (
            "1 depth /obs 8\n1 rate sensor 5\n1 depth /action 8",
            "1 depth /obs 8\n1 sensor-hz 5\n1 depth /action 8",
        ),
    ] {
        assert_eq!(KNOBS.lines(&knobs(list)).join("\n"), written);
    }
}

#[test]
fn invalid_knobs_are_refused_with_line_value_and_expected_form() {
    let shape = "is not a timed knob: expected seconds, knob and value, such as 2.5 rate NODE 10";
    let time = "is not a time: expected seconds, zero or more";
    let name = "is not a knob: expected control-hz, sensor-hz, queue-depth, policy, \
                think-ms, on-stale, rate, depth, send, takes, offset, wakes, link, read, lose, postpone, crash, \
                restart, hang or clock";
    let rate = "is not a rate: expected 0.001 to 10000 ticks per second";
    let depth = "is not a queue depth: expected a whole number from 1 to 1000000";
    let cases = [
        ("1 control-hz", "1 control-hz", shape),
        (
            "1 control-hz 10 20",
            "control-hz 10 20",
            "is not a knob: expected control-hz HZ",
        ),
        (
            "1 rate policy",
            "rate policy",
            "is not a knob: expected rate NODE HZ",
        ),
        (
            "1 depth /obs 1 2",
            "depth /obs 1 2",
            "is not a knob: expected depth TOPIC N",
        ),
        (
            "1 send policy",
            "send policy",
            "is not a knob: expected send NODE TEXT",
        ),
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
        let error = parse(&format!("# first\n0 control-hz 10\n{line}")).expect_err(line);
        assert_eq!(error.to_string(), format!("line 3: {value:?} {expected}"));
    }
}

#[test]
fn a_comment_begins_at_a_hash_at_the_start_or_after_white_space() {
    let policy = |path: &str| TimedKnob {
        at: secs(2.5),
        knob: Knob::Send {
            node: "policy".to_owned(),
            text: path.to_owned(),
        },
    };
    for (line, path) in [
        ("2.5 policy ./a#b.pt", "./a#b.pt"),
        ("2.5 policy ./a#b.pt # ./c.pt", "./a#b.pt"),
        ("2.5 policy ./a.pt\t#b.pt", "./a.pt"),
        (r"2.5 policy ./a \#b.pt # c", "./a #b.pt"),
        (r"2.5 policy \#a", "#a"),
        (r"2.5 policy ./a\#b \\#c", r"./a\#b \#c"),
    ] {
        assert_eq!(parse(line), Ok(vec![policy(path)]), "{line}");
        assert_eq!(
            parse(&KNOBS.lines(&[policy(path)])[0]),
            Ok(vec![policy(path)])
        );
    }
    assert_eq!(KNOBS.lines(&[policy("./a#b.pt")]), ["2.5 policy ./a#b.pt"]);
}
