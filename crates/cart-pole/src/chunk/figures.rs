//! What a run came to, of its chunks.

use ratelab_metrics::Fields;
use ratelab_system::{FigureValue, RunTally, SystemFigure};

use super::message::{CHUNK, Chunk, PLAYER_STEP, PlayerStep};

/// Adds up what the policy computed and what the player did.
#[derive(Debug, Default)]
pub(crate) struct ChunkTally {
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
            CHUNK => self.computed += row.len().saturating_sub(Chunk::HEAD) as u64,
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
