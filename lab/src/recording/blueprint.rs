//! How the viewer lays a recording out: everything at a glance.

use std::sync::{Mutex, PoisonError};

use ratelab::{
    cartpole::POLE_LIMIT_RAD,
    runtime::{ClockKind, Snapshot},
};
use rerun::{
    AsComponents, EntityPath, RecordingStream, RecordingStreamBuilder, RecordingStreamResult,
    SerializedComponentBatch, StoreKind,
    blueprint::{
        BarChartView, Blueprint, BlueprintActivation, BlueprintPanel, ContainerLike, GraphView,
        Horizontal, SelectionPanel, Spatial3DView, StateTimelineView, TextLogView, TimePanel,
        TimeSeriesView, Vertical, VisualizableArchetype,
        components::{BackgroundKind, LinkAxis, PanelState, PlayState},
    },
    components::Range1D,
    datatypes::{TimeRange, TimeRangeBoundary},
    external::{
        re_log_types::BlueprintActivationCommand,
        re_sdk_types::blueprint::{
            archetypes::{
                Background, EyeControls3D, LineGrid3D, PlotLegend, ScalarAxis, TextLogColumns,
                TimeAxis,
            },
            datatypes::{TextLogColumn, TextLogColumnKind, TimelineColumn},
        },
    },
    log::{Chunk, ChunkError, LogMsg},
    sink::MemorySinkStorage,
};

use super::{
    scene::{
        graph::GRAPH,
        histogram::HISTOGRAM,
        lines::{only, stepped},
        modes::MODES,
        palette,
        step_plots::{CART, LATENCY, LINES, POLE, STEPS},
        traffic::{DROPPED, PER_SECOND},
        world::WORLD,
    },
    schema::{EVENTS, NODES},
    timeline::RUN_TIME,
};

/// The timeline on which the viewer looks for a blueprint.
const BLUEPRINT: &str = "blueprint";

/// Sends the layout for a run of the graph in `start`, taken before its run, of
/// which `clock` runs the first part that is recorded.
/// Comes before the recording itself.
pub fn send(
    rec: &RecordingStream,
    start: &Snapshot,
    clock: ClockKind,
) -> RecordingStreamResult<()> {
    let subject = Subject::of(start, clock);
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    let known = made.iter().find(|(known, _)| *known == subject);
    let messages = match known {
        Some((_, messages)) => messages.clone(),
        None => {
            let mut properties = Properties::default();
            let layout = ViewerLayout {
                root: layout(&mut properties, start, clock),
                timeline: RUN_TIME,
                properties,
            };
            let messages = layout.messages(rec)?;
            made.push((subject, messages.clone()));
            messages
        }
    };
    drop(made);
    activate(messages, rec);
    Ok(())
}

/// What the layout of a run depends on.
#[derive(PartialEq)]
struct Subject {
    nodes: Vec<String>,
    topics: Vec<String>,
    clock: ClockKind,
}

impl Subject {
    fn of(start: &Snapshot, clock: ClockKind) -> Self {
        let nodes = start.nodes.iter().map(|node| node.name.to_string());
        let topics = start.topics.iter().map(|topic| topic.name.to_string());
        Self {
            nodes: nodes.collect(),
            topics: topics.collect(),
            clock,
        }
    }
}

/// Layouts that were made. The SDK (0.36.3) never ends the stream with which it
/// makes one: two threads and their memory each time, so each is made once.
static MADE: Mutex<Vec<(Subject, Vec<LogMsg>)>> = Mutex::new(Vec::new());

/// Views, and nothing else but what is needed to move through them.
pub struct ViewerLayout {
    /// The views.
    pub root: ContainerLike,
    /// What they are drawn over.
    pub timeline: &'static str,
    /// What the views are to look like.
    pub properties: Properties,
}

impl ViewerLayout {
    /// Has the viewer show it. Comes before the recording itself.
    pub fn send(self, rec: &RecordingStream) -> RecordingStreamResult<()> {
        activate(self.messages(rec)?, rec);
        Ok(())
    }

    fn messages(self, rec: &RecordingStream) -> RecordingStreamResult<Vec<LogMsg>> {
        let time = TimePanel::new()
            .with_state(PanelState::Collapsed)
            .with_timeline(self.timeline)
            // At the end every view has data.
            .with_play_state(PlayState::Following);
        let blueprint = Blueprint::new(self.root)
            .with_auto_views(false)
            .with_auto_layout(false)
            .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Hidden))
            .with_selection_panel(SelectionPanel::from_state(PanelState::Hidden))
            .with_time_panel(time);
        self.properties.messages_with(&blueprint, rec)
    }
}

fn layout(properties: &mut Properties, start: &Snapshot, clock: ClockKind) -> ContainerLike {
    let top = Horizontal::new([world(properties), graph()]).with_column_shares([2.0, 1.3]);
    let middle = Vertical::new([
        latency(properties),
        per_second(properties, start),
        drops(properties, start),
    ]);
    let mut right = vec![histogram(properties), modes(properties), events(properties)];
    if clock == ClockKind::Real {
        right.insert(0, lateness(properties, start));
    }
    let bottom = Horizontal::new([
        motion(properties).into(),
        middle.into(),
        Vertical::new(right).into(),
    ]);
    let rows = Vertical::new([top.into(), bottom.into()]);
    rows.with_row_shares([1.0, 2.0]).into()
}

fn world(properties: &mut Properties) -> ContainerLike {
    let view = Spatial3DView::new("cart-pole in space, ±12° fall limits").with_origin(WORLD);
    let eye = EyeControls3D::new()
        .with_position([0.0, -1.7, 0.75])
        .with_look_target([0.0, 0.0, 0.45])
        .with_eye_up([0.0, 0.0, 1.0]);
    let ground = Background::new(BackgroundKind::SolidColor).with_color(palette::NIGHT);
    let grid = LineGrid3D::new().with_visible(false);
    properties.set(
        view,
        &[
            ("EyeControls3D", &eye),
            ("Background", &ground),
            ("LineGrid3D", &grid),
        ],
    )
}

fn graph() -> ContainerLike {
    GraphView::new("node graph: nodes blue, topics orange")
        .with_origin(GRAPH)
        .into()
}

/// Pole above cart and force.
fn motion(properties: &mut Properties) -> Vertical {
    let limit = POLE_LIMIT_RAD.to_degrees();
    let angle = TimeSeriesView::new(format!("pole angle and fall limits ±{limit:.0}° (°)"))
        .with_origin(STEPS)
        .with_override(STEPS, only(POLE, LINES).visualizer());
    let range = [-1.25 * limit, 1.25 * limit];
    let cart = TimeSeriesView::new("cart position blue (m), action orange (share of 10 N)")
        .with_origin(STEPS)
        .with_override(STEPS, stepped(only(CART, LINES)).visualizer());
    Vertical::new([
        properties.plot(angle, Some(range)),
        properties.plot(cart, None),
    ])
}

fn latency(properties: &mut Properties) -> ContainerLike {
    let view = TimeSeriesView::new("sense→act latency blue, control period orange (ms)")
        .with_origin(STEPS)
        .with_override(STEPS, stepped(only(LATENCY, LINES)).visualizer());
    properties.plot(view, None)
}

fn per_second(properties: &mut Properties, start: &Snapshot) -> ContainerLike {
    let view = TimeSeriesView::new(format!("messages/s: {}", topic_key(start)));
    properties.plot(view.with_origin(PER_SECOND), None)
}

fn drops(properties: &mut Properties, start: &Snapshot) -> ContainerLike {
    let view = TimeSeriesView::new(format!("dropped so far: {}", topic_key(start)));
    properties.plot(view.with_origin(DROPPED), None)
}

fn topic_key(start: &Snapshot) -> String {
    palette::key(start.topics.iter().map(|topic| &*topic.name))
}

fn lateness(properties: &mut Properties, start: &Snapshot) -> ContainerLike {
    let nodes = palette::key(start.nodes.iter().map(|node| &*node.name));
    let view = TimeSeriesView::new(format!("µs late: {nodes}"));
    properties.plot(view.with_origin(NODES), None)
}

fn histogram(properties: &mut Properties) -> ContainerLike {
    let name = "control steps per sense→act latency (ms)";
    let view = BarChartView::new(name).with_origin(HISTOGRAM);
    let legend = PlotLegend::new().with_visible(false);
    properties.set(view, &[("PlotLegend", &legend)])
}

fn modes(properties: &mut Properties) -> ContainerLike {
    let view = StateTimelineView::new("clock and control rate in force").with_origin(MODES);
    // Of its own it does not fit the run.
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

/// The whole run. Linked axes would show the last half minute of a longer one.
fn whole_run() -> TimeAxis {
    let range = TimeRange {
        start: TimeRangeBoundary::Infinite,
        end: TimeRangeBoundary::Infinite,
    };
    TimeAxis::new().with_view_range(range)
}

/// Properties of views. The SDK has no call for most of them, but knows where
/// the viewer looks for them.
#[derive(Default)]
pub struct Properties(Vec<(EntityPath, Vec<SerializedComponentBatch>)>);

impl Properties {
    /// Gives `view` properties, each under the name of its archetype.
    fn set(
        &mut self,
        view: impl Into<ContainerLike>,
        properties: &[(&str, &dyn AsComponents)],
    ) -> ContainerLike {
        let view = view.into();
        if let ContainerLike::View(view) = &view {
            let path = view.blueprint_path();
            let entities = properties.iter().map(|(name, property)| {
                let entity = EntityPath::from(format!("{path}/{name}"));
                (entity, property.as_serialized_batches())
            });
            self.0.extend(entities);
        }
        view
    }

    /// Lines over time, with a fixed range of values or one that fits the data.
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

    /// `blueprint` and the properties of its views.
    fn messages_with(
        &self,
        blueprint: &Blueprint,
        rec: &RecordingStream,
    ) -> RecordingStreamResult<Vec<LogMsg>> {
        let mut messages = messages_of(blueprint, rec)?;
        let Some(id) = messages.first().map(|message| message.store_id().clone()) else {
            return Ok(messages); // A disabled stream.
        };
        let (stream, storage) = RecordingStreamBuilder::from_store_id(&id).memory()?;
        stream.set_time_sequence(BLUEPRINT, 0);
        for (entity, property) in &self.0 {
            stream.log_serialized_batches(entity.clone(), false, property.iter().cloned())?;
        }
        let data = taken(&stream, &storage).into_iter();
        messages.extend(data.filter(|message| matches!(message, LogMsg::ArrowMsg(..))));
        let messages = messages.into_iter().map(on_one_timeline);
        Ok(messages.collect::<Result<_, ChunkError>>()?)
    }
}

/// Sends the messages of a blueprint, then has the viewer show it.
fn activate(messages: Vec<LogMsg>, rec: &RecordingStream) {
    if let Some(first) = messages.first() {
        let activation = BlueprintActivationCommand {
            blueprint_id: first.store_id().clone(),
            make_active: true,
            make_default: true,
        };
        rec.send_blueprint(messages, activation);
    }
}

/// What `stream` wrote to `storage`. The two hold each other, and would never go
/// away if the stream were not disconnected.
fn taken(stream: &RecordingStream, storage: &MemorySinkStorage) -> Vec<LogMsg> {
    let messages = storage.take();
    stream.disconnect();
    messages
}

/// `message` without the timelines that the viewer does not ask a blueprint
/// for, which are a third of its size.
fn on_one_timeline(message: LogMsg) -> Result<LogMsg, ChunkError> {
    Ok(match message {
        LogMsg::ArrowMsg(store, data) => {
            let chunk = Chunk::from_arrow_msg(&data)?.timeline_sliced(BLUEPRINT.into());
            LogMsg::ArrowMsg(store, chunk.to_arrow_msg()?)
        }
        other => other,
    })
}

/// What the SDK makes of `blueprint`, without its activation.
fn messages_of(blueprint: &Blueprint, rec: &RecordingStream) -> RecordingStreamResult<Vec<LogMsg>> {
    let Some(info) = rec.store_info() else {
        return Ok(Vec::new());
    };
    let application = info.application_id().clone();
    let (stream, storage) = RecordingStreamBuilder::new(application).memory()?;
    blueprint.send(&stream, BlueprintActivation::default())?;
    let messages = taken(&stream, &storage).into_iter();
    let of_blueprint = messages.filter(|message| {
        message.store_id().kind() == StoreKind::Blueprint
            && !matches!(message, LogMsg::BlueprintActivationCommand(_))
    });
    Ok(of_blueprint.collect())
}
