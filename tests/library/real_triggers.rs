//! Triggers and executors under the real clock: what comes of a run is the same when it is
//! executed again, also with stretches of virtual time in it.

use crate::{re_execution::Run, support::*};

/// The graph in `lidar.toml`; all its nodes but the controller are those of `executor`, if it names
/// one.
fn robot(executor: &str) -> Arc<dyn System> {
    let nodes = ["camera", "lidar", "detector", "fusion", "closest"];
    let text = match executor {
        "" => graph_text("lidar", "group = \"slow\" →; group = \"reentrant\" →"),
        kind => {
            let text = graph_text("lidar", "");
            format!("{text}[executor.all]\nkind = \"{kind}\"\nnodes = {nodes:?}\n")
        }
    };
    graph_system(&text).expect("a graph")
}

const ON_THE_WALL: &str = "real; until 0.2";

/// Runs for 0.2 s and executes again, until a run was on time enough for what `shows` looks for.
fn until(executor: &str, commands: &str, shows: impl Fn(&[Vec<TickRecord>]) -> bool) {
    for _ in 0..20 {
        let commands = timed(commands);
        let run = Run::record(
            &robot(executor),
            &config(ON_THE_WALL),
            commands,
            |_, _, _| {},
        );
        for perturbed in [false, true] {
            let mut re_execution = run.re_execution();
            if perturbed {
                re_execution.perturb();
            }
            let again = run.check(re_execution);
            assert_eq!(again.log, run.log, "its log is another one");
        }
        if shows(&run.ticks) {
            return;
        }
    }
    panic!("no run was on time");
}

const KNOBS: &str =
    "0 takes detector 2; 0 takes control 3; 0 link /scan delay:4; 0.03 takes detector 12";

/// From the real clock to the virtual one, and back.
const HAND_OVERS: &str = "; 0.08 virtual; 0.14 real";

#[test]
fn a_run_with_triggers_comes_back_to_the_bit() {
    until("", KNOBS, |ticks| {
        let [_, _, detector, fusion, control, closest] = ticks else {
            panic!("six nodes");
        };
        // A delayed message arrives with its link: nothing is fused before.
        let delayed = fusion.iter().all(|tick| tick.at >= at_ms(4));
        // What comes of a tick is there at the end of its period, and not before.
        let ended = control.iter();
        let ended = ended.filter_map(|tick| Some(tick.ends? - tick.at));
        let ended: Vec<_> = ended.collect();
        // The first ticks may come before the commands.
        delayed
            && detector.len() > 10
            && fusion.len() > 5
            && closest.len() > 3
            && ended.iter().all(|took| *took > ms(3))
            && ended.iter().any(|took| *took > ms(8))
    });
}

#[test]
fn every_message_triggers_a_tick_or_is_dropped() {
    let summary = run_of(robot(""), &config(ON_THE_WALL));
    let image = summary.topic("/image").expect("a topic");
    let ticks = summary.node("detector").expect("a node").ticks;
    // On a busy machine the last ones come after the end, and wait in the queue.
    let left = image.published - image.dropped() - ticks;
    assert!(left <= image.depth.get() as u64, "{ticks} ticks: {image:?}");
}

const EXECUTORS: [&str; 4] = ["single", "multi:2", "multi:3", "events"];

/// Everything that may change what an executor plans.
const UPHEAVAL: &str = "\
    0.02 rate camera 333; 0.04 crash fusion; 0.05 crash lidar; 0.06 restart fusion; \
    0.07 restart lidar; 0.09 offset lidar 2; 0.1 takes camera busy 1; 0.12 depth /image 2; \
    0.13 hang closest 9; ";

#[test]
fn a_run_with_an_executor_comes_back_to_the_bit() {
    for executor in EXECUTORS {
        until(executor, &format!("{UPHEAVAL}{KNOBS}"), |ticks| {
            ticks.iter().all(|ticks| ticks.len() > 1)
        });
    }
}

#[test]
fn triggers_and_executors_go_on_under_the_other_clock() {
    let goes_on = |executor, list: &str, node: usize| {
        until(executor, &format!("{list}{KNOBS}{HAND_OVERS}"), |ticks| {
            let bounds = [0.0, 0.08, 0.14, 0.2].map(secs);
            let stretches = bounds.windows(2).map(|pair| pair[0]..pair[1]);
            let ticks = &ticks[node];
            stretches
                .into_iter()
                .all(|stretch| ticks.iter().any(|tick| stretch.contains(&tick.at)))
        });
    };
    goes_on("", "", 3);
    for executor in EXECUTORS {
        goes_on(executor, UPHEAVAL, 2);
    }
}

#[test]
fn the_threads_of_an_executor_are_as_many_as_it_says() {
    for (executor, most) in [("single", 1), ("events", 1), ("multi:2", 2)] {
        let costs = "takes camera 3; takes detector 4; takes lidar 5; takes closest 2";
        let config = config(&format!("{ON_THE_WALL}; {costs}"));
        let run = Run::record(&robot(executor), &config, Vec::new(), |_, _, _| {});
        let nodes = run.ticks.iter().enumerate().filter(|(node, _)| *node != 4);
        let ticks: Vec<_> = nodes.flat_map(|(_, ticks)| ticks).collect();
        let at_once = |at: Time| {
            let holds =
                |tick: &&&TickRecord| tick.at <= at && tick.ends.is_some_and(|end| at < end);
            ticks.iter().filter(holds).count()
        };
        let busiest = ticks.iter().map(|tick| at_once(tick.at)).max();
        assert_eq!(busiest, Some(most), "{executor}");
    }
}
