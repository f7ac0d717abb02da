//! Frames for tests of panes: plain figures without a run.

use std::time::Duration;

use ratelab::{ClockKind, Derived, Head, Hz, Speed, Status, Time, TimeSpan};
use ratelab_cart_pole::CartPole;
use ratelab_system::{AgeLimits, Picture, System};

use crate::{
    age::{AgeData, PushData, PushSentence},
    frame::{
        FrameData, Ghost, Health, LatencyData, NodeData, Quantiles, SignalTrace, Standing,
        TopicData, VerdictData,
    },
};

/// The latency of [`balanced`].
pub fn latency() -> LatencyData {
    balanced().latency.expect("a latency")
}

/// Three nodes in a row at 50 Hz, 6.40 s into a good run.
pub fn balanced() -> FrameData {
    let mut frame = in_a_row([50.0; 3], [320, 320, 321], [true, true, false]);
    for node in &mut frame.nodes {
        node.lateness = quantiles(450, 2_100, 3_300);
        node.tick_time = quantiles(7, 31, 120);
    }
    for topic in &mut frame.topics[..2] {
        topic.age = quantiles(10_000, 20_000, 20_900);
        topic.held = Some(Duration::from_millis(12));
    }
    frame
}

/// Sensor, policy and actuator in a row, with their rates (Hz), ticks and lights.
fn in_a_row(hz: [f64; 3], ticks: [u64; 3], lit: [bool; 3]) -> FrameData {
    let [nodes, topics] = [
        ["sensor", "policy", "actuator"],
        ["/obs", "/action", "/state"],
    ];
    let readers = [&[1][..], &[2], &[]];
    let nodes = (0..3).map(|n| node(nodes[n], hz[n], ticks[n], lit[n]));
    let topics = (0..3).map(|n| topic(topics[n], hz[n], ticks[n], &[n], readers[n]));
    frame_data(nodes.collect(), topics.collect())
}

/// A frame of the graph with the policy at 5 Hz: the pole fell.
pub fn broken() -> FrameData {
    let mut frame = in_a_row([50.0, 5.0, 50.0], [43, 5, 43], [true, false, true]);
    frame.now = Time::from_nanos(840_000_000);
    frame.wall_s = 1;
    frame.nodes[1].overruns = 2;
    let [obs, action, _] = &mut frame.topics[..] else {
        unreachable!("three topics")
    };
    (obs.dropped, obs.dropped_lately) = (37, 37);
    obs.age = quantiles(10_000, 20_000, 20_000);
    obs.held = Some(Duration::from_millis(16));
    action.age = quantiles(100_000, 196_000, 200_000);
    action.held = Some(Duration::from_millis(320));
    frame.latency = Some(LatencyData {
        name: "sense→act".to_owned(),
        figures: quantiles(112_000, 212_000, 216_000),
        bins: (0..24).map(|bin| u64::from(bin >= 1) * 2).collect(),
        bin: Duration::from_millis(10),
        newest: Some(0.136),
        period: Duration::from_millis(200),
    });
    frame.age = Some(age(95, 200));
    frame.state = state(-0.31, 0.215, -1.0);
    frame.verdict = VerdictData {
        standing: Standing::Lost,
        word: "pole fell".to_owned(),
        headline: "FELL at 0.84 s".to_owned(),
        why: vec![
            "policy decides 5 times a second; the pole needs about 20".to_owned(),
            "37 of 43 observations on /obs were never read".to_owned(),
        ],
    };
    frame
}

/// Five nodes: two cameras publish to one topic, a tracker publishes to two readers, and
/// one of these also reads from the other.
pub fn fan_out() -> FrameData {
    let mut frame = frame_data(
        vec![
            node("left", 30.0, 192, true),
            node("right", 30.0, 192, false),
            node("tracker", 15.0, 96, true),
            node("planner", 7.5, 48, false),
            node("logger", 1.0, 6, false),
        ],
        vec![
            topic("/image", 60.0, 384, &[0, 1], &[2]),
            topic("/pose", 15.0, 96, &[2], &[3, 4]),
            topic("/plan", 7.5, 48, &[3], &[4]),
        ],
    );
    let [image, pose, plan] = &mut frame.topics[..] else {
        unreachable!("three topics")
    };
    (image.dropped, image.dropped_lately) = (288, 45);
    image.depth = 4;
    // Lost once, at the start: a total without an alarm.
    pose.dropped = 7;
    plan.held = Some(Duration::from_millis(120));
    frame
}

/// `count` nodes in a chain, each a reader of the previous one.
pub fn chain(count: usize) -> FrameData {
    let nodes = (0..count)
        .map(|n| node(&format!("n{n}"), 50.0, 320, n % 3 == 0))
        .collect();
    let topics = (1..count)
        .map(|n| topic(&format!("/t{n}"), 50.0, 320, &[n - 1], &[n]))
        .collect();
    frame_data(nodes, topics)
}

/// The cart-pole with the cart at `cart` (m), the pole at `angle` (rad), and a push.
pub fn state(cart: f64, angle: f64, push: f64) -> Vec<f64> {
    vec![43.0, push, f64::NAN, cart, angle, 0.0, 0.0]
}

/// The picture of the cart-pole in `frame`.
pub fn picture(frame: &FrameData) -> Option<Picture> {
    CartPole::default().robot().picture(&frame.state)
}

/// The angle of [`broken`]: upright, then tipping over ever faster, with two knobs turned
/// on the way.
pub fn trace() -> SignalTrace {
    let points = (0..=42).map(|step| {
        let time = f64::from(step) * 0.02;
        (time, 0.2 * (time * 4.9).exp() * 1.0_f64.min(time + 0.2))
    });
    SignalTrace {
        signal: CartPole::default().signals().remove(0),
        points: points.collect(),
        limits: age(0, 0).limits,
        ages: (0..=4)
            .flat_map(|tooth| {
                [(0.0, 0.0), (0.2, 200.0)].map(|(at, ms)| (0.2 * f64::from(tooth) + at, ms))
            })
            .collect(),
        safe: None,
        marks: vec![
            (0.2, "policy 5 Hz".to_owned()),
            (0.6, "/obs depth 100".to_owned()),
        ],
        ghost: Ghost::default(),
    }
}

/// A mean and a maximum push age (ms), with limits of 60 (small deviations grow) and 74 to 90
/// (the run may be lost).
pub fn age(mean: u64, greatest: u64) -> AgeData {
    let ms = Duration::from_millis;
    AgeData {
        mean: ms(mean),
        greatest: ms(greatest),
        stretch: TimeSpan::new(Time::ZERO, Time::ZERO + ms(1_000)),
        predicted: None,
        limits: AgeLimits {
            grows: Some(ms(60)),
            may_fall: Some(ms(74)),
            falls: Some(ms(90)),
        },
        hidden: false,
    }
}

/// Run time in milliseconds.
pub fn ms(ms: u64) -> Time {
    Time::from_nanos(ms * 1_000_000)
}

/// A message that arrives at once.
pub fn head(seq: u64, at: Time, origin: Option<Time>) -> Head {
    Head {
        at,
        by: None,
        stamp: at,
        seq,
        origin,
        from: Derived::Reads,
        arrives: Some(at),
        dropped: 0,
    }
}

/// The parts of a push of 95 ms.
pub fn push() -> PushData {
    PushData {
        sentence: PushSentence(vec![
            "this push is 95 ms old: 12 waiting for the policy + 20 on /obs + 63 held".to_owned(),
            "this push is 95 ms old: 63 held + 32 more (i)".to_owned(),
        ]),
        reaction: Some(Duration::from_millis(110)),
        mean: [0, 12, 0, 20, 63].map(Duration::from_millis),
    }
}

/// A node without timings.
pub fn node(name: &str, hz: f64, ticks: u64, lit: bool) -> NodeData {
    NodeData {
        name: name.into(),
        caption: None,
        hz: Hz::new(hz).expect("a valid rate"),
        triggered: false,
        ticks,
        overruns: 0,
        lit,
        health: Health::Works,
        place: None,
        lateness: Quantiles::default(),
        tick_time: Quantiles::default(),
    }
}

/// A topic of depth 1 without losses.
pub fn topic(
    name: &str,
    per_second: f64,
    published: u64,
    publishers: &[usize],
    readers: &[usize],
) -> TopicData {
    TopicData {
        name: name.into(),
        depth: 1,
        published,
        per_second,
        average: per_second,
        dropped: 0,
        dropped_lately: 0,
        lost: 0,
        lost_lately: 0,
        overtaken: 0,
        unmatched: 0,
        dots: None,
        publishers: publishers.to_vec(),
        readers: readers.to_vec(),
        age: Quantiles::default(),
        held: None,
    }
}

/// Three figures in microseconds.
pub fn quantiles(p50: u64, p99: u64, max: u64) -> Quantiles {
    Quantiles {
        count: 320,
        p50: Duration::from_micros(p50),
        p99: Duration::from_micros(p99),
        max: Duration::from_micros(max),
    }
}

/// A good run of `nodes` and `topics`.
pub fn frame_data(nodes: Vec<NodeData>, topics: Vec<TopicData>) -> FrameData {
    FrameData {
        now: Time::from_nanos(6_400_000_000),
        wall_s: 6,
        status: Status {
            clock: ClockKind::Real,
            paused: false,
            speed: Speed::REAL_TIME,
        },
        seed: 0,
        world: None,
        settings: vec!["policy scripted".to_owned()],
        wrong_stamps: Vec::new(),
        nodes,
        topics,
        latency: Some(LatencyData {
            name: "sense→act".to_owned(),
            figures: quantiles(20_300, 40_500, 42_900),
            bins: vec![0, 2, 41, 118, 96, 40, 17, 4, 1, 1],
            bin: Duration::from_millis(5),
            newest: Some(0.021),
            period: Duration::from_millis(20),
        }),
        plan: None,
        age: Some(age(25, 43)),
        awaits_limits: false,
        push: None,
        same: None,
        state: state(0.04, -0.012, 0.18),
        verdict: VerdictData {
            standing: Standing::Good,
            word: String::new(),
            headline: "BALANCED so far".to_owned(),
            why: Vec::new(),
        },
        telemetry_lost: 0,
    }
}
