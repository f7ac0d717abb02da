//! A map for tests, without its background thread.

use std::sync::Arc;

use ratelab::Time;
use ratelab_cart_pole::{
    CartPole,
    verdict::{BALANCED, POLE_FELL},
};
use ratelab_experiment::{Config, Experiment, sweep::CellResult};
use ratelab_system::{System, Verdict};

use super::{CliffMap, Fill, KnobFocus, MapAxes};
use crate::tests::kit::config;

/// The map around a run of the cart-pole.
pub fn around(config: &Config) -> CliffMap {
    over(MapAxes::default(), config)
}

/// The map over `axes`.
pub fn over(axes: MapAxes, config: &Config) -> CliffMap {
    let system: Arc<dyn System> = Arc::new(CartPole::default());
    let experiment = Experiment::new(system.clone(), config).expect("experiment");
    let graph = experiment.observer().snapshot();
    let focus = KnobFocus::new(&*system, &graph);
    CliffMap::around(&system, &graph, &focus, axes, config).expect("a map")
}

/// All runs up to 15 Hz are finished: held from 8 Hz on, and every third at 6 and 7 Hz.
pub fn half_filled() -> CliffMap {
    let mut map = around(&config("seed 103; control-hz 7"));
    map.fill = Fill::nobody();
    map.outcomes.fill(None);
    map.done = 0;
    for index in 0..15 * map.sweep.seeds.len() {
        let (rate, seed) = (index / map.sweep.seeds.len(), index % map.sweep.seeds.len());
        let up = rate >= 7 || rate >= 5 && seed % 3 == 0;
        map.outcomes[index] = Some(outcome(up));
        map.done += 1;
    }
    map
}

fn outcome(up: bool) -> CellResult {
    let fell = Time::from_nanos(3_580_000_000);
    let end = Config::default().end;
    let (kind, sim_time) = if up {
        (BALANCED, end)
    } else {
        (POLE_FELL, fell)
    };
    CellResult {
        without_data: None,
        push_age: None,
        ages: Box::default(),
        cost: None,
        figures: Box::default(),
        verdict: Verdict::new(kind, sim_time),
        steps: 180,
        sim_time,
        mean_latency_s: Some(0.0779),
        dropped: vec![12, 0],
        state: [].into(),
    }
}
