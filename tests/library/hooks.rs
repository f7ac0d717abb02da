//! What a graph can do is given to it through traits: a link and a schedule that no crate of this
//! workspace has.

use ratelab::{
    Channel, GO_ON, Graph, Job, JobKind, Kit, Knob, Phase, Scheduler, SchedulerEvent, TaskSpec,
    TaskState, Time, Timetable,
};
use ratelab_effects::{Callback, Executors};

/// Nodes tick at 0, 1, 3, 7, 15 ... ms; every second message of a topic is lost.
struct Strange;

struct Doubling {
    spec: TaskSpec,
    due: Time,
}

struct EverySecond;

impl Kit for Strange {
    fn scheduler(&self, spec: TaskSpec) -> Box<dyn Scheduler> {
        let due = Time::ZERO;
        Box::new(Doubling { spec, due })
    }

    fn channel(&self, _: &str, _: u64) -> Option<Box<dyn Channel>> {
        Some(Box::new(EverySecond))
    }
}

impl Channel for EverySecond {
    fn deliver_at(&mut self, seq: u64, now: Time) -> Option<Time> {
        seq.is_multiple_of(2).then_some(now)
    }

    fn is_perfect(&self) -> bool {
        false
    }

    fn turn(&mut self, _: &Knob) -> Result<String, String> {
        Ok("every message".to_owned())
    }
}

impl Scheduler for Doubling {
    fn on(&mut self, event: SchedulerEvent, plan: &mut Timetable<'_>) -> Option<Job> {
        match event {
            SchedulerEvent::Alarm { .. } => {
                let after = self.due.as_nanos() * 2 + 1_000_000;
                self.due = Time::from_nanos(after);
                let kind = JobKind::Tick { is_instant: false };
                return Some(Job::new(0, kind));
            }
            SchedulerEvent::Opened { .. } | SchedulerEvent::Done { .. } => {
                plan.alarm(self.due, Phase::Start, 0);
            }
            _ => {}
        }
        None
    }

    fn state(&self, _: usize, _: Time) -> TaskState {
        TaskState {
            hz: self.spec.rate.hz(),
            due: self.due,
            last_due: None,
            skips: false,
            crashed: false,
            remaining: None,
            busy: false,
        }
    }

    fn check(&self, _: usize, knob: &Knob) -> Result<(), String> {
        Err(format!("{knob}: this schedule has no knobs"))
    }

    fn turn(&mut self, _: usize, knob: &Knob, _: &mut Timetable<'_>) -> Result<String, String> {
        Err(format!("{knob}: this schedule has no knobs"))
    }
}

#[test]
fn a_graph_ticks_and_delivers_by_the_kit_that_it_was_given() {
    let mut graph = Graph::with(Strange);
    let beat = graph.topic::<u64>("/beat");
    let added = graph.node("source", 50.0, 0, |wiring| {
        let beat = wiring.publisher(&beat);
        move |now: Time| {
            beat.publish(now.as_nanos() / 1_000_000, now, None);
            GO_ON
        }
    });
    added.expect("a node");
    let (sender, read) = crossbeam_channel::unbounded();
    let added = graph.node("reader", 50.0, 1, |wiring| {
        let mut beat = wiring.subscription(&beat);
        move |now| {
            sender.send(beat.latest(now).map(|message| message.data))?;
            GO_ON
        }
    });
    added.expect("a node");
    let link = "link /beat whatever".parse().expect("a knob");
    assert_eq!(graph.turn(&link).expect("a link"), "every message");
    let rate = "rate source 5".parse().expect("a knob");
    assert_eq!(
        graph.turn(&rate).expect_err("no rate"),
        "rate source 5: this schedule has no knobs"
    );
    let executor = graph.executor("single".parse().expect("one"), [Callback::of("source")]);
    let error = executor.expect_err("a schedule of its own").to_string();
    assert!(error.contains("does not know the schedule"), "{error}");
    graph.run_virtual(0.02).expect("a run");
    let read: Vec<u64> = read.try_iter().flatten().collect();
    assert_eq!(read, [0, 0, 3, 3, 15]);
}

#[test]
fn a_plain_graph_has_rates_and_depths_and_says_where_the_rest_is() {
    let mut graph = Graph::new();
    let topic = graph.topic::<u64>("/topic");
    let added = graph.node("reader", 50.0, 0, |wiring| {
        let _ = wiring.subscription(&topic);
        |_: Time| GO_ON
    });
    added.expect("a node");
    for (knob, answer) in [
        ("rate reader 5", Ok("50 Hz")),
        ("depth /topic 3", Ok("1")),
        ("crash reader", Ok("running")),
        ("takes reader 5", Err("this graph has no takes")),
        ("clock reader 5 0", Err("this graph has no clock")),
        ("link /topic delay:5", Err("this graph has no link")),
        ("lose /topic 3", Err("this graph has no lose")),
    ] {
        let turned = graph.turn(&knob.parse().expect(knob));
        match (turned, answer) {
            (Ok(before), Ok(expected)) => assert_eq!(before, expected, "{knob}"),
            (Err(why), Err(expected)) => assert!(why.starts_with(expected), "{knob}: {why}"),
            (turned, _) => panic!("{knob}: {turned:?}"),
        }
    }
    let error = graph.node("late", -1.0, 0, |_| |_: Time| GO_ON);
    assert!(error.expect_err("no rate").to_string().contains("-1"));
    assert!(graph.run_virtual(f64::NAN).is_err());
}
