//! What was recorded comes again, and what differs is found.

use std::{ops::ControlFlow, time::Duration};

use ratelab::{Command, Event, EventKind, Head, Knob, Time, TimedCommand};
use ratelab_cart_pole::CartPole;
use ratelab_experiment::{Config, Experiment};
use ratelab_metrics::{Rows, TickRecord};
use ratelab_re_execution::BusyNode;
use ratelab_recording::{Recording, VerifyError, VerifyStatus, VerifyWith};

use super::{
    Dice, assert_has, cart_pole, cases, experiment, falling, file, folder, found, ms, read,
    record_run, recorded, turned, verify, with_knobs,
};

/// The messages of `rows` that `keep` keeps, as it leaves them.
fn kept(rows: &Rows, mut keep: impl FnMut(&mut Head, &mut [f64]) -> bool) -> Rows {
    let mut kept = Rows::new(rows.width());
    for (head, row) in rows.iter() {
        let (mut head, mut row) = (*head, row.to_vec());
        if keep(&mut head, &mut row) {
            assert!(kept.push(head, row));
        }
    }
    kept
}

#[test]
fn any_virtual_run_comes_again_to_the_bit() {
    let mut dice = Dice(1);
    for _ in 0..cases(10) {
        let config = dice.config();
        let (recording, summary) = recorded(&config);
        assert!(recording.is_whole());
        let identical = verify(&recording).unwrap_or_else(|error| panic!("{config:?}: {error}"));
        let published: u64 = summary.topics.iter().map(|topic| topic.published).sum();
        let ticks: u64 = summary.nodes.iter().map(|node| node.ticks).sum();
        let found = [identical.messages, identical.ticks].map(|count| count as u64);
        assert_eq!(found, [published, ticks]);
    }
}

#[test]
fn a_single_bit_that_differs_is_found_and_named() {
    let (mut dice, (original, _)) = (Dice(2), recorded(&turned()));
    for _ in 0..60 {
        let topic = dice.below(original.topics.len());
        let name = &original.origin.topology.topics[topic].name;
        let rows = &original.topics[topic];
        let (index, field) = (dice.below(rows.len()), dice.below(rows.width()));
        let (part, bit) = (dice.below(7), 1 << dice.below(64));
        let its = rows.heads()[index];
        let changed = kept(rows, |head, row| {
            match part {
                _ if *head != its => {}
                0 => head.seq ^= bit,
                1 => head.dropped ^= bit,
                2 => head.stamp = Time::from_nanos(head.stamp.as_nanos() ^ bit),
                3 => {
                    let origin = head.origin.map_or(0, Time::as_nanos);
                    head.origin = Some(Time::from_nanos(origin ^ bit));
                }
                _ => row[field] = f64::from_bits(row[field].to_bits() ^ bit),
            }
            true
        });
        let error = found(&original, |altered| altered.topics[topic] = changed);
        assert_has(&error, &format!("{name} message"));
    }
}

#[test]
fn a_tick_that_differs_is_found_and_named() {
    type Lie = fn(&mut TickRecord);
    let lies: [(&str, Lie); 3] = [
        ("run time", |tick| tick.at = tick.at + Time::RESOLUTION),
        ("lateness", |tick| tick.lateness = Some(Time::RESOLUTION)),
        ("overruns", |tick| tick.overruns += 1),
    ];
    let (mut dice, (original, _)) = (Dice(3), recorded(&turned()));
    for _ in 0..20 {
        let node = dice.below(original.ticks.len());
        let name = &original.origin.topology.nodes[node].name;
        let index = dice.below(original.ticks[node].len());
        let (part, lie) = dice.pick(&lies);
        let error = found(&original, |altered| lie(&mut altered.ticks[node][index]));
        assert_has(&error, &format!("{name} tick {index}, {part}"));
    }
}

#[test]
fn how_long_ticks_took_is_not_compared() {
    let (mut altered, _) = recorded(&turned());
    for tick in altered.ticks.iter_mut().flatten() {
        tick.took = Some(Time::RESOLUTION);
    }
    verify(&altered).expect("identical");
}

#[test]
fn a_tick_or_a_message_more_or_less_is_found() {
    let (original, _) = recorded(&turned());
    for node in 0..original.ticks.len() {
        let last = original.ticks[node].last().cloned();
        let short = found(&original, |short| {
            short.ticks[node].pop();
        });
        assert_has(&short, "recorded none, computed a tick");
        let long = found(&original, |long| long.ticks[node].extend(last));
        assert_has(&long, "recorded a tick, computed none");
    }
    for (topic, rows) in original.topics.iter().enumerate() {
        let last = *rows.heads().last().expect("a message");
        let fewer = kept(rows, |head, _| *head != last);
        let short = found(&original, |short| short.topics[topic] = fewer);
        assert_has(&short, "recorded none, computed a message");
        let row = rows.row(rows.len() - 1).to_vec();
        let long = found(&original, |long| {
            assert!(long.topics[topic].push(last, row))
        });
        assert_has(&long, "recorded a message, computed none");
    }
}

/// `recording` as if it had begun with the last instant of its run.
fn begun_at_the_end(recording: &Recording) -> Recording {
    let mut late = recording.clone();
    let last = late.outcome.as_ref().expect("an end").at;
    for rows in &mut late.topics {
        *rows = kept(rows, |head, _| head.stamp >= last);
    }
    for ticks in &mut late.ticks {
        ticks.retain(|tick| tick.at >= last);
    }
    late
}

#[test]
fn what_a_recording_begun_later_did_not_see_is_not_missing_in_it() {
    let (fall, _) = recorded(&falling());
    // It falls between two decisions, so there is nothing of the policy in it.
    let identical = verify(&begun_at_the_end(&fall)).expect("identical");
    assert_eq!((identical.messages, identical.ticks), (2, 2));
    let error = found(&fall, |silent| silent.topics[1] = Rows::default());
    assert_has(&error, "/action message 0: recorded none");
}

#[test]
fn whoever_watches_a_verification_can_end_it() {
    let (mut years, _) = recorded(&turned());
    // It goes on for thirty of them.
    let at = Time::from_nanos(1_000_000_000_000_000_000);
    (years.outcome, years.until) = (None, at);
    let what = EventKind::Applied {
        command: Command::Pause,
        was: None,
    };
    years.events.push(Event { at, what });
    let mut advance_to = Time::ZERO;
    let watch = |look: &VerifyStatus| {
        advance_to = look.now;
        ControlFlow::Break(())
    };
    let error = ratelab_recording::verify(&years, &cart_pole(), VerifyWith::default(), watch)
        .expect_err("ended");
    assert!(matches!(error, VerifyError::Stopped), "{error}");
    assert!(Time::ZERO < advance_to && advance_to < at, "{advance_to}");
}

#[test]
fn nothing_is_not_identical_with_nothing() {
    let (original, _) = recorded(&turned());
    for (topic, name) in ["/obs", "/action", "/state"].into_iter().enumerate() {
        let error = found(&original, |half| half.topics[topic] = Rows::default());
        assert_has(&error, &format!("{name} message 0: recorded none"));
    }
    let error = found(&original, |torn| {
        (torn.outcome, torn.until) = (None, Time::ZERO);
        torn.ticks.iter_mut().for_each(Vec::clear);
    });
    assert_has(&error, "nothing in it to verify: this file is good up to");
    let error = found(&original, |renamed| {
        renamed.origin.topology.topics[1].name = "/other".to_owned();
    });
    assert_has(&error, "/other");
}

#[test]
fn a_rate_that_was_a_knob_once_is_turned_again_and_by_no_new_run() {
    let folder = folder();
    let rate = "1 rate actuator 25";
    let taken = CartPole::KNOBS.parse_list(rate).expect("a knob");
    for (place, (setup, knobs)) in [("rate actuator 25", ""), ("", rate)].iter().enumerate() {
        let config = with_knobs(setup, knobs);
        assert!(Experiment::new(cart_pole(), &config).is_err());
        // As it was recorded when the actuator's rate was a knob.
        let old =
            Experiment::again(cart_pole(), &config, &taken, Default::default()).expect("a graph");
        let path = folder.path().join(format!("{place}.rrd"));
        record_run(old, &path).0.expect("no fault");
        verify(&read(&path)).expect("identical");
    }
}

#[test]
fn a_rate_that_was_refused_is_refused_again() {
    let (_folder, path) = file("refused.rrd");
    let mut experiment = experiment(&Config::default());
    let knob: Knob = "rate actuator 25".parse().expect("a knob");
    experiment.schedule(vec![TimedCommand {
        at: ms(1000),
        command: knob.into(),
    }]);
    record_run(experiment, &path).0.expect("no fault");
    let recording = read(&path);
    let refused = |event: &&Event| matches!(event.what, EventKind::Refused { .. });
    assert_eq!(recording.events.iter().filter(refused).count(), 1);
    verify(&recording).expect("identical");
}

#[test]
fn a_tick_that_was_long_when_it_was_recorded_is_not_stuck() {
    let node = BusyNode {
        name: "policy".into(),
        at: Time::ZERO,
        took: Duration::from_secs(12),
    };
    let after = |seconds| {
        let busy = Duration::from_secs(seconds);
        VerifyStatus::new(Time::ZERO, Some(node.clone()), busy).stuck
    };
    assert_eq!(after(13), None);
    assert_eq!(after(23), Some(node.clone()));
}
