//! The appearance of the plant.

use ratatui::style::Modifier;

use super::*;
use crate::{frame::FrameData, view::testing::*};

fn pane(frame: &FrameData, size: (u16, u16), theme: &Theme) -> Buffer {
    let picture = sample::picture(frame);
    screen(size, theme, |sheet| {
        render(picture.as_ref(), PictureFit::Area, &frame.verdict, sheet)
    })
}

#[test]
fn the_whole_rail_is_in_sight() {
    insta::assert_snapshot!(text(&pane(&sample::balanced(), (62, 13), &POOR)), @"
    +2 plant-----------------------------------------------------+
    |                                                            |
    |                           .  *  .                          |
    |                            . *  .                          |
    |                            . * .                           |
    |                              *                             |
    |                             .*.                            |
    |   |                          *.                         |  |
    |   |                         #*#>                        |  |
    |   |-----------------------------------------------------|  |
    |-2.4 m           -1 m        0 m       +1 m           +2.4 m|
    | angle   -0.69 deg   cart +0.04 m   push +0.18 (+1.8 N)     |
    +------------------------------------------------------------+
    ");
}

#[test]
fn a_narrow_view_follows_the_cart() {
    let mut far = sample::balanced();
    far.state = sample::state(2.3, -0.012, 0.18);
    insta::assert_snapshot!(text(&pane(&far, (34, 10), &RICH)), @"
    ┌2 plant─────────────────────────┐
    │                          ⢆ ⣤ ⢀⠆│
    │                          ⢨ ⣿ ⢨ │
    │                           ⡇⣿ ⡇ │
    │                           ⢱⡏⣶⠁ │
    │                           ⠈⡇⡏  │
    │                           ⢀⣧⣷  │
    │⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠼⠿⠿⠉⠁│
    │ angle   −0.69°   cart +2.30 m  │
    └────────────────────────────────┘
    ");
}

#[test]
fn a_fall_is_said_and_seen() {
    let buf = pane(&sample::broken(), (62, 13), &RICH);
    assert_eq!(styled(&buf, RICH.alarm()), " ✖ pole fell ");
    // Above the cart, this style is the pole's.
    let pole = buf.content[..62 * 8].iter().filter(|cell| {
        cell.style().fg == RICH.alarm().fg && !cell.modifier.contains(Modifier::REVERSED)
    });
    assert!(pole.count() >= 6);
    let good = pane(&sample::balanced(), (62, 13), &RICH);
    assert!(styled(&good, RICH.alarm_line()).is_empty());
}

#[test]
fn angles_look_true() {
    let mut frame = sample::balanced();
    frame.state = sample::state(0.0, 45_f64.to_radians(), 0.0);
    let buf = pane(&frame, (90, 20), &POOR);
    let star = |x: &u16, y: &u16| buf[(*x, *y)].symbol() == "*";
    let wide = (0..90).filter(|x| (0..20).any(|y| star(x, &y))).count();
    let high = (0..20).filter(|y| (0..90).any(|x| star(&x, y))).count();
    // A cell is twice as high as wide.
    assert!(high > 4 && wide.abs_diff(2 * high) <= 2, "{wide} x {high}");
}

#[test]
fn any_size_and_any_pose_will_do() {
    let mut frame = sample::broken();
    for (cart, angle) in [(-0.3, 0.2), (9.0, -3.1), (f64::NAN, f64::INFINITY)] {
        frame.state = sample::state(cart, angle, angle);
        let picture = sample::picture(&frame);
        for fit in [PictureFit::Area, PictureFit::Robot] {
            torture(|sheet| render(picture.as_ref(), fit, &frame.verdict, sheet));
        }
    }
    torture(|sheet| render(None, PictureFit::Area, &frame.verdict, sheet));
}

#[test]
fn the_pole_grows_with_the_pane() {
    for (size, least) in [((34, 10), 4), ((62, 13), 5), ((46, 20), 10), ((60, 34), 16)] {
        let drawn = text(&pane(&sample::balanced(), size, &POOR));
        let rows = drawn.lines().filter(|line| line.contains('*')).count();
        assert!(rows >= least, "{rows} of {least} rows:\n{drawn}");
    }
}
