//! The age of data is what the records say: the parts, what the chain itself measured, and the records
//! followed by hand are one number.

use proptest::{prelude::*, sample::Index};

use crate::support::*;

/// Two sensors that trigger a node, in an executor that another node keeps busy.
const TWO_TRIGGERS: &str = "
    name = 'two-triggers'
    node.a = { rate = 50, publishes = ['/a'] }
    node.b = { rate = 10, offset = 35, publishes = ['/b'] }
    node.sync = { trigger = ['/a', '/b'], match = 'each', publishes = ['/pair'] }
    node.load = { rate = 5, takes = 150 }
    executor.one = { kind = 'KIND', nodes = ['sync', 'load'] }
    chain.c = { path = ['a', '/a', 'sync', '/pair'] }
";

/// A subscription without a cost and a timer in one executor.
const NO_COST: &str = "
    name = 'no-cost'
    node.a = { rate = 100, publishes = ['/a'] }
    node.b = { trigger = ['/a'], publishes = ['/b'] }
    node.c = { rate = 100, reads = ['/b'], publishes = ['/c'] }
    executor.e = { kind = 'KIND', nodes = ['b', 'c'] }
    chain.c = { path = ['a', '/a', 'b', '/b', 'c', '/c'] }
";

/// A sensor whose clock is wrong by OFFSET, matched by stamp with one that is right.
const WRONG_CLOCK: &str = "
    name = 'wrong-clock'
    node.imu = { rate = 100, publishes = ['/imu'] }
    node.vision = { rate = 20, stamp_clock = 'OFFSET 0', publishes = ['/vision'] }
    node.fuse = { trigger = ['/imu', '/vision'], match = 'exact:50', publishes = ['/pose'] }
    chain.imu = { path = ['imu', '/imu', 'fuse', '/pose'] }
    chain.vision = { path = ['vision', '/vision', 'fuse', '/pose'] }
";

/// One exposure on two topics: the planner works on one, and the other comes late.
const ONE_EXPOSURE: &str = "
    name = 'one-exposure'
    node.camera = { rate = 10, publishes = ['/a', '/b'] }
    node.planner = { rate = 100, reads = ['/b', '/a'], publishes = ['/act'] }
    node.motor = { rate = 100, reads = ['/act'], publishes = ['/done'] }
    topic.'/b'.link = 'delay:60'
    chain.used = { path = ['camera', '/a', 'planner', '/act', 'motor', '/done'] }
";

/// The mean of an age and its largest part, as `run` has them.
fn told(text: &str, chain: &str) -> (f64, &'static str, String) {
    let system = graph_system(text).unwrap_or_else(|error| panic!("{error}: {text}"));
    let mut experiment = Experiment::new(system, &config("until 20")).expect("a graph");
    experiment.watch_ages();
    let summary = experiment.run().expect("no fault");
    let age = summary
        .ages
        .iter()
        .find(|age| age.chain.as_deref() == Some(chain));
    let age = age.unwrap_or_else(|| panic!("no age of {chain}: {text}"));
    assert_eq!(age.apart_from_ns, None, "{age:?}\n{text}");
    let largest = age.parts.first().expect("a part");
    let mean = (age.mean_ns as f64 / 1e5).round() / 10.0;
    (mean, largest.stage.key(), largest.owner.clone())
}

#[test]
fn ages_that_were_worked_out_by_hand() {
    let clocks = |offset: &str| WRONG_CLOCK.replace("OFFSET", offset);
    let kinds = |text: &str, kind: &str| text.replace("KIND", kind);
    for (text, chain, mean, kind, owner) in [
        // 10 ms at the tick and 100 ms until the next one, which load puts off every second time.
        (kinds(TWO_TRIGGERS, "single"), "c", 109.7, "match", "/b"),
        (kinds(TWO_TRIGGERS, "events"), "c", 109.7, "match", "/b"),
        // The timer comes first, and reads what came 10 ms before.
        (kinds(NO_COST, "single"), "c", 15.0, "wait", "c"),
        (kinds(NO_COST, "events"), "c", 15.0, "wait", "c"),
        // The timer is as urgent as its place in the file: behind the subscription.
        (kinds(NO_COST, "fixed-priority:1"), "c", 5.0, "hold", "/b"),
        // A stamp of the vision is 175 ms behind: its partner waits for it so long.
        (clocks("0"), "imu", 25.0, "match", "/vision"),
        (clocks("-170"), "imu", 195.0, "match", "/vision"),
        (clocks("-170"), "vision", 25.0, "hold", "/vision"),
        // Held for 45 ms in the planner's topic, then for 5 ms at the motor.
        (ONE_EXPOSURE.to_owned(), "used", 50.0, "hold", "/a"),
    ] {
        let (told, of, whose) = told(&text, chain);
        assert_eq!((of, &*whose), (kind, owner), "{told} ms: {text}");
        // A clock that is behind stamps zero before zero: so its run begins otherwise.
        assert!((told - mean).abs() <= 1.0, "{told} ms for {mean}: {text}");
    }
}

/// A graph of the library with one exposure on two topics, which are wired in this order: the planner
/// works on `/a` and looks at `/b`, which comes late.
fn exposure(order: [usize; 2]) -> Arc<dyn System> {
    system(move |builder| {
        let names = ["/a", "/b"].map(|name| Topic::new(name, Depth::ONE));
        let act = Topic::new("/act", Depth::ONE);
        let graph = builder.graph();
        graph.node("camera", hz(10.0), 0, |wiring| {
            let outputs = order.map(|topic| wiring.publisher(&names[topic]));
            move |tick: &mut Tick| {
                outputs.iter().for_each(|output| tick.publish(output, 1.0));
            }
        })?;
        graph.node("planner", hz(100.0), 1, |wiring| {
            let mut images = order.map(|topic| wiring.subscription::<f64>(&names[topic]));
            let act = wiring.publisher(&act);
            move |tick: &mut Tick| {
                let read = images.each_mut().map(|image| tick.read(image));
                if let Some(image) = &read[order[0]] {
                    tick.publish(&act, 2.0 * image.data);
                }
            }
        })?;
        graph.node("motor", hz(100.0), 2, |wiring| {
            Motor(PUSHES, wiring.subscription(&act))
        })?;
        let late = knob("link /b delay:60");
        graph
            .set(&late)
            .map_err(|why| BuildError::Setting(why.to_string()))?;
        Ok(())
    })
}

/// What a node does with its tick that acts by commands.
type Acts = fn(&mut Tick, &mut Subscription<f64>);

/// Acts by what it reads.
const PUSHES: Acts = |tick, act| {
    tick.read(act);
    tick.act();
};

/// A node that acts by commands.
struct Motor(Acts, Subscription<f64>);

impl Node for Motor {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        (self.0)(tick, &mut self.1);
        Ok(Flow::Continue)
    }
}

/// The ages of a run of `system`: what the run measured follows from its records.
fn whole_ages(what: &str, system: Arc<dyn System>, run: &Config) -> Vec<RunAge> {
    let mut experiment = Experiment::new(system, run).expect("a graph");
    experiment.watch_ages();
    let summary = experiment.run().expect("no fault");
    for age in &summary.ages {
        assert_eq!(age.apart_from_ns, None, "{what}: {age:?}");
        let parts = age.parts.iter().map(|part| part.ns);
        assert_eq!(parts.sum::<i64>(), age.mean_ns, "{what}: {age:?}");
    }
    summary.ages
}

/// The only one of them.
fn whole_age(what: &str, system: Arc<dyn System>, run: &Config) -> RunAge {
    let ages = whole_ages(what, system, run);
    let [age] = <[RunAge; 1]>::try_from(ages).unwrap_or_else(|ages| panic!("{what}: {ages:?}"));
    age
}

#[test]
fn of_one_exposure_on_two_topics_the_one_counts_that_came_first() {
    for order in [[0, 1], [1, 0]] {
        let age = whole_age("exposure", exposure(order), &config("until 20"));
        let parts = age.parts.iter();
        let parts: Vec<_> = parts.map(|part| (part.stage.key(), &*part.owner)).collect();
        assert_eq!((&*age.node, parts[0]), ("motor", ("hold", "/a")), "{age:?}");
        assert!(parts.iter().all(|(_, owner)| *owner != "/b"), "{age:?}");
        assert_eq!(age.mean_ns, 50_000_000, "{age:?}");
    }
}

/// What a node does with its tick that reads images and makes commands of them.
type Commands = fn(&mut Tick, &mut [Subscription<f64>; 2], &Publisher<f64>);

/// A camera with two links, a planner that makes `commands` of its images, and a motor.
fn planned(commands: Commands) -> Arc<dyn System> {
    acting(commands, PUSHES)
}

/// Such a graph with another motor.
fn acting(commands: Commands, acts: Acts) -> Arc<dyn System> {
    system(move |builder| {
        let [near, far, act] = ["/near", "/far", "/act"].map(|name| Topic::new(name, depth(1)));
        let graph = builder.graph();
        graph.node("camera", hz(10.0), 0, |wiring| {
            let outputs = [&near, &far].map(|topic| wiring.publisher(topic));
            move |tick: &mut Tick| outputs.iter().for_each(|output| tick.publish(output, 1.0))
        })?;
        graph.node("planner", hz(100.0), 1, |wiring| {
            let mut images = [&near, &far].map(|topic| wiring.subscription::<f64>(topic));
            let act = wiring.publisher(&act);
            move |tick: &mut Tick| commands(tick, &mut images, &act)
        })?;
        graph.node("motor", hz(100.0), 2, |wiring| {
            Motor(acts, wiring.subscription(&act))
        })?;
        for link in ["link /near delay:100", "link /far delay:300"] {
            graph
                .set(&knob(link))
                .map_err(|why| BuildError::Setting(why.to_string()))?;
        }
        Ok(())
    })
}

#[test]
fn no_node_can_forget_what_its_data_were_derived_from() {
    // An image on /near arrives when it is 100 ms old, and the next one 100 ms later.
    let rows: [(&str, Commands, f64); 4] = [
        (
            "derived from all that was read: the newest counts",
            |tick, [near, far], act| {
                if tick.read(near).is_some() && tick.read(far).is_some() {
                    tick.publish(act, 2.0);
                }
            },
            150.0,
        ),
        (
            "derived from all that was ever read",
            |tick, [near, far], act| {
                if tick.read_next(far).is_some() {
                    tick.read(near);
                }
                tick.publish(act, 2.0);
            },
            // It begins data until 300 ms.
            0.3 / 20.0 * 5.0 + 19.7 / 20.0 * 150.0,
        ),
        (
            "derived from one message",
            |tick, [near, far], act| {
                tick.read(near);
                if let Some(image) = tick.read(far) {
                    tick.publish_from(act, 2.0, &image);
                }
            },
            350.0,
        ),
        (
            "new, whatever was read",
            |tick, [near, far], act| {
                tick.read(near);
                tick.read(far);
                tick.publish_new(act, 2.0);
            },
            5.0,
        ),
    ];
    for (what, commands, mean) in rows {
        let age = whole_age(what, planned(commands), &config("until 20"));
        let told = age.mean_ns as f64 / 1e6;
        assert!((told - mean).abs() < 0.1, "{what}: {told} ms for {mean}");
    }
}

/// Reads, publishes and acts in any order, in ticks that take time and in others.
const USES: &[(Commands, Acts, &str)] = {
    const PASSES: Commands = |tick, [near, _], act| {
        tick.read(near);
        tick.publish(act, 2.0);
    };
    const BEHIND: Commands = |tick, [near, _], act| {
        tick.publish(act, 2.0);
        tick.read(near);
    };
    const ALL: Commands = |tick, [_, far], act| {
        while tick.read_next(far).is_some() {
            tick.publish(act, 2.0);
        }
    };
    const NEW: Commands = |tick, [near, _], act| {
        tick.read(near);
        tick.publish_new(act, 2.0);
    };
    const EARLY: Acts = |tick, act| {
        tick.act();
        tick.read(act);
    };
    // In each third tick.
    const SELDOM: Acts = |tick, act| {
        tick.read(act);
        if (tick.now().as_nanos() / 10_000_000).is_multiple_of(3) {
            tick.act();
        }
    };
    &[
        (PASSES, PUSHES, "takes planner 5"),
        (PASSES, EARLY, "takes motor 5"),
        (PASSES, SELDOM, "takes planner 5"),
        (PASSES, SELDOM, "rate camera 3"),
        (BEHIND, PUSHES, "takes planner 25"),
        (BEHIND, SELDOM, ""),
        (ALL, PUSHES, "rate planner 4; depth /far 10"),
        (
            ALL,
            PUSHES,
            "rate planner 4; depth /far 10; depth /act 10; read /act oldest",
        ),
        (NEW, PUSHES, "takes planner 5; takes motor 15"),
        (
            PASSES,
            PUSHES,
            "takes planner 5; 3.001 crash planner; 4 restart planner",
        ),
    ]
};

#[test]
fn parts_sum_to_the_age_however_a_node_uses_its_tick() {
    for (commands, acts, knobs) in USES {
        let run = config(&format!("until 20; {knobs}"));
        let age = whole_age(knobs, acting(*commands, *acts), &run);
        let known = |part: &AgeShare| part.stage != AgeStage::Before;
        assert!(age.parts.iter().all(known), "{knobs}: {age:?}");
    }
}

#[test]
fn a_tick_that_a_crash_cuts_off_has_its_number_and_its_reads() {
    let (image, mut graph) = (Topic::new("/image", depth(1)), Graph::new());
    talker(&mut graph, "camera", 10.0, 0, &image, |_| Some(()));
    let build = move |wiring: &mut Wiring<'_>| {
        let mut images = wiring.subscription(&image);
        move |tick: &mut Tick| {
            let read = tick.read(&mut images);
            match read.filter(|image| image.seq == 5) {
                Some(_) => Err(NodeCrash("a bad image".to_owned()).into()),
                None => Ok(Flow::Continue),
            }
        }
    };
    let added = graph.restartable_node("detector", hz(10.0), 1, build, None);
    added.expect("a node");
    let ticks = TapHandle::new(&graph).ticks(ROOM);
    run_virtual(
        &mut graph,
        "0 takes detector 30; 0.75 restart detector",
        secs(1.0),
    );
    let mut numbers = Vec::new();
    for tick in ticks[1].items().try_iter() {
        let read = tick.causes.reads.iter().map(|read| read.message.seq);
        let (at, ended) = (tick.at.as_nanos() / 1_000_000, tick.ends.is_some());
        assert_eq!(read.collect::<Vec<_>>(), [at / 100], "{tick:?}");
        assert_eq!(ended, at != 500 && at != 1000, "{tick:?}");
        numbers.push(tick.number);
    }
    assert!(numbers.iter().copied().eq(0..9), "{numbers:?}");
}

#[test]
fn a_push_with_data_of_several_nodes_has_an_age_by_each() {
    let sources = [("map", 1.0, 500_000_000), ("camera", 10.0, 50_000_000)];
    let ages = |order: [usize; 2]| {
        let system = system(move |builder| {
            let topics = ["/map", "/camera"].map(|name| Topic::new(name, depth(1)));
            let act = Topic::new("/act", depth(1));
            let graph = builder.graph();
            for source in order {
                let (name, rate, _) = sources[source];
                graph.node(name, hz(rate), 0, |wiring| {
                    let topic = wiring.publisher(&topics[source]);
                    move |tick: &mut Tick| tick.publish(&topic, 1.0)
                })?;
            }
            graph.node("planner", hz(100.0), 1, |wiring| {
                let mut inputs = topics.each_ref().map(|topic| wiring.subscription(topic));
                let act = wiring.publisher(&act);
                move |tick: &mut Tick| {
                    for input in &mut inputs {
                        tick.read(input);
                    }
                    tick.publish(&act, 2.0);
                }
            })?;
            graph.node("motor", hz(100.0), 2, |wiring| {
                Motor(PUSHES, wiring.subscription(&act))
            })?;
            Ok(())
        });
        whole_ages("sources", system, &config("until 20"))
    };
    for order in [[0, 1], [1, 0]] {
        let told = ages(order);
        let told = told.iter();
        let told: Vec<_> = told
            .map(|age| (age.source.as_deref(), age.is_beside, age.mean_ns))
            .collect();
        let [first, second] = order.map(|source| sources[source]);
        let expected = [
            (Some(first.0), false, first.2),
            (Some(second.0), true, second.2),
        ];
        assert_eq!(told, expected);
    }
}

/// Longer than what is counted at a time, and with other ages in its second half.
#[test]
fn a_push_beside_a_chain_has_its_parts_to_the_end_of_a_long_run() {
    let chain = "[chain.see]\npath = ['sensor', '/obs', 'camera', '/image', 'logger']\n";
    let system = graph_system(&(graph_text("middle", "") + chain)).expect("a graph");
    let run = config("until 60; 30 takes policy 15");
    let mut experiment = Experiment::new(system, &run).expect("a graph");
    experiment.watch_ages();
    let summary = experiment.run().expect("no fault");
    let measured = summary.push_age().expect("pushes").run_s * 1e9;
    let mut ages = summary.ages.iter();
    let push = ages.find(|age| age.chain.is_none()).expect("an age");
    let sum: i64 = push.parts.iter().map(|part| part.ns).sum();
    assert!((sum as f64 - measured).abs() < 2.0, "{push:?}");
}

/// A node of a random graph.
#[derive(Clone, Debug)]
struct RandomNode {
    settings: &'static str,
    rate: &'static str,
    matching: &'static str,
    triggers: Vec<Index>,
    reads: Vec<Index>,
    executed: bool,
}

/// Settings of any node.
const SETTINGS: [&str; 6] = [
    "takes = 5",
    "takes = '2..30'",
    "takes = 'lognormal:8,20'",
    "clock = '-4 20'",
    "takes = 0.1",
    "",
];

const RATES: [&str; 5] = [
    "rate = 5",
    "rate = 20\noffset = 3",
    "rate = 30",
    "rate = 100",
    "rate = 7.5",
];

const MATCHES: [&str; 3] = ["each", "exact:5", "approximate:5"];

/// What lies on a topic.
const TOPICS: [&str; 7] = [
    "",
    "",
    "depth = 5",
    "depth = 3\nread = 'oldest'",
    "link = 'delay:3..20'",
    "link = 'delay:5..40,in-order,loss:0.1'\ndepth = 2",
    "link = 'delay:10,burst:0.05,3'",
];

const KINDS: [&str; 6] = [
    "single",
    "events",
    "multi:2",
    "fixed-priority:1",
    "edf:1",
    "",
];

fn random_node() -> impl Strategy<Value = RandomNode> {
    let inputs = || prop::collection::vec(any::<Index>(), 0..3);
    let select = prop::sample::select::<&'static str>;
    (
        select(SETTINGS.to_vec()),
        select(RATES.to_vec()),
        select(MATCHES.to_vec()),
        (inputs(), inputs()),
        any::<bool>(),
    )
        .prop_map(
            |(settings, rate, matching, (triggers, reads), executed)| RandomNode {
                settings,
                rate,
                matching,
                triggers,
                reads,
                executed,
            },
        )
}

/// The topics before node `number`, of which these are picked.
fn picked(number: usize, of: &[Index]) -> Vec<usize> {
    let mut picked: Vec<usize> = match number {
        0 => Vec::new(),
        before => of.iter().map(|index| index.index(before)).collect(),
    };
    picked.sort_unstable();
    picked.dedup();
    picked
}

/// The topics that trigger node `number`, and those that it reads.
fn inputs(number: usize, node: &RandomNode) -> [Vec<usize>; 2] {
    let triggers = picked(number, &node.triggers);
    let mut reads = picked(number, &node.reads);
    reads.retain(|read| !triggers.contains(read));
    if triggers.is_empty() && reads.is_empty() && number > 0 {
        reads.push(number - 1);
    }
    [triggers, reads]
}

/// The graph file of these nodes with one chain: back from the last node, by `way` where it has a
/// choice. Returns the numbers of the nodes on it, the last one first.
fn graph_of(
    nodes: &[RandomNode],
    topics: &[&str],
    kind: &str,
    way: &[Index],
) -> (String, Vec<usize>) {
    let mut text = "name = 'random'\n".to_owned();
    let list = |of: &[usize]| {
        let names: Vec<String> = of.iter().map(|of| format!("'/t{of}'")).collect();
        names.join(", ")
    };
    let all: Vec<[Vec<usize>; 2]> = (0..).zip(nodes).map(|(n, node)| inputs(n, node)).collect();
    let mut executed = Vec::new();
    for (number, (node, [triggers, reads])) in nodes.iter().zip(&all).enumerate() {
        text += &format!(
            "[node.n{number}]\npublishes = ['/t{number}']\n{}\n",
            node.settings
        );
        text += &match triggers.len() {
            0 => format!("{}\n", node.rate),
            1 => format!("trigger = [{}]\n", list(triggers)),
            _ => format!(
                "trigger = [{}]\nmatch = '{}'\n",
                list(triggers),
                node.matching
            ),
        };
        if !reads.is_empty() {
            text += &format!("reads = [{}]\n", list(reads));
        }
        if kind.starts_with("edf") && !triggers.is_empty() && node.executed {
            text += "deadline_ms = 50\n";
        }
        if node.executed {
            executed.push(format!("'n{number}'"));
        }
    }
    for (topic, settings) in topics.iter().enumerate() {
        if all.iter().flatten().any(|inputs| inputs.contains(&topic)) && !settings.is_empty() {
            text += &format!("[topic.'/t{topic}']\n{settings}\n");
        }
    }
    if executed.len() > 1 && !kind.is_empty() {
        let nodes = executed.join(", ");
        text += &format!("[executor.one]\nkind = '{kind}'\nnodes = [{nodes}]\n");
    }
    let mut path = vec![nodes.len() - 1];
    for choice in way {
        let before = all[path[path.len() - 1]].concat();
        if !before.is_empty() {
            path.push(before[choice.index(before.len())]);
        }
    }
    let names = path
        .iter()
        .rev()
        .map(|node| format!("'n{node}', '/t{node}'"));
    let names: Vec<String> = names.collect();
    text += &format!("[chain.c]\npath = [{}]\n", names.join(", "));
    (text, path)
}

/// The ticks of all nodes and the messages of all topics, whose indices are those of their nodes.
struct Records {
    ticks: Vec<Vec<TickRecord>>,
    heads: Vec<Vec<Head>>,
    /// The ages that the run measured as ticks ended (ms), each with its tick.
    measured: Vec<(TickId, f64)>,
}

impl Records {
    /// When the data began that tick `number` of the node at the end of `path` stands for; `None` if
    /// none had come.
    fn began(&self, path: &[usize], number: u64) -> Option<Time> {
        let mut tick = TickId {
            node: path[0],
            number,
        };
        for topic in &path[1..] {
            let mut before = self.ticks[tick.node].iter().rev();
            let read = before.find_map(|known| {
                let mut reads = known.causes.reads.iter().rev();
                let read = reads.find(|read| read.message.topic == *topic)?;
                (known.number <= tick.number).then_some(read.message.seq)
            })?;
            tick = self.heads[*topic][read as usize].by.expect("a tick");
        }
        Some(self.ticks[tick.node][tick.number as usize].at)
    }
}

/// Checks the run of a graph file with a chain along these nodes; returns the number of ticks that were
/// compared.
fn is_one_number(text: &str, path: &[usize], run: &Config) -> Result<usize, TestCaseError> {
    let Ok(system) = graph_system(text) else {
        return Ok(0); // An executor cannot have such a node.
    };
    let mut experiment = Experiment::new(system.clone(), run).expect("a graph");
    let tap = experiment.taps().all(1 << 17);
    let topology = experiment.observer().topology();
    experiment.watch_ages();
    let summary = experiment.run().expect("no fault");
    for age in &summary.ages {
        prop_assert_eq!(age.apart_from_ns, None, "{:?}\n{}", age, text);
        let sum: i64 = age.parts.iter().map(|part| part.ns).sum();
        prop_assert_eq!(sum, age.mean_ns, "{}", text);
    }
    let mut lineage = Lineage::new(topology.clone(), system.about().settings);
    lineage = lineage.along(system.about().latency_path());
    let mut records = Records {
        ticks: vec![Vec::new(); topology.nodes.len()],
        heads: vec![Vec::new(); topology.topics.len()],
        measured: Vec::new(),
    };
    let chains = topology.topic(CHAINS);
    for row in tap.items() {
        match row {
            RunRow::Message(topic, head, numbers) => {
                lineage.message(topic, &head);
                records.heads[topic].push(head);
                if chains == Some(topic) {
                    let by = head.by.expect("a tick");
                    records.measured.push((by, numbers[2]));
                }
            }
            RunRow::Tick(node, tick) => {
                lineage.tick(node, tick.clone());
                records.ticks[node].push(tick);
            }
        }
    }
    lineage.settle();
    let mut compared = 0;
    for tick in &records.ticks[path[0]] {
        let Some((began, ends)) = records.began(path, tick.number).zip(tick.ends) else {
            continue;
        };
        let push = lineage.push_at(path[0], ends);
        let sum = push.map(|push| push.parts(ends).sum_ns() as u128);
        // Another tick may end at that instant, too.
        let is_last = records.ticks[path[0]].get(tick.number as usize + 1);
        if path.len() > 1 && is_last.is_none_or(|next| next.ends != Some(ends)) {
            let followed = Some(ends.since(began).as_nanos());
            prop_assert_eq!(sum, followed, "at {}\n{}", ends, text);
            compared += 1;
        }
    }
    for (by, ms) in &records.measured {
        let ends = records.ticks[by.node][by.number as usize].ends;
        let (began, ends) = (records.began(path, by.number), ends.expect("it measured"));
        let followed = began.map(|began| ends.since(began).as_nanos());
        let known = (!ms.is_nan()).then(|| (ms * 1e6).round() as u128);
        prop_assert_eq!(known, followed, "at {}\n{}", ends, text);
    }
    Ok(compared)
}

/// Small graphs whose node `nN` publishes on the topic `/tN`, with a chain back from `n2`.
const ON_THREADS: [&str; 5] = [
    "
    node.n0 = { rate = 100, publishes = ['/t0'] }
    node.n1 = { rate = 50, takes = 2, reads = ['/t0'], publishes = ['/t1'] }
    node.n2 = { rate = 100, reads = ['/t1'], publishes = ['/t2'] }
    ",
    "
    node.n0 = { rate = 100, publishes = ['/t0'] }
    node.n1 = { trigger = ['/t0'], takes = '1..4', publishes = ['/t1'] }
    node.n2 = { trigger = ['/t1'], publishes = ['/t2'] }
    ",
    "
    node.n0 = { rate = 50, publishes = ['/t0'] }
    node.n1 = { rate = 100, reads = ['/t0'], publishes = ['/t1'] }
    node.n2 = { trigger = ['/t1', '/t0'], match = 'each', publishes = ['/t2'] }
    ",
    "
    node.n0 = { rate = 100, publishes = ['/t0'] }
    node.n1 = { trigger = ['/t0'], takes = 3, publishes = ['/t1'] }
    node.n2 = { rate = 50, takes = 2, reads = ['/t1'], publishes = ['/t2'] }
    executor.one = { kind = 'single', nodes = ['n1', 'n2'] }
    ",
    "
    node.n0 = { rate = 100, publishes = ['/t0'] }
    node.n1 = { rate = 50, reads = ['/t0'], publishes = ['/t1'] }
    node.n2 = { rate = 100, reads = ['/t1'], publishes = ['/t2'] }
    topic.'/t0' = { depth = 3, read = 'oldest' }
    topic.'/t1' = { link = 'delay:3..10' }
    ",
];

#[test]
fn on_the_real_clock_too_they_are_one_number() {
    let chain = "chain.c = { path = ['n0', '/t0', 'n1', '/t1', 'n2', '/t2'] }";
    for nodes in ON_THREADS {
        let text = format!("name = 'threads'\n{nodes}\n{chain}\n");
        let compared = || is_one_number(&text, &[2, 1, 0], &config("real; until 0.3"));
        let compared = || compared().unwrap_or_else(|why| panic!("{why}"));
        // On a machine that is too busy no data may come through at first.
        assert!((0..10).any(|_| compared() > 0), "{text}");
    }
}

/// A command that is published again and again has the same sensing: the run may end in between.
#[test]
fn on_the_real_clock_the_parts_of_a_push_sum_to_what_the_run_measured() {
    let again: Commands = |tick, [near, _], act| {
        if tick.read_next(near).is_none() {
            tick.publish(act, 2.0);
        }
    };
    let compared = || whole_ages("again", acting(again, PUSHES), &config("real; until 0.4")).len();
    // On a machine that is too busy no data may come through at first.
    assert!((0..10).any(|_| compared() > 0));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(number("RATELAB_CASES", 300)))]
    #[test]
    fn the_parts_the_chain_and_the_records_are_one_number(
        nodes in prop::collection::vec(random_node(), 3..7),
        topics in prop::collection::vec(prop::sample::select(TOPICS.to_vec()), 7),
        kind in prop::sample::select(KINDS.to_vec()),
        way in prop::collection::vec(any::<Index>(), 6),
        seed in 0..100u64,
    ) {
        let (text, path) = graph_of(&nodes, &topics, kind, &way);
        is_one_number(&text, &path, &config(&format!("until 3; seed {seed}")))?;
    }
}
