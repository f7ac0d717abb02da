//! No page on the way to an exercise has its answer.

use std::{fs, path::Path};

use exercises::framework::{Answer, Exercise};

use crate::support::{Folder, ROOT};

/// The pages that a learner reads before an exercise. `docs/age.md` and `docs/theory.md`
/// warn of their answers at the top; `docs/answers.md` is for teachers.
const PAGES: [&str; 12] = [
    "README.md",
    "docs/chapter.md",
    "docs/commands.md",
    "docs/concepts.md",
    "docs/faults.md",
    "docs/hunt.md",
    "docs/install.md",
    "docs/policies.md",
    "docs/recordings.md",
    "docs/ros2.md",
    "exercises/README.md",
    "recordings/README.md",
];

/// Pages with answers, each with a warning.
const WARNED: [(&str, &str); 7] = [
    ("docs/age.md", "predict first"),
    ("docs/plants.md", "predict first"),
    ("docs/slow-policies.md", "predict first"),
    ("docs/theory.md", "predict first"),
    ("docs/answers.md", "For teachers"),
    ("docs/teaching.md", "For teachers"),
    ("docs/throughput.md", "For after the first two exercises"),
];

fn page(name: &str) -> String {
    fs::read_to_string(Path::new(ROOT).join(name)).expect(name)
}

/// The pages and the help texts, with their names.
fn texts() -> Vec<(String, String)> {
    let pages = PAGES.iter().map(|name| ((*name).to_owned(), page(name)));
    let help = [
        "", "lab", "run", "sweep", "hunt", "exercise", "keys", "info",
    ];
    let help = help.map(|command| {
        let line = format!("{command} --help");
        let text = Folder::new().says(&line).0;
        (line, text)
    });
    pages.chain(help).collect()
}

fn measured(name: &str) -> Answer {
    let mut questions = exercises::questions();
    let exercise = questions.find(|exercise| exercise.brief().name == name);
    exercise.expect(name).run().expect("measured").answer
}

fn exactly(name: &str) -> f64 {
    match measured(name) {
        Answer::Exactly(number) => number,
        Answer::Between { .. } | Answer::Choice { .. } => panic!("{name}"),
    }
}

fn between(name: &str) -> [f64; 2] {
    match measured(name) {
        Answer::Between { from, to } => [from, to],
        _ => panic!("{name}"),
    }
}

/// What gives an answer away: all the words between `…` in one line.
fn answers() -> Vec<String> {
    // Solved transcripts; 2: what the queue does not do; 7 to 9: the runs that are asked about;
    // 12: the line; 13: the repair.
    let told = "You predicted|Measured: |\
        --break --queue-depth|queue…saves nothing|queue…changes nothing|no depth…helps|\
        --queue-depth 10…read /obs oldest|delay:40..100|/action loss…0.8|link /action loss:0.8|\
        NANOS / hz|--plan committed";
    let mut told: Vec<String> = told.split('|').map(str::to_owned).collect();
    let [held, failed] = between("cliff");
    told.push(format!("balanced up to {failed} Hz"));
    told.push(format!("all from {held} Hz"));
    told.extend((6..=9).map(|hz| format!("ratelab…control-hz {hz} ")));
    let ranges = ["5..10", "4..12", "5..9", "5..12"];
    told.extend(ranges.map(|range| format!("--control-hz {range}")));
    for (name, hz) in [("ties", "25 Hz"), ("mend", "30 Hz")] {
        told.push(format!("{hz}…{:.1} ms", exactly(name)));
    }
    told.push(format!("stable… {} Hz", exactly("limits")));
    let [held, failed] = between("rescue");
    told.push(format!("too late…{failed} s"));
    told.push(format!("slow…for {held} s"));
    for (name, hz) in [("one-law-50", "50 Hz"), ("one-law-25", "25 Hz")] {
        for delay in between(name) {
            told.push(format!("delay…{hz}… {delay} ms"));
            told.push(format!("control-hz…delay:{delay}"));
        }
    }
    let [_, failed] = between("deep-queue");
    told.push(format!("queue…falls…{failed} s"));
    told
}

/// The lines of `text` with all `words`, upper or lower case.
fn lines_with<'t>(text: &'t str, words: &str) -> Vec<&'t str> {
    let words = words.to_lowercase();
    let has = |line: &&str| {
        let line = line.to_lowercase();
        words.split('…').all(|word| line.contains(word))
    };
    text.lines().filter(has).collect()
}

#[test]
fn no_page_on_the_way_and_no_help_text_has_an_answer() {
    let (texts, mut found) = (texts(), Vec::new());
    for words in answers() {
        for (name, text) in &texts {
            let lines = lines_with(text, &words).into_iter();
            found.extend(lines.map(|line| format!("{name}: {words}: {line}")));
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn pages_with_answers_say_so_at_the_top() {
    for (name, warning) in WARNED {
        let page = page(name);
        let top: Vec<&str> = page.lines().take(4).collect();
        assert!(top.join("\n").contains(warning), "{name}");
    }
    // The search finds the answers where they are.
    let key = page("docs/answers.md");
    let mut found = answers();
    found.retain(|words| !lines_with(&key, words).is_empty());
    assert!(found.len() >= 3, "{found:?}");
}

#[test]
fn no_example_of_a_prediction_is_right() {
    let exercise: &Exercise = exercises::find(1).expect("an exercise");
    let example = "30 because fewer decisions come too late";
    assert!(page("exercises/README.md").contains(example));
    let prediction = exercises::framework::Prediction::read(example, exercise.brief());
    let findings = exercise.run().expect("measured");
    let (right, _) = findings.judge(exercise.brief(), &prediction.expect("read"));
    assert!(!right);
}
