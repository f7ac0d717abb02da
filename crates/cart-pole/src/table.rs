//! The table of the course: a row for each control step.

use ratelab::Time;
use ratelab_metrics::Fields;
use ratelab_system::StateTable;

use super::{ControlStep, message::Pose};

/// Observation and action are f32, written with as many digits as it takes to
/// recover their bits.
pub(super) const TABLE: StateTable = StateTable {
    header: "step,time_s,cart_position_m,cart_velocity_m_s,cos_theta,sin_theta,\
             pole_angular_velocity_rad_s,action,latency_s",
    row,
    more: "latency_ms,pole_angle_rad",
    more_cells,
};

/// Returns the latency in the unit of all ages, and the angle of the pole from upright.
fn more_cells(state: &[f64]) -> String {
    let step = ControlStep::from_row(state);
    let latency = step
        .as_ref()
        .and_then(|step| step.latency)
        .map(|latency| (latency.as_nanos() as f64 / 1e6).to_string());
    let angle = step.map_or(0.0, |step| Pose::new(step.qpos).pole_angle);
    format!("{},{angle}", latency.unwrap_or_default())
}

fn row(at: Time, state: &[f64]) -> String {
    let Some(step) = ControlStep::from_row(state) else {
        return String::new();
    };
    let [x, v, cos, sin, omega] = step.observation.to_array();
    let latency = step
        .latency
        .map(|latency| latency.as_secs_f64().to_string());
    format!(
        "{},{},{x},{v},{cos},{sin},{omega},{},{}",
        step.step,
        at.as_secs_f64(),
        step.action.0,
        latency.unwrap_or_default()
    )
}
