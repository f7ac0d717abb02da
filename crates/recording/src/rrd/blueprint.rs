//! The layout of a recording in the viewer: everything at a glance.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use ratelab::{ClockKind, sync::lock};
use ratelab_system::{Signal, System, paced_node};
use rerun::{
    AnyValues, AsComponents, EntityPath, RecordingStream, RecordingStreamBuilder,
    SerializedComponentBatch, SeriesLines, StoreKind, TimePoint, Timeline,
    blueprint::{
        BarChartView, Blueprint, BlueprintActivation, BlueprintPanel, ContainerLike, GraphView,
        Horizontal, SelectionPanel, Spatial2DView, StateTimelineView, TextLogView, TimePanel,
        TimeSeriesView, Vertical, VisualizableArchetype,
        components::{BackgroundKind, LinkAxis, PanelState, PlayState},
    },
    components::Range1D,
    datatypes::{TimeRange, TimeRangeBoundary},
    external::{
        arrow::array::{ArrayRef, StringArray},
        re_sdk_types::blueprint::{
            archetypes::{Background, PlotLegend, ScalarAxis, TextLogColumns, TimeAxis},
            datatypes::{TextLogColumn, TextLogColumnKind, TimelineColumn},
        },
    },
    log::{Chunk, ChunkError, LogMsg, RowId},
};

use super::{
    file::RecordingFile,
    scene::{
        graph::GRAPH,
        lanes::TIMELINE,
        latency::{HISTOGRAM, LATENCY},
        lines::{self, stepped},
        picture::PICTURE,
        signals::{self, MODES},
        traffic::{DROPPED, LINKS, PER_SECOND},
    },
    schema::{APPLICATION, EVENTS, JSON, NODES, ORIGIN, topic_entity},
    timeline::{RUN_TIME, Written},
    viewer::{FileAndViewer, Viewer},
};
use crate::recorder::Source;

/// The timeline on which the viewer looks for a blueprint.
const BLUEPRINT: &str = "blueprint";

/// Returns whether there can be a layout. The SDK (0.36.3) makes layouts in a stream that the
/// variable `RERUN` switches off, and panics then; what is recorded is in streams that are on in
/// any case.
fn is_possible() -> bool {
    rerun::decide_logging_enabled(true)
}

/// Sends the layout for the run of `source`. To be called before the recording itself.
pub fn send(rec: &RecordingStream, source: &Source) -> Written {
    if !is_possible() {
        let why = "RERUN is off in the environment: the recording has no layout for the viewer";
        (source.notice)(why);
    }
    let key = key(source);
    let mut made = lock(&MADE);
    if !made.contains_key(&key) {
        let mut properties = Properties::default();
        let layout = ViewerLayout {
            root: layout(source, &mut properties),
            timeline: RUN_TIME,
            properties,
        };
        made.insert(key.clone(), layout.messages(rec)?);
    }
    made.get(&key)
        .into_iter()
        .flatten()
        .cloned()
        .for_each(|message| rec.record_msg(message));
    Ok(())
}

/// All layouts so far. The SDK (0.36.3) never ends the stream of a layout, which costs
/// two threads and their memory each time, so each layout is made only once.
static MADE: Mutex<BTreeMap<String, Vec<LogMsg>>> = Mutex::new(BTreeMap::new());

/// Views, with only the panels needed for navigation.
pub struct ViewerLayout {
    /// The views.
    pub root: ContainerLike,
    /// Their timeline.
    pub timeline: &'static str,
    /// Properties of the views.
    pub properties: Properties,
}

impl ViewerLayout {
    /// Shows the layout in the viewer. To be called before the recording itself.
    pub fn send(self, rec: &RecordingStream) -> Written {
        self.messages(rec)?
            .into_iter()
            .for_each(|message| rec.record_msg(message));
        Ok(())
    }

    /// Returns the messages of the layout, the last of which activates it; none where it is not
    /// possible.
    fn messages(self, rec: &RecordingStream) -> Written<Vec<LogMsg>> {
        let Some(info) = rec.store_info().filter(|_| is_possible()) else {
            return Ok(Vec::new());
        };
        let time = TimePanel::new()
            .with_state(PanelState::Collapsed)
            .with_timeline(self.timeline)
            // At the end of the recording every view has data.
            .with_play_state(PlayState::Following);
        let blueprint = Blueprint::new(self.root)
            .with_auto_views(false)
            .with_auto_layout(false)
            .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Hidden))
            .with_selection_panel(SelectionPanel::from_state(PanelState::Hidden))
            .with_time_panel(time);
        let stream = RecordingStreamBuilder::new(info.application_id().clone());
        let (stream, storage) = stream.memory()?;
        blueprint.send(&stream, BlueprintActivation::default())?;
        let messages = storage.take().into_iter();
        // The two refer to each other, and would never be freed if the stream stayed connected.
        stream.disconnect();
        let layout = messages
            .filter(|message| message.store_id().kind() == StoreKind::Blueprint)
            .map(on_one_timeline)
            .collect::<Result<_, _>>()?;
        self.properties.among(layout)
    }
}

/// Returns all that changes the layout of a run.
fn key(source: &Source) -> String {
    let nodes = source.start.nodes.iter().map(|node| &node.name);
    let topics = source.start.topics.iter().map(|topic| &topic.name);
    let names: (Vec<_>, Vec<_>) = (nodes.collect(), topics.collect());
    let (system, clock) = (source.system.name(), source.observer.status().clock);
    format!("{system:?} {names:?} {} {clock}", source.has_picture())
}

fn layout(source: &Source, properties: &mut Properties) -> ContainerLike {
    let graph = GraphView::new("node graph: nodes blue, topics orange").with_origin(GRAPH);
    let top = if source.has_picture() {
        let views = [picture(properties, source.system.name()), graph.into()];
        Horizontal::new(views).with_column_shares([2.0, 1.3])
    } else {
        Horizontal::new([graph.into()])
    };
    let signals = source
        .system
        .signals()
        .into_iter()
        .map(|signal| signal_plot(&*source.system, &signal, properties));
    let columns = [
        signals.collect(),
        plots(source, properties),
        states(source, properties),
    ]
    .into_iter()
    .filter(|views| !views.is_empty());
    let columns = Horizontal::new(columns.map(|views| Vertical::new(views).into()));
    let name = "timeline: ticks of nodes, and what became of messages";
    let timeline = lanes(properties, name, TIMELINE);
    let rows = Vertical::new([top.into(), columns.into(), timeline]);
    rows.with_row_shares([1.0, 2.0, 1.0]).into()
}

fn signal_plot(system: &dyn System, signal: &Signal, properties: &mut Properties) -> ContainerLike {
    let entity = signals::entity(&signal.topic);
    let only = signals::only(&system.signals(), &signal.topic, &signal.name);
    let view = TimeSeriesView::new(signals::title(signal))
        .with_origin(entity.clone())
        .with_override(entity, only.visualizer());
    properties.plot(view, Some(signal.range))
}

/// Latency, messages and drops over time.
fn plots(source: &Source, properties: &mut Properties) -> Vec<ContainerLike> {
    let latency = source.system.latency().map(|(_, meter)| {
        let period = paced_node(&*source.system)
            .map_or(String::new(), |node| format!(", {node} period orange"));
        TimeSeriesView::new(format!("{meter} latency blue{period} (ms)"))
            .with_origin(LATENCY)
            .with_override(LATENCY, stepped().visualizer())
    });
    let key = lines::key(source.start.topics.iter().map(|topic| &*topic.name));
    let sent = TimeSeriesView::new(format!("messages/s: {key}")).with_origin(PER_SECOND);
    let dropped = TimeSeriesView::new(format!("dropped so far: {key}"))
        .with_origin(DROPPED)
        .with_contents([DROPPED, LINKS].map(|entity| format!("/{entity}")));
    latency
        .into_iter()
        .chain([sent, dropped])
        .map(|view| properties.plot(view, None))
        .collect()
}

/// Lateness, the distribution of latency, modes and events.
fn states(source: &Source, properties: &mut Properties) -> Vec<ContainerLike> {
    let mut views = Vec::new();
    if source.observer.status().clock == ClockKind::Real {
        let nodes = lines::key(source.start.nodes.iter().map(|node| &*node.name));
        let late = TimeSeriesView::new(format!("µs late: {nodes}")).with_origin(NODES);
        views.push(properties.plot(late, None));
    }
    let latency = source.system.latency();
    views.extend(latency.map(|(_, meter)| histogram(properties, meter)));
    views.push(lanes(properties, "clock and rates in force", MODES));
    views.push(events(properties));
    views
}

fn picture(properties: &mut Properties, system: &str) -> ContainerLike {
    let view = Spatial2DView::new(system).with_origin(PICTURE);
    let ground = Background::new(BackgroundKind::SolidColor).with_color(lines::NIGHT);
    properties.set(view, &[("Background", &ground)])
}

fn histogram(properties: &mut Properties, meter: &str) -> ContainerLike {
    let name = format!("steps per {meter} latency (ms)");
    let view = BarChartView::new(name).with_origin(HISTOGRAM);
    let legend = PlotLegend::new().with_visible(false);
    properties.set(view, &[("PlotLegend", &legend)])
}

fn lanes(properties: &mut Properties, name: &str, origin: &str) -> ContainerLike {
    let view = StateTimelineView::new(name).with_origin(origin);
    // The default does not fit the run.
    let axis = TimeAxis::new().with_link(LinkAxis::LinkToGlobal);
    properties.set(view, &[("TimeAxis", &axis)])
}

fn events(properties: &mut Properties) -> ContainerLike {
    let column = |kind, visible: bool| TextLogColumn {
        visible: visible.into(),
        kind,
    };
    let columns = TextLogColumns::new()
        .with_timeline_columns([TimelineColumn {
            visible: true.into(),
            timeline: RUN_TIME.into(),
        }])
        .with_text_log_columns([
            column(TextLogColumnKind::LogLevel, true),
            column(TextLogColumnKind::Body, true),
        ]);
    let view = TextLogView::new("events: commands and verdict").with_origin(EVENTS);
    properties.set(view, &[("TextLogColumns", &columns)])
}

/// Returns the whole run. Linked axes would show the last half minute of a longer run.
fn whole_run() -> TimeAxis {
    let range = TimeRange {
        start: TimeRangeBoundary::Infinite,
        end: TimeRangeBoundary::Infinite,
    };
    TimeAxis::new().with_view_range(range)
}

/// Properties of views. The SDK has no call for most of them, but gives their place in
/// the viewer's blueprint.
#[derive(Default)]
pub struct Properties(Vec<(EntityPath, Vec<SerializedComponentBatch>)>);

impl Properties {
    /// Sets properties of `view`, each under the name of its archetype.
    fn set(
        &mut self,
        view: impl Into<ContainerLike>,
        properties: &[(&str, &dyn AsComponents)],
    ) -> ContainerLike {
        let contents = view.into();
        if let ContainerLike::View(contents) = &contents {
            let path = contents.blueprint_path();
            let entities = properties.iter().map(|(name, property)| {
                let entity = EntityPath::from(format!("{path}/{name}"));
                (entity, property.as_serialized_batches())
            });
            self.0.extend(entities);
        }
        contents
    }

    /// Returns a plot over time, with a fixed range of values or one that fits the data.
    pub fn plot(&mut self, view: TimeSeriesView, range: Option<[f64; 2]>) -> ContainerLike {
        let legend = PlotLegend::new().with_visible(false);
        let time = whole_run();
        let mut properties: Vec<(&str, &dyn AsComponents)> =
            vec![("PlotLegend", &legend), ("TimeAxis", &time)];
        let axis = range.map(|range| ScalarAxis::new().with_range(Range1D(range.into())));
        if let Some(axis) = &axis {
            properties.push(("ScalarAxis", axis));
        }
        self.set(view, &properties)
    }

    /// Returns `messages` of a blueprint, with the properties before the last one, its activation.
    fn among(self, mut messages: Vec<LogMsg>) -> Written<Vec<LogMsg>> {
        let Some(activation) = messages.pop() else {
            return Ok(messages);
        };
        for (entity, batches) in self.0 {
            let time = TimePoint::default().with(Timeline::new_sequence(BLUEPRINT), 0);
            let row = Chunk::builder(entity).with_serialized_batches(RowId::new(), time, batches);
            let data = row.build()?.to_arrow_msg()?;
            messages.push(LogMsg::ArrowMsg(activation.store_id().clone(), data));
        }
        messages.push(activation);
        Ok(messages)
    }
}

/// Returns `message` without the timelines that a blueprint does not need, a third of its size.
fn on_one_timeline(message: LogMsg) -> Result<LogMsg, ChunkError> {
    Ok(match message {
        LogMsg::ArrowMsg(store, data) => {
            let chunk = Chunk::from_arrow_msg(&data)?.timeline_sliced(BLUEPRINT.into());
            LogMsg::ArrowMsg(store, chunk.to_arrow_msg()?)
        }
        other => other,
    })
}

/// Opens a stream to `file`, and to `viewer` if any, with layout and description.
pub fn begin(
    file: &RecordingFile,
    viewer: Option<&Viewer>,
    source: &Source,
) -> Written<RecordingStream> {
    let (origin, config) = (&source.origin, &source.origin.config);
    let name = format!(
        "{}, {} clock, seed {}",
        origin.system, config.clock, config.seed
    );
    let rec = RecordingStreamBuilder::new(APPLICATION)
        .enabled(true)
        .recording_name(name)
        .buffered()?;
    match viewer {
        None => rec.set_sink(Box::new(file.clone())),
        Some(viewer) => rec.set_sink(Box::new(FileAndViewer::new(file.clone(), viewer))),
    }
    // Readers need this first, and columns overtake logged messages.
    let json = serde_json::to_string(origin).unwrap_or_default();
    let json: ArrayRef = Arc::new(StringArray::from(vec![json]));
    let description = AnyValues::default().with_component_from_data(JSON, json);
    rec.send_property(ORIGIN, &description)?;
    let _ = rec.flush_blocking();
    send(&rec, source)?;
    for topic in &origin.topology.topics {
        if let Some(fields) = source.taps.fields(&topic.name) {
            let names = SeriesLines::new().with_names(fields.iter().map(String::as_str));
            rec.log_static(topic_entity(&topic.name), &names)?;
        }
    }
    Ok(rec)
}
