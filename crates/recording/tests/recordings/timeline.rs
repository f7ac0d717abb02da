//! The place of rows on the timelines of a file.

use std::time::{Duration, UNIX_EPOCH};

use ratelab::Time;
use ratelab_recording::rrd::timeline::{BatchStream, CONTROL_STEP, RUN_TIME, WALL_TIME};
use rerun::{Scalars, log::Chunk};

use super::{batch_stream, chunks, stream};

/// Two rows at 20 ns and at the end of time, in the stream that `change` makes of one with seven
/// steps before.
fn sent(change: impl FnOnce(&mut BatchStream<'_>)) -> Chunk {
    let (rec, storage) = stream();
    let mut batch = batch_stream(&rec, 7, &[]);
    change(&mut batch);
    let columns = Scalars::new([1.0, 2.0]).columns_of_unit_batches();
    let times = [Time::from_nanos(20), Time::MAX];
    let sent = batch.send("/row", &times, columns.expect("columns"));
    sent.expect("sent");
    let messages = storage.take();
    let mut chunks = chunks(&messages).filter(|chunk| *chunk.entity_path() == "/row".into());
    chunks.next().expect("a chunk")
}

#[test]
fn wall_time_is_run_time_since_the_epoch_and_virtual_time_has_none() {
    let chunk = sent(|batch| batch.epoch = Some(UNIX_EPOCH + Duration::from_secs(1)));
    let end = i64::MAX;
    for (name, places) in [
        (RUN_TIME, [20, end]),
        (CONTROL_STEP, [7, 7]),
        (WALL_TIME, [1_000_000_020, end]),
    ] {
        let column = chunk.timelines().get(&name.into()).expect(name);
        assert_eq!(column.times_raw(), places, "{name}");
    }
    assert_eq!(chunk.timelines().len(), 3);
    assert_eq!(sent(|_| {}).timelines().len(), 2);
}
