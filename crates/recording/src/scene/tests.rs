//! What is drawn does not depend on how it came in.

use std::{collections::BTreeMap, time::Duration};

use ratelab::{ClockKind, Head, Time};
use ratelab_account::{Rows, Snapshot};
use ratelab_cart_pole::{CartPole, POLICY, STATE};
use ratelab_study::experiment::{Config, Experiment, Summary};
use rerun::{
    RecordingStream, Scalars,
    log::{Chunk, LogMsg},
};

use super::{Scene, SceneBatch, latency::LATENCY};
use crate::{
    blueprint::{self, Subject},
    tests::{cart_pole, chunks, stream},
    timeline::{BatchStream, RUN_TIME},
};

/// More messages than any run here has.
const ROOM: usize = 4096;

/// All that a run gave.
struct Run {
    start: Snapshot,
    topics: Vec<(String, Rows)>,
    summary: Summary,
}

/// Ten seconds, in which the control rate is turned down and up again.
fn run() -> Run {
    run_with("2.51 control-hz 10\n6 control-hz 50")
}

/// Ten seconds with `knobs`.
fn run_with(knobs: &str) -> Run {
    let config = Config {
        knobs: CartPole::KNOBS.parse_list(knobs).expect("knobs"),
        ..Config::default()
    };
    let experiment = Experiment::new(cart_pole(), &config).expect("a plant");
    let start = experiment.observer().snapshot();
    let taps = experiment.taps();
    let names = taps.topics().iter().map(|topic| topic.name().to_owned());
    let tapped = names.map(|name| (taps.rows(&name, ROOM).expect("a topic"), name));
    let tapped: Vec<_> = tapped.collect();
    drop(taps);
    let summary = experiment.run().expect("no fault");
    let topics = tapped.into_iter().map(|(tap, name)| {
        let mut rows = tap.rows();
        tap.take(&mut rows);
        (name, rows)
    });
    Run {
        start,
        topics: topics.collect(),
        summary,
    }
}

/// Draws `run` in batches of `span`.
fn draw(run: &Run, span: Duration) -> Vec<LogMsg> {
    let (rec, storage) = stream();
    let mut scene = Scene::new(&cart_pole(), &run.start);
    let beginning = scene.begin(&batch_stream(&rec, 0, &[]), &run.start);
    beginning.expect("the beginning");
    let topics = run.topics.iter().map(|(_, rows)| rows.clone());
    let (mut topics, mut made, mut from) = (topics.collect::<Vec<_>>(), 0, Time::ZERO);
    let end = run.summary.sim_time;
    while from <= end {
        let until = from + (span - Time::RESOLUTION);
        let events = run.summary.events.iter();
        let events: Vec<_> = events
            .filter(|event| from <= event.at && event.at <= until)
            .cloned()
            .collect();
        let news: Vec<Rows> = topics
            .iter_mut()
            .map(|rows| rows.take_until(until))
            .collect();
        let names = run.topics.iter().map(|(name, _)| &**name);
        let news: Vec<(&str, Rows)> = names.zip(news).collect();
        let states = news.iter().find(|(name, _)| *name == STATE);
        let stream = batch_stream(&rec, made, states.expect("states").1.heads());
        made = stream.made();
        let batch = SceneBatch {
            topics: &news,
            events: &events,
            until: until.min(end),
        };
        scene.add(&stream, &batch).expect("a batch");
        from = from + span;
    }
    let finished = scene.finish(&batch_stream(&rec, made, &[]), end, "BALANCED", false);
    finished.expect("an end");
    storage.take()
}

fn batch_stream<'a>(rec: &RecordingStream, before: u64, steps: &'a [Head]) -> BatchStream<'a> {
    BatchStream {
        rec: rec.clone(),
        epoch: None,
        before,
        steps,
    }
}

/// Every value that is drawn as a line, by entity and run time.
fn lines(messages: &[LogMsg]) -> BTreeMap<(String, i64), Vec<u64>> {
    let scalars = Scalars::descriptor_scalars().component;
    let mut lines = BTreeMap::new();
    for chunk in chunks(messages) {
        let Some(times) = chunk.timelines().get(&RUN_TIME.into()) else {
            continue;
        };
        let values = chunk.iter_slices::<f64>(scalars);
        for (time, values) in times.times_raw().iter().zip(values) {
            let bits = values.iter().map(|value| value.to_bits()).collect();
            let before = lines.insert((chunk.entity_path().to_string(), *time), bits);
            assert_eq!(before, None, "twice at {time}");
        }
    }
    lines
}

#[test]
fn batches_make_no_difference() {
    let run = run();
    let many = draw(&run, Duration::from_millis(750));
    let one = draw(&run, Duration::from_secs(1000));
    let (many, one) = (lines(&many), lines(&one));
    // Signals and latency per step, and ten a second after the first, to the end.
    assert_eq!(one.len(), 2 * 501 + 2 * 100);
    assert_eq!(many, one);
}

#[test]
fn the_control_period_is_drawn_where_it_changed() {
    let run = run();
    let lines = lines(&draw(&run, Duration::from_millis(750)));
    let period = |ms: i64| f64::from_bits(lines[&(format!("/{LATENCY}"), ms * 1_000_000)][1]);
    assert_eq!(
        [2500, 2520, 5980, 6000].map(period),
        [20.0, 100.0, 100.0, 20.0]
    );
    assert_eq!(run.start.period(POLICY), Duration::from_millis(20));
}

#[test]
fn the_age_that_is_drawn_is_the_one_of_the_summary() {
    let run = run_with("2.51 control-hz 10");
    let lines = lines(&draw(&run, Duration::from_millis(750)));
    let age = f64::from_bits(lines[&(format!("/{LATENCY}"), 10_000_000_000)][2]);
    let summary = run.summary.push_age().expect("pushes");
    assert_eq!(age, summary.late_s * 1e3);
}

#[test]
fn the_layout_comes_with_its_activation() {
    let start = run().start;
    let (rec, storage) = stream();
    let subject = Subject {
        system: &CartPole::default(),
        picture: true,
        start: &start,
        clock: ClockKind::Virtual,
    };
    blueprint::send(&rec, &subject).expect("a layout");
    let messages = storage.take();
    let active = messages.iter().filter_map(|message| match message {
        LogMsg::BlueprintActivationCommand(command) => Some(command.blueprint_id.clone()),
        _ => None,
    });
    let active: Vec<_> = active.collect();
    assert_eq!(active.len(), 1);
    let background = messages.iter().any(|message| match message {
        LogMsg::ArrowMsg(store, data) if *store == active[0] => {
            let chunk = Chunk::from_arrow_msg(data).expect("a chunk");
            chunk.entity_path().to_string().ends_with("Background")
        }
        _ => false,
    });
    assert!(background, "the properties of views are in the same store");
}

#[test]
fn knobs_of_a_batch_take_no_chunks_of_their_own() {
    let knobs = |count: u32| {
        let line = |n| format!("{} control-hz {}\n", 1.0 + f64::from(n) / 1e3, 20 + n % 30);
        run_with(&(0..count).map(line).collect::<String>())
    };
    let chunks = |run: &Run| draw(run, Duration::from_secs(1000)).len();
    assert_eq!(chunks(&knobs(500)), chunks(&knobs(1)));
}

#[test]
fn every_rate_has_a_row_and_a_colour() {
    let run = run_with("1 control-hz 40\n2 control-hz 30\n3 control-hz 40\n4 sensor-hz 40");
    let messages = draw(&run, Duration::from_secs(1000));
    let texts = |chunk: &Chunk, name: &str| {
        let component = chunk
            .components_identifiers()
            .find(|c| c.as_str().ends_with(name));
        let rows = component.map(|component| chunk.iter_slices::<String>(component));
        rows.into_iter()
            .flatten()
            .flatten()
            .map(|text| text.to_string())
            .collect::<Vec<_>>()
    };
    let (mut rows, mut coloured) = (Vec::new(), Vec::new());
    let chunks = chunks(&messages);
    for chunk in chunks.filter(|c| c.entity_path().to_string() == "/mode/rate/policy") {
        rows.extend(texts(&chunk, "state"));
        coloured.extend(texts(&chunk, "values"));
    }
    assert_eq!(rows, ["50 Hz", "40 Hz", "30 Hz", "40 Hz"]);
    // The last table replaces the one before.
    assert!(coloured.ends_with(&["50 Hz", "40 Hz", "30 Hz"].map(str::to_owned)));
}
