//! The sweep as curves over the control rate, in a file for the rerun viewer.

use std::{
    io,
    path::{Path, PathBuf},
};

use rerun::{
    RecordingStream, RecordingStreamBuilder, RecordingStreamResult, Scalars, TimeColumn,
    blueprint::{ContainerLike, TimeSeriesView, Vertical},
};

use super::summary::{RateSummary, SweepSummary};
use crate::{
    error::Error,
    output::{record_error, write_error},
    recording::{
        RecordingFile,
        blueprint::{Properties, ViewerLayout},
        scene::{
            lines::{self, Line},
            palette,
        },
        schema::SWEEP_APPLICATION,
    },
};

/// A figure of a row, if it has one.
type PlotFigure = fn(&RateSummary) -> Option<f64>;

/// What is drawn, one plot under the other: entity, title, and the figure.
const PLOTS: [(&str, &str, PlotFigure); 3] = [
    (
        "survival",
        "balanced runs over the control rate (%)",
        |row| row.share().map(|share| share * 100.0),
    ),
    ("latency", "mean sense→act latency (ms)", |row| {
        row.mean_latency_s.map(|s| s * 1e3)
    }),
    (
        "growth",
        "growth of a small deviation by linear theory (1/s): above 0 is no fall yet",
        |row| row.growth,
    ),
];

/// The line at zero growth.
const ZERO: &str = "growth/zero";

/// A file that the curves go to.
pub struct Record {
    path: PathBuf,
    file: RecordingFile,
}

impl Record {
    /// Makes the file, which must not exist yet.
    pub fn create(path: &Path) -> Result<Self, Error> {
        let file = RecordingFile::create(path).map_err(|why| record_error(path, &why))?;
        let path = path.to_owned();
        Ok(Self { path, file })
    }

    /// Writes the curves of `summary`, and the layout to see them in.
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
        let axis = RateAxis::of(summary);
        layout(&rec, summary, &axis)?;
        for (plot, _, figure) in PLOTS {
            curves(&rec, summary, &axis, plot, figure)?;
        }
        let rates = summary.groups().next().unwrap_or_default();
        lines::begin(&rec, ZERO, &[Line::new("zero", palette::GREY, 1.0)])?;
        curve(&rec, ZERO, &axis, rates, |_| Some(0.0))?;
        let _ = rec.flush_blocking();
        rec.disconnect(); // Nothing may follow the end of the file.
        Ok(())
    }
}

/// One curve for each group, in colours of their own.
fn curves(
    rec: &RecordingStream,
    summary: &SweepSummary,
    axis: &RateAxis,
    plot: &str,
    figure: PlotFigure,
) -> RecordingStreamResult<()> {
    let groups = summary.groups();
    let looks = palette::series(groups.len()).zip(palette::widths(groups.len()));
    for (rows, (colour, width)) in groups.zip(looks) {
        let Some(name) = rows.first().map(name) else {
            continue;
        };
        let entity = format!("{plot}/{}", name.replace([' ', '.'], "_"));
        lines::begin(rec, &entity, &[Line::new(name, colour, width)])?;
        curve(rec, &entity, axis, rows, figure)?;
    }
    Ok(())
}

/// The rows that have such a figure, over their control rates.
fn curve(
    rec: &RecordingStream,
    entity: &str,
    axis: &RateAxis,
    rows: &[RateSummary],
    figure: PlotFigure,
) -> RecordingStreamResult<()> {
    let points = rows.iter().filter_map(|row| Some((row, figure(row)?)));
    let mut points: Vec<(i64, f64)> = points
        .map(|(row, value)| (axis.place(row), value))
        .collect();
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

/// The control rate as what the viewer calls a timeline, which knows whole
/// numbers only.
struct RateAxis {
    name: &'static str,
    /// Units in a hertz.
    units: f64,
}

impl RateAxis {
    /// The coarsest that holds every rate.
    fn of(summary: &SweepSummary) -> Self {
        let fits = |units: f64| {
            let mut rates = summary.sweep.control_hz.iter();
            rates.all(|hz| (hz.get() * units).fract() == 0.0)
        };
        let (name, units) = match () {
            () if fits(1.0) => ("control_hz", 1.0),
            () if fits(1e3) => ("control_millihz", 1e3),
            () => ("control_microhz", 1e6),
        };
        Self { name, units }
    }

    fn place(&self, row: &RateSummary) -> i64 {
        (row.cell.control_hz.get() * self.units).round() as i64
    }
}

fn name(row: &RateSummary) -> String {
    let cell = &row.cell;
    format!(
        "{} sensor {} depth {}",
        cell.policy.name(),
        cell.sensor_hz,
        cell.queue_depth
    )
}

fn layout(
    rec: &RecordingStream,
    summary: &SweepSummary,
    axis: &RateAxis,
) -> RecordingStreamResult<()> {
    let mut properties = Properties::default();
    let names: Vec<String> = summary
        .groups()
        .filter_map(|rows| rows.first().map(name))
        .collect();
    let key = match names.len() {
        1 => names.concat(),
        _ => palette::key(names.iter().map(String::as_str)),
    };
    let views = PLOTS.map(|(plot, title, _)| -> ContainerLike {
        let view = TimeSeriesView::new(format!("{title}: {key}")).with_origin(plot);
        let range = (plot == "survival").then_some([-5.0, 105.0]);
        properties.plot(view, range)
    });
    let layout = ViewerLayout {
        root: Vertical::new(views).into(),
        timeline: axis.name,
        properties,
    };
    layout.send(rec)
}

#[cfg(test)]
mod tests {
    use std::{fs::File, io::BufReader, ops::ControlFlow};

    use ratelab::experiment::{
        Config,
        sweep::{Axis, Sweep, all_cores},
    };
    use ratelab::runtime::Hz;
    use rerun::{
        Scalars,
        external::re_log_encoding::DecoderApp,
        log::{Chunk, LogMsg},
    };

    use super::{Record, SweepSummary};
    use crate::sweep::theory::Theory;

    /// The values of all scalars in a file, by entity, beside their places.
    fn read(path: &std::path::Path, timeline: &'static str) -> Vec<(String, Vec<i64>, Vec<f64>)> {
        let file = BufReader::new(File::open(path).expect("a file"));
        let messages = DecoderApp::decode_eager(file).expect("a recording");
        let chunks = messages.filter_map(|message| match message.expect("whole") {
            LogMsg::ArrowMsg(_, data) => Some(Chunk::from_arrow_msg(&data).expect("a chunk")),
            _ => None,
        });
        let scalars = Scalars::descriptor_scalars().component;
        let rows = chunks.filter_map(|chunk| {
            let places = chunk
                .timelines()
                .get(&timeline.into())?
                .times_raw()
                .to_vec();
            let values = chunk.iter_slices::<f64>(scalars).flatten().copied();
            let values: Vec<f64> = values.collect();
            (!values.is_empty()).then(|| (chunk.entity_path().to_string(), places, values))
        });
        rows.collect()
    }

    #[test]
    fn curves_hold_the_figures_over_their_rates() {
        let sweep = Sweep {
            control_hz: "5..10:2.5".parse::<Axis<Hz>>().expect("rates").into(),
            seeds: vec![0, 1],
            ..Sweep::of(Config::default())
        };
        let swept = sweep.run(all_cores(), |_, _| ControlFlow::Continue(()));
        let swept = swept.expect("swept");
        let theory = Theory::of(&sweep, true).expect("theory");
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("sweep.rrd");
        let record = Record::create(&path).expect("a new file");
        record
            .write(&SweepSummary::of(&swept, &theory))
            .expect("written");
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
