//! The lines that the lab and a program exchange: what is asked, and which answers count.

use std::{fs, os::unix::fs::symlink};

use tempfile::TempDir;

use crate::{clone::root, support::*, table::rows};

/// The folder of a program, with what it says and what it is asked.
struct Program(TempDir);

impl Program {
    /// One that says these lines.
    fn saying(lines: &[&str]) -> Self {
        let folder = TempDir::new().expect("a folder");
        // One file for all tests: while another process begins, a new one may not be started.
        let script = root().join("tests/fixtures/policies/says.sh");
        symlink(script, folder.path().join("policy")).expect("a link");
        let says = lines.join("\n") + "\n";
        fs::write(folder.path().join("policy.says"), says).expect("written");
        Self(folder)
    }

    /// Starts it for chunks of so many actions, or for single ones.
    fn start(&self, chunk: Option<usize>) -> Result<SwappablePolicy, String> {
        let path = self.0.path().join("policy");
        let spec = path.to_str().expect("UTF-8").parse();
        started(&spec.expect("a policy"), chunk).map_err(|error| error.to_string())
    }

    /// What it was asked so far, line by line.
    fn asked(&self) -> Vec<serde_json::Value> {
        let asked = fs::read_to_string(self.0.path().join("policy.asked")).expect("asked");
        let asked = asked.lines().map(serde_json::from_str);
        asked.collect::<Result<_, _>>().expect("JSON")
    }
}

/// A reading of which every number is this one.
fn reading(number: f32) -> Observation {
    Observation::from_row(&[number.into(); 5]).expect("a reading")
}

/// Its answer to a question: whether a chunk, and why it crashed, if it did.
fn answer(policy: &mut SwappablePolicy) -> (bool, String) {
    let chunk = policy.whole_chunk(&reading(0.0));
    if chunk.is_none() {
        policy.act(&reading(0.0));
    }
    (chunk.is_some(), policy.crash().unwrap_or_default())
}

#[test]
fn a_program_says_what_it_answers_with_and_how_long_it_takes() {
    for [ready, chunks, said] in rows(
        r#"
        {"ready":"actions"}                | false | gave no answer for 5 s
        {"ready":"chunks","limit_s":0.125} | true  | gave no answer for 0.125 s
        {"ready":"chunks","limit_s":0}     |       | asked for a limit_s of 0: expected seconds
        {"ready":"chunks","limit_s":1e300} |       | up to 86400
        {"ready":true}                     |       | expected {"ready"
        {"id":1,"action":0}                |       | expected {"ready"
                                           |       | answered ""
        "#,
    ) {
        let (is_chunk, why) = match Program::saying(&[&ready]).start(Some(2)) {
            Ok(mut policy) => {
                let (is_chunk, why) = answer(&mut policy);
                (is_chunk.to_string(), why)
            }
            Err(why) => (String::new(), why),
        };
        assert_eq!(is_chunk, chunks, "{ready}: {why}");
        assert!(why.contains(&said), "{ready}: {why}");
    }
}

#[test]
fn only_an_answer_to_the_question_is_taken() {
    for [line, horizon, wrong] in rows(
        r#"
        {"id":1,"action":0.5}               |   |
        {"id":1,"actions":[1,-1]}           | 2 |
        {"id":2,"action":0.5}               |   | answered question 2 where 1 was asked
        {"id":1,"actions":[1]}              | 2 | 1 actions, and a chunk has 2
        {"id":1,"actions":[1,2,3]}          | 2 | 3 actions, and a chunk has 2
        {"id":1,"action":0.5}               | 2 | expected {"id":1,"actions"
        {"id":1,"actions":[1]}              |   | expected {"id":1,"action":0.5}
        {"id":1,"action":1,"actions":[1]}   |   | expected
        {"id":1,"action":NaN}               |   | expected
        {"id":1,"action":"0.5"}             |   | expected
        {"id":1,"action":[0.5]}             |   | expected
        {"id":1,"action":null}              |   | expected
        {"id":1,"action":1e39}              |   | a finite float32
        {"id":1,"actions":[0,1e39]}         | 2 | a finite float32
        {"id":1,"action":1e999}             |   | expected
        {"id":1,"action":1,"dropped":0}     |   | expected
        hello                               |   | answered "hello"
                                            |   | answered ""
        "#,
    ) {
        let horizon = horizon.parse().ok();
        let ready = match horizon {
            Some(_) => r#"{"ready":"chunks"}"#,
            None => r#"{"ready":"actions"}"#,
        };
        let mut policy = Program::saying(&[ready, &line])
            .start(horizon)
            .expect("ready");
        let (_, why) = answer(&mut policy);
        assert_eq!(why.is_empty(), wrong.is_empty(), "{line}: {why}");
        assert!(why.contains(&wrong), "{line}: {why}");
    }
}

#[test]
fn numbers_go_both_ways_without_a_change() {
    let numbers = [0.1_f32, -0.0, 1e-45, f32::MAX, 0.333_333_34];
    let answers = (1..).zip(numbers).map(|(id, number)| {
        let action = serde_json::to_string(&f64::from(number)).expect("JSON");
        format!("{{\"id\":{id},\"action\":{action}}}")
    });
    let answers: Vec<String> = answers.collect();
    let ready = [r#"{"ready":"actions"}"#].into_iter();
    let lines: Vec<&str> = ready.chain(answers.iter().map(String::as_str)).collect();
    let program = Program::saying(&lines);
    let mut policy = program.start(None).expect("ready");
    for number in numbers {
        let Action(back) = policy.act(&reading(number));
        assert_eq!(policy.crash(), None);
        assert_eq!(back.to_bits(), number.to_bits(), "{number:e}");
    }
    // The first line is the greeting.
    let asked = program.asked();
    let questions = asked[1..].iter().map(|line| &line["observation"]);
    for (seen, number) in questions.zip(numbers) {
        let expected = [f64::from(number).to_bits(); 5];
        let seen: [f64; 5] = serde_json::from_value(seen.clone()).expect("numbers");
        assert_eq!(seen.map(f64::to_bits), expected, "{number:e}");
    }
    assert_eq!(asked.len(), 1 + numbers.len());
}

#[test]
fn a_policy_in_a_file_sees_the_numbers_that_it_is_set_to_see() {
    let program = Program::saying(&[r#"{"ready":"actions"}"#, r#"{"id":1,"action":0.5}"#]);
    let path = program.0.path().join("policy");
    let spec: PolicySpec = path.to_str().expect("UTF-8").parse().expect("a policy");
    let context = PolicyContext {
        seed: 0,
        control_hz: hz(CONTROL_HZ),
        chunk: None,
    };
    let terms: CartTerms = "x v  theta*2 spin 1.5".parse().expect("terms");
    assert_eq!(terms.to_string(), "x v theta*2 spin 1.5");
    assert_eq!(CartTerms::default().to_string(), "x v cos sin spin");
    let cache = PolicyCache::default().seeing(terms);
    let mut policy = SwappablePolicy::new(&spec, cache, context, None).expect("a policy");
    let row = [0.25, -0.5, 0.6, 0.8, 2.0];
    policy.act(&Observation::from_row(&row).expect("a reading"));
    let seen = program.asked()[1]["observation"].clone();
    let seen: Vec<f64> = serde_json::from_value(seen).expect("numbers");
    let theta = f64::from(0.8_f32).atan2(f64::from(0.6_f32));
    assert_eq!(seen, [0.25, -0.5, 2.0 * theta, 2.0, 1.5]);
    for wrong in ["", "y", "x*", "x*nan", "inf", "theta*2*3"] {
        let error = wrong.parse::<CartTerms>().expect_err(wrong).to_string();
        assert!(error.contains("expected names of x, v"), "{error}");
    }
    let long = "x ".repeat(65).parse::<CartTerms>();
    assert!(long.is_err());
}
