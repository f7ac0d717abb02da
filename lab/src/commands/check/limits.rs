//! The limits of a graph, compared with the figures of its runs.

use ratelab_system::{FigureLimit, Verdict};
use serde_json::{Map, Value};

use super::results::{LimitResult, Miss, Results};
use crate::{error::Error, program::Program};

/// The figures of a run.
pub struct CheckedRun {
    pub seed: u64,
    pub verdict: Verdict,
    pub metrics: Map<String, Value>,
    /// The chains without data, each with the reason.
    pub without_data: Vec<String>,
}

impl CheckedRun {
    /// Returns why its verdict counts as a missed limit, if it does: it is lost, or a chain has no
    /// data.
    fn miss(&self) -> Option<Miss> {
        let verdict = self.verdict.is_lost().then(|| self.verdict.to_string());
        let reasons: Vec<String> = verdict
            .into_iter()
            .chain(self.without_data.iter().cloned())
            .collect();
        (!reasons.is_empty()).then(|| Miss {
            seed: self.seed,
            text: reasons.join("; "),
        })
    }
}

/// Compares the limits of the graph of `program` with its `runs`; the verdict is a limit as well,
/// and with it that data come through each chain.
///
/// # Errors
/// [`Error::BadInput`] for a limit of a figure that the runs do not have.
pub fn compare(program: &Program, runs: &[CheckedRun]) -> Result<Results, Error> {
    let verdict = LimitResult {
        limit: "verdict".to_owned(),
        misses: runs.iter().filter_map(CheckedRun::miss).collect(),
    };
    let limits = program
        .system
        .about()
        .limits
        .iter()
        .map(|limit| compared(program, limit, runs));
    let limits = [Ok(verdict)].into_iter().chain(limits);
    Ok(Results {
        graph: program.system.name().to_owned(),
        runs: runs.len(),
        limits: limits.collect::<Result<_, _>>()?,
    })
}

/// One limit, and the runs that miss it. What was not measured is missed.
fn compared(
    program: &Program,
    limit: &FigureLimit,
    runs: &[CheckedRun],
) -> Result<LimitResult, Error> {
    let mut misses = Vec::new();
    for run in runs {
        let text = match figure(&run.metrics, &limit.figure) {
            Some(Value::Number(number)) => {
                let kept = number
                    .as_f64()
                    .is_some_and(|value| limit.bound.holds(value));
                (!kept).then(|| number.to_string())
            }
            Some(Value::Null) => Some("not measured".to_owned()),
            _ => {
                let (figure, [line, column]) = (&limit.figure, limit.place);
                let file = program.file.iter();
                let place: String = file
                    .map(|file| format!("{file}:{line}:{column}: "))
                    .collect();
                let text = format!(
                    "{place}limit {figure:?}: no figure of a run: expected a number that run --json prints, such as nodes.NODE.overruns"
                );
                return Err(Error::BadInput(text));
            }
        };
        misses.extend(text.map(|text| Miss {
            seed: run.seed,
            text,
        }));
    }
    Ok(LimitResult {
        limit: limit.to_string(),
        misses,
    })
}

/// Returns the figure at `path` within `metrics`: names with dots between, and within some names.
fn figure<'m>(metrics: &'m Map<String, Value>, path: &str) -> Option<&'m Value> {
    metrics.iter().find_map(|(name, value)| {
        let rest = path.strip_prefix(name.as_str())?;
        match value {
            _ if rest.is_empty() => Some(value),
            Value::Object(inner) => figure(inner, rest.strip_prefix('.')?),
            _ => None,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_figure_is_found_by_its_names_with_dots_between_and_within() {
        let json = json!({ "a": 1, "nodes": { "x": { "n": 2 }, "x.y": { "n": 3 } } });
        let metrics = json.as_object().expect("an object");
        let of = |path| figure(metrics, path).and_then(Value::as_u64);
        assert_eq!(of("a"), Some(1));
        assert_eq!(of("nodes.x.n"), Some(2));
        assert_eq!(of("nodes.x.y.n"), Some(3));
        assert_eq!([of("nodes.x.m"), of("nodes"), of("a.n"), of("")], [None; 4]);
    }
}
