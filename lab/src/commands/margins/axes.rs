//! What gets worse for a robot, step by step.

use ratelab::Knob;
use ratelab_plant::{ACTION, COMMAND, INNER_OBS};

use crate::error::Error;

/// Something that gets worse step by step.
pub struct MarginAxis {
    /// Its name for programs.
    pub name: &'static str,
    /// Its name for people.
    pub title: &'static str,
    /// The unit of its values.
    pub unit: &'static str,
    /// The last step.
    pub last: u64,
    /// The value of step 0.
    first: f64,
    /// What a step adds to it.
    by: f64,
    /// The topic that is late by a constant delay, if that is what gets worse.
    pub late: Option<&'static str>,
    /// The knobs, with `{}` for the value.
    knobs: &'static [&'static str],
}

impl MarginAxis {
    /// Returns the axes for a policy at `hz`, in a cascade with the delay of each loop.
    pub fn all(hz: f64, is_cascade: bool) -> Vec<Self> {
        let mut axes = vec![Self {
            late: Some(ACTION),
            ..Self::delay(
                "delay",
                "greatest constant delay of /action",
                &["link /action delay:{}"],
            )
        }];
        if is_cascade {
            axes.extend(Self::of_loops());
        }
        axes.extend([
            Self::delay(
                "jitter",
                "greatest J, for random delays from 0 to J",
                &["link /action delay:0..{}"],
            ),
            Self {
                name: "loss",
                title: "greatest share of lost actions",
                unit: "%",
                last: 99,
                by: 0.01,
                knobs: &["link /action loss:{}"],
                ..Self::NONE
            },
            Self {
                name: "rate",
                title: "lowest rate of sensor and policy",
                unit: "Hz",
                last: (hz.ceil() as u64).saturating_sub(1),
                first: hz.ceil(),
                by: -1.0,
                knobs: &["rate sensor {}", "rate policy {}"],
                ..Self::NONE
            },
        ]);
        axes
    }

    /// Nothing that gets worse.
    const NONE: Self = Self {
        name: "",
        title: "",
        unit: "",
        last: 0,
        first: 0.0,
        by: 0.0,
        late: None,
        knobs: &[],
    };

    /// Returns the axis of a delay, to the millisecond.
    const fn delay(
        name: &'static str,
        title: &'static str,
        knobs: &'static [&'static str],
    ) -> Self {
        Self {
            name,
            title,
            unit: "ms",
            last: 1000,
            by: 1.0,
            knobs,
            ..Self::NONE
        }
    }

    /// Returns the axes of the loops of a cascade.
    const fn of_loops() -> [Self; 2] {
        let outer = Self::delay(
            "outer",
            "greatest constant delay of /command",
            &["link /command delay:{}"],
        );
        let inner = Self::delay(
            "inner",
            "greatest constant delay of /inner-obs",
            &["link /inner-obs delay:{}"],
        );
        [
            Self {
                late: Some(COMMAND),
                ..outer
            },
            Self {
                late: Some(INNER_OBS),
                ..inner
            },
        ]
    }

    /// Returns the number of steps that a search looks at, at most.
    pub fn tries(&self) -> u64 {
        2 * u64::from(u64::BITS - self.last.leading_zeros()) + 1
    }

    /// Returns the value of `step`, in its unit.
    pub fn value(&self, step: u64) -> f64 {
        let value = self.first + self.by * step as f64;
        if self.unit == "%" { step as f64 } else { value }
    }

    /// Returns the knobs of `step`.
    ///
    /// # Errors
    /// [`Error::BadInput`] for a value that no knob takes.
    pub fn knobs(&self, step: u64) -> Result<Vec<Knob>, Error> {
        let value = format!("{:.2}", self.first + self.by * step as f64);
        let value = value.trim_end_matches('0').trim_end_matches('.');
        // Nothing late and nothing lost is the graph as it is.
        if step == 0 && self.first == 0.0 {
            return Ok(Vec::new());
        }
        self.knobs
            .iter()
            .map(|knob| super::knob(&knob.replace("{}", value)))
            .collect()
    }
}
