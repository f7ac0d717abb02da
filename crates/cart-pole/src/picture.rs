//! Cart and pole as a picture.

use ratelab_system::{Picture, Shape, Style};

use super::{CART_LIMIT_M, ControlStep, MOTOR_N, POLE_LIMIT_RAD, Pose};

/// Length of the pole (m), from the model.
const POLE_M: f64 = 1.0;

/// Half the width and half the height of the cart (m), from the model.
const CART_HALF_M: [f64; 2] = [0.1, 0.05];

/// Height of the rail (m): a little below the cart, to distinguish the two.
const RAIL_M: f64 = -0.09;

/// Height of the end stops and length of the longest push (m).
const STOP_M: f64 = 0.15;
const PUSH_M: f64 = 0.5;

/// The preferred visible area: the rail with a small margin (m).
const VIEW: [f64; 4] = [-2.6, -0.15, 2.6, 1.1];

/// Draws cart and pole after `step`.
pub(super) fn draw(step: &ControlStep) -> Picture {
    let pose = Pose::new(step.qpos);
    let cart = pose.cart_position;
    let arm = |angle: f64, length: f64| Shape::Segment {
        from: [cart, 0.0],
        to: [cart + length * angle.sin(), length * angle.cos()],
    };
    let mut shapes = rail();
    for limit in [-POLE_LIMIT_RAD, POLE_LIMIT_RAD] {
        shapes.push((Style::Limit, arm(limit, 1.08 * POLE_M)));
    }
    let push = f64::from(step.action.0);
    shapes.extend(arrow(cart, push).map(|arrow| (Style::Action, arrow)));
    let body = Shape::Box {
        centre: [cart, 0.0],
        half: CART_HALF_M,
        angle: 0.0,
    };
    shapes.push((Style::Body, body));
    shapes.push((Style::Subject, arm(pose.pole_angle, POLE_M)));
    Picture {
        shapes,
        view: VIEW,
        focus: [cart, 0.0],
        captions: vec![
            format!("angle {:+7.2}°", pose.pole_angle.to_degrees()),
            format!("cart {cart:+.2} m"),
            format!("push {push:+.2} ({:+.1} N)", push * MOTOR_N),
        ],
    }
}

/// Returns the rail with its end stops, and a label at every metre.
fn rail() -> Vec<(Style, Shape)> {
    let y = RAIL_M;
    let mut shapes = vec![Shape::Segment {
        from: [-CART_LIMIT_M, y],
        to: [CART_LIMIT_M, y],
    }];
    for x in [-CART_LIMIT_M, CART_LIMIT_M] {
        shapes.push(Shape::Segment {
            from: [x, y],
            to: [x, STOP_M],
        });
    }
    for x in [-CART_LIMIT_M, -1.0, 0.0, 1.0, CART_LIMIT_M] {
        let text = if x == 0.0 {
            "0 m".to_owned()
        } else {
            format!("{x:+} m")
        };
        shapes.push(Shape::Label { at: [x, y], text });
    }
    let scenery = |shape| (Style::Scenery, shape);
    shapes.into_iter().map(scenery).collect()
}

/// Returns a bar on the side to which the cart is pushed; `None` without a push.
fn arrow(cart: f64, push: f64) -> Option<Shape> {
    let (side, length) = (push.signum(), push.abs().min(1.0) * PUSH_M);
    let from = cart + side * 1.2 * CART_HALF_M[0];
    (length > 0.01).then_some(Shape::Segment {
        from: [from, 0.0],
        to: [from + side * length, 0.0],
    })
}
