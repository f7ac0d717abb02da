//! Messages as rows of numbers: every row has the width of its topic, and taking or
//! cutting keeps messages whole.

use proptest::prelude::*;

use crate::support::*;

/// Messages with stamps in order, including some of a wrong width.
fn any_messages(width: usize) -> impl Strategy<Value = Vec<(u64, Vec<f64>)>> {
    let values = prop_oneof![
        6 => proptest::collection::vec(-1e9..1e9f64, width),
        1 => proptest::collection::vec(-1e9..1e9f64, 0..8),
    ];
    let messages = proptest::collection::vec((0..50u64, values), 0..40);
    messages.prop_map(|mut messages| {
        messages.sort_by_key(|(at, _)| *at);
        messages
    })
}

fn head(at: u64, seq: usize) -> Head {
    Head {
        at: Time::from_nanos(at),
        by: None,
        // The stamps of a clock that is wrong may go back.
        stamp: Time::from_nanos(60 - at),
        seq: seq as u64,
        origin: None,
        from: Derived::Reads,
        arrives: None,
        dropped: 0,
    }
}

/// `rows` as a list of messages.
fn messages(rows: &Rows) -> Vec<(u64, Vec<f64>)> {
    let rows = rows.iter();
    rows.map(|(head, row)| (head.at.as_nanos(), row.to_vec()))
        .collect()
}

proptest! {
    #[test]
    fn rows_keep_every_message_of_their_width_and_refuse_others(
        (width, given) in (1..6usize).prop_flat_map(|width| (Just(width), any_messages(width))),
        until in 0..60u64,
    ) {
        let mut rows = Rows::new(width);
        for (seq, (at, values)) in given.iter().enumerate() {
            prop_assert_eq!(rows.push(head(*at, seq), values.iter().copied()), values.len() == width);
        }
        let mut kept = given;
        kept.retain(|(_, values)| values.len() == width);
        prop_assert_eq!(messages(&rows), kept.clone());
        prop_assert_eq!((rows.len(), rows.values().len()), (kept.len(), kept.len() * width));
        prop_assert!(rows.row(rows.len()).is_empty());

        let (early, late): (Vec<_>, Vec<_>) = kept.into_iter().partition(|(at, _)| *at <= until);
        let mut cut = rows.clone();
        cut.cut(Time::from_nanos(until));
        prop_assert_eq!(messages(&cut), early.clone());
        let taken = rows.take_until(Time::from_nanos(until));
        prop_assert_eq!((messages(&taken), messages(&rows)), (early, late));
        prop_assert_eq!((taken.width(), rows.width()), (width, width));
        rows.clear();
        prop_assert!(rows.is_empty() && rows.push(head(0, 0), vec![0.0; width]));
    }
}

#[test]
fn the_rows_of_a_topic_are_its_messages() {
    let experiment = experiment(&Config::default());
    let tap = experiment.taps().rows(STATE, 1_000).expect(STATE);
    let topic = experiment.taps().topics()[2].clone();
    assert_eq!(topic.newest(), None);
    experiment.run().expect("run");
    let mut rows = tap.rows();
    assert!(tap.wait(&mut rows));
    assert_eq!((tap.take(&mut rows), tap.lost()), (0, 0));
    let newest = topic.newest().expect("messages");
    assert_eq!(newest.last(), rows.last());
    // The tap ends with the last handle of its topic.
    drop(topic);
    assert!(!tap.wait(&mut rows));
    assert_eq!(rows.width(), ControlStep::FIELDS.len());
    let messages = (0..).map_while(|index| rows.message::<ControlStep>(index));
    assert!(messages.eq(run_bytes(&Config::default()).steps));
}
