//! What is drawn does not depend on how it came in.

use std::{collections::BTreeMap, time::Duration};

use ratelab::{Derived, Head, Time};
use ratelab_cart_pole::{CartPole, POLICY, STATE};
use ratelab_experiment::{Config, Experiment, Summary};
use ratelab_metrics::Snapshot;
use ratelab_recording::{
    BINS, RunRows, Source, Tapped,
    rrd::{
        blueprint,
        scene::{
            Scene,
            latency::{HISTOGRAM, Histogram, LATENCY},
            traffic::{DROPPED, PER_SECOND},
        },
        timeline::RUN_TIME,
    },
};
use rerun::{
    BarChart, Scalars, TensorBuffer,
    components::TensorData,
    log::{Chunk, LogMsg},
};

use super::{batch_stream, cart_pole, chunks, ms, stream};

/// More rows than any run here has.
const ROOM: usize = 1 << 14;

/// All that a run gave.
struct Run {
    start: Snapshot,
    rows: RunRows,
    summary: Summary,
}

/// Ten seconds with `knobs`.
fn run_with(knobs: &str) -> Run {
    let config = Config {
        knobs: CartPole::KNOBS.parse_list(knobs).expect("knobs"),
        ..Config::default()
    };
    let experiment = Experiment::new(cart_pole(), &config).expect("a plant");
    let start = experiment.observer().snapshot();
    let tap = experiment.taps().all(ROOM);
    let mut rows = experiment
        .taps()
        .empty_rows(&experiment.observer().topology());
    let summary = experiment.run().expect("no fault");
    rows.receive(&tap);
    Run {
        start,
        rows,
        summary,
    }
}

/// Draws `run` in batches of `span`.
fn draw(run: &Run, span: Duration) -> Vec<LogMsg> {
    let (rec, storage) = stream();
    let mut scene = Scene::new(&cart_pole(), &run.start);
    let beginning = scene.begin(&batch_stream(&rec, 0, &[]), &run.start);
    beginning.expect("the beginning");
    let (mut rest, mut made, mut from) = (run.rows.clone(), 0, Time::ZERO);
    let mut names = run.start.topics.iter().map(|topic| &*topic.name);
    let state = names.position(|name| name == STATE).expect("states");
    let end = run.summary.sim_time;
    while from <= end {
        let until = from + (span - Time::RESOLUTION);
        let events = run.summary.events.iter();
        let events: Vec<_> = events
            .filter(|event| from <= event.at && event.at <= until)
            .cloned()
            .collect();
        let news = rest.take_until(until);
        let stream = batch_stream(&rec, made, news.topics[state].heads());
        made = stream.made();
        let drawn = scene.add(&stream, &news.topics, &events, until.min(end));
        drawn.expect("a batch");
        from = from + span;
    }
    let finished = scene.finish(&batch_stream(&rec, made, &[]), end, "BALANCED", false);
    finished.expect("an end");
    storage.take()
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

/// What one of the lines of `entity` shows at these times (ms).
fn drawn<const N: usize>(run: &Run, entity: &str, line: usize, at: [i64; N]) -> [f64; N] {
    let lines = lines(&draw(run, Duration::from_millis(750)));
    at.map(|ms| f64::from_bits(lines[&(format!("/{entity}"), ms * 1_000_000)][line]))
}

#[test]
fn batches_make_no_difference() {
    let run = run_with("2.51 control-hz 10\n6 control-hz 50");
    let many = lines(&draw(&run, Duration::from_millis(750)));
    let one = lines(&draw(&run, Duration::from_secs(1000)));
    // Signals and latency per step, and ten a second after the first, to the end.
    assert_eq!(one.len(), 2 * 501 + 2 * 100);
    assert_eq!(many, one);
}

#[test]
fn the_control_period_is_drawn_where_it_changed() {
    let run = run_with("1 sensor-hz 40\n2.51 control-hz 10\n6 control-hz 50\n6.01 control-hz 25");
    assert_eq!(
        drawn(&run, LATENCY, 1, [1000, 2500, 2520, 5980, 6000, 6020]),
        [20.0, 20.0, 100.0, 100.0, 20.0, 40.0]
    );
    assert_eq!(run.start.period(POLICY), Duration::from_millis(20));
}

#[test]
fn the_age_that_is_drawn_is_the_one_of_the_summary() {
    let run = run_with("2.51 control-hz 10");
    let summary = run.summary.push_age().expect("pushes");
    assert_eq!(drawn(&run, LATENCY, 2, [10_000]), [summary.late_s * 1e3]);
}

#[test]
fn the_messages_of_the_last_second_are_drawn_and_all_that_were_dropped() {
    let run = run_with("0 control-hz 10");
    let of_obs = |entity| drawn(&run, entity, 0, [500, 1000, 5000, 10_000]);
    // That of exactly a second ago is out, that of now is in; four of five are not read.
    assert_eq!(of_obs(PER_SECOND), [50.0; 4]);
    assert_eq!(of_obs(DROPPED), [20.0, 40.0, 200.0, 400.0]);
}

#[test]
fn bars_of_latency_widen_and_none_is_lost() {
    let (rec, storage) = stream();
    let at = ms(200);
    let step = |(seq, latency)| Head {
        seq,
        at,
        by: None,
        stamp: at,
        dropped: 0,
        origin: Some(at - Duration::from_millis(latency)),
        from: Derived::Reads,
        arrives: Some(at),
    };
    let steps = [(0, 0), (1, 0), (2, 0), (3, 180), (4, 180)].map(step);
    let mut histogram = Histogram::default();
    let counted = histogram.add(&batch_stream(&rec, 0, &steps));
    counted.expect("counted");
    let finished = histogram.finish(&batch_stream(&rec, 5, &[]), ms(1_000));
    finished.expect("an end");
    let messages = storage.take();
    let charts = chunks(&messages).filter(|chunk| *chunk.entity_path() == HISTOGRAM.into());
    let values = BarChart::descriptor_values().component;
    let bars = charts
        .filter_map(|chart| {
            let rows: Vec<TensorData> = chart
                .iter_component(values)
                .flat_map(|row| row.to_vec())
                .collect();
            match &rows.last()?.buffer {
                TensorBuffer::U64(bars) => Some(bars.to_vec()),
                other => panic!("{other:?}"),
            }
        })
        .last()
        .expect("bars");
    // Ten milliseconds wide.
    assert_eq!((bars.len(), bars[0], bars[18]), (BINS, 3, 2));
}

#[test]
fn the_layout_comes_with_its_activation() {
    let experiment = Experiment::new(cart_pole(), &Config::default()).expect("a plant");
    let (rec, storage) = stream();
    blueprint::send(&rec, &Source::for_experiment(&experiment)).expect("a layout");
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
