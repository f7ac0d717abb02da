//! A replay shows the figures of its run.

use ratelab::{ClockKind, Time};
use ratelab_cart_pole::{CartPole, STATE};
use ratelab_experiment::{Config, Summary};
use ratelab_metrics::Snapshot;
use ratelab_system::WorldKind;

use super::{
    Dice, assert_has, cases, file, folder, found, ms, read, record, recorded, replay, replayed,
    traffic, turned, verify, with_knobs,
};

/// All figures in a snapshot, as text.
fn figures(snapshot: &Snapshot) -> String {
    let now = snapshot.now;
    let nodes = snapshot.nodes.iter().map(|node| {
        let meters: Vec<_> = node.meters.iter().map(|(_, meter)| meter).collect();
        let counts = (&node.name, node.hz, node.ticks, node.overruns);
        format!(
            "{counts:?} {:?} {:?} {meters:?}\n",
            node.lateness, node.tick_time
        )
    });
    let topics = snapshot.topics.iter().map(|topic| {
        let readers = topic.readers.iter();
        let readers: Vec<_> = readers
            .map(|reader| (reader.dropped, reader.dropped_lately(now), &reader.ages))
            .collect();
        let counts = (&topic.name, topic.depth, topic.published, topic.newest);
        format!("{counts:?} {} {readers:?}\n", topic.per_second(now))
    });
    let first = format!("{now} {:?}\n", snapshot.status);
    [first].into_iter().chain(nodes).chain(topics).collect()
}

#[test]
fn a_run_told_again_shows_the_figures_that_the_run_showed() {
    let (folder, mut dice) = (folder(), Dice(3));
    for number in 0..cases(3) {
        let config = Config {
            knobs: CartPole::KNOBS.parse_list(&dice.knobs(3)).expect("knobs"),
            ..dice.config()
        };
        let mut replay = replay(recorded(&config).0);
        // As far as the run came, and at two moments on the way.
        let last = replay.recording().until.as_nanos();
        for until in [last / 3, last / 2, last].map(Time::from_nanos) {
            let part = Config {
                end: until.min(config.end),
                ..config.clone()
            };
            let path = folder.path().join(format!("{number}-{until}.rrd"));
            let shown = figures(&record(&part, &path).1);
            replay.advance_to(until);
            let told = figures(&replay.observer().snapshot());
            assert_eq!(told, shown, "{config:?} at {until}");
        }
    }
}

#[test]
fn a_replay_from_the_beginning_is_the_same() {
    let mut replay = replay(recorded(&turned()).0);
    let until = ms(2500);
    replay.advance_to(until);
    let steps = replay.new_rows(STATE);
    assert_eq!((steps.len(), replay.new_rows(STATE).len()), (126, 0));
    let first = figures(&replay.observer().snapshot());
    replay.advance_to(Time::MAX);
    replay.rewind();
    replay.advance_to(until);
    assert_eq!(replay.new_rows(STATE), steps);
    assert_eq!(figures(&replay.observer().snapshot()), first);
}

#[test]
fn a_real_clock_run_is_replayed_and_comes_again() {
    let (_folder, path) = file("real.rrd");
    let config = Config {
        clock: ClockKind::Real,
        end: ms(1200),
        // Ticks too long for their rate: the policy overruns.
        ..CartPole::config("takes policy 50").expect("a setup")
    };
    let (outcome, snapshot) = record(&config, &path);
    let recording = read(&path);
    verify(&recording).expect("identical");
    let (replayed, summary) = (replayed(recording).summary(), outcome.expect("no fault"));
    let times = |summary: &Summary| (summary.verdict.clone(), summary.sim_time, summary.wall_time);
    assert_eq!(times(&replayed), times(&summary));
    let last = |summary: &Summary| (summary.state.clone(), summary.chains.clone(), summary.cost);
    assert_eq!(last(&replayed), last(&summary));
    assert_eq!(traffic(&replayed), traffic(&summary));
    assert!(snapshot.nodes[1].overruns > 5, "no overruns to tell of");
    for (replayed, node) in replayed.nodes.iter().zip(&snapshot.nodes) {
        assert_eq!(
            (replayed.ticks, replayed.overruns),
            (node.ticks, node.overruns)
        );
        assert_eq!(replayed.lateness.sum(), node.lateness.sum());
        assert_eq!(replayed.tick_time.sum(), node.tick_time.sum());
    }
}

#[test]
fn a_replay_in_the_own_world_measures_what_the_run_measured() {
    for setup in [
        "",
        "takes policy 15..55, takes actuator 3, link /action loss:0.2",
        "control-hz 7, clock sensor 5 40",
        "takes actuator 4..30, takes policy 9",
    ] {
        let (recording, summary) = recorded(&Config {
            world: WorldKind::OWN,
            seed: 3,
            ..CartPole::config(setup).expect("a setup")
        });
        verify(&recording).expect("identical");
        let replayed = replayed(recording).summary();
        assert!(summary.latency.count() > 10, "{setup}");
        let measured = |summary: &Summary| {
            let latency = &summary.latency;
            let age = summary.push_age().expect("pushes");
            (latency.count(), latency.sum(), age)
        };
        assert_eq!(measured(&replayed), measured(&summary), "{setup}");
    }
}

#[test]
fn a_tick_that_pushed_otherwise_is_found() {
    let (recording, _) = recorded(&Config {
        world: WorldKind::OWN,
        ..Config::default()
    });
    let error = found(&recording, |altered| {
        let push = altered.ticks[3][40].push.as_mut().expect("a push");
        push.sensed = push.sensed + Time::RESOLUTION;
    });
    assert_has(&error, "actuator tick 40, what it applied");
}

#[test]
fn links_faults_and_clocks_that_go_back_are_replayed_and_verified() {
    let live = "0.5 link /obs delay:5..60,loss:0.3\n1 clock sensor 100 0\n\
                2 clock sensor -50 300\n2.5 link /action delay:30\n2.7 lose /action 140\n\
                3 crash policy\n3.1 restart policy\n3.2 hang actuator 45";
    let (recording, summary) = recorded(&Config {
        end: ms(4000),
        world: WorldKind::OWN,
        ..with_knobs("depth /obs 3, read /obs oldest", live)
    });
    assert!(recording.is_whole(), "{:?}", recording.defect());
    verify(&recording).expect("the same run");
    assert_eq!(traffic(&replayed(recording).summary()), traffic(&summary));
    let obs = summary.topic("/obs").expect("a topic");
    assert!(obs.lost > 30 && obs.overtaken > 10, "{obs:?}");
    let action = summary.topic("/action").expect("a topic");
    assert!(action.in_flight() > 0);
}
