//! The margins of a robot, for people and for programs.

use ratelab_system::graph_file::PlantSpec;
use serde_json::{Map, Value, json};

use super::{
    axes::MarginAxis,
    search::{Bears, MarginRuns},
};

/// What a robot bears of one axis.
pub struct Margin {
    pub axis: MarginAxis,
    pub bears: Bears,
    /// What linear theory says, in the unit of the axis.
    pub theory: Option<f64>,
}

/// The margins of a robot, with what they depend on.
pub struct MarginReport<'r> {
    pub name: &'r str,
    pub spec: &'r PlantSpec,
    pub trials: &'r MarginRuns<'r>,
    /// The limit of the coordinates that the file names none for.
    pub other_limit: Option<f64>,
    /// How fast the fastest deviation grows without a controller (1/s), if one grows.
    pub pole: Option<f64>,
    /// Whether contacts hold it: they may open, which theory does not see.
    pub touches: bool,
    /// The runs that go well with the controls of the pose for ever.
    pub held: usize,
    pub margins: Vec<Margin>,
}

impl Margin {
    /// Returns the value that is borne, if there is one.
    fn value(&self) -> Option<f64> {
        Some(self.axis.value(self.bears.step?))
    }

    fn line(&self, touches: bool) -> String {
        let MarginAxis {
            title, unit, name, ..
        } = self.axis;
        let value = match (self.value(), self.bears.is_end) {
            (None, _) => "none: it is lost as it is".to_owned(),
            (Some(value), false) => format!("{value} {unit}"),
            (Some(value), true) => format!("{value} {unit}, the last value tried"),
        };
        let theory = self.theory.map(|theory| format!("theory {theory} {unit}"));
        let blind = touches && theory.is_some();
        let theory = theory.map(|theory| theory + if blind { ", contacts may open" } else { "" });
        let theory = theory.map_or_else(String::new, |theory| format!(" ({theory})"));
        let lost = self.bears.lost_by.as_ref();
        let lost = lost.map_or_else(String::new, |cause| format!("; then lost: {cause}"));
        format!("{name:<10}{value}{theory}: {title}{lost}")
    }

    fn json(&self) -> Value {
        let tried = self.bears.tried.iter();
        let tried =
            tried.map(|(step, stood)| json!({ "value": self.axis.value(*step), "stood": stood }));
        json!({
            "name": self.axis.name,
            "unit": self.axis.unit,
            "bears": self.value(),
            "last_tried": self.bears.is_end,
            "theory": self.theory,
            "lost_by": self.bears.lost_by,
            "tried": tried.collect::<Vec<Value>>(),
        })
    }
}

impl MarginReport<'_> {
    /// Returns the margins in a line each.
    pub fn text(&self) -> String {
        let (runs, spec) = (self.trials.seeds.len(), self.spec);
        let mut limits: Vec<String> = spec
            .limits
            .iter()
            .filter(|(name, _)| name != "*")
            .map(|(name, limit)| format!("{name} {limit}"))
            .collect();
        if let Some(limit) = self.other_limit {
            let which = if limits.is_empty() { "all" } else { "others" };
            limits.push(format!("{which} {limit}"));
        }
        let pole = self.pole.map_or_else(
            || "none: without a controller no deviation grows".to_owned(),
            |pole| format!("{pole:.2}/s: growth of the fastest deviation without a controller"),
        );
        let mut lines = vec![
            format!("robot     {}", self.name),
            format!("start     each speed at most {} m/s, rad/s", spec.start),
            format!("limits    {} (m, rad)", limits.join(", ")),
            format!("pole      {pole}"),
            format!(
                "runs      {runs} of {}, of which {} % must stay within their limits",
                self.trials.config.end,
                100.0 * self.trials.share
            ),
        ];
        lines.extend(self.margins.iter().map(|margin| margin.line(self.touches)));
        let held = match self.held {
            0 => "without feedback no run stays within its limits".to_owned(),
            held => format!(
                "{held} of {runs} runs stay within their limits without feedback: \
                 only feedback on old data can lose the robot"
            ),
        };
        lines.push(format!("hold      {held}"));
        lines.join("\n")
    }

    /// Returns the margins for programs.
    pub fn json(&self) -> Value {
        let limits = self.spec.limits.iter();
        let limits: Map<String, Value> = limits
            .map(|(name, limit)| (name.clone(), json!(limit.is_finite().then_some(limit))))
            .collect();
        json!({
            "robot": self.name,
            "start": self.spec.start,
            "limits": limits,
            "other_limit": self.other_limit.filter(|limit| limit.is_finite()),
            "seeds": self.trials.seeds,
            "duration_s": self.trials.config.end.as_secs_f64(),
            "share": self.trials.share,
            "fastest_pole_per_s": self.pole,
            "contacts_may_open": self.touches,
            "hold_stood": self.held,
            "margins": self.margins.iter().map(Margin::json).collect::<Vec<Value>>(),
        })
    }
}
