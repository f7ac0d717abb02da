//! A repeated session is identical to the bit: its commands are logged with their run
//! times, and nothing else affects it.

use std::thread;

use proptest::prelude::*;

use crate::support::*;

/// Every message of a run again, by its events and as fast as it goes.
fn replay(config: &Config, events: &[Event]) -> Vec<u8> {
    let mut again = experiment(&Config {
        speed: Speed::Unlimited,
        knobs: Vec::new(),
        ..config.clone()
    });
    again.schedule(events.iter().filter_map(Event::replayable).collect());
    collect(again).bytes()
}

fn any_command() -> impl Strategy<Value = Command> {
    let one_of = |words: &'static str| {
        let words: Vec<_> = words.split('|').collect();
        prop::sample::select(words)
    };
    let (nodes, topics) = (
        one_of("sensor|policy|actuator"),
        one_of("/obs|/action|/state"),
    );
    let policies = one_of("scripted|lqr|random|no policy");
    let text = prop_oneof![
        3 => (nodes, 10.0..200.0f64).prop_map(|(node, rate)| format!("rate {node} {rate}")),
        2 => policies.prop_map(|policy| format!("send policy {policy}")),
        2 => (topics, 1..20usize).prop_map(|(topic, depth)| format!("depth {topic} {depth}")),
        5 => one_of("pause|resume|resume|step|step").prop_map(str::to_owned),
        1 => (30.0..100.0f64).prop_map(|times| format!("speed {times}")),
    ];
    text.prop_map(|text| command(&text))
}

proptest! {
    // A case depends on the timing of its commands, so storing it is useless.
    #![proptest_config(ProptestConfig {
        cases: 24,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn a_repeated_session_is_the_same_to_the_bit(
        script in proptest::collection::vec((any_command(), 0..2_000u64), 1..30),
        seed in 0..100u64,
        policy in prop_oneof![Just("scripted"), Just("random")],
        turns in prop_oneof![Just(""), Just("1 control-hz 20; 2 queue-depth 5")],
        stops: bool,
    ) {
        let config = Config {
            speed: Speed::times(100.0).expect("speed"),
            ..config(&format!("until 3; seed {seed}; policy {policy}; {turns}"))
        };
        let experiment = experiment(&config);
        let commander = experiment.commands();
        let live = thread::scope(|scope| {
            scope.spawn(move || {
                let last = if stops { Command::Stop } else { Command::Resume };
                for (command, pause_us) in script.into_iter().chain([(last, 0)]) {
                    thread::sleep(Duration::from_micros(pause_us));
                    // The run may be over by now.
                    let _ = commander.send(command);
                }
            });
            collect(experiment)
        });
        let events = &live.summary.events;
        let turned = applied(events).contains(&(secs(1.0), command("rate policy 20")));
        let is_short = live.summary.sim_time <= secs(1.0);
        prop_assert!(turned || is_short || turns.is_empty(), "{:?}", events);
        prop_assert!(live.bytes() == replay(&config, events), "{:?}", events);
    }
}

#[test]
fn single_stepping_through_a_whole_run_is_the_run() {
    let config = config("control-hz 15; until 1");
    let whole = run_bytes(&config);
    let total: u64 = whole.summary.nodes.iter().map(|node| node.ticks).sum();
    let experiment = experiment(&config);
    let (commander, observer) = (experiment.commands(), experiment.observer());
    commander.send(Command::Pause).expect("open");
    let stepped = thread::scope(|scope| {
        scope.spawn(move || {
            for done in 0..total {
                assert_eq!(ticks(&observer), done, "one step is one tick");
                commander.send(Command::Step).expect("the run goes on");
                while ticks(&observer) == done {
                    thread::yield_now();
                }
            }
        });
        collect(experiment)
    });
    assert!(stepped.bytes() == whole.bytes());
    assert_eq!(stepped.summary.verdict, whole.summary.verdict);
}
