//! The sweep as curves over the fastest knob, in a file for the rerun viewer.

use std::{
    io,
    path::{Path, PathBuf},
};

use ratelab::KnobKind;
use ratelab_recording::{
    RecordError,
    rrd::{
        RecordingFile,
        blueprint::{Properties, ViewerLayout},
        scene::{
            lines::{self, Line},
            palette,
        },
        schema::SWEEP_APPLICATION,
    },
};
use ratelab_study::system::names::key;
use rerun::{
    RecordingStream, RecordingStreamBuilder, RecordingStreamResult, Scalars, TimeColumn,
    TimelineName,
    blueprint::{ContainerLike, TimeSeriesView, Vertical},
};

use super::{
    figures,
    summary::{RowSummary, SweepSummary},
};
use crate::{
    error::Error,
    output::{record_error, write_error},
};

/// A figure of a row, if available.
type PlotFigure = fn(&RowSummary) -> Option<f64>;

/// A plot: entity, title and figure.
type Plot = (&'static str, String, PlotFigure);

/// The plots, from top to bottom.
fn plots(summary: &SweepSummary) -> Vec<Plot> {
    let (good, noun) = (&summary.good, summary.main.noun());
    let mut plots: Vec<Plot> = vec![(
        "survival",
        format!("{good} runs over the {noun} (%)"),
        |row| row.survival.share().map(|share| share * 100.0),
    )];
    if let Some((_, meter)) = summary.sweep.system.latency() {
        let title = format!("mean {meter} latency (ms)");
        plots.push(("latency", title, figures::LATENCY.value));
        let title = "mean push age in the last second (ms)";
        plots.push(("age", title.to_owned(), figures::AGE.value));
    }
    if summary.rows().iter().any(|row| row.theory.growth.is_some()) {
        let title = "growth of a small deviation by linear theory (1/s): above 0 is no fall yet";
        plots.push(("growth", title.to_owned(), |row| row.theory.growth));
    }
    plots
}

/// The line at zero growth.
const ZERO: &str = "growth/zero";

/// A file for the curves.
pub struct Record {
    path: PathBuf,
    file: RecordingFile,
}

impl Record {
    /// Creates the file; refuses an existing one.
    pub fn create(path: &Path) -> Result<Self, Error> {
        let path = path.to_owned();
        match RecordingFile::create(&path) {
            Ok(file) => Ok(Self { path, file }),
            Err(why) => Err(record_error(RecordError { path, why })),
        }
    }

    /// Writes the curves of `summary`, with a layout for the viewer.
    pub fn write(self, summary: &SweepSummary) -> Result<(), Error> {
        let written = self.send(summary).map_err(io::Error::other);
        written
            .and_then(|()| self.file.complete())
            .map(drop)
            .map_err(|why| write_error(&self.path, why))
    }

    fn send(&self, summary: &SweepSummary) -> RecordingStreamResult<()> {
        let rec = RecordingStreamBuilder::new(SWEEP_APPLICATION)
            .enabled(true)
            .recording_name(format!("{} of {} runs", summary.runs, summary.cells))
            .buffered()?;
        rec.set_sink(Box::new(self.file.clone()));
        let (axis, plots) = (SweepTimeline::of(summary), plots(summary));
        layout(&rec, summary, &axis, &plots)?;
        for (plot, _, figure) in &plots {
            curves(&rec, summary, &axis, plot, *figure)?;
        }
        if plots.iter().any(|(plot, ..)| *plot == "growth") {
            let rows = summary.groups().next().unwrap_or_default();
            lines::begin(&rec, ZERO, &[Line::new("zero", palette::GREY, 1.0)])?;
            curve(&rec, ZERO, &axis, rows, |_| Some(0.0))?;
        }
        let _ = rec.flush_blocking();
        rec.disconnect(); // Nothing may be written after the end of the file.
        Ok(())
    }
}

/// A curve for each group, each in its own colour.
fn curves(
    rec: &RecordingStream,
    summary: &SweepSummary,
    axis: &SweepTimeline,
    plot: &str,
    figure: PlotFigure,
) -> RecordingStreamResult<()> {
    let groups = summary.groups();
    let looks = palette::series(groups.len()).zip(palette::widths(groups.len()));
    for (rows, (colour, width)) in groups.zip(looks) {
        let name = name(summary, rows);
        let entity = format!("{plot}/{}", name.replace([' ', '.'], "_"));
        lines::begin(rec, entity.as_str(), &[Line::new(name, colour, width)])?;
        curve(rec, &entity, axis, rows, figure)?;
    }
    Ok(())
}

/// The rows with this figure, over the fastest knob.
fn curve(
    rec: &RecordingStream,
    entity: &str,
    axis: &SweepTimeline,
    rows: &[RowSummary],
    figure: PlotFigure,
) -> RecordingStreamResult<()> {
    let points = rows.iter().enumerate();
    let points = points.filter_map(|(index, row)| Some((axis.place(index, row), figure(row)?)));
    let mut points: Vec<(i64, f64)> = points.collect();
    points.sort_by_key(|(place, _)| *place);
    let (places, values): (Vec<i64>, Vec<f64>) = points.into_iter().unzip();
    if places.is_empty() {
        return Ok(());
    }
    let columns = Scalars::new(values).columns_of_unit_batches()?;
    rec.send_columns(
        entity,
        [TimeColumn::new_sequence(axis.name, places)],
        columns,
    )
}

/// The fastest knob as a timeline of the viewer, which supports whole numbers only.
/// Messages are numbered.
struct SweepTimeline {
    name: TimelineName,
    /// Timeline units per unit of the knob.
    units: f64,
}

impl SweepTimeline {
    /// The coarsest timeline that represents every value.
    fn of(summary: &SweepSummary) -> Self {
        let name = key(&summary.main.name);
        let fits = |units: f64| {
            let values = summary.rows().iter().map(RowSummary::number);
            let mut numbers = values.filter(|value| !value.is_nan());
            numbers.all(|value| (value * units).fract() == 0.0)
        };
        let suffixes = match summary.main.kind {
            KnobKind::Rate => ["hz", "millihz", "microhz"],
            _ => ["", "_thousandths", "_millionths"],
        };
        let (unit, units) = match () {
            () if fits(1.0) => (suffixes[0], 1.0),
            () if fits(1e3) => (suffixes[1], 1e3),
            () => (suffixes[2], 1e6),
        };
        let name = match name.strip_suffix(suffixes[0]) {
            Some(stem) => format!("{stem}{unit}"),
            None => name,
        };
        let name = TimelineName::try_new(name).unwrap_or_else(|_| "value".into());
        Self { name, units }
    }

    fn place(&self, index: usize, row: &RowSummary) -> i64 {
        let number = row.number();
        if number.is_nan() {
            return index as i64;
        }
        (number * self.units).round() as i64
    }
}

/// The common values of a group.
fn name(summary: &SweepSummary, rows: &[RowSummary]) -> String {
    summary.slower(rows, |_| true, |column, value| column.with_unit(&value))
}

fn layout(
    rec: &RecordingStream,
    summary: &SweepSummary,
    axis: &SweepTimeline,
    plots: &[Plot],
) -> RecordingStreamResult<()> {
    let mut properties = Properties::default();
    let names: Vec<String> = summary.groups().map(|rows| name(summary, rows)).collect();
    let key = match names.len() {
        1 => names.concat(),
        _ => palette::key(names.iter().map(String::as_str)),
    };
    let views = plots.iter().map(|(plot, title, _)| -> ContainerLike {
        let view = TimeSeriesView::new(format!("{title}: {key}")).with_origin(*plot);
        let range = (*plot == "survival").then_some([-5.0, 105.0]);
        properties.plot(view, range)
    });
    let layout = ViewerLayout {
        root: Vertical::new(views.collect::<Vec<_>>()).into(),
        timeline: axis.name.as_str(),
        properties,
    };
    layout.send(rec)
}

#[cfg(test)]
mod tests {
    use std::{fs::File, io::BufReader, ops::ControlFlow};

    use std::sync::Arc;

    use ratelab_cart_pole::CartPole;
    use ratelab_study::experiment::{
        Config,
        sweep::{Sweep, SweepAxis, all_cores},
    };
    use rerun::{
        Scalars,
        external::re_log_encoding::DecoderApp,
        log::{Chunk, LogMsg},
    };

    use super::{Record, SweepSummary};

    /// The values of all scalars in a file, by entity, with their positions on the
    /// timeline.
    fn read(path: &std::path::Path, timeline: &'static str) -> Vec<(String, Vec<i64>, Vec<f64>)> {
        let file = BufReader::new(File::open(path).expect("a file"));
        let messages = DecoderApp::decode_eager(file).expect("a recording");
        let chunks = messages.filter_map(|message| match message.expect("whole") {
            LogMsg::ArrowMsg(_, data) => Some(Chunk::from_arrow_msg(&data).expect("a chunk")),
            _ => None,
        });
        let scalars = Scalars::descriptor_scalars().component;
        let rows = chunks.filter_map(|chunk| {
            let places = chunk.timelines().get(&timeline.into())?;
            let places = places.times_raw().to_vec();
            let values = chunk.iter_slices::<f64>(scalars).flatten().copied();
            let values: Vec<f64> = values.collect();
            (!values.is_empty()).then(|| (chunk.entity_path().to_string(), places, values))
        });
        rows.collect()
    }

    #[test]
    fn curves_hold_the_figures_over_their_rates() {
        let rates = SweepAxis::parse(CartPole::KNOBS, "control-hz", "5..10:2.5");
        let sweep = Sweep {
            axes: vec![rates.expect("rates")],
            seeds: vec![0, 1],
            ..Sweep::of(Arc::new(CartPole::default()), Config::default())
        };
        let swept = sweep.run(all_cores(), |_, _| ControlFlow::Continue(()));
        let swept = swept.expect("swept");
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("sweep.rrd");
        let record = Record::create(&path).expect("a new file");
        let summary = SweepSummary::of(&swept, true).expect("a summary");
        record.write(&summary).expect("written");
        let curves = read(&path, "control_millihz");
        let curve = |name: &str| {
            let mut curves = curves.iter();
            let curve = curves.find(|(entity, ..)| entity.contains(name));
            curve.unwrap_or_else(|| panic!("no {name} in {curves:?}"))
        };
        let (_, places, shares) = curve("survival");
        assert_eq!(places, &[5_000, 7_500, 10_000]);
        assert_eq!(shares, &[0.0, 100.0, 100.0]);
        let (_, _, growth) = curve("growth/scripted");
        assert!((growth[2] - 1.8178).abs() < 1e-4, "{growth:?}");
        assert_eq!(curve("growth/zero").2, [0.0; 3]);
        assert_eq!(curve("latency").1.len(), 3);
        assert!(Record::create(&path).is_err(), "it would be overwritten");
    }
}
