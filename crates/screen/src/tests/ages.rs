//! The age in the header and its parts, in graphs with triggers and executors.

use super::*;

/// A session with the graph in `text`.
fn begun(text: &str, speed: Speed) -> App {
    let system = graph(text);
    let config = Config {
        end: seconds(7.3),
        speed,
        setup: system.about().setup(),
        ..Config::default()
    };
    opened(SessionSetup::new(system, None), &config)
}

/// A session with the graph in `text` whose run is over.
fn over(text: &str) -> App {
    let mut app = begun(text, Speed::Unlimited);
    end(&mut app);
    app
}

/// The age of the header (ms), and the sum of its parts as they are printed.
fn header(text: &str) -> Option<(u64, u64)> {
    let screen = large(&over(text));
    let line = screen.lines().find(|line| line.contains(" held "))?;
    let digits = |text: &str| -> u64 {
        let digits: String = text.chars().filter(char::is_ascii_digit).collect();
        digits.parse().unwrap_or_default()
    };
    let (age, parts) = line.split_once(" ms ")?;
    Some((digits(age), parts.split(" + ").map(digits).sum()))
}

#[test]
fn at_each_moment_the_push_has_an_age_and_is_not_older_than_the_oldest_that_is_told() {
    let run = recorded(setup(), &config("control-hz 5"), 0.0);
    let mut app = App::for_recording(Arc::new(run), setup());
    for at in (0..840).step_by(7) {
        app.jump(sample::ms(at));
        super::sample(&mut app);
        let (shown, drawn) = (frame(&app), small(&app));
        let age = shown.age.expect(&drawn).greatest.as_millis();
        let push = shown.push.expect(&drawn);
        let words: Vec<&str> = push.sentence.whole().split(' ').collect();
        let now: u128 = words[3].parse().expect("this push is N ms old");
        assert!(now <= age, "{now} of {age} ms:\n{drawn}");
    }
}

#[test]
fn a_replay_shows_the_curve_of_the_age_and_its_own_speed_in_the_default_terminal() {
    let run = recorded(setup(), &config("control-hz 5"), 0.0);
    let mut app = App::for_recording(Arc::new(run), setup());
    app.suggest_playing();
    app.jump(seconds(0.4));
    super::sample(&mut app);
    let drawn = small(&app);
    shows(&drawn, &["▷ replay", "push age (ms)", "0.840 s  0.1×"]);
    assert!(!drawn.contains("virtual max"), "{drawn}");
}

/// Two images that match, and a planner with a rate of its own; the times are no whole
/// milliseconds.
const PAIR: &str = r#"
name = "pair"
[node]
left = { rate = 13, takes = "3..9", publishes = ["/left"] }
right = { rate = 31, takes = "5..30", publishes = ["/right"] }
stereo = { trigger = ["/left", "/right"], match = "MATCH", takes = "2..7", publishes = ["/pose"] }
planner = { rate = 17, takes = 3.3, reads = ["/pose"], publishes = ["/path"] }
[executor]
one = { kind = "KIND", nodes = ["stereo", "planner"] }
[chain]
see.path = ["left", "/left", "stereo", "/pose", "planner", "/path"]
other.path = ["right", "/right", "stereo", "/pose", "planner", "/path"]
"#;

#[test]
fn the_parts_in_the_header_add_up_to_the_age() {
    for matching in ["each", "approximate:10"] {
        for kind in ["single", "multi:2", "events", "fixed-priority:1"] {
            let text = PAIR.replace("MATCH", matching).replace("KIND", kind);
            let (age, sum) = header(&text).expect("an age");
            assert_eq!(sum, age, "{matching} {kind}");
            assert!(age > 0);
        }
    }
    for file in ["autoware", "robot"] {
        let path = format!("{}/../../graphs/{file}.toml", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(path).expect("a file");
        let (age, sum) = header(&text).expect("an age");
        assert_eq!(sum, age, "{file}");
    }
}

#[test]
fn a_refused_clock_is_not_the_one_shown_and_the_reason_is() {
    let text = PAIR
        .replace("MATCH", "each")
        .replace("KIND", "edf:1")
        .replace("match =", "deadline_ms = 20, match =");
    let mut app = begun(&text, Speed::REAL_TIME);
    // The second time as the first: it asks for the other clock again.
    for _ in 0..2 {
        press(&mut app, "c");
        until(&mut app, |app| app.notice.is_some());
        shows(said(&app), &["edf:1 needs real-time"]);
        shows(&small(&app), &["edf:1 needs real-time"]);
    }
}

/// A slow planner behind a camera, on an executor with another node.
const SHARED: &str = r#"
name = "shared"
[node]
camera = { rate = 20, publishes = ["/image"] }
planner = { rate = 5, takes = 20, reads = ["/image"], publishes = ["/path"] }
map = { rate = 5, takes = COST }
[executor]
one = { kind = "single", nodes = ["planner", "map"] }
[chain]
see = { path = ["camera", "/image", "planner", "/path"], age_ms = 120 }
"#;

#[test]
fn no_higher_rate_is_advised_where_there_is_no_time_for_it() {
    for (cost, advised) in [("0.1", true), ("178", false)] {
        let verdict = verdict(&over(&SHARED.replace("COST", cost)));
        for (part, said) in [
            ("rate planner 10", advised),
            ("no time for a higher rate", !advised),
        ] {
            assert_eq!(verdict.contains(part), said, "{cost}: {part} in {verdict}");
        }
    }
}

#[test]
fn a_run_at_full_speed_is_not_called_silent_or_lost_because_its_screen_is_behind() {
    let system = graph(
        "name = \"late\"
        node.a = { rate = 10, publishes = [\"/a\"] }
        node.b = { rate = 10, offset = 3, reads = [\"/a\"], publishes = [\"/b\"] }
        chain.c = { path = [\"a\", \"/a\", \"b\", \"/b\"], age_ms = 500 }",
    );
    let config = Config {
        end: Time::MAX,
        speed: Speed::Unlimited,
        setup: system.about().setup(),
        ..Config::default()
    };
    let mut app = opened(SessionSetup::new(system, None), &config);
    sample(&mut app);
    until(&mut app, |app| frame(app).now > seconds(1.0));
    for _ in 0..50 {
        sample(&mut app);
        let verdict = verdict(&app);
        assert!(verdict.contains("KEPT so far"), "{verdict}");
    }
}

#[test]
fn a_limit_is_not_called_kept_before_the_first_data() {
    let text = SHARED
        .replace("COST", "1")
        .replace("rate = 5", "rate = 0.2")
        .replace("takes = 20", "takes = 20, offset = 4000");
    let mut app = begun(&text, Speed::REAL_TIME);
    sample(&mut app);
    until(&mut app, |app| frame(app).now > Time::ZERO);
    let parts = ["no data so far", "no data on chain see"];
    shows(&verdict(&app), &parts);
}
