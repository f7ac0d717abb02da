//! Curves over something other than run time, in a file for the viewer.

use std::io;

use rerun::{
    RecordingStream, RecordingStreamBuilder, RecordingStreamResult, Scalars, TimeColumn,
    TimelineName,
    blueprint::{ContainerLike, TimeSeriesView, Vertical},
};

use super::{
    RecordingFile,
    blueprint::{Properties, ViewerLayout},
    scene::lines::{self, Line},
    schema::SWEEP_APPLICATION,
};

/// Plots of curves, from top to bottom, over one axis.
pub struct CurvePlots {
    /// Name of the whole.
    pub name: String,
    /// Name of the axis.
    pub axis: String,
    /// The plots.
    pub plots: Vec<CurvePlot>,
}

/// Curves over the axis, one for each of the groups that all plots have.
pub struct CurvePlot {
    /// Its entity.
    pub entity: &'static str,
    /// Its title, without the names of its curves.
    pub title: String,
    /// The range of its values; from the curves if it has none.
    pub range: Option<[f64; 2]>,
    /// Places with a line at zero between them.
    pub zero: Vec<i64>,
    /// The curves, each with its name.
    pub curves: Vec<(String, Curve)>,
}

/// Values over whole numbers of the axis, which is all that a timeline of the viewer knows.
pub type Curve = Vec<(i64, f64)>;

impl CurvePlots {
    /// Writes them to a new `file`.
    ///
    /// # Errors
    /// The system's error for the file.
    pub fn write(&self, file: RecordingFile) -> io::Result<()> {
        self.send(&file).map_err(io::Error::other)?;
        file.complete().map(drop)
    }

    fn send(&self, file: &RecordingFile) -> RecordingStreamResult<()> {
        let rec = RecordingStreamBuilder::new(SWEEP_APPLICATION)
            .enabled(true)
            .recording_name(self.name.as_str())
            .buffered()?;
        rec.set_sink(Box::new(file.clone()));
        let axis = TimelineName::try_new(&self.axis).unwrap_or_else(|_| "value".into());
        self.layout(axis).send(&rec)?;
        for plot in &self.plots {
            plot.send(&rec, axis)?;
        }
        let _ = rec.flush_blocking();
        rec.disconnect(); // Nothing may be written after the end of the file.
        Ok(())
    }

    fn layout(&self, axis: TimelineName) -> ViewerLayout {
        let mut properties = Properties::default();
        let views = self.plots.iter().map(|plot| -> ContainerLike {
            let names: Vec<&str> = plot.curves.iter().map(|(name, _)| &**name).collect();
            let key = match names[..] {
                [alone] => alone.to_owned(),
                _ => lines::key(names),
            };
            let view = TimeSeriesView::new(format!("{}: {key}", plot.title));
            properties.plot(view.with_origin(plot.entity), plot.range)
        });
        ViewerLayout {
            root: Vertical::new(views.collect::<Vec<_>>()).into(),
            timeline: axis.as_str(),
            properties,
        }
    }
}

impl CurvePlot {
    /// Sends each curve in its own colour, and the line at zero, if any.
    fn send(&self, rec: &RecordingStream, axis: TimelineName) -> RecordingStreamResult<()> {
        let count = self.curves.len();
        let looks = lines::series(count).zip(lines::widths(count));
        for ((name, curve), (colour, width)) in self.curves.iter().zip(looks) {
            let line = Line::new(name, colour, width);
            self.line(rec, axis, line, curve.iter().copied())?;
        }
        if self.zero.is_empty() {
            return Ok(());
        }
        let zero = self.zero.iter().map(|place| (*place, 0.0));
        self.line(rec, axis, Line::new("zero", lines::GREY, 1.0), zero)
    }

    /// Sends a line of these `points`.
    fn line(
        &self,
        rec: &RecordingStream,
        axis: TimelineName,
        line: Line,
        points: impl Iterator<Item = (i64, f64)>,
    ) -> RecordingStreamResult<()> {
        let entity = format!("{}/{}", self.entity, line.name.replace([' ', '.'], "_"));
        lines::begin(rec, entity.as_str(), &[line])?;
        let (places, values): (Vec<i64>, Vec<f64>) = points.unzip();
        if places.is_empty() {
            return Ok(());
        }
        let columns = Scalars::new(values).columns_of_unit_batches()?;
        rec.send_columns(entity, [TimeColumn::new_sequence(axis, places)], columns)
    }
}
