//! The sweep as curves over the fastest knob, in a file for the rerun viewer.

use std::path::{Path, PathBuf};

use ratelab::KnobKind;
use ratelab_recording::{
    RecordError,
    rrd::{Curve, CurvePlot, CurvePlots, RecordingFile},
};
use ratelab_system::{file::Provisional, names::key};

use super::summary::{self, RowSummary, SweepSummary};
use crate::{
    error::Error,
    output::{record_error, write_error},
};

/// A figure of a row, if available.
type PlotFigure = fn(&RowSummary) -> Option<f64>;

/// A plot: entity, title and figure.
type Plot = (&'static str, String, PlotFigure);

/// The entities of two plots.
const SURVIVAL: &str = "survival";
const GROWTH: &str = "growth";

/// Returns the plots, from top to bottom.
fn plots(summary: &SweepSummary) -> Vec<Plot> {
    let (good, noun) = (&summary.good, summary.main.noun());
    let mut plots: Vec<Plot> = vec![(
        SURVIVAL,
        format!("{good} runs over the {noun} (%)"),
        |row| row.survival.share().map(|share| share * 100.0),
    )];
    if let Some((_, meter)) = summary.sweep.system.latency() {
        let title = format!("mean {meter} latency (ms)");
        plots.push(("latency", title, summary::LATENCY.value));
        let title = "mean push age in the last second (ms)";
        plots.push(("age", title.to_owned(), summary::AGE.value));
    }
    if summary.rows().iter().any(|row| row.theory.growth.is_some()) {
        let title = "growth of a small deviation by linear theory (1/s): above 0 is no fall yet";
        plots.push((GROWTH, title.to_owned(), |row| row.theory.growth));
    }
    plots
}

/// A file for the curves, which is removed unless they are written.
pub struct Record {
    path: PathBuf,
    file: RecordingFile,
    made: Provisional,
}

impl Record {
    /// Creates the file; refuses an existing one.
    pub fn create(path: &Path) -> Result<Self, Error> {
        let path = path.to_owned();
        match Provisional::new(&path, RecordingFile::create) {
            Ok((made, file)) => Ok(Self { path, file, made }),
            Err(why) => Err(record_error(RecordError { path, why })),
        }
    }

    /// Writes the curves of `summary`, with a layout for the viewer.
    pub fn write(self, summary: &SweepSummary) -> Result<(), Error> {
        let written = curves(summary).write(self.file);
        written.map_err(|why| write_error(&self.path, why))?;
        self.made.keep();
        Ok(())
    }
}

/// Returns the curves of `summary`: a plot for each figure, a curve for each group.
fn curves(summary: &SweepSummary) -> CurvePlots {
    let axis = SweepTimeline::new(summary);
    let plots = plots(summary).into_iter().map(|(entity, title, figure)| {
        let curves = summary.groups().map(|rows| {
            let name = summary.slower(rows, |_| true, |column, value| column.with_unit(&value));
            (name, axis.curve(rows, figure))
        });
        let first = summary.groups().next().unwrap_or_default();
        let zero = axis.curve(first, |_| (entity == GROWTH).then_some(0.0));
        CurvePlot {
            entity,
            title,
            range: (entity == SURVIVAL).then_some([-5.0, 105.0]),
            zero: zero.into_iter().map(|(place, _)| place).collect(),
            curves: curves.collect(),
        }
    });
    CurvePlots {
        name: format!("{} of {} runs", summary.runs, summary.cells),
        plots: plots.collect(),
        axis: axis.name,
    }
}

/// The fastest knob as a timeline of the viewer, which supports whole numbers only.
/// Messages are numbered.
struct SweepTimeline {
    name: String,
    /// Timeline units per unit of the knob.
    units: f64,
}

impl SweepTimeline {
    /// Creates the coarsest timeline that represents every value.
    fn new(summary: &SweepSummary) -> Self {
        let name = key(&summary.main.name);
        let fits = |units: f64| {
            summary
                .rows()
                .iter()
                .map(RowSummary::number)
                .filter(|value| !value.is_nan())
                .all(|value| (value * units).fract() == 0.0)
        };
        let suffixes = match summary.main.kind {
            KnobKind::Rate => ["hz", "millihz", "microhz"],
            _ => ["", "_thousandths", "_millionths"],
        };
        let (unit, units) = if fits(1.0) {
            (suffixes[0], 1.0)
        } else if fits(1e3) {
            (suffixes[1], 1e3)
        } else {
            (suffixes[2], 1e6)
        };
        let name = match name.strip_suffix(suffixes[0]) {
            Some(stem) => format!("{stem}{unit}"),
            None => name,
        };
        Self { name, units }
    }

    /// Returns the rows with this figure.
    fn curve(&self, rows: &[RowSummary], figure: impl Fn(&RowSummary) -> Option<f64>) -> Curve {
        let mut points: Curve = rows
            .iter()
            .enumerate()
            .filter_map(|(index, row)| Some((self.place(index, row), figure(row)?)))
            .collect();
        points.sort_by_key(|(place, _)| *place);
        points
    }

    fn place(&self, index: usize, row: &RowSummary) -> i64 {
        let number = row.number();
        if number.is_nan() {
            return index as i64;
        }
        (number * self.units).round() as i64
    }
}

#[cfg(test)]
mod tests {
    use std::{ops::ControlFlow, sync::Arc};

    use ratelab_cart_pole::CartPole;
    use ratelab_experiment::{
        Config,
        sweep::{Sweep, SweepAxis, all_cores},
    };

    use super::{Record, SweepSummary, curves};

    #[test]
    fn curves_hold_the_figures_over_their_rates() {
        let rates = SweepAxis::parse(CartPole::KNOBS, "control-hz", "5..10:2.5");
        let sweep = Sweep {
            axes: vec![rates.expect("rates")],
            seeds: vec![0, 1],
            ..Sweep::new(Arc::new(CartPole::default()), Config::default())
        };
        let swept = sweep.run(all_cores(), |_, _| ControlFlow::Continue(()));
        let summary = SweepSummary::new(&swept.expect("swept"), true).expect("a summary");
        let drawn = curves(&summary);
        assert_eq!(drawn.axis, "control_millihz");
        let plot = |name: &str| {
            let mut plots = drawn.plots.iter();
            plots.find(|plot| plot.entity == name).expect(name)
        };
        let [(_, shares)] = &plot("survival").curves[..] else {
            panic!("more than one group");
        };
        assert_eq!(shares[..], [(5_000, 0.0), (7_500, 100.0), (10_000, 100.0)]);
        let (name, growth) = &plot("growth").curves[0];
        assert!(name.contains("scripted"), "{name}");
        assert!((growth[2].1 - 1.8178).abs() < 1e-4, "{growth:?}");
        assert_eq!(plot("growth").zero, [5_000, 7_500, 10_000]);
        assert_eq!(plot("latency").curves[0].1.len(), 3);
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("sweep.rrd");
        let record = Record::create(&path).expect("a new file");
        record.write(&summary).expect("written");
        assert!(Record::create(&path).is_err(), "it would be overwritten");
    }
}
