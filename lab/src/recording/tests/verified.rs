//! What was recorded comes again, and what differs is found.

use std::ops::ControlFlow;

use ratelab::{Command, Event, EventKind, Head, Knob, Time, TimedCommand};
use ratelab_account::Rows;
use ratelab_cart_pole::CartPole;
use ratelab_study::experiment::{Config, Experiment};

use super::{
    Dice, cart_pole, cases, experiment, folder, read, record, record_run, recording, verify,
    with_knobs,
};
use crate::recording::{Recording, VerifyError, schema::RunStatus, verify::VerifyStatus};

/// `rows` with message `index` as `change` makes it.
fn changed(rows: &Rows, index: usize, change: impl FnOnce(&mut Head, &mut [f64])) -> Rows {
    let (mut changed, mut change) = (Rows::new(rows.width()), Some(change));
    for (number, (head, row)) in rows.iter().enumerate() {
        let (mut head, mut row) = (*head, row.to_vec());
        if number == index {
            change.take().expect("once")(&mut head, &mut row);
        }
        assert!(changed.push(head, row));
    }
    changed
}

/// The messages of `rows` that `keep` keeps.
fn kept(rows: &Rows, keep: impl Fn(&Head) -> bool) -> Rows {
    let mut kept = Rows::new(rows.width());
    for (head, row) in rows.iter().filter(|(head, _)| keep(head)) {
        assert!(kept.push(*head, row.iter().copied()));
    }
    kept
}

#[test]
fn any_virtual_run_comes_again_to_the_bit() {
    let (folder, mut dice) = (folder(), Dice(1));
    for number in 0..cases(10) {
        let path = folder.path().join(format!("{number}.rrd"));
        let config = dice.config();
        let (outcome, _) = record(&config, &path);
        let recording = read(&path);
        assert!(recording.is_whole());
        let identical = verify(&recording).unwrap_or_else(|error| panic!("{config:?}: {error}"));
        let summary = outcome.expect("no fault");
        let published: u64 = summary.topics.iter().map(|topic| topic.published).sum();
        assert_eq!(identical.messages as u64, published);
        let ticks: u64 = summary.nodes.iter().map(|node| node.ticks).sum();
        assert_eq!(identical.ticks as u64, ticks);
    }
}

#[test]
fn a_single_bit_that_differs_is_found_and_named() {
    let (folder, mut dice) = (folder(), Dice(2));
    let original = recording(&folder);
    for _ in 0..60 {
        let mut altered = original.clone();
        let topic = dice.below(altered.topics.len());
        let name = original.origin.topology.topics[topic].name.clone();
        let rows = &mut altered.topics[topic];
        let (index, field) = (dice.below(rows.len()), dice.below(rows.width()));
        let (part, bit) = (dice.below(7), 1 << dice.below(64));
        *rows = changed(rows, index, |head, row| match part {
            0 => head.seq ^= bit,
            1 => head.dropped ^= bit,
            2 => head.stamp = Time::from_nanos(head.stamp.as_nanos() ^ bit),
            3 => {
                let origin = head.origin.map_or(0, Time::as_nanos);
                head.origin = Some(Time::from_nanos(origin ^ bit));
            }
            _ => row[field] = f64::from_bits(row[field].to_bits() ^ bit),
        });
        let error = verify(&altered).expect_err("a difference").to_string();
        assert!(error.contains(&format!("{name} message")), "{error}");
    }
}

#[test]
fn a_tick_that_differs_is_found_and_named() {
    let (folder, mut dice) = (folder(), Dice(3));
    let original = recording(&folder);
    for _ in 0..20 {
        let mut altered = original.clone();
        let node = dice.below(altered.ticks.len());
        let name = original.origin.topology.nodes[node].name.clone();
        let index = dice.below(altered.ticks[node].len());
        let tick = &mut altered.ticks[node][index];
        let part = match dice.below(3) {
            0 => {
                tick.at = tick.at + Time::TICK;
                "run time"
            }
            1 => {
                tick.lateness = Some(Time::TICK);
                "lateness"
            }
            _ => {
                tick.overruns += 1;
                "overruns"
            }
        };
        let error = verify(&altered).expect_err("a difference").to_string();
        assert!(
            error.contains(&format!("{name} tick {index}, {part}")),
            "{error}"
        );
    }
}

#[test]
fn how_long_ticks_took_is_not_compared() {
    let folder = folder();
    let mut altered = recording(&folder);
    for tick in altered.ticks.iter_mut().flatten() {
        tick.took = Some(Time::TICK);
    }
    verify(&altered).expect("identical");
}

#[test]
fn a_tick_more_or_less_is_found() {
    let folder = folder();
    let original = recording(&folder);
    for node in 0..original.ticks.len() {
        let mut short = original.clone();
        short.ticks[node].pop();
        let error = verify(&short).expect_err("one is missing").to_string();
        assert!(error.contains("recorded none, computed a tick"), "{error}");
        let mut long = original.clone();
        let last = long.ticks[node].last().copied();
        long.ticks[node].extend(last);
        let error = verify(&long).expect_err("one is too many").to_string();
        assert!(error.contains("recorded a tick, computed none"), "{error}");
    }
}

#[test]
fn a_message_more_or_less_is_found() {
    let folder = folder();
    let original = recording(&folder);
    for topic in 0..original.topics.len() {
        let mut short = original.clone();
        let rows = &mut short.topics[topic];
        let last = *rows.heads().last().expect("a message");
        *rows = kept(rows, |head| *head != last);
        let error = verify(&short).expect_err("one is missing").to_string();
        assert!(
            error.contains("recorded none, computed a message"),
            "{error}"
        );
        let mut long = original.clone();
        let rows = &mut long.topics[topic];
        let row = rows.row(rows.len() - 1).to_vec();
        assert!(rows.push(last, row));
        let error = verify(&long).expect_err("one is too many").to_string();
        assert!(
            error.contains("recorded a message, computed none"),
            "{error}"
        );
    }
}

/// `recording` as if it had begun with the last instant of its run.
fn begun_at_the_end(recording: &Recording) -> Recording {
    let mut late = recording.clone();
    let last = late.outcome.as_ref().expect("an end").at;
    for rows in &mut late.topics {
        *rows = kept(rows, |head| head.stamp >= last);
    }
    for ticks in &mut late.ticks {
        ticks.retain(|tick| tick.at >= last);
    }
    late
}

#[test]
fn what_a_recording_begun_later_did_not_see_is_not_missing_in_it() {
    let folder = folder();
    let path = folder.path().join("fall.rrd");
    let config = CartPole::config("control-hz 5").expect("a knob");
    record(&config, &path).0.expect("no fault");
    // It falls between two decisions, so there is nothing of the policy in it.
    let late = begun_at_the_end(&read(&path));
    let identical = verify(&late).expect("identical");
    assert_eq!((identical.messages, identical.ticks), (2, 2));
    let mut silent = read(&path);
    silent.topics[1] = Rows::default();
    let error = verify(&silent)
        .expect_err("answers are missing")
        .to_string();
    assert!(
        error.contains("/action message 0: recorded none"),
        "{error}"
    );
}

#[test]
fn whoever_watches_a_verification_can_end_it() {
    let folder = folder();
    let mut years = recording(&folder);
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
    let error = crate::recording::verify(&years, &cart_pole(), false, watch).expect_err("ended");
    assert!(matches!(error, VerifyError::Stopped), "{error}");
    assert!(Time::ZERO < advance_to && advance_to < at, "{advance_to}");
}

#[test]
fn another_end_is_found() {
    let folder = folder();
    let mut altered = recording(&folder);
    let outcome = altered.outcome.as_mut().expect("an end");
    let RunStatus::Ended(end) = &mut outcome.end else {
        panic!("it ended otherwise: {outcome:?}");
    };
    end.steps += 1;
    let error = verify(&altered).expect_err("another end").to_string();
    assert!(error.contains("the end of the run"), "{error}");
}

#[test]
fn nothing_is_not_identical_with_nothing() {
    let folder = folder();
    let original = recording(&folder);
    let mut empty = original.clone();
    empty.topics[2] = Rows::default();
    let error = verify(&empty).expect_err("a topic is missing").to_string();
    assert!(error.contains("/state message 0: recorded none"), "{error}");
    let mut torn = original.clone();
    (torn.outcome, torn.until) = (None, Time::ZERO);
    torn.ticks.iter_mut().for_each(Vec::clear);
    let error = verify(&torn).expect_err("nothing to compare").to_string();
    assert!(
        error.contains("nothing in it to verify: this file is good up to"),
        "{error}"
    );
    let mut half = original.clone();
    half.topics[0] = Rows::default();
    let error = verify(&half).expect_err("a topic is missing").to_string();
    assert!(error.contains("/obs message 0: recorded none"), "{error}");
    let mut renamed = original;
    renamed.origin.topology.topics[1].name = "/other".to_owned();
    assert!(verify(&renamed).is_err());
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
        let old = Experiment::again(cart_pole(), &config, &taken).expect("a graph");
        let path = folder.path().join(format!("{place}.rrd"));
        record_run(old, &path).0.expect("no fault");
        verify(&read(&path)).expect("identical");
    }
}

#[test]
fn a_rate_that_was_refused_is_refused_again() {
    let folder = folder();
    let path = folder.path().join("refused.rrd");
    let mut experiment = experiment(&Config::default());
    let knob: Knob = "rate actuator 25".parse().expect("a knob");
    let at = Time::from_nanos(1_000_000_000);
    experiment.schedule(vec![TimedCommand {
        at,
        command: knob.into(),
    }]);
    record_run(experiment, &path).0.expect("no fault");
    let recording = read(&path);
    let refused = |event: &&Event| matches!(event.what, EventKind::Refused { .. });
    assert_eq!(recording.events.iter().filter(refused).count(), 1);
    verify(&recording).expect("identical");
}
