//! A repeated session is identical to the bit: its commands are logged with their run
//! times, and nothing else affects it.

use std::thread;

use crossbeam_channel::Sender;
use proptest::prelude::*;

use crate::support::*;

/// Runs an experiment while `person` gives commands.
fn run_live(config: &Config, person: impl FnOnce(Sender<Command>) + Send) -> RunBytes {
    let experiment = experiment(config);
    let commander = experiment.commands();
    thread::scope(|scope| {
        scope.spawn(|| person(commander));
        collect(experiment)
    })
}

/// Every message of such an experiment under `timed` commands, as fast as it goes.
fn replay(config: &Config, timed: Vec<TimedCommand>) -> Vec<u8> {
    let speed = Speed::Unlimited;
    let mut again = experiment(&Config {
        speed,
        ..config.clone()
    });
    again.schedule(timed);
    collect(again).bytes()
}

fn replayable(events: &[Event]) -> Vec<TimedCommand> {
    events.iter().filter_map(Event::replayable).collect()
}

fn live_config() -> Config {
    Config {
        speed: Speed::times(100.0).expect("speed"),
        ..config("until 3")
    }
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
    ];
    let speed = (30.0..100.0f64).prop_map(|speed| Speed::times(speed).expect("speed"));
    prop_oneof![
        12 => text.prop_map(|text| command(&text)),
        1 => speed.prop_map(Command::Speed),
    ]
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
        policy in prop_oneof![Just("policy scripted"), Just("policy random")],
    ) {
        let setup = config(policy).setup;
        let config = Config { seed, setup, ..live_config() };
        let live = run_live(&config, |commander| {
            for (command, pause_us) in script {
                thread::sleep(Duration::from_micros(pause_us));
                // The run may be over by now.
                let _ = commander.send(command);
            }
            let _ = commander.send(Command::Resume);
        });
        let again = replay(&config, replayable(&live.summary.events));
        prop_assert!(live.bytes() == again, "{:?}", live.summary.events);
    }
}

#[test]
fn a_stopped_session_ends_at_the_same_message_when_repeated() {
    let live = run_live(&live_config(), |commander| {
        for text in ["rate policy 20", "depth /obs 3", "stop"] {
            thread::sleep(ms(5));
            let _ = commander.send(command(text));
        }
    });
    let timed = replayable(&live.summary.events);
    assert!(live.bytes() == replay(&live_config(), timed));
}

#[test]
fn timed_knobs_and_live_commands_replay_together() {
    let config = Config {
        knobs: config("1 control-hz 20; 2 queue-depth 5").knobs,
        ..live_config()
    };
    let live = run_live(&config, |commander| {
        for text in ["rate sensor 100", "rate sensor 25", "rate sensor 60"] {
            thread::sleep(ms(8));
            let _ = commander.send(command(text));
        }
    });
    let events = &live.summary.events;
    assert!(applied(events).contains(&(secs(1.0), command("rate policy 20"))));
    assert!(live.bytes() == replay(&live_config(), replayable(events)));
}

#[test]
fn the_pace_of_a_run_leaves_it_unchanged() {
    let [paced, flat_out] = [live_config().speed, Speed::Unlimited].map(|speed| {
        let setup = config("control-hz 15").setup;
        run_bytes(&Config {
            setup,
            speed,
            ..live_config()
        })
        .bytes()
    });
    assert!(!paced.is_empty() && paced == flat_out);
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
