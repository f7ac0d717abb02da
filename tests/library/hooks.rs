//! What a graph can do is given to it through traits: a link and a schedule that no crate of this
//! workspace has.

use crate::{support::*, table::rows};

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

    fn set(&mut self, _: &Knob) -> Result<String, String> {
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
            deadline: None,
            busy: false,
        }
    }

    fn check(&self, _: usize, knob: &Knob) -> Result<(), String> {
        Err(format!("{knob}: this schedule has no knobs"))
    }

    fn set(&mut self, _: usize, knob: &Knob, _: &mut Timetable<'_>) -> Result<String, String> {
        Err(format!("{knob}: this schedule has no knobs"))
    }
}

#[test]
fn a_graph_ticks_and_delivers_by_the_kit_that_it_was_given() {
    let mut graph = Graph::with(Strange);
    let beat = graph.topic::<u64>("/beat");
    talker(&mut graph, "source", 50.0, 0, &beat, |now| {
        Some(now.as_nanos() / 1_000_000)
    });
    let read = reader(&mut graph, "reader", 50.0, 1, &beat);
    let mut turn = |text: &str| graph.set(&text.parse().expect(text));
    assert_eq!(turn("link /beat whatever").as_deref(), Ok("every message"));
    let refused = "rate source 5: this schedule has no knobs".to_owned();
    assert_eq!(turn("rate source 5"), Err(refused));
    let executor = graph.executor("single".parse().expect("one"), [Callback::of("source")]);
    let error = executor.expect_err("a schedule of its own").to_string();
    assert!(error.contains("does not know the schedule"), "{error}");
    graph.run_virtual(0.02).expect("a run");
    let read = read.try_iter().map(|(_, message)| message.data);
    assert!(read.eq([0, 0, 3, 3, 15]));
}

#[test]
fn a_plain_graph_has_rates_and_depths_and_says_where_the_rest_is() {
    let mut graph = Graph::new();
    let topic = graph.topic::<u64>("/topic");
    reader(&mut graph, "reader", 50.0, 0, &topic);
    for [text, answer] in rows(
        "rate reader 5        | was 50 Hz
         depth /topic 3       | was 1
         crash reader         | was running
         takes reader 5       | this graph has no takes
         clock reader 5 0     | this graph has no clock
         link /topic delay:5  | this graph has no link
         lose /topic 3        | this graph has no lose",
    ) {
        let turned = graph.set(&text.parse().expect(&text));
        let said = turned.map_or_else(|why| why, |before| format!("was {before}"));
        assert_eq!(said.split(':').next(), Some(&*answer), "{text}");
    }
    let error = graph.node("late", -1.0, 0, |_| |_: &mut Tick| {});
    assert!(error.expect_err("no rate").to_string().contains("-1"));
    assert!(graph.run_virtual(f64::NAN).is_err());
}
