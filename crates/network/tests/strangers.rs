//! Strangers on the network: what they send is counted, and never obeyed.

mod support;

use std::{
    fs,
    io::Write,
    net::TcpStream,
    path::{Path, PathBuf},
    sync::Arc,
    thread,
    time::Duration,
};

use ratelab::Command;
use ratelab_cart_pole::CartPole;
use ratelab_experiment::Experiment;
use ratelab_network::{
    Bridge, Refusal, Settings,
    key::{Keys, Of},
    machine::ClockMoment,
    packet::{self, PacketHead},
    telemetry::Order,
};
use support::{address, connect, connects, listen, until, until_met};
use zenoh::{Session, Wait};

const PLANT: [&str; 2] = ["sensor", "actuator"];
const POLICY: [&str; 1] = ["policy"];

fn cart_pole() -> Arc<CartPole> {
    Arc::default()
}

/// Nodes and topics as of the cart-pole, without a pole that falls while the machine is busy.
const STEADY: &str = "
    name = 'cart-pole'
    node.sensor = { rate = 50, publishes = ['/obs'] }
    node.policy = { rate = 50, reads = ['/obs'], publishes = ['/action'] }
    node.actuator = { rate = 50, reads = ['/action'] }
";

/// Where the plant's process takes actions from.
fn actions() -> String {
    Keys::new("cart-pole").data("policy", "/action")
}

/// A connection of somebody who knows the address.
fn stranger(address: &str) -> Session {
    connect(address, None).open().expect("anybody may connect")
}

/// The plant's part of the cart-pole, which listens, also in the domain `ros`.
fn plant(address: &str, ros: u32) -> (Experiment, Bridge) {
    support::part(cart_pole(), &PLANT, &listen(address, None), Some(ros))
}

/// A part of a run of a minute.
fn steady(nodes: &[&str], end: &Settings) -> (Experiment, Bridge) {
    support::part_for(60.0, support::graph(STEADY), nodes, end, None)
}

/// The type of joint states, as ROS names it.
const JOINT_STATES: &str = "sensor_msgs::msg::dds_::JointState_/\
    RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e";

/// Sends to `key` what no sender of ours does, again and again.
fn flood(session: &Session, rounds: usize) {
    let key = actions();
    for seq in 0..rounds as u64 {
        let head = PacketHead {
            incarnation: 666,
            seq,
            stamp: ClockMoment::now(),
            origin: None,
        };
        for bytes in [
            vec![0xff; 64],
            packet::encode(&head, &[10.0, 10.0]),
            packet::encode(&head, &[f64::NAN]),
            packet::encode(&head, &[10.0]),
        ] {
            let _ = session.put(&key, bytes).wait();
        }
    }
}

#[test]
fn what_strangers_send_is_counted_and_the_run_goes_on() {
    let address = address();
    let (plant, there) = steady(&PLANT, &listen(&address, None));
    let (policy, here) = steady(&POLICY, &connect(&address, None));
    until_met(&there, &here);
    let socket = address.trim_start_matches("tcp/").to_owned();
    let (observer, stops) = (plant.observer(), [plant.commands(), policy.commands()]);
    let arrived = || {
        let topics = observer.snapshot().topics;
        let action = topics.iter().find(|topic| &*topic.name == "/action");
        action.map_or(0, |action| action.published)
    };
    let more = thread::scope(|scope| {
        let policy = scope.spawn(|| policy.run().expect("a run"));
        let plant = scope.spawn(|| plant.run().expect("a run"));
        // The first sender has to be the policy.
        until(|| there.inlets()[0].sender().starts > 0);
        flood(&stranger(&address), 100);
        let large = stranger(&address);
        let _ = large.put(actions(), vec![0; 100_000_000]).wait();
        for _ in 0..2_000 {
            let connected = TcpStream::connect(&socket);
            let _ = connected.map(|mut open| open.write_all(&[0xaa; 64]));
        }
        let idle: Vec<_> = (0..150).map(|_| TcpStream::connect(&socket)).collect();
        let before = arrived();
        until(|| arrived() >= before + 50 || plant.is_finished());
        let more = arrived() - before;
        for stop in stops {
            // It may have ended.
            let _ = stop.send(Command::Stop);
        }
        plant.join().expect("a thread");
        drop((idle, policy.join().expect("a thread")));
        more
    });
    let inlet = &there.inlets()[0];
    let refused = inlet.refused.read();
    use Refusal::{Format, Length, NotFinite, Sender};
    for why in [Format, Length, NotFinite, Sender] {
        let count = refused.get(&why).copied().unwrap_or_default();
        assert!(count >= 100, "{why}: {refused:?}");
    }
    let sender = inlet.sender();
    assert_eq!((sender.lost, sender.starts), (0, 1), "{refused:?}");
    assert!(more >= 50, "{more} actions arrived afterwards");
}

#[test]
fn presences_that_nobody_answers_for_keep_no_process_out() {
    let address = address();
    let (plant, there) = steady(&PLANT, &listen(&address, None));
    let (session, keys) = (stranger(&address), Keys::new("cart-pole"));
    // Whoever asks them waits for as long as the questions are kept.
    let (keep, _kept) = std::sync::mpsc::channel();
    let claimed = (1..=200).map(|number| {
        let keep = keep.clone();
        let mute = session.declare_queryable(keys.endpoint(number, Of::INFO));
        let mute = mute.callback(move |query| drop(keep.send(query)));
        let token = session.liveliness().declare_token(keys.process(number));
        (
            mute.wait().expect("mute"),
            token.wait().expect("a presence"),
        )
    });
    let claimed: Vec<_> = claimed.collect();
    let (policy, here) = steady(&POLICY, &connect(&address, None));
    let stops = [plant.commands(), policy.commands()];
    let policy = thread::spawn(move || drop((policy.run().expect("a run"), here)));
    until(|| !there.others().is_empty() && there.have_begun(&there.others()));
    assert_eq!(there.others()[0].nodes, POLICY);
    let plant = thread::spawn(|| drop(plant.run().expect("a run")));
    until(|| there.inlets()[0].sender().starts > 0 || plant.is_finished());
    assert_eq!(there.inlets()[0].sender().starts, 1, "actions came");
    stops
        .into_iter()
        .for_each(|stop| stop.send(Command::Stop).expect("it runs"));
    [plant, policy]
        .into_iter()
        .for_each(|run| run.join().expect("a thread"));
    drop(claimed);
}

#[test]
fn a_ros_node_begins_the_run_if_it_acts_and_not_if_it_looks_on() {
    let address = address();
    let (_plant, bridge) = plant(&address, 9);
    let session = stranger(&address);
    let [obs, action] = ["obs", "action"].map(|topic| format!("{topic}/{JOINT_STATES}"));
    let looks_on = [format!("9/{obs}"), "9/**".to_owned()].map(|key| {
        let looks_on = session.declare_subscriber(key).callback(|_| ());
        looks_on.wait().expect("a subscriber")
    });
    let token = |zid: &str| {
        let token = format!("@ros2_lv/9/{zid}/0/1/MP/%/%/policy/%{action}/::,1:,:,:,,");
        let token = session.liveliness().declare_token(token);
        token.wait().expect("a token")
    };
    // Of a process of ratelab itself: its messages come without ROS.
    let own = session.info().routers_zid().wait().next();
    let of_ours = token(&own.expect("the plant").to_string());
    // Tokens and subscriptions come in order: after this answer they are there.
    let known = session.liveliness().get("@ros2_lv/9/**").wait();
    let known = known.expect("asked");
    while known.recv().is_ok() {}
    assert!(!bridge.has_ros_nodes());
    drop(of_ours);
    let _acts = token("b0b");
    until(|| bridge.has_ros_nodes());
    drop(looks_on);
}

/// A force of 1 N as ROS nodes send it: a joint state in CDR, after its representation.
fn ros_action() -> Vec<u8> {
    let words = |words: &[u32]| words.iter().flat_map(|word| word.to_le_bytes()).collect();
    // Stamp, frame, one name, no positions, no velocities, one effort.
    let parts: [Vec<u8>; 4] = [
        words(&[0x0100, 0, 0, 1, 0, 1, 5]),
        b"cart\0\0\0\0".to_vec(),
        words(&[0, 0, 1, 0]),
        1.0f64.to_le_bytes().to_vec(),
    ];
    parts.concat()
}

/// What runs in the process that listens, as it answers.
fn info_of_plant(session: &Session) -> serde_json::Value {
    // A session learns only after a while who answers.
    loop {
        let all = Keys::new("cart-pole").all_endpoints(Of::INFO);
        let infos = session.get(all).wait().expect("asked");
        if let Ok(answer) = infos.recv() {
            let info = answer.into_result().expect("of the plant");
            return serde_json::from_slice(&info.payload().to_bytes()).expect("JSON");
        }
    }
}

#[test]
fn who_claims_the_session_of_a_ros_node_does_not_silence_it() {
    let address = address();
    let (plant, there) = plant(&address, 4);
    let [policy, stranger] = [(), ()].map(|()| stranger(&address));
    let zid = policy.zid();
    let keys = Keys::new("cart-pole");
    let mut info = info_of_plant(&policy);
    let number = u128::from_le_bytes(zid.to_le_bytes()) as u64;
    for (name, value) in [
        ("session", zid.to_string().into()),
        ("incarnation", number.into()),
        ("nodes", serde_json::json!([])),
        ("is_hub", false.into()),
    ] {
        info[name] = value;
    }
    let key = keys.endpoint(number, Of::INFO);
    let claims = stranger.declare_queryable(key.clone());
    let claims = claims.callback(move |query| {
        let _ = query.reply(key.clone(), info.to_string()).wait();
    });
    let _claims = claims.wait().expect("a queryable");
    let token = stranger.liveliness().declare_token(keys.process(number));
    let _token = token.wait().expect("a presence");
    let key = format!("action/{JOINT_STATES}");
    let token = format!("@ros2_lv/4/{zid}/0/1/MP/%/%/policy/%{key}/::,1:,:,:,,");
    let gid = xxhash_rust::xxh3::xxh3_128(token.as_bytes()).to_le_bytes();
    let token = policy.liveliness().declare_token(token);
    let _acts = token.wait().expect("a presence");
    until(|| !there.others().is_empty());
    let run = thread::spawn(move || plant.run().expect("a run"));
    let sender = || there.inlets()[0].sender();
    for number in 1i64.. {
        let numbers = [number, 0].map(i64::to_le_bytes).concat();
        let attachment = [numbers, vec![16], gid.to_vec()].concat();
        let sent = policy.put(format!("4/{key}"), ros_action());
        let _ = sent.attachment(attachment).wait();
        if sender().starts > 0 || run.is_finished() {
            break;
        }
    }
    let refused = there.inlets()[0].refused.read();
    assert_eq!(sender().starts, 1, "{refused:?}");
    run.join().expect("a run");
}

#[test]
fn a_run_that_was_stopped_names_who_stopped_it() {
    for (name, named) in [("a dashboard", "a dashboard"), (" ", "nobody named")] {
        let address = address();
        let (plant, there) = steady(&PLANT, &listen(&address, None));
        let observer = plant.observer();
        let session = stranger(&address);
        let run = thread::spawn(move || plant.run().expect("a run"));
        until(|| there.times().zero().is_some());
        let order = Order {
            by: 1,
            name: name.to_owned(),
            command: Command::Stop,
        };
        let order = serde_json::to_vec(&order).expect("JSON");
        let all = Keys::new("cart-pole").all_endpoints(Of::COMMAND);
        let asked = session.get(all).payload(order).wait().expect("asked");
        drop(asked);
        run.join().expect("a run");
        let events: Vec<String> = observer.events(0).iter().map(ToString::to_string).collect();
        let who = format!("sensor: the run is stopped by {named}");
        assert!(
            events.iter().any(|event| event.ends_with(&who)),
            "{events:?}"
        );
    }
}

/// The configurations of the manual for robot, policy and dashboard, with their users.
fn roles(folder: &Path) -> [PathBuf; 3] {
    let users = "policy:change-me-too\ndashboard:change-me-as-well\n";
    fs::write(folder.join("users.txt"), users).expect("written");
    ["robot.json5", "policy.json5", "dashboard.json5"]
        .map(|name| support::of_manual(folder, name, &["users.txt"], &[]))
}

#[test]
fn with_the_configurations_of_the_manual_a_policy_joins_and_nobody_without_a_password() {
    let folder = tempfile::tempdir().expect("a folder");
    let [robot, policy, _] = roles(folder.path());
    let address = address();
    let part = |nodes: &[&str], end: &Settings| support::part(cart_pole(), nodes, end, None);
    let (_plant, there) = part(&PLANT, &listen(&address, Some(&robot)));
    let (_policy, here) = part(&POLICY, &connect(&address, Some(&policy)));
    until_met(&there, &here);
    assert!(!connects(&connect(&address, None)), "without a password");
}

/// The connection of a user with the configuration `file`.
fn user(address: &str, file: &Path) -> Session {
    connect(address, Some(file)).open().expect("a user")
}

/// Keys that somebody may try.
const KEYS: [&str; 12] = [
    "ratelab/1/cart-pole/data/policy/action",
    "ratelab/1/cart-pole/data/sensor/obs",
    "ratelab/1/cart-pole/data/actuator/state",
    "ratelab/1/cart-pole/process/0123456789abcdef",
    "ratelab/1/cart-pole/process/0123456789abcdef/clock",
    "ratelab/1/cart-pole/process/0123456789abcdef/info",
    "ratelab/1/cart-pole/process/0123456789abcdef/command",
    "ratelab/1/cart-pole/process/0123456789abcdef/telemetry",
    "ratelab/1/cart-pole/other",
    "0/action/sensor_msgs::msg::dds_::JointState_/RIHS01_0",
    "0/obs/sensor_msgs::msg::dds_::JointState_/RIHS01_0",
    "anything",
];

#[test]
fn the_access_file_of_the_manual_lets_through_what_each_role_needs_and_nothing_else() {
    let folder = tempfile::tempdir().expect("a folder");
    let [robot, policy, dashboard] = roles(folder.path());
    let address = address();
    let robot = listen(&address, Some(&robot)).open().expect("a robot");
    let (sender, arrived) = std::sync::mpsc::channel();
    let put = sender.clone();
    let all = robot.declare_subscriber("**").callback(move |sample| {
        let _ = put.send(("put", sample.key_expr().to_string()));
    });
    let _all = all.wait().expect("a subscriber");
    let answers = robot.declare_queryable("**").callback(move |query| {
        let _ = sender.send(("query", query.key_expr().to_string()));
        let _ = query.reply(query.key_expr().clone(), "here").wait();
    });
    let _answers = answers.wait().expect("a queryable");
    // The last one allowed is at the end: what was sent before it has come by then.
    let [clock, info, command] = [4, 5, 6].map(|key| ("query", KEYS[key]));
    for (role, allowed) in [
        (
            &policy,
            &[("put", KEYS[0]), ("put", KEYS[7]), clock, info][..],
        ),
        (&dashboard, &[clock, info, command]),
    ] {
        let session = user(&address, role);
        for key in KEYS {
            let _ = session.put(key, "x").wait();
            let _ = session.delete(key).wait();
        }
        let (_, last) = *allowed.last().expect("one");
        for key in KEYS.iter().filter(|key| **key != last) {
            let replies = session.get(*key).timeout(Duration::from_millis(50));
            drop(replies.wait().expect("asked"));
        }
        let answered = session.get(last).wait().expect("asked").recv();
        assert!(answered.is_ok(), "{role:?}");
        let _ = session.close().wait();
        let mut came: Vec<_> = arrived.try_iter().collect();
        came.sort();
        let expected = allowed.iter().map(|(how, key)| (*how, (*key).to_owned()));
        let mut expected: Vec<_> = expected.collect();
        expected.sort();
        assert_eq!(came, expected, "{role:?}");
    }
}
