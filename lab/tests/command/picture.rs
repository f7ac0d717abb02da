//! Pictures of the dashboard, for slides.

use crate::support::{Folder, Said};

fn picture(options: &str) -> Said {
    let folder = Folder::with(&["recordings/fall-5hz.rrd"]);
    folder.says(&format!("picture -o lab.svg {options}"));
    Said(folder.read("lab.svg"))
}

/// The characters of a picture, row by row.
fn letters(svg: &str) -> Said {
    let texts = svg.lines().filter_map(|line| line.strip_prefix("<text "));
    let letters = texts.filter_map(|text| text.split_once('>')?.1.strip_suffix("</text>"));
    Said(letters.collect())
}

#[test]
fn a_picture_is_that_of_the_moment_and_the_same_every_time() {
    let at = |at: &str| letters(&picture(&format!("fall-5hz.rrd --at {at} --size 80x24")));
    at("0.3").has("0.30ssim").lacks("FELL");
    at("0.84").has("0.84ssim").has("FELL");
    let run = "--control-hz 8 --at 2";
    let (first, again) = (picture(run), picture(run));
    // But for the wall time, in whole seconds.
    assert_eq!(first.lines().count(), again.lines().count());
    letters(&first).has("8Hz");
}
