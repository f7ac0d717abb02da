//! Plays chunks, and counts what was played.

use ratelab::{Flow, Node, NodeError, Payload, Publisher, Subscription, Tick, TickResult, Time};
use ratelab_metrics::Fields;
use ratelab_system::{FigureValue, RunTally, SystemFigure};

use super::{
    message::{CHUNK, Chunk, PLAYER_STEP, PlayerStep, Request},
    queue::{History, Planned, PlayQueue},
    settings::{ChunkSettings, PlanKind, replace},
};

/// An action as a message.
pub trait PlayedAction: Payload {
    /// Returns the action with these numbers.
    fn from_numbers(numbers: &[f32]) -> Self;
}

/// Plays chunks: one action in each of their periods.
pub struct Player<A> {
    chunks: Subscription<Chunk>,
    actions: Publisher<A>,
    steps: Publisher<PlayerStep>,
    /// Publisher of `/request`, if the policy ticks on that.
    requests: Option<Publisher<Request>>,
    /// Run time of the last request since the last chunk. A request or its answer may be lost:
    /// after the time of a whole chunk it asks again.
    asked: Option<Time>,
    settings: ChunkSettings,
    queue: PlayQueue,
    history: History,
    /// Whether it ever had a chunk.
    has_begun: bool,
    /// Whether it took a chunk since its last action.
    seam: bool,
    /// What the running tick publishes when it is over.
    pending: Option<(Planned, PlayerStep)>,
}

impl<A: PlayedAction> Player<A> {
    /// Creates a player without a chunk so far.
    pub fn new(
        settings: &ChunkSettings,
        chunks: Subscription<Chunk>,
        actions: Publisher<A>,
        steps: Publisher<PlayerStep>,
        requests: Option<Publisher<Request>>,
    ) -> Self {
        Self {
            chunks,
            actions,
            steps,
            requests,
            asked: None,
            settings: *settings,
            queue: PlayQueue::new(settings.shape, settings.play, settings.merge),
            history: History::new(settings.shape.width),
            has_begun: false,
            seam: false,
            pending: None,
        }
    }

    /// Takes the chunks that were delivered since the last tick.
    fn take(&mut self, tick: &mut Tick, step: &mut PlayerStep) {
        let now = tick.now();
        while let Some(message) = tick.read_next(&mut self.chunks) {
            let error = delay_error(&message.data, now);
            step.most_delay_error = match step.taken {
                0.0 => error,
                _ => error.max(step.most_delay_error),
            };
            step.taken += 1.0;
            step.delay_errors += error;
            self.queue.take(message, now, &self.history);
        }
        self.has_begun |= step.taken > 0.0;
        self.seam |= step.taken > 0.0;
    }

    /// Asks for a chunk if few actions are left, or none.
    fn ask(&mut self, tick: &mut Tick, took: bool) {
        let now = tick.now();
        let (Some(requests), Some(share)) = (&self.requests, self.settings.refill) else {
            return;
        };
        let left = self.queue.left(now, &self.history);
        let (horizon, lasts) = (self.settings.horizon, self.settings.duration());
        let waits = |asked: &Time| !took && *asked + lasts > now;
        self.asked = self.asked.filter(waits);
        if left <= share * horizon.get() as f64 && self.asked.is_none() {
            self.asked = Some(now);
            tick.publish_new(requests, Request { left });
        }
    }

    /// Returns what is known of an action before it is published.
    fn played(&self, planned: &Planned) -> PlayerStep {
        let newest = self.queue.newest();
        let as_planned = newest
            .filter(|taken| taken.chunk.plan != PlanKind::Hold)
            .map_or(0, |taken| taken.as_planned(&self.history));
        let last = self.history.last.as_ref();
        PlayerStep {
            played: 1.0,
            predicted: as_planned as f64 * self.settings.shape.period.as_nanos() as f64,
            change: last.map_or(f64::NAN, |last| greatest_change(last, &planned.action)),
            ..PlayerStep::default()
        }
    }
}

/// Returns how far the number that changes most is from what it was.
fn greatest_change(before: &[f32], now: &[f32]) -> f64 {
    let changes = before.iter().zip(now);
    changes
        .map(|(before, now)| (f64::from(*now) - f64::from(*before)).abs())
        .fold(0.0, f64::max)
}

/// Returns the delay of a chunk that a tick at `now` takes, less the expected one (ns).
fn delay_error(chunk: &Chunk, now: Time) -> f64 {
    let expected = chunk.made + chunk.expected;
    let late = now.since(expected).as_nanos() as f64;
    late - expected.since(now).as_nanos() as f64
}

impl<A: PlayedAction> Node for Player<A> {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        let now = tick.now();
        let mut step = PlayerStep::default();
        self.queue.advance();
        self.take(tick, &mut step);
        self.ask(tick, step.taken > 0.0);
        let planned = self.queue.action(now, &self.history);
        if planned.is_none() && self.has_begun {
            step.stalls = 1.0;
        }
        if let Some(newest) = self.queue.newest() {
            step.chunk = newest.seq as f64;
            step.index = newest.place_by_time(now) as f64;
        }
        if step.taken + step.stalls > 0.0 {
            tick.publish_at_once(&self.steps, step);
        }
        if let Some(planned) = &planned {
            let step = PlayerStep {
                chunk: step.chunk,
                index: step.index,
                ..self.played(planned)
            };
            self.pending = Some((planned.clone(), step));
            tick.publish_from(
                &self.actions,
                A::from_numbers(&planned.action),
                planned.cause(),
            );
        }
        let action = planned.map(|planned| planned.action);
        self.history.begin(now, action);
        Ok(Flow::Continue)
    }

    fn apply(&mut self, tick: &mut Tick) -> TickResult {
        if let Some((planned, mut step)) = self.pending.take() {
            self.history.publish(planned.action.clone());
            step.used = planned.take_parts() as f64;
            step.seam = f64::from(std::mem::take(&mut self.seam));
            tick.publish_new(&self.steps, step);
        }
        Ok(Flow::Continue)
    }

    fn set_parameter(&mut self, name: &str, value: &str, _: Time) -> Result<String, NodeError> {
        match name {
            "play" => Ok(replace(&mut self.queue.play, value)?),
            "merge" => Ok(self.queue.set_merge(value)?),
            _ => Err(format!("the player has no parameter {name:?}").into()),
        }
    }

    /// It has forgotten its chunks, what it played, and its settings.
    fn restart(&mut self) -> Result<(), NodeError> {
        self.queue = PlayQueue::new(self.settings.shape, self.settings.play, self.settings.merge);
        self.has_begun = false;
        self.asked = None;
        self.history.restart(self.pending.take().is_some());
        Ok(())
    }
}

/// Adds up what the policy computed and what the player did.
#[derive(Debug, Default)]
pub struct ChunkTally {
    /// The numbers of an action.
    width: usize,
    computed: u64,
    used: u64,
    stalls: u64,
    taken: u64,
    delay_errors: f64,
    most_delay_error: f64,
    played: u64,
    predicted: f64,
    seams: ActionChanges,
    steps: ActionChanges,
}

/// The changes of the action from one tick to the next.
#[derive(Debug, Default)]
struct ActionChanges(Vec<f64>);

impl ActionChanges {
    fn mean(&self) -> Option<f64> {
        mean(self.0.iter().sum(), self.0.len() as u64)
    }

    /// Returns the ⌈0.99 n⌉-th smallest.
    fn p99(&self) -> Option<f64> {
        let mut sorted = self.0.clone();
        let place = (99 * sorted.len()).div_ceil(100).checked_sub(1)?;
        let (_, p99, _) = sorted.select_nth_unstable_by(place, f64::total_cmp);
        Some(*p99)
    }
}

fn mean(sum: f64, count: u64) -> Option<f64> {
    (count > 0).then(|| sum / count as f64)
}

impl ChunkTally {
    /// Creates one for actions of `width` numbers.
    pub fn new(width: usize) -> Self {
        Self {
            width,
            ..Self::default()
        }
    }

    fn step(&mut self, step: &PlayerStep) {
        if step.taken > 0.0 {
            self.most_delay_error = match self.taken {
                0 => step.most_delay_error,
                _ => step.most_delay_error.max(self.most_delay_error),
            };
            self.taken += step.taken as u64;
            self.delay_errors += step.delay_errors;
        }
        self.stalls += step.stalls as u64;
        self.used += step.used as u64;
        if step.played > 0.0 {
            self.played += 1;
            self.predicted += step.predicted;
            let changes = if step.seam > 0.0 {
                &mut self.seams
            } else {
                &mut self.steps
            };
            changes
                .0
                .extend(Some(step.change).filter(|change| !change.is_nan()));
        }
    }
}

impl RunTally for ChunkTally {
    fn topics(&self) -> &'static [&'static str] {
        &[CHUNK, PLAYER_STEP]
    }

    fn message(&mut self, topic: &str, row: &[f64]) {
        match topic {
            CHUNK => {
                let numbers = row.len().saturating_sub(Chunk::HEAD.len());
                self.computed += (numbers / self.width.max(1)) as u64;
            }
            _ => {
                if let Some(step) = PlayerStep::from_row(row) {
                    self.step(&step);
                }
            }
        }
    }

    fn figures(&self) -> Vec<SystemFigure> {
        let (count, number) = (FigureValue::Count, FigureValue::Number);
        let ms = |ns: f64| ns / 1e6;
        let most = (self.taken > 0).then_some(ms(self.most_delay_error));
        let mean_error = mean(self.delay_errors, self.taken).map(ms);
        let of_chunks = |name, text, value| SystemFigure {
            block: Some("chunks"),
            name,
            text,
            value,
        };
        let predicted = number(mean(self.predicted, self.played).map(ms));
        vec![
            of_chunks("computed", "{} actions computed", count(self.computed)),
            of_chunks("used", "{} used", count(self.used)),
            SystemFigure {
                block: None,
                name: "stalls",
                text: "{} stalls",
                value: count(self.stalls),
            },
            of_chunks("predicted_ms", "{} ms of the age predicted", predicted),
            of_chunks("seam_mean", "", number(self.seams.mean())),
            of_chunks("seam_p99", "seams p99 {}", number(self.seams.p99())),
            of_chunks("step_mean", "", number(self.steps.mean())),
            of_chunks("step_p99", "other steps p99 {}", number(self.steps.p99())),
            of_chunks(
                "expect_error_mean_ms",
                "delay less the expected one {} ms",
                number(mean_error),
            ),
            of_chunks("expect_error_max_ms", "", number(most)),
        ]
    }
}
