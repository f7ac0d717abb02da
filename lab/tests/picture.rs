//! Pictures of the dashboard, for slides.

mod support;

use std::fs;

use support::{complaint, folder, path, ratelab, reference, text};

fn picture(args: &[&str]) -> String {
    let folder = folder();
    let file = path(&folder, "lab.svg");
    let output = ratelab(&[&["picture", "-o", &file], args].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    fs::read_to_string(file).expect("a picture")
}

/// The characters of a picture, row by row.
fn letters(svg: &str) -> String {
    let texts = svg.lines().filter_map(|line| line.strip_prefix("<text "));
    let letters = texts.filter_map(|text| text.split_once('>')?.1.strip_suffix("</text>"));
    letters.collect()
}

#[test]
fn a_picture_is_that_of_the_moment_and_the_same_every_time() {
    let fall = reference("fall-5hz.rrd");
    let at = |at: &str| letters(&picture(&[&fall, "--at", at, "--size", "80x24"]));
    let (early, late) = (at("0.3"), at("0.84"));
    assert!(
        early.contains("0.30ssim") && late.contains("0.84ssim"),
        "{early}\n{late}"
    );
    assert!(late.contains("FELL") && !early.contains("FELL"), "{late}");
    let run = ["--control-hz", "8", "--at", "2"];
    let (first, again) = (picture(&run), picture(&run));
    // But for the wall time, in whole seconds.
    assert_eq!(first.lines().count(), again.lines().count());
    assert!(letters(&first).contains("8Hz"), "{}", letters(&first));
}

#[test]
fn themes_have_papers_of_their_own() {
    for (theme, paper) in [
        ("dark", "#16181d"),
        ("light", "#ffffff"),
        ("high", "#000000"),
    ] {
        let svg = picture(&["--at", "0.5", "--theme", theme]);
        assert!(
            svg.contains(&format!("rx=\"6\" fill=\"{paper}\"")),
            "{theme}"
        );
    }
}

#[test]
fn what_cannot_be_drawn_is_refused_in_a_line() {
    let fall = reference("fall-5hz.rrd");
    for (args, part) in [
        (&["--size", "10x10"][..], "40x12 to 400x200"),
        (&["--size", "wide"], "such as 120x35"),
        (&["--clock", "real"], "virtual clock"),
        (
            &[&fall, "--seed", "3"],
            "leave the options of the graph out",
        ),
        (&[&fall, "--at", "9"], "choose an earlier moment"),
        (&[&fall, "-o", &fall], "this is the file that is read"),
    ] {
        let said = complaint(&ratelab(&[&["picture"], args].concat()), 2);
        assert!(said.contains(part), "{args:?}: {said}");
    }
}
