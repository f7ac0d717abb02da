//! What the threads of an executor have in common: what is due, and who is busy.

use std::{
    cmp::Reverse,
    collections::{BinaryHeap, VecDeque},
};

use crate::runtime::{
    clock::wall::Wall,
    command::Command,
    dispatch::{Call, CallbackQueue, EventOrder, Nodes, WindowOrder},
    executor::{Callback, Executor},
    rate::Rate,
    scheduled_node::{MOST_WAITING, ScheduledNode},
    time::Time,
};

/// What the threads of an executor have in common. Its nodes are known by their number in the
/// order of registration.
pub(super) struct Board {
    queue: Box<CrewQueue>,
    timers: Vec<Timer>,
    /// Number of topics that trigger each node.
    inputs: Vec<usize>,
    arrivals: BinaryHeap<Reverse<PlannedArrival>>,
    /// Number of arrivals so far.
    arrived: u64,
    /// Whether a thread has each node.
    pub(super) taken: Vec<bool>,
    /// Commands for nodes that threads have.
    pub(super) commands: VecDeque<(usize, Command)>,
    /// Ticks from before the start that nobody has yet, each with its beginning.
    pub(super) unfinished: Vec<(usize, Time)>,
    pub(super) wall: Option<Wall>,
    pub(super) stopped: bool,
}

type CrewQueue = dyn for<'a> CallbackQueue<Look<'a>>;

/// The arrival of a message: time, number among all, node and its input.
type PlannedArrival = (Time, u64, usize, usize);

/// The next due time of a node's timer.
struct Timer {
    /// [`Time::MAX`] while it waits for its call.
    due: Time,
    /// The due times after that, where they wait in line, and the number of those in wait.
    rate: Rate,
    waiting: usize,
}

impl Timer {
    fn of(node: &ScheduledNode) -> Self {
        Self {
            due: node.due(),
            rate: node.rate.clone(),
            waiting: node.queued_timers().len(),
        }
    }
}

/// A node as a thread leaves it.
pub(super) struct NodeState {
    /// The end of its tick, if it is in one.
    ends: Option<Time>,
    timer: Timer,
}

impl NodeState {
    pub(super) fn of(node: &ScheduledNode) -> Self {
        Self {
            ends: node.running().map(|running| running.ends),
            timer: Timer::of(node),
        }
    }
}

/// Whether a message of an input waits for a node.
pub(super) type Waits<'a> = dyn Fn(usize, usize) -> bool + 'a;

/// A look at the nodes.
pub(super) struct Look<'a> {
    waits: &'a Waits<'a>,
    taken: &'a [bool],
    timers: &'a mut [Timer],
    inputs: &'a [usize],
    unfinished: &'a [(usize, Time)],
}

impl Nodes for Look<'_> {
    /// A node that a thread has may still get to its messages.
    fn waits(&mut self, node: usize, input: usize) -> bool {
        self.taken[node] || (self.waits)(node, input)
    }

    fn inputs(&self, node: usize) -> usize {
        self.inputs[node]
    }

    /// The node has it wait as well, when it is called.
    fn queue_timer(&mut self, node: usize) -> (bool, Time) {
        let timer = &mut self.timers[node];
        timer.rate.advance();
        let room = timer.waiting < MOST_WAITING;
        timer.waiting += usize::from(room);
        (room, timer.rate.due())
    }

    /// The thread that has the node waits for the end of its tick.
    fn plan_end(&mut self, _: usize, _: Time) {}

    fn queued_timers(&self, node: usize) -> usize {
        self.timers[node].waiting
    }

    fn ends(&self, node: usize) -> Option<Time> {
        let unfinished = self.unfinished.iter().find(|tick| tick.0 == node);
        // When it ends is for the thread that takes it over.
        unfinished.map(|tick| tick.1)
    }
}

impl Board {
    /// The nodes as they are at run time `now`; `None` if the executor has no threads.
    pub(super) fn new<'n>(
        executor: Executor,
        callbacks: impl Iterator<Item = Callback>,
        nodes: impl Iterator<Item = &'n ScheduledNode>,
        now: Time,
    ) -> Option<Self> {
        let members: Vec<_> = callbacks.enumerate().collect();
        let queue: Box<CrewQueue> = match executor {
            Executor::Single => Box::new(WindowOrder::new(&members, 1)),
            Executor::Multi { threads } => Box::new(WindowOrder::new(&members, threads)),
            Executor::Events => Box::new(EventOrder::new(&members)),
            Executor::FixedPriority { .. } | Executor::Edf { .. } | Executor::Let => return None,
        };
        let mut board = Self {
            queue,
            timers: Vec::new(),
            inputs: Vec::new(),
            arrivals: BinaryHeap::new(),
            arrived: 0,
            taken: vec![false; members.len()],
            commands: VecDeque::new(),
            unfinished: Vec::new(),
            wall: None,
            stopped: false,
        };
        for (member, node) in nodes.enumerate() {
            board.timers.push(Timer::of(node));
            board.inputs.push(node.inputs());
            let running = node.running().map(|running| (member, running.began));
            board.unfinished.extend(running);
            board.with(&|_, _| false, |queue, look| queue.take_over(member, look));
            board.add_waiting(member, node, now);
        }
        Some(board)
    }

    /// Adds the messages that wait for a node.
    fn add_waiting(&mut self, member: usize, node: &ScheduledNode, now: Time) {
        for input in 0..node.inputs() {
            for _ in 0..node.waiting_in(input, now) {
                self.add_arrival(now, member, input);
            }
        }
    }

    /// Adds a message that arrives at run time `at`.
    pub(super) fn add_arrival(&mut self, at: Time, member: usize, input: usize) {
        self.arrived += 1;
        let planned = (at, self.arrived, member, input);
        self.arrivals.push(Reverse(planned));
    }

    /// Has the queue see what is due or arrives by `now`.
    pub(super) fn pass(&mut self, now: Time, waits: &Waits<'_>) {
        loop {
            let timers = self.timers.iter().enumerate();
            let timer = timers.min_by_key(|(_, timer)| timer.due);
            let timer = timer.map(|(member, timer)| (timer.due, member));
            let arrival = self.arrivals.peek().map(|Reverse(arrival)| *arrival);
            match (timer, arrival) {
                (timer, Some((at, _, member, input)))
                    if at <= now && timer.is_none_or(|(due, _)| at <= due) =>
                {
                    self.arrivals.pop();
                    self.with(waits, |queue, look| queue.arrived(member, input, look));
                }
                (Some((due, member)), _) if due <= now => {
                    let next = self.with(waits, |queue, look| queue.due(member, look));
                    self.timers[member].due = next.unwrap_or(Time::MAX);
                }
                _ => return,
            }
        }
    }

    /// Time of the next timer or arrival.
    pub(super) fn next_at(&self) -> Time {
        let timers = self.timers.iter().map(|timer| timer.due);
        let arrival = self.arrivals.peek().map(|Reverse((at, ..))| *at);
        timers.chain(arrival).min().unwrap_or(Time::MAX)
    }

    /// The next callback to be called. Its node belongs to the calling thread until
    /// [`put_back`](Self::put_back).
    pub(super) fn pick(&mut self, waits: &Waits<'_>) -> Option<Call> {
        let call = self.with(waits, |queue, look| queue.next(look))?;
        self.taken[call.node()] = true;
        Some(call)
    }

    /// A thread has ended a step of a node.
    pub(super) fn put_back(&mut self, member: usize, node: NodeState, waits: &Waits<'_>) {
        self.taken[member] = false;
        self.with(waits, |queue, look| match node.ends {
            Some(ends) => queue.began(member, ends, look),
            None => queue.ended(member, look),
        });
        let timer = &mut self.timers[member];
        match timer.due {
            Time::MAX => *timer = node.timer,
            _ => timer.waiting = node.timer.waiting,
        }
    }

    /// A command has changed the due times of a node, or it has `crashed` and perhaps begun
    /// again.
    pub(super) fn changed(&mut self, member: usize, crashed: bool, node: &ScheduledNode, at: Time) {
        self.timers[member] = Timer::of(node);
        match crashed {
            true => self.queue.forget(member),
            false => self.queue.reschedule(member),
        }
        if crashed && !node.is_crashed() {
            self.add_waiting(member, node, at);
        }
    }

    fn with<R>(
        &mut self,
        waits: &Waits<'_>,
        call: impl FnOnce(&mut CrewQueue, &mut Look<'_>) -> R,
    ) -> R {
        let mut look = Look {
            waits,
            taken: &self.taken,
            timers: &mut self.timers,
            inputs: &self.inputs,
            unfinished: &self.unfinished,
        };
        call(&mut *self.queue, &mut look)
    }
}
