//! Runs of a system that is no cart-pole.

use std::sync::Arc;

use ratelab::{Flow, KnobKind, Tick, TimedKnob};
use ratelab_experiment::{Config, Experiment, Summary};
use ratelab_metrics::{Fields, Rows, fields};
use ratelab_recording::{Recording, RunStatus, rrd::scene::signals};
use ratelab_system::{
    About, BuildError, Builder, Final, Judge, Picture, RobotInfo, Shape, Signal, SignalValue,
    Style, System,
};

use rerun::EntityPath;

use super::{
    assert_has, chunks_of, file, ms, read, record_run, replayed, replayed_with, traffic, verify,
    verify_with,
};

/// A ball that falls, and somebody who looks at it: names with spaces, a topic
/// without fields and one that is not recorded.
struct Ball;

/// Height (m) and speed (m/s).
#[derive(Clone, Copy)]
struct Fall {
    height: f64,
    speed: f64,
}
fields!(Fall {
    height: "height (m)",
    speed: "speed (m/s)"
});

/// Somebody blinked.
#[derive(Clone, Copy)]
struct Blink;

impl Fields for Blink {
    const FIELDS: &'static [&'static str] = &[];

    fn append_to(&self, _: &mut Vec<f64>) {}

    fn from_row(row: &[f64]) -> Option<Self> {
        row.is_empty().then_some(Self)
    }
}

impl System for Ball {
    fn name(&self) -> &str {
        "ball"
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let fall = builder.topic::<Fall>("/the ball/fall");
        let blink = builder.topic::<Blink>("/blink");
        let internal = builder.internal_topic::<String>("/internal");
        let falls = fall.clone();
        builder.node("the ball", 100.0, 0, move |wiring| {
            let (falls, mut height, mut speed) = (wiring.publisher(&falls), 5.0, 0.0);
            move |tick: &mut Tick| {
                speed -= 0.0981;
                height += speed / 100.0;
                tick.publish_stamped(&falls, Fall { height, speed }, tick.now());
                if height > 0.0 {
                    Flow::Continue
                } else {
                    Flow::End
                }
            }
        })?;
        builder.node("eye", 30.0, 1, move |wiring| {
            let (mut seen, blink) = (wiring.subscription(&fall), wiring.publisher(&blink));
            let internal = wiring.publisher(&internal);
            move |tick: &mut Tick| {
                tick.publish(&internal, "seen".to_owned());
                if tick
                    .read(&mut seen)
                    .is_some_and(|message| message.seq % 2 == 0)
                {
                    tick.publish(&blink, Blink);
                }
            }
        })
    }

    fn signals(&self) -> Vec<Signal> {
        vec![Signal {
            name: "height".into(),
            unit: "m".into(),
            topic: "/the ball/fall".into(),
            value: SignalValue::new(|row| row[0]),
            limits: Some([0.0, 6.0]),
            range: [0.0, 6.0],
        }]
    }

    fn about(&self) -> About<'_> {
        About {
            state: Some("/the ball/fall"),
            ..About::default()
        }
    }

    fn judge(&self) -> &dyn Judge {
        self
    }

    fn robot(&self) -> &dyn RobotInfo {
        self
    }
}

impl Judge for Ball {
    fn finals(&self, state: &[f64]) -> Vec<Final> {
        [("final_speed", state[1]), ("infinite", f64::INFINITY)]
            .map(|(name, value)| Final {
                name: name.into(),
                unit: "m/s".into(),
                value,
            })
            .into()
    }
}

impl RobotInfo for Ball {
    fn picture(&self, state: &[f64]) -> Option<Picture> {
        let centre = [0.0, *state.first()?];
        let (from, to) = ([-1.0, 0.0], [1.0, 0.0]);
        let (at, text, radius) = (centre, "ball".to_owned(), 0.1);
        let shapes = vec![
            (Style::Scenery, Shape::Segment { from, to }),
            (Style::Subject, Shape::Circle { centre, radius }),
            (Style::Action, Shape::Label { at, text }),
        ];
        Some(Picture {
            shapes,
            ..Picture::default()
        })
    }
}

fn ball() -> Arc<dyn System> {
    Arc::new(Ball)
}

/// A run of the ball, the eye of which is slowed after half a second.
fn config() -> Config {
    let set = |kind: KnobKind, what, value| kind.set(what, value).expect("a knob");
    let depth = set(KnobKind::Depth, "/the ball/fall", "3");
    Config {
        setup: [depth].into_iter().collect(),
        knobs: vec![TimedKnob {
            at: ms(500),
            knob: set(KnobKind::Rate, "eye", "7"),
        }],
        ..Config::default()
    }
}

/// The recording of that run, and its summary.
fn recorded() -> (Recording, Summary) {
    let (_folder, path) = file("ball.rrd");
    let experiment = Experiment::new(ball(), &config()).expect("a graph");
    let summary = record_run(experiment, &path).0.expect("no fault");
    (read(&path), summary)
}

#[test]
fn a_run_of_any_system_is_read_as_it_was_and_comes_again() {
    let (recording, _) = recorded();
    assert_eq!(recording.defect(), None);
    assert_eq!(recording.origin.config, config());
    assert_eq!(recording.origin.format, 3);
    assert_eq!(recording.origin.system, "ball");
    assert_eq!(recording.origin.engine, None, "no MuJoCo in it");
    let falls = recording.messages::<Fall>("/the ball/fall");
    assert_eq!(falls.len(), 101);
    assert!(falls[100].data.height <= 0.0 && falls[99].data.height > 0.0);
    assert!(recording.messages::<Blink>("/blink").len() > 3);
    assert_eq!(recording.rows("/internal").map(Rows::len), Some(0));
    let identical = verify_with(&recording, &ball()).expect("identical");
    assert_eq!(identical.topics, 2);
    let mut altered = recording.clone();
    if let RunStatus::Ended(end) = &mut altered.outcome.as_mut().expect("an end").end {
        assert_eq!(end.finals["infinite"], None);
        end.finals.remove("infinite");
    }
    let error = verify_with(&altered, &ball()).expect_err("a figure is missing");
    assert_has(&error.to_string(), "figures of the last state");
}

#[test]
fn a_replay_of_any_system_ends_as_its_run_did() {
    let (recording, summary) = recorded();
    let replayed = replayed_with(recording, &ball()).summary();
    let end = |summary: &Summary| {
        (
            summary.verdict.clone(),
            summary.sim_time,
            summary.state.clone(),
        )
    };
    assert_eq!(end(&replayed), end(&summary));
    // What is not recorded is not counted either.
    assert_eq!(traffic(&replayed)[..2], traffic(&summary)[..2]);
    assert_eq!((replayed.topics[2].published, replayed.steps), (0, 101));
    assert_eq!(replayed.knobs(), config().knobs);
}

#[test]
fn another_system_is_refused_by_both_names_and_shown_without_its_picture() {
    let (recording, _) = recorded();
    let error = verify(&recording).expect_err("another system").to_string();
    assert_has(&error, "\"ball\"");
    assert_has(&error, "\"cart-pole\"");
    assert_eq!(error.lines().count(), 1, "{error}");
    let replay = replayed(recording);
    assert!(replay.system().signals().is_empty());
    let summary = replay.summary();
    let fall = summary.topic("/the ball/fall");
    assert_eq!(fall.map(|topic| topic.published), Some(101));
    assert_eq!(summary.events.len(), 2);
}

#[test]
fn signals_and_picture_are_drawn() {
    let (_folder, path) = file("ball.rrd");
    let experiment = Experiment::new(ball(), &config()).expect("a graph");
    record_run(experiment, &path).0.expect("no fault");
    let chunks = chunks_of(&path);
    let rows = |entity: &EntityPath, component: &str| -> usize {
        let chunks = chunks.iter().filter(|chunk| chunk.entity_path() == entity);
        let columns = chunks.map(|chunk| {
            let mut components = chunk.components_identifiers();
            let there = components.any(|name| name.as_str().contains(component));
            if there { chunk.num_rows() } else { 0 }
        });
        columns.sum()
    };
    for (entity, component, count) in [
        (signals::entity("/the ball/fall"), "scalars", 101),
        // Every fourth state: 25 in a second look smooth.
        ("/picture".into(), "strips", 26),
        ("/picture".into(), "labels", 26),
        ("/picture/scenery".into(), "strips", 1),
        // It measures none.
        ("/plot/latency".into(), "scalars", 0),
    ] {
        assert_eq!(rows(&entity, component), count, "{component} of {entity}");
    }
}
