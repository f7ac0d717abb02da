//! What else than a limit loses a run: a low body, a tilted one, one that touches something.

use mujoco_rs::prelude::MjtObjBase;

use crate::{BodyData, PlantDefect, defect::parse_items, model::RobotModel};

/// The key with the rules.
const LOST: &str = "lost";

/// A rule by which a run is lost.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LossRule {
    /// The rule, as in the file.
    pub(crate) text: String,
    kind: LossKind,
    body: usize,
    bound: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum LossKind {
    /// The origin of the body is lower than this (m).
    Height,
    /// Its z axis is farther from the world's than this (degrees).
    Tilt,
    /// It has more contacts than this.
    Touches,
}

impl LossRule {
    /// Reads the rules of a file for `model`.
    ///
    /// # Errors
    /// [`PlantDefect`] for a rule of another form, and an unknown body.
    pub(crate) fn parse(texts: &[String], model: &RobotModel) -> Result<Vec<Self>, PlantDefect> {
        parse_items(texts, |text| Self::parse_one(text, model))
    }

    fn parse_one(text: &str, model: &RobotModel) -> Result<Self, PlantDefect> {
        let text = text.trim();
        let no_rule = || {
            let what = format!(
                "{text:?} does not say what loses a run: expected \"height BODY < METRES\", \"tilt \
                 BODY > DEGREES\" or \"touches BODY > 0\""
            );
            PlantDefect::new(LOST, what)
        };
        let (kind, rest) = text.split_once(char::is_whitespace).ok_or_else(no_rule)?;
        let (kind, sign) = match kind {
            "height" => (LossKind::Height, '<'),
            "tilt" => (LossKind::Tilt, '>'),
            "touches" => (LossKind::Touches, '>'),
            _ => return Err(no_rule()),
        };
        let (body, bound) = rest.rsplit_once(sign).ok_or_else(no_rule)?;
        let bound = bound.trim().parse().ok().filter(|bound: &f64| match kind {
            LossKind::Height => bound.is_finite(),
            LossKind::Tilt => (0.0..180.0).contains(bound),
            LossKind::Touches => *bound == 0.0,
        });
        let name = body.trim();
        let body = model.named(MjtObjBase::mjOBJ_BODY, name);
        Ok(Self {
            text: text.to_owned(),
            kind,
            bound: bound.ok_or_else(no_rule)?,
            body: body.map_err(|names| PlantDefect::unknown(LOST, "body", name, &names))?,
        })
    }

    /// Returns whether it loses the run in `data`, where all that follows from the positions was
    /// computed.
    pub(crate) fn holds(&self, data: &BodyData) -> bool {
        match self.kind {
            LossKind::Height => data.xpos()[self.body][2] < self.bound,
            LossKind::Tilt => {
                let [.., up] = data.xmat()[self.body];
                up.clamp(-1.0, 1.0).acos().to_degrees() > self.bound
            }
            LossKind::Touches => {
                let bodies = data.model().geom_bodyid();
                let is_of_it = |geom: i32| {
                    let geom = usize::try_from(geom).ok();
                    let body = geom.and_then(|geom| bodies.get(geom));
                    body.is_some_and(|body| *body as usize == self.body)
                };
                data.contact().iter().any(|contact| {
                    contact.dist <= 0.0 && contact.geom.iter().any(|geom| is_of_it(*geom))
                })
            }
        }
    }
}
