//! Several nodes that publish to one topic.

use std::{hint::black_box, sync::Arc};

use ratelab::{Tick, Time};
use ratelab_experiment::Experiment;
use ratelab_recording::{Recording, Replay};
use ratelab_system::{BuildError, Builder, System};

use super::{Made, file, leaks::Number, ms, read, real, record_run, verify_with};

/// A node that works for milliseconds before it publishes, and one that publishes at once.
fn pair(builder: &mut Builder<'_>) -> Result<(), BuildError> {
    let topic = builder.topic::<Number>("/number");
    for (name, hz, work) in [("slow", 50.0, 300_000), ("fast", 500.0, 1)] {
        let topic = topic.clone();
        builder.node(name, hz, 0, move |wiring| {
            let numbers = wiring.publisher(&topic);
            move |tick: &mut Tick| {
                let sum = |sum: f64, n| black_box(sum + f64::from(n)).sqrt();
                let number = (0..work).fold(0.0, sum);
                tick.publish(&numbers, Number { number });
            }
        })?;
    }
    Ok(())
}

/// A run of the pair under the real clock.
fn recorded(system: &Arc<dyn System>) -> Recording {
    let (_folder, path) = file("pair.rrd");
    let experiment = Experiment::new(system.clone(), &real(ms(300))).expect("a graph");
    record_run(experiment, &path).0.expect("no fault");
    read(&path)
}

fn goes_back(recording: &Recording) -> bool {
    let heads = recording.topics[0].heads();
    heads.windows(2).any(|two| two[1].at < two[0].at)
}

#[test]
fn messages_out_of_the_order_of_time_are_read_in_that_of_their_numbers() {
    let system: Arc<dyn System> = Arc::new(Made("pair", pair));
    let mut runs = (0..20).map(|_| recorded(&system));
    let recording = runs.find(goes_back).expect("a message that came late");
    assert_eq!(recording.defect(), None);
    verify_with(&recording, &system).expect("identical");
    let messages = recording.topics[0].clone();
    let mut replay = Replay::new(Arc::new(recording), &system);
    let mut replayed = 0;
    for until in (0..=300).map(ms).chain([Time::MAX]) {
        replay.advance_to(until);
        replayed += replay.new_rows("/number").len();
    }
    assert_eq!(replayed, messages.len());
}
