//! What linear theory says of a run by its setup: the loops that it reads from knobs
//! are those that are written down by hand, and what it does not know it says.

use ratelab_cart_pole::stability::{
    Cadence, Expected, Loop, Loss, Lost, PlannedOutlook, Timing, WorldModel, expected,
};

use crate::{support::*, table::rows};

/// What is expected of a setup.
fn said(setup: &str) -> Result<Expected, String> {
    let said = expected(&config(setup).setup, WorldKind::OWN);
    said.map_err(|error| error.to_string())
}

fn of(setup: &str) -> Expected {
    said(setup).expect(setup)
}

/// The usual graph, and what `change` makes of it.
fn graph(change: impl FnOnce(&mut Timing)) -> Loop {
    let mut timing = Timing {
        actuator: Some(Cadence::new(hz(50.0))),
        ..Timing::direct(hz(50.0))
    };
    change(&mut timing);
    Loop::cart_pole(Scripted::GAINS, WorldModel::Own(ms(1)), timing).expect("plant")
}

#[test]
fn knobs_are_read_as_the_loop_that_they_make() {
    // The rates of sensor, policy and actuator (Hz); what the policy takes, the delays of readings
    // and of actions, and the offset of the actuator (ms).
    for [setup, rates, times] in rows(
        "control-hz 50                             | 50 50 50  | 0 0 0 0
         control-hz 10; sensor-hz 25               | 25 10 50  | 0 0 0 0
         link /action delay:55                     | 50 50 50  | 0 0 55 0
         link /obs delay:15; link /action delay:30 | 50 50 50  | 0 15 30 0
         takes policy 35; offset actuator 7        | 50 50 50  | 35 0 0 7
         rate actuator 200; depth /obs 9           | 50 50 200 | 0 0 0 0",
    ) {
        let rates: Vec<Hz> = rates.split(' ').map(|hz| hz.parse().expect(hz)).collect();
        let times = times.split(' ').map(|time| ms(time.parse().expect(time)));
        let times: Vec<Duration> = times.collect();
        let made = graph(|timing| {
            (timing.sensor.hz, timing.policy.hz) = (rates[0], rates[1]);
            (timing.policy_takes, timing.obs_delay, timing.action_delay) =
                (times[0], times[1], times[2]);
            let (hz, offset) = (rates[2], times[3]);
            timing.actuator = Some(Cadence { hz, offset });
        });
        let growth = made.stability().expect("short").growth();
        assert_eq!(of(&setup), Expected::Growth(growth), "{setup}");
    }
}

#[test]
fn losses_grow_in_the_mean_square_held_or_with_no_force() {
    let control = graph(|_| {});
    for (knob, lost) in [("hold", Lost::Hold), ("zero:10", Lost::Zero)] {
        for probability in [0.5, 0.6, 0.7] {
            let loss = Loss { probability, lost };
            let growth = control.mean_square_growth(loss).expect("short") / 2.0;
            let setup = format!("link /action loss:{probability}; send actuator {knob}");
            assert_eq!(of(&setup), Expected::MeanSquare(growth), "{setup}");
        }
    }
}

#[test]
fn a_range_of_delays_is_sure_within_the_jitter_margin_and_no_further() {
    let margin = graph(|_| {})
        .jitter_margin()
        .expect("short")
        .expect("stable");
    // What a fast actuator and a step of the world add.
    let most = (margin.jitter - ms(2)).as_millis();
    let range = |most| of(&format!("link /action delay:0..{most}; rate actuator 1000"));
    assert_eq!(range(most), Expected::Any(true));
    assert_eq!(range(most + 1), Expected::Any(false));
    // A decision that takes longer than a period skips one.
    for (most, sure) in [(10, true), (25, false)] {
        let setup = format!("takes policy 0..{most}; rate actuator 1000");
        assert_eq!(of(&setup), Expected::Any(sure));
    }
}

#[test]
fn what_it_does_not_know_it_says() {
    let unknown = "link /obs loss:0.1|link /action burst:0.1,3|link /action loss:0.1,delay:0..10|\
        link /action delay:lognormal:1,2|read /obs oldest|wakes policy 5|takes sensor 5|\
        clock policy 5 0|send actuator zero:50|policy zero|policy policies/patient.safetensors";
    for setup in unknown.split('|') {
        assert!(!said(setup).expect_err(setup).is_empty(), "{setup}");
    }
}

/// What is expected of a setup with chunks, in the course's world, which the model of a plan knows
/// to the bit.
fn outlook(setup: &str) -> PlannedOutlook {
    match expected(&config(setup).setup, WorldKind::Course) {
        Ok(Expected::Planned(outlook)) => outlook,
        other => panic!("{setup}: {other:?}"),
    }
}

#[test]
fn a_loop_with_chunks_grows_as_the_loop_without_that_it_comes_to() {
    for [chunks, single] in rows(
        "chunk 50; plan hold                                            | control-hz 50
         chunk 50; plan hold; control-hz 5                              | control-hz 5
         chunk 1; control-hz 10                                         | control-hz 10
         chunk 50; plan hold; takes policy 40; control-hz 10            | takes policy 40; control-hz 10
         chunk 50; plan hold; link /chunk delay:60                      | link /action delay:60
         chunk 50; control-hz 5                                         | control-hz 50
         chunk 50; plan committed; takes policy 200; expect-delay 200; control-hz 5 | control-hz 50
         chunk 11; plan committed; link /chunk delay:200; expect-delay last+200     | control-hz 50",
    ) {
        let found = outlook(&chunks).growth;
        let Ok(Expected::Growth(growth)) = expected(&config(&single).setup, WorldKind::Course)
        else {
            panic!("{single}");
        };
        assert!((found - growth).abs() < 1e-6, "{chunks}: {found} and {growth}");
    }
}

#[test]
fn more_force_fewer_stand_and_a_model_that_errs_fells_the_old() {
    let slow = "chunk 50; plan committed; expect-delay 200; takes policy 200; control-hz 5";
    let stands = |change: &str| outlook(&format!("{slow}; {change}")).stands;
    assert!(stands("disturb 0") > 0.999);
    let shares = ["0.5", "1", "2", "4"].map(|force| stands(&format!("disturb {force}")));
    assert!(
        shares.is_sorted_by(|more, fewer| more > fewer),
        "{shares:?}"
    );
    assert!(stands("model length:2") < stands("model length:1.1"));
}

#[test]
fn theory_of_chunks_ends_where_its_player_does_something_else() {
    for [setup, found] in rows(
        "play arrival              | another play of chunks
         merge blend:0.7           | a merge of chunks
         refill 0.5                | a request of chunks
         takes policy 20..90       | a random delay of chunks
         sensor-hz 100             | another sensor of chunks
         link /action delay:20     | link /action delay:20
         set sensor similar 0.1    | set sensor similar 0.1",
    ) {
        let error = said(&format!("chunk 50; {setup}")).expect_err(&setup);
        assert!(error.starts_with(&found), "{setup}: {error}");
    }
}
