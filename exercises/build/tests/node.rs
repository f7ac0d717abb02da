//! The promises of a node, and of the clock that ticks it.

use std::cell::RefCell;

use build_it::{Node, clock};

#[test]
fn a_tick_does_the_work_at_its_time_and_moves_on() {
    let times = RefCell::new(Vec::new());
    let mut node = Node::new("sensor", 4, 0, |now| {
        times.borrow_mut().push(now);
        true
    });
    assert_eq!(node.name(), "sensor");
    assert_eq!(node.turn(), (0, 0));
    assert!(node.tick() && node.tick());
    assert_eq!(node.turn(), (500_000_000, 0));
    assert_eq!(*times.borrow(), [0, 250_000_000]);
}

#[test]
fn a_tick_passes_on_that_the_run_ends() {
    let mut left = 2;
    let mut node = Node::new("actuator", 50, 2, |_| {
        left -= 1;
        left > 0
    });
    assert!(node.tick());
    assert!(!node.tick());
}

#[test]
fn nodes_that_are_due_together_tick_by_priority() {
    let order = RefCell::new(String::new());
    let node = |name: char, hz, priority| {
        let order = &order;
        Node::new("node", hz, priority, move |_| {
            order.borrow_mut().push(name);
            true
        })
    };
    let mut nodes = [node('c', 4, 2), node('a', 4, 0), node('b', 2, 1)];
    clock::run(&mut nodes, 1_000_000_000);
    assert_eq!(*order.borrow(), "abcacabcacabc");
}

#[test]
fn the_run_ends_with_the_node_that_ends_it() {
    let ticks = RefCell::new(0);
    let mut nodes = [
        Node::new("sensor", 10, 0, |_| {
            *ticks.borrow_mut() += 1;
            true
        }),
        Node::new("actuator", 10, 1, |now| now < 300_000_000),
    ];
    clock::run(&mut nodes, 1_000_000_000);
    assert_eq!(*ticks.borrow(), 4);
}
