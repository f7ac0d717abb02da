//! What reaches the nodes of a run under the real clock beside their topics, so that it
//! cannot come back: it is named.

use std::{
    path::Path,
    sync::{
        Arc, Mutex,
        atomic::{AtomicU64, Ordering},
    },
    thread,
};

use ratelab::{Command, Shared, Tick, Time};
use ratelab_experiment::Experiment;
use ratelab_metrics::fields;
use ratelab_recording::{FinishedRecording, Recorder, Source};
use ratelab_system::{Builder, System};

use super::{Made, assert_has, file, finish, ms, read, real, to, verify_with};

/// A number.
#[derive(Clone, Copy)]
pub struct Number {
    /// The number.
    pub number: f64,
}
fields!(Number { number: "number" });

/// A node that publishes the number that it `reads`, and another one that `adds` to what the
/// number is made of.
fn leaky(
    reads: impl Fn() -> f64 + Send + Sync + 'static,
    adds: impl Fn() + Send + Sync + 'static,
) -> Arc<dyn System> {
    let (reads, adds) = (Arc::new(reads), Arc::new(adds));
    let build = move |builder: &mut Builder<'_>| {
        let number = builder.topic::<Number>("/number");
        let (reads, adds) = (reads.clone(), adds.clone());
        builder.node("reads", 200.0, 0, move |wiring| {
            let (numbers, reads) = (wiring.publisher(&number), reads.clone());
            move |tick: &mut Tick| {
                let number = reads();
                tick.publish(&numbers, Number { number });
            }
        })?;
        builder.node("adds", 200.0, 1, move |_| {
            let adds = adds.clone();
            move |_: &mut Tick| adds()
        })
    };
    Arc::new(Made("leaky", build))
}

/// A system with a value that counts its turns, which is no leak.
fn sharing(shared: &Arc<Shared<u64>>) -> Arc<dyn System> {
    let (read, added) = (shared.clone(), shared.clone());
    leaky(move || *read.lock() as f64, move || *added.lock() += 1)
}

/// All notices of recorders.
static NOTICES: Mutex<Vec<String>> = Mutex::new(Vec::new());

fn notices_of(name: &str) -> usize {
    let notices = NOTICES.lock().expect("open");
    notices.iter().filter(|text| text.contains(name)).count()
}

/// Records a run of `system`; `meanwhile` sees it tick.
fn record(system: &Arc<dyn System>, path: &Path, meanwhile: impl FnOnce()) -> FinishedRecording {
    let experiment = Experiment::new(system.clone(), &real(Time::MAX)).expect("experiment");
    let source = Source {
        notice: |text| NOTICES.lock().expect("open").push(text.to_owned()),
        ..Source::for_experiment(&experiment)
    };
    let recorder = Recorder::from_the_start(&mut to(path), &source).expect("a recorder");
    let (observer, commands) = (experiment.observer(), experiment.commands());
    let run = thread::spawn(move || experiment.run());
    while observer.now() < ms(50) {
        thread::yield_now();
    }
    meanwhile();
    commands.send(Command::Stop).expect("it goes on");
    finish(recorder, &run.join().expect("no panic"))
}

#[test]
fn a_write_from_outside_of_the_graph_is_named_by_the_recording_and_by_verify() {
    let (_folder, path) = file("run.rrd");
    let shared = Arc::new(Shared::new("the number", 0));
    let system = sharing(&shared);
    let recorded = record(&system, &path, || {
        for _ in 0..2 {
            *shared.lock() += 100;
            // The run goes on for as long as this takes.
            while notices_of("wrote to the number") == 0 {
                thread::yield_now();
            }
        }
    });
    assert_eq!(notices_of("wrote to the number"), 1);
    let defect = recorded.defect().expect("it cannot come back");
    assert_has(&defect, "wrote to the number");
    let error = verify_with(&read(&path), &system).expect_err("not to be had");
    assert_has(&error.to_string(), "the number was written to");
}

#[test]
fn a_shared_value_that_only_nodes_write_to_is_no_defect() {
    let (_folder, path) = file("run.rrd");
    let shared = Arc::new(Shared::new("the number", 0));
    // Before the run anybody may write.
    *shared.lock() = 0;
    let system = sharing(&shared);
    let recorded = record(&system, &path, || drop(shared.peek()));
    assert_eq!(recorded.defect(), None);
    // Another run has another value, which counts from its first turn.
    let again = Arc::new(Shared::new("the number", 0));
    verify_with(&read(&path), &sharing(&again)).expect("identical");
}

#[test]
fn what_a_node_takes_from_elsewhere_makes_a_difference_with_its_likely_reasons() {
    let (_folder, path) = file("run.rrd");
    // A value that outlives the run, as the wall's time and a file do.
    static GLOBAL: AtomicU64 = AtomicU64::new(0);
    let add = || {
        GLOBAL.fetch_add(1, Ordering::Relaxed);
    };
    let system = leaky(|| GLOBAL.load(Ordering::Relaxed) as f64, add);
    assert_eq!(record(&system, &path, || {}).defect(), None);
    let error = verify_with(&read(&path), &system).expect_err("another run");
    let text = error.to_string();
    assert_has(&text, "/number message 0, ");
    assert_has(&text, "not a topic, read a clock, or a file was changed");
}
