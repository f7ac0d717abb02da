//! The appearance of the graph.

use insta::assert_snapshot;

use super::render;
use crate::{
    frame::{Dot, FrameData, Health},
    knobs::KnobFocus,
    view::testing::*,
};

fn buffer(frame: &FrameData, theme: &Theme, width: u16, height: u16) -> Buffer {
    screen((width, height), theme, |sheet| {
        render(frame, &KnobFocus::default(), sheet);
    })
}

fn rich(frame: &FrameData, width: u16, height: u16) -> String {
    text(&buffer(frame, &RICH, width, height))
}

/// Returns a cycle, two topics between the same nodes, and one that skips a node.
fn circle() -> FrameData {
    let node = |name| sample::node(name, 50.0, 320, true);
    let nodes = ["sensor", "logic", "actuator"].map(node).to_vec();
    let topics = vec![
        sample::topic("/obs", 50.0, 320, &[0], &[1]),
        sample::topic("/debug", 50.0, 320, &[0], &[2]),
        sample::topic("/action", 50.0, 320, &[1], &[2]),
        sample::topic("/note", 50.0, 320, &[1], &[2]),
        sample::topic("/state", 50.0, 320, &[2], &[0]),
    ];
    sample::frame_data(nodes, topics)
}

/// Returns a thousand nodes that all publish to the same topic.
fn crowd() -> FrameData {
    let node = |_| sample::node("node", 50.0, 320, true);
    let all: Vec<usize> = (0..1_000).collect();
    let topics = vec![sample::topic("/all", 50.0, 320, &all, &[3])];
    sample::frame_data((0..1_000).map(node).collect(), topics)
}

#[test]
fn roomy() {
    assert_snapshot!(rich(&sample::fan_out(), 120, 11), @"
    ┌1 graph───────────────────────────────────────────────────────────────────────────────────────────────────────────────┐
    │┌ left ───────┐ /image  60.0/s                                                                                        │
    ││● 30 Hz      │──────✖─────✖────┐                  /pose                             /plan                            │
    ││  0 overruns │   288 dropped   ✖  ┌ tracker ────┐  15.0/s           ┌ planner ────┐   7.5/s           ┌ logger ─────┐│
    │└─────────────┘   depth 4       ├─►│● 15 Hz      │──────•─────•───┬─►│○ 7.5 Hz     │──────•─────•─────►│○ 1 Hz       ││
    │┌ right ──────┐                 ✖  │  0 overruns │   7 dropped    │  │  0 overruns │   0 dropped    ┌•►│  0 overruns ││
    ││○ 30 Hz      │──────✖─────✖────┘  └─────────────┘   depth 1      •  └─────────────┘   depth 1      │  └─────────────┘│
    ││  0 overruns │                                                   │                     120 ms ago  │                 │
    │└─────────────┘                                                   │                                 │                 │
    │                                                                  └──•─────•─────•─────•─────•─────•┘                 │
    └──────────────────────────────────────────────────────────────────────────────────────────────────────────────────────┘
    ");
}

#[test]
fn compact() {
    assert_snapshot!(rich(&sample::broken(), 80, 5), @"
    ┌1 graph───────────────────────────────────────────────────────────────────────┐
    │┌ sensor ─────┐ /obs  50.0/s    ┌ policy ─────┐ /action        ┌ actuator ───┐│
    ││● 50 Hz      │─•─────✖─────✖──►│○ 5 Hz 2 over│─────•─────•───►│● 50 Hz      ││
    │└─────────────┘   37 dropped    └─────────────┘   0 dropped    └─────────────┘│
    └──────────────────────────────────────────────────────────────────────────────┘
    ");
    assert_snapshot!(rich(&sample::fan_out(), 80, 8), @"
    ┌1 graph───────────────────────────────────────────────────────────────────────┐
    │[● left      ]─────┬✖►[● tracker   ]────┬─►[○ planner   ]──────►[○ logger    ]│
    │[○ right     ]─────┘                    │                    │                │
    │                                        └─────•─────•─────•──┘                │
    │/image  60.0/s depth 4     288 drops    /pose   15.0/s depth 1     7 dropped  │
    │/plan    7.5/s depth 1     0 dropped                                          │
    │                                                                              │
    └──────────────────────────────────────────────────────────────────────────────┘
    ");
}

#[test]
fn captions_are_in_the_boxes_whole_or_as_their_verbs() {
    let mut frame = sample::balanced();
    let captions = ["reads the plant", "decides", "pushes"];
    for (node, caption) in frame.nodes.iter_mut().zip(captions) {
        node.caption = Some(caption);
    }
    assert_snapshot!(rich(&frame, 120, 9));
    assert_snapshot!(rich(&frame, 80, 7));
    let low = rich(&frame, 80, 6);
    shows(&low, &["0 overruns"]);
    assert!(!low.contains("decides"), "{low}");
}

#[test]
fn small() {
    assert_snapshot!(rich(&sample::broken(), 38, 7), @"
    ┌1 graph─────────────────────────────┐
    │┌ sensor ┐   ┌ policy ┐   ┌actuator┐│
    ││● 50 Hz │─•►│○ 5 Hz  │──►│● 50 Hz ││
    │└────────┘   └────────┘   └────────┘│
    │/obs     50.0/s depth 1     37 drops│
    │/action   5.0/s depth 1     0 drops │
    └────────────────────────────────────┘
    ");
}

#[test]
fn circles_lead_back_below() {
    assert_snapshot!(rich(&circle(), 100, 12), @"
    ┌1 graph───────────────────────────────────────────────────────────────────────────────────────────┐
    │                   /obs  50.0/s                           /action  50.0/s                         │
    │   ┌ sensor ─────┐   0 dropped            ┌ logic ──────┐   0 dropped           ┌ actuator ───┐   │
    │ ┌►│● 50 Hz      │──•─────•─────•─────•──►│● 50 Hz      │──•─────•─────•───┌•──►│● 50 Hz      │─┐ │
    │ │ │  0 overruns │──•─────•─────•─────•┐  │  0 overruns │──•─────•─────•───┘ ┌•►│  0 overruns │ • │
    │ │ └─────────────┘ /debug  50.0/s      │  └─────────────┘ /note  50.0/s      │  └─────────────┘ │ │
    │ │                   0 dropped         │                    0 dropped        │                  │ │
    │ └─•─────•─────•─────•─────•─────•─────•─────•─────•─────•─────•─────•─────•─│───•─────•─────•──┘ │
    │                                       └•─────•─────•─────•─────•─────•─────•┘                    │
    │/state  50.0/s depth 1     0 dropped                                                              │
    │                                                                                                  │
    └──────────────────────────────────────────────────────────────────────────────────────────────────┘
    ");
}

#[test]
fn as_many_as_fit() {
    assert_snapshot!(rich(&sample::chain(1_000), 80, 6), @"
    ┌1 graph──────────────────────────────────────────────────────────── +993 more ┐
    │┌ n0 ──┐    ┌ n1 ──┐    ┌ n2 ──┐    ┌ n3 ──┐    ┌ n4 ──┐   ┌ n5 ──┐   ┌ n6 ──┐│
    ││●50 Hz│──•►│○50 Hz│──•►│○50 Hz│──•►│●50 Hz│──•►│○50 Hz│──►│○50 Hz│──►│●50 Hz││
    │└──────┘    └──────┘    └──────┘    └──────┘    └──────┘   └──────┘   └──────┘│
    │/t1  50.0/s depth 1     0 dropped       +5 topics                             │
    └──────────────────────────────────────────────────────────────────────────────┘
    ");
    assert_snapshot!(rich(&crowd(), 60, 7), @"
    ┌1 graph──────────────────────────────────────── +980 more ┐
    │   [● node]─┐ [● node]─┐ [● node]─┐ [● node]─┐ [● node]─┐ │
    │   [● node]─┤ [● node]─┤ [● node]─┤ [● node]─┤ [● node]─┤ │
    │   [● node]─┤ [● node]─┤ [● node]─┤ [● node]─┤ [● node]─┤ │
    │ ┌►[● node]─┤ [● node]─┤ [● node]─┤ [● node]─┤ [● node]─┤ │
    │ └────•─────┴──────────┴──────────┴──────────┴──────────┘ │
    └──────────────────────────────────────────────────────────┘
    ");
    assert_snapshot!(rich(&sample::chain(1), 40, 6), @"
    ┌1 graph───────────────────────────────┐
    │          ┌ n0 ────────────┐          │
    │          │ ● 50 Hz        │          │
    │          │   0 overruns   │          │
    │          └────────────────┘          │
    └──────────────────────────────────────┘
    ");
    assert_snapshot!(rich(&sample::chain(0), 20, 3), @"
    ┌1 graph───────────┐
    │                  │
    └──────────────────┘
    ");
}

#[test]
fn ascii() {
    let buf = buffer(&sample::broken(), &POOR, 80, 8);
    assert_snapshot!(text(&buf), @"
    +1 graph-----------------------------------------------------------------------+
    |                /obs                            /action                       |
    |+ sensor -----+  50.0/s         + policy -----+   5.0/s        + actuator ---+|
    ||* 50 Hz      |-o-----x-----x-->|o 5 Hz       |-----o-----o--->|* 50 Hz      ||
    ||  0 overruns |   37 dropped    |  2 overruns |   0 dropped    |  0 overruns ||
    |+-------------+   depth 1       +-------------+   depth 1      +-------------+|
    |                    16 ms ago                   ~  320 ms ago                 |
    +------------------------------------------------------------------------------+
    ");
}

#[test]
fn as_many_messages_are_crossed_out_as_are_lost() {
    let crossed = |dropped| {
        let mut frame = sample::balanced();
        frame.topics[0].dropped_lately = dropped;
        rich(&frame, 160, 11).matches('✖').count()
    };
    let [none, half, all] = [0, 25, 50].map(crossed);
    assert!(none == 0 && 0 < half && half < all, "{none} {half} {all}");
}

#[test]
fn old_messages_are_marked() {
    let aged = |ms| {
        let mut frame = sample::broken();
        frame.topics[1].held = Some(std::time::Duration::from_millis(ms));
        rich(&frame, 80, 8)
    };
    // At 5 Hz the next message is overdue by half after 300 ms.
    assert!(aged(300).contains("   300 ms ago"));
    assert!(aged(301).contains("◷  301 ms ago"));
    assert!(aged(12_345).contains("◷  12.3 s ago"));
}

#[test]
fn messages_travel_one_cell_at_a_time() {
    let dots = |published| {
        let mut frame = sample::balanced();
        frame.topics[0].published = published;
        let drawn = rich(&frame, 120, 11);
        let line = drawn.lines().find(|line| line.contains('•'));
        let cells = line.unwrap_or_default().chars().take(47).enumerate();
        let dots = cells.filter(|(_, cell)| *cell == '•');
        dots.map(|(column, _)| column).collect::<Vec<_>>()
    };
    let moved = |from, to| {
        let (from, to): (Vec<_>, Vec<_>) = (dots(from), dots(to));
        from.len() >= 3 && from.iter().zip(&to).all(|(a, b)| a + 1 == *b)
    };
    assert_eq!(dots(0), [0; 0]);
    assert!(moved(1, 2) && moved(320, 321));
}

#[test]
fn nothing_moves_but_messages_while_counts_grow() {
    let places = |drops: u64, rate: f64, held: u64| {
        let mut frame = sample::balanced();
        let topic = &mut frame.topics[0];
        (topic.dropped, topic.dropped_lately, topic.per_second) = (drops, drops, rate);
        topic.held = Some(std::time::Duration::from_millis(held));
        let drawn = rich(&frame, 80, 8);
        let column = |line: &str, word| line.find(word).map(|at| line[..at].chars().count());
        ["/s", "depth", " ms"].map(|word| drawn.lines().find_map(|line| column(line, word)))
    };
    assert_eq!(places(0, 9.9, 1), places(123_456, 10_000.0, 9_999));
    assert!(places(0, 9.9, 1).iter().all(Option::is_some));
}

fn policy_and_obs() -> KnobFocus {
    KnobFocus {
        node: "policy".to_owned(),
        topics: vec!["/obs".to_owned()],
    }
}

#[test]
fn what_keys_turn_is_marked_by_more_than_a_colour() {
    for (theme, mark, height) in [(&RICH, '▸', 9), (&RICH, '▸', 5), (&POOR, '>', 5)] {
        let drawn = screen((120, height), theme, |sheet| {
            render(&sample::broken(), &policy_and_obs(), sheet);
        });
        let drawn = text(&drawn);
        let with_mark = |name| drawn.contains(&format!("{mark}{name}"));
        let marked = ["sensor", "/obs", "policy", "/action"].map(with_mark);
        assert_eq!(marked, [false, true, true, false], "{drawn}");
    }
}

#[test]
fn any_size_will_do() {
    for frame in [
        sample::broken(),
        sample::fan_out(),
        circle(),
        sample::chain(40),
    ] {
        for knobs in [KnobFocus::default(), policy_and_obs()] {
            torture(|sheet| render(&frame, &knobs, sheet));
        }
    }
    for (width, height) in [(0, 0), (8, 3), (9, 4), (40, 200), (400, 3), (300, 100)] {
        rich(&crowd(), width, height);
        rich(&sample::chain(1_000), width, height);
    }
}

#[test]
fn a_link_that_takes_time_has_its_messages_where_they_are() {
    let mut frame = sample::broken();
    let line = |frame: &FrameData| {
        let drawn = rich(frame, 120, 9);
        let line = drawn.lines().nth(3).expect("a line").to_owned();
        line.split('│').nth(5).expect("a wire").to_owned()
    };
    let dot = |way, lost| Dot { way, lost };
    frame.topics[1].dots = Some(vec![dot(0.0, false), dot(0.5, true), dot(0.9, false)]);
    let wire = line(&frame);
    assert_eq!(wire.matches('•').count(), 2, "{wire}");
    assert!(wire.starts_with("─•") && wire.contains('◌'), "{wire}");
    assert!(wire.find('◌') < wire.rfind('•'), "{wire}");
    frame.topics[1].dots = Some(Vec::new());
    assert_eq!(line(&frame).trim_matches('─'), "►");
}

#[test]
fn losses_on_a_link_are_told_from_drops() {
    let mut frame = sample::broken();
    frame.topics[0].lost = 300;
    frame.topics[0].lost_lately = 40;
    let drawn = rich(&frame, 120, 9);
    shows(&drawn, &["◌", "37 dropped 300 lost"]);
}

#[test]
fn a_node_that_does_not_work_looks_dead_in_words() {
    let mut frame = sample::broken();
    frame.nodes[0].health = Health::Hangs;
    frame.nodes[1].health = Health::Crashed;
    for (width, height, dead) in [(120, 9, "crashed"), (60, 5, "dead")] {
        let drawn = rich(&frame, width, height);
        shows(&drawn, &[dead, "hangs", "✖"]);
    }
}
