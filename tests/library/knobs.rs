//! Knobs as text and as JSON: whatever is written is refused in one line, or means what it prints;
//! a printed list of timed knobs is read again.

use std::sync::Mutex;

use proptest::prelude::*;

use crate::{
    support::{
        specs::{HEADS, almost_knob},
        *,
    },
    table::rows,
};

/// Knobs with the aliases of the cart-pole.
const KNOBS: KnobText = CartPole::KNOBS;

fn parse(text: &str) -> Result<Vec<TimedKnob>, KnobTextError> {
    KNOBS.parse_list(text)
}

#[test]
fn a_knob_is_printed_in_its_shortest_form_and_read_back_from_text_and_from_json() {
    let cases = rows(
        "link /obs delay:30                    | link /obs delay:30
         link /obs delay:5..40.5,in-order      | link /obs delay:5..40.5,in-order
         link /obs delay:lognormal:10,50,loss:0.2,burst:0.01,4.5,reliable:40 \
            | link /obs delay:lognormal:10,50,loss:0.2,burst:0.01,4.5,reliable:40
         link /obs burst:0.1,3, delay:lognormal:5,9,loss:0 \
            | link /obs delay:lognormal:5,9,burst:0.1,3
         link /obs none                        | link /obs none
         read /obs oldest                      | read /obs oldest
         read /obs newest                      | read /obs newest
         lose /obs 17                          | lose /obs 17
         postpone /obs 17 0.5                  | postpone /obs 17 0.5
         set policy plan committed             | set policy plan committed
         set arm  gains 1 2  3                 | set arm gains 1 2  3
         crash policy                          | crash policy
         restart policy                        | restart policy
         hang policy 90                        | hang policy 90
         clock sensor -12.5 40                 | clock sensor -12.5 40
         clock sensor 0 0 10                   | clock sensor 0 0 10
         takes policy 30                       | takes policy 30
         takes policy 60..110                  | takes policy 60..110
         takes policy lognormal:30,90          | takes policy lognormal:30,90
         takes policy busy 12.5                | takes policy busy 12.5
         takes policy busy 0..0.000001         | takes policy busy 0..0.000001
         takes policy 0                        | takes policy none
         takes policy recorded:my runs/real.rrd | takes policy recorded:my runs/real.rrd
         takes policy busy file:my runs/a.csv  | takes policy busy file:my runs/a.csv
         wakes policy drawn:a.csv              | wakes policy drawn:a.csv
         wakes sensor 0.25..3                  | wakes sensor 0.25..3
         wakes sensor none                     | wakes sensor none
         late policy  catch-up                 | late policy catch-up
         late policy queue:4294967295          | late policy catch-up
         late policy queue:0                   | late policy skip
         late policy queue:02                  | late policy queue:2
         offset actuator 7.000001              | offset actuator 7.000001
         offset actuator 0                     | offset actuator 0",
    );
    for [text, printed] in cases {
        let knob = checked_knob(&text).expect(&text);
        assert_eq!(knob.to_string(), printed);
        let json = serde_json::to_string(&Command::Set(knob.clone())).expect("JSON");
        let read: Command = serde_json::from_str(&json).expect("a command");
        assert_eq!(read, Command::Set(knob), "{json}");
    }
    let [one, other] = ["lose /obs 1", "lose /obs 2"].map(|text| checked_knob(text).expect(text));
    assert!(!one.is_of(&other));
    let [one, other] = ["set a b 1", "set a c 1"].map(|text| checked_knob(text).expect(text));
    assert!(!one.is_of(&other) && one.is_of(&checked_knob("set a b 2").expect("a knob")));
}

/// The gain in each tick, and how long the tick before took.
type Heard = Vec<(f64, Option<Duration>)>;

/// A node with a gain.
struct Amplifier {
    gain: f64,
    last_tick: LastTick,
    heard: Arc<Mutex<Heard>>,
}

impl Node for Amplifier {
    fn tick(&mut self, _: &mut Tick) -> TickResult {
        let mut heard = self.heard.lock().expect("heard");
        heard.push((self.gain, self.last_tick.take()));
        Ok(Flow::Continue)
    }

    fn set_parameter(&mut self, name: &str, value: &str, _: Time) -> Result<String, NodeError> {
        match (name, value.parse()) {
            ("gain", Ok(gain)) => Ok(std::mem::replace(&mut self.gain, gain).to_string()),
            _ => Err(format!("{name} {value}: expected gain and a number").into()),
        }
    }
}

#[test]
fn a_node_obeys_its_parameters_and_knows_how_long_its_last_tick_took() {
    let heard = Arc::new(Mutex::new(Heard::new()));
    let mut graph = Graph::new();
    let node = graph.node("amplifier", hz(10.0), 0, |wiring| Amplifier {
        gain: 1.0,
        last_tick: wiring.last_tick(),
        heard: heard.clone(),
    });
    node.expect("a node");
    let commands = "0 takes amplifier 30; 0.1 set amplifier gain 2; 0.1 set amplifier gain two;
                    0.2 set amplifier mass 3; 0.2 takes amplifier 0";
    run_virtual(&mut graph, commands, secs(0.3));
    let took = |millis| Some(ms(millis));
    assert_eq!(
        *heard.lock().expect("heard"),
        [
            (1.0, None),
            (2.0, took(30)),
            (2.0, took(30)),
            (2.0, took(0))
        ]
    );
    let refused = "expected gain and a number";
    let said = ["amplifier gain 2 (was 1)", refused, refused];
    for (line, said) in events(&graph)[1..4].iter().zip(said) {
        assert!(line.contains(said), "{line}");
    }
}

#[test]
fn an_invalid_knob_is_refused_in_one_line_with_the_accepted_values() {
    let cases = rows(
        r#"
        link /obs                     | expected link TOPIC SPEC
        link /obs delay:-1            | delay:lognormal:MEDIAN,P99
        link /obs delay:NaN           | "NaN" is not a delay
        link /obs delay:9..3          | delay:A..B
        link /obs delay:recorded:a.rrd | is not a delay
        link /obs delay:0 * file:a.csv | expected a factor from 0.000001 to 1000000
        link /obs delay:x * file:a.csv | is not a delay
        link /obs loss:1.5            | expected 0 to 1
        link /obs loss:NaN            | expected 0 to 1
        link /obs loss:-0.1           | expected 0 to 1
        link /obs burst:0.1           | expected burst:P,N
        link /obs burst:0.1,0.5       | expected 1 to
        link /obs loss:0.1,loss:0.2   | loss is there twice
        link /obs loss:1,reliable:40  | expected less than 1
        link /obs slow                | "slow" is not a part of a link
        link /obs delay:3,,loss:0.1   | "" is not a part of a link
        link /obs none,loss:0.1       | "none" is not a part
        read /obs first               | expected newest or oldest
        lose /obs -1                  | expected lose TOPIC N
        postpone /obs 3               | expected postpone TOPIC N MS
        postpone /obs 3 -4            | expected milliseconds
        set policy                    | expected set NODE NAME VALUE
        set policy plan               | expected set NODE NAME VALUE
        crash policy now              | expected crash NODE
        crash                         | is not a knob
        hang policy long              | expected milliseconds
        clock policy 5                | expected OFFSET_MS DRIFT_PPM
        clock policy 5 1e9            | 500000 ppm
        clock policy NaN 0            | is not a clock error
        clock policy 0 0 0            | OFFSET_MS DRIFT_PPM STEP_MS
        stamp_clock policy 5          | is not a clock error
        takes policy -1               | expected milliseconds such as 30
        takes policy soon             | "soon" is not a duration
        takes policy busy             | "busy" is not a duration
        takes policy 9..3             | expected A..B, A first
        takes policy lognormal:30     | expected lognormal:MEDIAN,P99
        takes policy lognormal:90,30  | in this order
        takes policy lognormal:0,30   | above zero
        takes policy recorded:        | expected recorded:FILE
        takes policy file:            | expected file:FILE
        takes policy drawn:a@sha256:0 | expected 64 hexadecimal digits
        takes policy NaN              | is not a duration
        offset policy 1e300           | is not a duration
        offset policy -0.1            | 0 to 1000000000
        late policy burst             | expected skip, catch-up or queue:N
        late policy queue:-1          | expected skip, catch-up or queue:N
        wakes policy busy 3           | is not a duration
        "#,
    );
    for [text, part] in cases {
        let error = checked_knob(&text).expect_err(&text);
        assert!(error.contains(&part), "{text}: {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

#[test]
fn random_knobs_are_of_every_kind() {
    for kind in KnobKind::ALL {
        let mut heads = HEADS.split('|').map(|head| head.split(' ').next());
        assert!(heads.any(|name| name == Some(kind.name())), "{kind:?}");
    }
}

#[test]
fn an_invalid_timed_knob_is_refused_with_line_value_and_expected_form() {
    let shape = "is not a timed knob: expected seconds, knob and value, such as 2.5 rate NODE 10";
    let rate = "is not a rate: expected 0.001 to 10000 ticks per second";
    let depth = "is not a queue depth: expected a whole number from 1 to 1000000";
    let known = "control-hz, sensor-hz, queue-depth, policy, think-ms, on-stale, observe, chunk, plan, \
                 expect-delay, model, play, merge, refill, disturb, rate, depth, send, set, takes, \
                 offset, wakes, late, link, read, lose, postpone, crash, restart, hang, clock or \
                 stamp_clock";
    let cases = rows(
        r"
        1 control-hz           | 1 control-hz     | SHAPE
        1 control-hz 10 20     | control-hz 10 20 | is not a knob: expected control-hz HZ
        1 rate policy          | rate policy      | is not a knob: expected rate NODE HZ
        1 depth /obs 1 2       | depth /obs 1 2   | is not a knob: expected depth TOPIC N
        1 send policy          | send policy      | is not a knob: expected send NODE TEXT
        now control-hz 10      | now              | TIME
        -1 control-hz 10       | -1               | TIME
        NaN control-hz 10      | NaN              | TIME
        inf control-hz 10      | inf              | TIME
        1e300 control-hz 10    | 1e300            | TIME
        1 policy-hz 10         | policy-hz        | is not a knob: expected KNOWN
        1 control-hz 0         | 0                | RATE
        1 control-hz NaN       | NaN              | RATE
        1 sensor-hz 1e9        | 1e9              | RATE
        1 sensor-hz fast       | fast             | RATE
        1 queue-depth 0        | 0                | DEPTH
        1 queue-depth 1000001  | 1000001          | DEPTH
        1 queue-depth ten      | ten              | DEPTH
        1 queue-depth 1.5      | 1.5              | DEPTH
        1 queue-depth -1       | -1               | DEPTH
        ",
    );
    for [line, value, expected] in cases {
        let names = [
            ("SHAPE", shape),
            ("TIME", "is not a time: expected seconds, zero or more"),
            ("KNOWN", known),
            ("RATE", rate),
            ("DEPTH", depth),
        ];
        let expected = names
            .iter()
            .fold(expected, |text, (name, said)| text.replace(name, said));
        let error = parse(&format!("# first\n0 control-hz 10\n{line}")).expect_err(&line);
        assert_eq!(error.to_string(), format!("line 3: {value:?} {expected}"));
    }
}

#[test]
fn comments_and_empty_lines_are_ignored_and_underscores_accepted_for_dashes() {
    let text =
        "# all of it\n\n  0 control-hz 10 # slow\r\n\t\n2.5\tsensor-hz  33.3\n#3 queue-depth 0";
    let expected = [(0.0, "rate policy 10"), (2.5, "rate sensor 33.3")];
    let expected = expected.map(|(seconds, text)| TimedKnob {
        at: secs(seconds),
        knob: knob(text),
    });
    assert_eq!(parse(text), Ok(expected.to_vec()));
    assert_eq!(parse(""), Ok(Vec::new()));
    let text = "1 control_hz 10\n1 sensor_hz 20\n1 queue_depth 3";
    assert_eq!(parse(text), parse(&text.replace('_', "-")));
    assert_eq!(parse(text).map(|knobs| knobs.len()), Ok(4));
}

#[test]
fn knobs_are_written_by_an_alias_where_it_has_them_all_at_one_time_with_one_value() {
    let cases = rows(
        r"
        0 control-hz 10                      | 0 control-hz 10
        2.5 rate sensor 33.3                 | 2.5 sensor-hz 33.3
        0.000000001 queue-depth 100          | 0.000000001 queue-depth 100
        3 send policy lqr                    | 3 policy lqr
        3.5 policy my policies/first.pt      | 3.5 policy my policies/first.pt
        4 rate actuator 100                  | 4 rate actuator 100
        5 depth /obs 2                       | 5 depth /obs 2
        6 send sensor be quiet               | 6 send sensor be quiet
        1 depth /obs 8\n1 depth /action 8    | 1 queue-depth 8
        1 depth /obs 8\n2 depth /action 8    | 1 depth /obs 8\n2 depth /action 8
        1 depth /obs 8\n1 depth /action 9    | 1 depth /obs 8\n1 depth /action 9
        1 depth /obs 8\n1 rate sensor 5\n1 depth /action 8 | 1 depth /obs 8\n1 sensor-hz 5\n1 depth /action 8
        ",
    );
    for [list, written] in cases {
        assert_eq!(KNOBS.lines(&parse(&list).expect(&list)).join("\n"), written);
    }
}

#[test]
fn a_comment_begins_at_a_hash_at_the_start_or_after_white_space() {
    let policy = |path: &str| {
        let (node, text) = ("policy".to_owned(), path.to_owned());
        let (at, knob) = (secs(2.5), Knob::Send { node, text });
        TimedKnob { at, knob }
    };
    for (line, path) in [
        ("2.5 policy ./a#b.pt", "./a#b.pt"),
        ("2.5 policy ./a#b.pt # ./c.pt", "./a#b.pt"),
        ("2.5 policy ./a.pt\t#b.pt", "./a.pt"),
        (r"2.5 policy ./a \#b.pt # c", "./a #b.pt"),
        (r"2.5 policy \#a", "#a"),
        (r"2.5 policy ./a\#b \\#c", r"./a\#b \#c"),
    ] {
        let expected = Ok(vec![policy(path)]);
        assert_eq!(parse(line), expected, "{line}");
        assert_eq!(parse(&KNOBS.lines(&[policy(path)])[0]), expected);
    }
    assert_eq!(KNOBS.lines(&[policy("./a#b.pt")]), ["2.5 policy ./a#b.pt"]);
}

/// Knobs at run times; some are turned together, and have an alias.
fn any_list() -> impl Strategy<Value = Vec<TimedKnob>> {
    let text = r"[a-z./#\\]{1,9}( [a-z#\\]{1,5})?";
    let send = (r"[a-z/#\\]{1,6}", text).prop_map(|(node, text)| vec![Knob::Send { node, text }]);
    let depth = (proptest::sample::select(vec!["/obs", "/action"]), 1..3);
    let depth =
        depth.prop_map(|(topic, messages)| vec![knob(&format!("depth {topic} {messages}"))]);
    let other = almost_knob().prop_map(|text| KNOBS.parse(&text).unwrap_or_default());
    // Seconds are parsed in double precision: exact to the nanosecond for fifty days.
    let time = prop_oneof![Just(0), 0..1u64 << 52].prop_map(Time::from_nanos);
    let knobs = (time, prop_oneof![send, depth, other]);
    let knobs =
        knobs.prop_map(|(at, knobs)| knobs.into_iter().map(move |knob| TimedKnob { at, knob }));
    proptest::collection::vec(knobs, 0..20).prop_map(|lists| lists.into_iter().flatten().collect())
}

/// Similar enough to a list of knobs to pass the first checks.
const ALMOST_A_LIST: &str =
    "((control-hz|queue_depth|rate|send|/obs|NaN|inf|-0|1e400|[0-9a-z#.eE_+-]{0,8})[ \n]){0,20}";

/// The knobs in `text`, held to what is promised of any text.
fn held(text: &str) -> Result<Vec<Knob>, TestCaseError> {
    let knobs = match KNOBS.parse(text) {
        Ok(knobs) => knobs,
        Err(error) => {
            let error = error.to_string();
            prop_assert_eq!(error.lines().count(), 1, "{}", error);
            prop_assert!(error.contains("expected"), "{}", error);
            return Ok(Vec::new());
        }
    };
    for knob in &knobs {
        let printed = knob.to_string();
        let parsed = printed.parse::<Knob>();
        prop_assert_eq!(parsed.as_ref(), Ok(knob), "{}", printed);
        let json = serde_json::to_string(knob).expect("JSON");
        let read: Knob = serde_json::from_str(&json).expect("a knob");
        prop_assert_eq!(&read, knob, "{}", json);
    }
    Ok(knobs)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(number("RATELAB_CASES", 20_000)))]
    #[test]
    fn any_knob_is_refused_in_one_line_or_means_what_is_read_back(text in almost_knob()) {
        held(&text)?;
    }
}

proptest! {
    #[test]
    fn a_list_of_knobs_that_is_written_is_read_again(knobs in any_list()) {
        for aliases in [KNOBS, KnobText::default()] {
            let text = aliases.lines(&knobs).join("\n");
            prop_assert_eq!(parse(&text), Ok(knobs.clone()), "{}", text);
        }
    }

    #[test]
    fn any_list_is_read_as_it_is_written_or_refused_by_its_line(
        text in prop_oneof![ALMOST_A_LIST, ".*"],
    ) {
        match parse(&text) {
            Ok(knobs) => prop_assert_eq!(parse(&KNOBS.lines(&knobs).join("\n")), Ok(knobs)),
            Err(error) => prop_assert!(error.to_string().starts_with("line "), "{}", error),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(number("RATELAB_CASES", 300)))]
    #[test]
    fn any_knobs_run_or_are_refused_in_one_line(
        texts in proptest::collection::vec((almost_knob(), 0..200_u64), 1..6),
        own: bool,
    ) {
        let mut config = config(if own { "own; until 0.3" } else { "until 0.3" });
        for (text, ms) in texts {
            let at = at_ms(ms);
            let knobs = held(&text)?.into_iter();
            match ms % 2 {
                0 => config.setup.extend(knobs),
                _ => config.knobs.extend(knobs.map(|knob| TimedKnob { at, knob })),
            }
        }
        match Experiment::new(cart_pole(), &config) {
            Ok(experiment) => drop(experiment.run().expect("no node fails")),
            Err(error) => prop_assert_eq!(error.to_string().lines().count(), 1),
        }
    }
}
