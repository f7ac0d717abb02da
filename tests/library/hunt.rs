//! A hunt finds faults that are enough, and of which no part can be left out: held to
//! every smaller list, each run here again.

use std::{
    collections::BTreeSet,
    num::NonZeroUsize,
    sync::atomic::{AtomicUsize, Ordering},
};

use ratelab_experiment::hunt::{Budget, Found, Hunt, HuntError, Hunted, LONGEST_PART, Proof};

use crate::support::*;

fn losses(lose: usize) -> Budget {
    Budget {
        topic: "/action".to_owned(),
        lose,
        ..Budget::default()
    }
}

fn delay(delay: Duration) -> Budget {
    Budget { delay, ..losses(0) }
}

fn hang(node: &str, longest: Duration) -> Budget {
    Budget {
        hang: Some((node.to_owned(), longest)),
        ..losses(0)
    }
}

/// A hunt in six seconds of the cart-pole.
fn hunt(setup: &str) -> Hunt {
    Hunt::new(cart_pole(), config(&format!("until 6; {setup}")))
}

fn found(hunt: &Hunt, budget: &Budget) -> Found {
    match hunt.run(budget, &|| false).expect("a hunt") {
        Hunted::Lost(found) => found,
        held @ Hunted::Held { .. } => panic!("{held:?}"),
    }
}

fn is_lost(hunt: &Hunt, faults: &[TimedKnob]) -> bool {
    run(&hunt.with(faults)).verdict.is_lost()
}

/// How large a fault is, if it may be smaller.
fn size(fault: &mut TimedKnob) -> Option<&mut Duration> {
    match &mut fault.knob {
        Knob::Postpone { delay, .. } => Some(delay),
        Knob::Hang { cost, .. } => Some(cost),
        _ => None,
    }
}

/// A fault as it is, smaller and smaller, and at last none.
fn smaller(fault: &TimedKnob) -> Vec<Option<TimedKnob>> {
    let whole = size(&mut fault.clone()).map_or(LONGEST_PART, |size| *size);
    let count = whole.as_millis() / LONGEST_PART.as_millis();
    let sizes = (1..=count as u32).rev().map(|count| {
        let mut fault = fault.clone();
        size(&mut fault)
            .into_iter()
            .for_each(|size| *size = LONGEST_PART * count);
        Some(fault)
    });
    sizes.chain([None]).collect()
}

/// Every list that is a part of `faults`, the whole first and no faults last.
fn parts(faults: &[TimedKnob]) -> Vec<Vec<TimedKnob>> {
    faults.iter().fold(vec![Vec::new()], |lists, fault| {
        let longer = lists.iter().flat_map(|list| {
            smaller(fault).into_iter().map(|fault| {
                let mut list = list.clone();
                list.extend(fault);
                list
            })
        });
        longer.collect()
    })
}

#[test]
fn every_list_that_is_part_of_the_result_leaves_the_run_as_it_was() {
    let cases = [
        ("control-hz 15", losses(8), 6),
        ("control-hz 10", delay(ms(500)), 6),
        ("control-hz 12", hang("policy", ms(600)), 15),
        ("control-hz 10; policy lqr", losses(8), 14),
    ];
    for (setup, budget, count) in cases {
        let hunt = hunt(setup);
        let found = found(&hunt, &budget);
        assert_eq!(
            found.proof,
            Proof::EverySmaller(count),
            "{setup}: {found:?}"
        );
        let lists = parts(&found.knobs);
        assert_eq!(lists.len(), count + 2);
        for (place, list) in lists.iter().enumerate() {
            assert_eq!(is_lost(&hunt, list), place == 0, "{setup}: {list:?}");
        }
    }
}

#[test]
fn the_result_is_the_same_on_any_number_of_threads() {
    for budget in [losses(8), delay(ms(300)), hang("policy", ms(400))] {
        let on = |threads| {
            let mut hunt = hunt("control-hz 12");
            hunt.threads = NonZeroUsize::new(threads).expect("some");
            hunt.run(&budget, &|| false).expect("a hunt")
        };
        let one = on(1);
        assert_eq!(one, on(2));
        assert_eq!(one, on(5));
    }
}

#[test]
fn what_was_found_is_kept_when_a_hunt_is_stopped() {
    let hunt = hunt("control-hz 15");
    for most in [0, 60, 100] {
        let runs = AtomicUsize::new(0);
        let stop = || runs.fetch_add(1, Ordering::Relaxed) >= most;
        match hunt.run(&losses(8), &stop).expect("a hunt") {
            Hunted::Lost(found) => {
                assert_eq!(found.proof, Proof::Stopped);
                assert!(most > 0 && is_lost(&hunt, &found.knobs), "{found:?}");
            }
            Hunted::Held { stopped, .. } => assert!(stopped && most == 0),
        }
    }
}

#[test]
fn a_hunt_that_is_stopped_counts_the_lists_that_it_has_tried() {
    let mut hunt = hunt("");
    hunt.threads = NonZeroUsize::MIN;
    for most in [0, 1, 60] {
        let asked = AtomicUsize::new(0);
        let stop = || asked.fetch_add(1, Ordering::Relaxed) >= most;
        let hunted = hunt.run(&losses(1), &stop).expect("a hunt");
        let (runs, stopped) = (most, true);
        assert_eq!(hunted, Hunted::Held { runs, stopped });
    }
}

#[test]
fn delays_that_differ_are_found_within_the_budget() {
    let hunt = Hunt::new(cart_pole(), own(2, "rate policy 20; until 3"));
    let found = found(&hunt, &delay(ms(400)));
    let mut delays = found.knobs.clone();
    let delays = delays
        .iter_mut()
        .map(|fault| *size(fault).expect("a delay"));
    assert!(delays.sum::<Duration>() <= ms(400), "{found:?}");
    assert!(is_lost(&hunt, &found.knobs), "{found:?}");
}

#[test]
fn nothing_is_found_where_the_budget_is_too_small() {
    let hunted = hunt("").run(&losses(1), &|| false).expect("a hunt");
    assert!(
        matches!(
            hunted,
            Hunted::Held {
                runs: 1_001..,
                stopped: false
            }
        ),
        "{hunted:?}"
    );
}

#[test]
fn a_hunt_without_an_end_or_of_too_much_is_refused() {
    let endless = Hunt::new(cart_pole(), config("until ever"));
    let endless = endless.run(&losses(1), &|| false);
    assert!(matches!(endless, Err(HuntError::Endless)));
    let much = hunt("").run(&losses(usize::MAX), &|| false);
    assert!(matches!(much, Err(HuntError::TooMuch)));
}

#[test]
fn an_interrupt_ends_a_hunt_within_a_run() {
    let hunt = Hunt::new(cart_pole(), config("control-hz 15; until 31536000"));
    let hunted = std::thread::scope(|scope| {
        scope.spawn(|| hunt.interrupt.ask());
        hunt.run(&losses(8), &|| false).expect("a hunt")
    });
    let (runs, stopped) = (0, true);
    assert_eq!(hunted, Hunted::Held { runs, stopped });
}

/// Ends the run where the lost ones of its `count` messages are `enough`: then it is lost.
struct Fragile {
    count: u64,
    enough: fn(&[u64]) -> bool,
}

impl System for Fragile {
    fn name(&self) -> &str {
        "fragile"
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let Self { count, enough } = *self;
        let (topic, over) = (Topic::new("/number", Depth::ONE), at_ms(10 * count));
        let graph = builder.graph();
        talker(graph, "talker", 100.0, 0, &topic, move |now| {
            (now < over).then_some(())
        });
        graph.node("reader", 100.0, 1, |wiring| {
            let (mut messages, mut read) = (wiring.subscription(&topic), BTreeSet::new());
            move |tick: &mut Tick| {
                let now = tick.now();
                read.extend(tick.read(&mut messages).map(|message| message.seq));
                if now < over {
                    return Flow::Continue;
                }
                let lost: Vec<u64> = (0..count).filter(|seq| !read.contains(seq)).collect();
                if enough(&lost) {
                    Flow::End
                } else {
                    Flow::Continue
                }
            }
        })?;
        Ok(())
    }

    fn judge(&self) -> &dyn Judge {
        self
    }
}

impl Judge for Fragile {
    fn verdict(&self, exit: &ClockExit, at: Time, _: Option<&[f64]>) -> Verdict {
        match exit {
            ClockExit::Ended { .. } => Verdict::new(BROKEN, at),
            _ => Verdict::from_exit(exit, at),
        }
    }

    fn verdicts(&self) -> Vec<VerdictKind> {
        vec![VerdictKind::COMPLETED, VerdictKind::STOPPED, BROKEN]
    }
}

/// The verdict of a [`Fragile`] system that lost too much.
const BROKEN: VerdictKind = VerdictKind::lost("broken", "BROKEN at {at}");

/// The numbers of the messages whose loss breaks a [`Fragile`] system, and the evidence.
fn shrunk(count: u64, enough: fn(&[u64]) -> bool) -> (Vec<u64>, Proof) {
    let hunt = Hunt::new(Arc::new(Fragile { count, enough }), config("until 1.1"));
    let budget = Budget {
        topic: "/number".to_owned(),
        lose: count as usize,
        ..Budget::default()
    };
    let found = found(&hunt, &budget);
    let lost = found.knobs.iter().map(|fault| match fault.knob {
        Knob::Lose { seq, .. } => seq,
        _ => panic!("{fault:?}"),
    });
    (lost.collect(), found.proof)
}

#[test]
fn what_is_left_is_what_it_takes() {
    let (lost, proof) = shrunk(100, |lost| [3, 40, 41].iter().all(|n| lost.contains(n)));
    assert_eq!(
        (&lost[..], proof),
        (&[3, 40, 41][..], Proof::EverySmaller(6))
    );
    let (lost, proof) = shrunk(30, |lost| lost.len() >= 20);
    assert_eq!((lost.len(), proof), (20, Proof::EachPart(20)));
}

#[test]
fn a_smaller_list_is_found_where_more_would_not_be_enough() {
    // Neither is a piece that is left out or in, and the pair is the smaller one.
    let enough = |lost: &[u64]| lost.len() >= 6 || [&[2, 3, 5][..], &[1, 4]].contains(&lost);
    assert_eq!(shrunk(8, enough), (vec![1, 4], Proof::EverySmaller(2)));
}
