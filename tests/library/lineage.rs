//! Where the age of an action arose: the chain behind it, and its parts.

use std::sync::Mutex;

use proptest::prelude::*;

use crate::support::*;

/// The messages behind a message: topics and sequence numbers, from the sensing on.
type Chain = Vec<(usize, u64)>;

/// Run times at which something was applied, the sensing behind it, and its chain.
type Applied = Arc<Mutex<Vec<(Time, Time, Chain)>>>;

/// A node that passes on the newest of what it reads, with what is behind it; the last one
/// applies it.
struct Link {
    inputs: Vec<Subscription<Chain>>,
    output: Option<(usize, Publisher<Chain>)>,
    published: u64,
    command: Option<(Time, Chain)>,
    acts: bool,
    applied: Applied,
}

impl Node for Link {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        let reads = self.inputs.iter_mut().filter_map(|input| tick.read(input));
        let freshest = reads.max_by_key(|message| message.sensed());
        let Some((topic, output)) = &self.output else {
            self.command = freshest.map(|message| (message.sensed(), message.data));
            return Ok(Flow::Continue);
        };
        if freshest.is_some() || self.inputs.is_empty() {
            let mut chain = freshest.map_or_else(Vec::new, |message| message.data);
            chain.push((*topic, self.published));
            self.published += 1;
            tick.publish(output, chain);
        }
        Ok(Flow::Continue)
    }

    fn apply(&mut self, tick: &mut Tick) -> TickResult {
        if let Some((sensed, chain)) = self.command.clone().filter(|_| self.acts) {
            tick.act();
            let applied = (tick.now(), sensed, chain);
            self.applied.lock().expect("log").push(applied);
        }
        Ok(Flow::Continue)
    }
}

/// A graph by chance: nodes from the sensor to the one that acts.
#[derive(Clone, Debug)]
struct Plan {
    /// Per node its rate, its priority, and which of the topics before it it reads.
    nodes: Vec<(u32, u32, Vec<usize>)>,
    /// Knobs, at run times in ms.
    knobs: Vec<(u64, String)>,
}

/// Knobs of a plan; `FEW`, `SOME` and `MORE` are numbers.
const KNOBS: &str = "takes NODE none|takes NODE SOME.5|takes NODE SOME..MORE|offset NODE SOME|\
    wakes NODE FEW|hang NODE MORE|link TOPIC delay:SOME|link TOPIC delay:0..SOME|\
    link TOPIC delay:0..SOME,in-order|link TOPIC loss:0.FEW|link TOPIC loss:0.FEW,reliable:13|\
    read TOPIC oldest|depth TOPIC FEW";

fn plans(most_inputs: usize) -> impl Strategy<Value = Plan> {
    let inputs = prop::collection::vec(0..8usize, 1..=most_inputs);
    let nodes = prop::collection::vec((1..=100u32, 0..3u32, inputs), 2..5);
    let knob = prop::sample::select(KNOBS.split('|').collect::<Vec<_>>());
    let at = prop_oneof![3 => Just(0u64), 1 => 0..700u64];
    let numbers = (1..7u32, 1..40u32, 40..100u32);
    let knobs = prop::collection::vec((at, knob, numbers, 0..8usize), 0..7);
    (nodes, knobs).prop_map(|(nodes, knobs)| {
        let count = nodes.len();
        let knobs = knobs.into_iter().map(|(at, knob, (few, some, more), of)| {
            let words = [
                ("NODE", format!("n{}", of % count)),
                ("TOPIC", format!("/t{}", of % (count - 1))),
                ("FEW", few.to_string()),
                ("SOME", some.to_string()),
                ("MORE", more.to_string()),
            ];
            let knob = words.iter().fold(knob.to_owned(), |knob, (word, value)| {
                knob.replace(word, value)
            });
            (at, knob)
        });
        let knobs = knobs.collect();
        Plan { nodes, knobs }
    })
}

/// The topics that node `number` of a plan reads: the first none, the last one.
fn inputs(plan: &Plan, number: usize) -> Vec<usize> {
    let (_, _, inputs) = &plan.nodes[number];
    let mut inputs: Vec<usize> = match number {
        0 => Vec::new(),
        n if n == plan.nodes.len() - 1 => vec![n - 1],
        n => inputs.iter().map(|input| input % n).collect(),
    };
    inputs.sort_unstable();
    inputs.dedup();
    inputs
}

/// The graph of a plan, its topics, and what its last node applies.
fn built(plan: &Plan, seed: u64) -> (Graph, Vec<Topic<Chain>>, Applied) {
    let last = plan.nodes.len() - 1;
    let mut graph = Graph::with_seed(seed);
    let topics = (0..last).map(|topic| Topic::new(format!("/t{topic}"), depth(1)));
    let (topics, applied) = (topics.collect::<Vec<_>>(), Applied::default());
    for (number, (rate, priority, _)) in plan.nodes.iter().enumerate() {
        // Even and odd rates, so that instants are, too.
        let rate = f64::from(*rate) * 2.0;
        let added = graph.node(&format!("n{number}"), rate, *priority, |wiring| {
            let inputs = inputs(plan, number).into_iter();
            let output = topics
                .get(number)
                .map(|topic| (number, wiring.publisher(topic)));
            Link {
                inputs: inputs.map(|of| wiring.subscription(&topics[of])).collect(),
                acts: output.is_none(),
                output,
                published: 0,
                command: None,
                applied: applied.clone(),
            }
        });
        added.expect("a node");
    }
    (graph, topics, applied)
}

/// The lineage of a second of a plan, what was applied, and its mean age (s).
fn played(plan: &Plan, seed: u64) -> (Lineage, Vec<(Time, Time, Chain)>, Option<f64>) {
    let (mut graph, topics, applied) = built(plan, seed);
    let taps = TapHandle::new(&graph);
    let ticks = taps.ticks(ROOM);
    let messages: Vec<_> = topics.iter().map(|topic| taps.topic(topic, ROOM)).collect();
    let mut lineage = Lineage::new(graph.topology(), &[]);
    let commands = plan.knobs.iter();
    let commands = commands.map(|(ms, text)| format!("{} {text}; ", *ms as f64 / 1e3));
    run_virtual(&mut graph, &commands.collect::<String>(), secs(1.0));
    let observer = Observer::new(&graph);
    let events = observer.events(0);
    events.iter().for_each(|event| lineage.event(event));
    let topology = observer.topology();
    for (topic, tap) in topics.iter().zip(&messages) {
        let index = topology.topic(topic.name());
        let items = tap.items().try_iter();
        items.for_each(|tapped| lineage.message(index.expect("a topic"), &tapped.head));
    }
    let lineage = settled(lineage, &ticks);
    let snapshot = observer.snapshot();
    let acts = snapshot.nodes.last();
    let age = acts.and_then(|acts| acts.push_age.saw()?.mean_s(snapshot.now));
    let applied = applied.lock().expect("log").clone();
    (lineage, applied, age)
}

/// The chain behind a push, as the lineage has it.
fn chain(lineage: &Lineage, push: &PushInForce) -> Chain {
    let name = |topic: usize| lineage.topology().topics[topic].name[2..].parse();
    let messages = lineage.chain_of(push).messages;
    let named = messages
        .iter()
        .rev()
        .map(|message| (name(message.topic).expect("a number"), message.seq));
    named.collect()
}

/// The parts sum to the age whenever it is asked for; the mean parts to the mean age.
fn sums_are_exact(plan: &Plan, seed: u64, chains: bool) -> Result<(), TestCaseError> {
    let (lineage, applied, age) = played(plan, seed);
    let actor = plan.nodes.len() - 1;
    for (number, (since, sensed, truth)) in applied.iter().enumerate() {
        let until = applied.get(number + 1).map_or(secs(1.0), |next| next.0);
        // Replaced in the same instant: a tick with a duration ended there, and another
        // one began.
        if number + 1 < applied.len() && until == *since {
            continue;
        }
        let push = lineage.push_at(actor, *since);
        prop_assert!(push.is_some(), "{since}");
        let push = push.expect("a push");
        if chains {
            prop_assert_eq!(&chain(&lineage, &push), truth);
        }
        for share in 0..4 {
            let at = *since + until.since(*since) * share / 4;
            let parts = push.parts(at);
            prop_assert_eq!(parts.sum_ns() as u128, at.since(*sensed).as_nanos());
            prop_assert_eq!(parts.before_ns, 0);
        }
    }
    if let Some((first, ..)) = applied.first() {
        let parts = mean_parts(&lineage, actor, TimeSpan::new(*first, secs(1.0)));
        let sum: f64 = parts.iter().map(|(_, ns)| ns).sum();
        let mean = age.unwrap_or_default() * 1e9;
        prop_assert!((sum - mean).abs() < 1.0, "{sum} for {mean}");
    }
    Ok(())
}

#[test]
fn the_reading_behind_a_push_is_told_from_others_that_are_near() {
    // The first push is of the first reading, which was published at the time of the second.
    let long = "link /t0 delay:0..20,in-order;hang n0 45";
    for (case, nodes, knobs, seed) in [
        ("one that took long", [(100, 0), (8, 0)], long, 33),
        ("two at once", [(20, 1), (20, 0)], "hang n0 75", 0),
    ] {
        let nodes = nodes.map(|(rate, priority)| (rate, priority, vec![0]));
        let knobs = knobs.split(';').map(|knob| (0, knob.to_owned()));
        let plan = Plan {
            nodes: nodes.into(),
            knobs: knobs.collect(),
        };
        sums_are_exact(&plan, seed, true).expect(case);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn the_parts_of_an_age_sum_to_it_and_the_chain_is_that_of_the_messages(
        plan in plans(1), seed in 0..100u64,
    ) {
        sums_are_exact(&plan, seed, true)?;
    }

    /// Günzel and others, On the Equivalence of Maximum Reaction Time and Maximum Data
    /// Age for Cause-Effect Chains, ECRTS 2023.
    #[test]
    fn the_greatest_reaction_time_is_the_greatest_age(plan in plans(1), seed in 0..100u64) {
        let (lineage, applied, _) = played(&plan, seed);
        let (Some(first), Some(last)) = (applied.first(), applied.last()) else {
            return Ok(());
        };
        // From a sensing, as something changes right after it, to the first action that
        // is derived from a later one.
        let sensings = lineage.ticks(0).map(|worked| worked.tick.at);
        let sensings = sensings.filter(|at| (first.1..last.1).contains(at));
        let reaction = sensings.filter_map(|sensed| {
            let answer = applied.iter().find(|(_, later, _)| *later > sensed)?;
            Some(answer.0.since(sensed))
        });
        let answered = applied.iter().find(|(_, sensed, _)| *sensed == last.1);
        let until = answered.expect("the last sensing").0;
        let acts = plan.nodes.len() - 1;
        if let Some(reaction) = reaction.max() {
            prop_assert_eq!(lineage.greatest_age(acts, TimeSpan::new(first.0, until)), reaction);
        }
    }

    #[test]
    fn the_parts_sum_to_the_age_where_readings_meet(plan in plans(3), seed in 0..100u64) {
        sums_are_exact(&plan, seed, false)?;
    }
}
