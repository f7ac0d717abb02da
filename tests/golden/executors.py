"""Triggers and executors in virtual time: a model that shares no code with the crate.

The rules are those of rclcpp 29.3.0 (a0a2a06), rcl 9.2.0 (c19dab5) and TrueTime (63ae017) as
docs/executors.md has them. Times are whole milliseconds here.

    python3 executors.py          writes executors.txt: 500 random graphs and what they did
    python3 executors.py 5000     prints that many, for
                                  RATELAB_EXECUTORS=FILE cargo test executors
    python3 executors.py show N   the ticks of graph N, one a line

A graph is a line of words:

    until=MS executor=KIND nodes=NODE;NODE;...
    NODE = name,priority,release,cost,group,place,publishes
      release    every:PERIOD, or MATCH:TOPIC+TOPIC with a match of graph files: each or
                 approximate:QUEUE from graph 300 on
      group      - for a group of its own
      place      executor or thread
      publishes  TOPIC+TOPIC or -
    depths=TOPIC:DEPTH,...  delays=TOPIC:MS,...  stamps=TOPIC:MS,...

The line below it has the number of ticks, and the FNV-1a hash (64 bits) of their text: for
each node in order, for each of its ticks `name due start end` and a line feed, in
milliseconds; `-` for the end of a tick that the run cuts off.

A tick hands on the oldest stamp of its set. A timer stamps with the end of its tick; where
`stamps` has the topic, with the start, rounded down to a multiple of these milliseconds.
"""

import random
import sys

from approximate import Matcher

PERIODS = [2, 4, 5, 8, 10, 16, 20, 25, 32, 40, 50]


class Each:
    """The newest of each topic."""

    def __init__(self, topics):
        self.newest, self.sets = [None] * topics, []

    def add(self, topic, stamp, _):
        self.newest[topic] = stamp
        if None not in self.newest:
            self.sets.append(self.newest)
            self.newest = [None] * len(self.newest)


class Node:
    def __init__(self, index, name, priority, release, match, cost, group, place, publishes):
        self.index, self.name, self.priority = index, name, priority
        self.period = release if isinstance(release, int) else None
        self.topics = None if self.period else release
        self.cost, self.group, self.place, self.publishes = cost, group, place, publishes
        if self.topics:
            count = len(self.topics)
            queue = int(match.partition(":")[2] or 0)
            self.match = Matcher(count, queue, None) if queue else Each(count)
        self.sets = []          # those that the last message completed, and no tick has used
        self.completed = None   # the arrival of that message
        self.turn = 0           # whose turn it is, for a node that takes by itself
        self.unread = {topic: [] for topic in self.topics or []}   # (arrival, stamp), not taken
        self.ticks = []         # [due, start, end or None]
        self.running = None     # the tick under way
        self.stamp = None       # what it hands on, if messages trigger it
        self.next = None        # the next due time of the timer

    def rank(self):
        return (self.priority, self.index)

    def take(self, topic):
        """Takes a message; the due time if that makes a set."""
        self.completed, stamp = self.unread[topic].pop(0)
        self.match.add(self.topics.index(topic), stamp, stamp)
        self.sets, self.match.sets = self.match.sets, []
        return self.go_on()

    def go_on(self):
        """The due time of the next set of the message that was taken last."""
        if not self.sets:
            return None
        self.stamp = min(self.sets.pop(0))
        return self.completed

    def take_in_turn(self):
        if self.sets:
            return self.go_on()
        while any(self.unread.values()):
            topic = self.topics[self.turn]
            self.turn = (self.turn + 1) % len(self.topics)
            if self.unread[topic]:
                due = self.take(topic)
                if due is not None:
                    return due
        return None

    def oldest(self):
        return min((queue[0][0] for queue in self.unread.values() if queue), default=None)


class Run:
    def __init__(self, nodes, executor, depths, delays, stamps):
        self.nodes, self.depths, self.delays, self.stamps = nodes, depths, delays, stamps
        self.now = 0
        self.ends = []          # (time, rank, node)
        self.arrivals = []      # (time, number, topic, stamp)
        self.published = 0
        self.members = [node for node in nodes if node.place == "executor"]
        self.executor = make(executor, self)
        self.let = executor == "let"
        for node in nodes:
            if node.period:
                node.next = 0
        if executor.split(":")[0] in ("single", "multi", "events"):
            for node in self.members:
                if node.period:
                    node.next = node.period

    def own(self, node):
        return node.place == "thread" or self.let

    def run(self, until):
        now = 0
        while now is not None and now <= until:
            self.now = now
            while self.step():
                pass
            now = self.when()

    def when(self):
        times = [at for at, *_ in self.ends] + [at for at, *_ in self.arrivals]
        times += [node.next for node in self.nodes if node.next is not None]
        return min((at for at in times if at > self.now), default=None)

    def step(self):
        """The first thing that there is to do now."""
        now = self.now
        ends = sorted(entry for entry in self.ends if entry[0] == now)
        if ends:
            self.ends.remove(ends[0])
            self.finish(self.nodes[ends[0][2]])
            return True
        arrivals = sorted(entry for entry in self.arrivals if entry[0] == now)
        if arrivals:
            self.arrivals.remove(arrivals[0])
            self.deliver(*arrivals[0][2:])
            return True
        for node in self.members:
            if not self.own(node) and node.next == now:
                if self.executor.due(node):
                    return True
        idle = [node for node in self.nodes if self.own(node) and self.has_work(node)]
        if idle:
            self.work(min(idle, key=Node.rank))
            return True
        return bool(self.executor) and self.executor.pick()

    # Nodes with a thread of their own.

    def has_work(self, node):
        if node.period:
            return node.next == self.now
        return node.running is None and (bool(node.sets) or node.oldest() is not None)

    def work(self, node):
        if node.period:
            due, node.next = node.next, node.next + node.period
            if node.running is None:
                self.begin(node, due)
        else:
            due = node.take_in_turn()
            if due is not None:
                self.begin(node, due)

    # Ticks.

    def begin(self, node, due):
        """Begins a tick; whether it is over at once."""
        node.running = [due, self.now, None]
        node.ticks.append(node.running)
        ends = self.now + node.cost
        if self.let and node.place == "executor":
            ends = max(ends, self.now + 1)
            ends += -ends % node.period
        if ends == self.now:
            self.over(node)
            return True
        if self.own(node):
            self.end_at(node, ends)
        else:
            self.executor.began(node, ends)
        return False

    def end_at(self, node, at):
        self.ends.append((at, node.rank(), node.index))

    def finish(self, node):
        self.over(node)
        if not self.own(node):
            self.executor.ended(node)

    def over(self, node):
        node.running[2] = self.now
        node.running = None
        for topic in node.publishes:
            at = self.now + self.delays.get(topic, 0)
            stamp = node.stamp
            if node.period:
                start = node.ticks[-1][1]
                step = self.stamps.get(topic)
                stamp = start - start % step if step else self.now
            self.arrivals.append((at, self.published, topic, stamp))
            self.published += 1

    def deliver(self, topic, stamp):
        for node in self.nodes:
            if node.topics and topic in node.topics:
                queue = node.unread[topic]
                queue.append((self.now, stamp))
                if len(queue) > self.depths[topic]:
                    queue.pop(0)
                if not self.own(node):
                    self.executor.arrived(node, topic)


class Windows:
    """rclcpp's single- and multi-threaded executors."""

    def __init__(self, run, threads):
        self.run, self.free, self.window, self.busy = run, threads, [], set()
        self.known = set()      # timers that are due and were not called
        self.unfinished = []    # nodes with another set of the message that they were called for

    def due(self, node):
        if node in self.known:
            return False
        self.known.add(node)
        return True

    def arrived(self, node, topic):
        pass

    def is_free(self, node):
        return node.group not in self.busy

    def look(self):
        timers, others = [], []
        for node in self.run.members:
            if not self.is_free(node):
                continue
            if node.period:
                if node.next <= self.run.now:
                    timers.append((node, None))
            else:
                others += [(node, topic) for topic in node.topics if node.unread[topic]]
        self.window = timers + others

    def choose(self):
        for entry in self.window:
            if entry[1] is None and self.is_free(entry[0]):
                self.window.remove(entry)
                return entry
        timers = [entry for entry in self.window if entry[1] is None]
        others = [entry for entry in self.window if entry[1] is not None]
        while others:
            entry = others.pop(0)
            if self.is_free(entry[0]):
                self.window = timers + others
                return entry
        self.window = timers
        return None

    def pick(self):
        if self.unfinished:
            node = min(self.unfinished, key=self.run.members.index)
            self.unfinished.remove(node)
            return self.call(node, node.go_on())
        if self.free == 0:
            return False
        entry = self.choose()
        if entry is None:
            self.look()
            entry = self.choose()
        if entry is None:
            return False
        node, topic = entry
        if topic is None:
            self.known.discard(node)
            due, node.next = node.next, node.next + node.period
            if node.next <= self.run.now:
                node.next += (1 + (self.run.now - node.next) // node.period) * node.period
        else:
            due = node.take(topic)
        return self.call(node, due)

    def call(self, node, due):
        self.free -= 1
        self.busy.add(node.group)
        if due is None or self.run.begin(node, due):
            self.ended(node)
        return True

    def began(self, node, ends):
        self.run.end_at(node, ends)

    def ended(self, node):
        self.free += 1
        self.busy.discard(node.group)
        if node.sets:
            self.unfinished.append(node)


class Events:
    """rclcpp's experimental events executor."""

    def __init__(self, run):
        self.run, self.queue, self.busy = run, [], False
        self.unfinished = None  # the node with another set of its message

    def due(self, node):
        self.queue.append((node, None, node.next))
        node.next += node.period
        return True

    def arrived(self, node, topic):
        self.queue.append((node, topic, None))

    def pick(self):
        if self.busy or not self.queue and self.unfinished is None:
            return False
        if self.unfinished is not None:
            node, self.unfinished = self.unfinished, None
            due = node.go_on()
        else:
            node, topic, due = self.queue.pop(0)
            if topic is not None:
                due = node.take(topic) if node.unread[topic] else None
        if due is not None:
            self.busy = True
            if self.run.begin(node, due):
                self.ended(node)
        return True

    def began(self, node, ends):
        self.run.end_at(node, ends)

    def ended(self, node):
        self.busy = False
        if node.sets:
            self.unfinished = node


class Preemptive:
    """TrueTime's kernel, on several cores."""

    def __init__(self, run, cores, by_deadline):
        self.run, self.cores, self.by_deadline = run, cores, by_deadline
        self.released = {node: [] for node in run.members}
        self.jobs = {}          # node: [key, left, on core since or None]
        self.places = {}        # node: the key of its last job

    def due(self, node):
        self.released[node].append(node.next)
        node.next += node.period
        return True

    def arrived(self, node, topic):
        pass

    def key(self, node, released):
        urgency = released + node.period if self.by_deadline else node.priority
        return (urgency, released, self.run.members.index(node))

    def first(self, node):
        if node in self.jobs:
            return self.jobs[node][0]
        if node.period:
            return self.key(node, self.released[node][0]) if self.released[node] else None
        if node.sets:
            return self.places[node]
        oldest = node.oldest()
        return None if oldest is None else self.key(node, oldest)

    def pick(self):
        now = self.run.now
        ready = [(self.first(node), node) for node in self.run.members]
        ready = sorted((entry for entry in ready if entry[0] is not None), key=lambda e: e[0])
        chosen = [node for _, node in ready[: self.cores]]
        for node, job in self.jobs.items():
            if node not in chosen and job[2] is not None:
                job[1] -= now - job[2]
                job[2] = None
                self.run.ends = [end for end in self.run.ends if end[2] != node.index]
        for node in chosen:
            if node in self.jobs:
                if self.jobs[node][2] is None:
                    self.go(node)
                continue
            key = self.places[node] = self.first(node)
            if node.period:
                due = self.released[node].pop(0)
            else:
                due = node.take_in_turn()
            self.starts = key
            if due is not None:
                self.run.begin(node, due)
            return True
        return False

    def go(self, node):
        job = self.jobs[node]
        job[2] = self.run.now
        self.run.end_at(node, self.run.now + job[1])

    def began(self, node, ends):
        self.jobs[node] = [self.starts, ends - self.run.now, None]
        self.go(node)

    def ended(self, node):
        self.jobs.pop(node, None)


def make(executor, run):
    name, _, number = executor.partition(":")
    if name in ("single", "multi"):
        return Windows(run, int(number or 1))
    if name == "events":
        return Events(run)
    if name in ("fixed-priority", "edf"):
        return Preemptive(run, int(number), name == "edf")
    return None


def graph(dice, matches):
    """A random graph: its line, and its parts; `matches` for those of stamps, too."""
    executor = dice.choice(
        ["single", "multi:1", "multi:2", "multi:3", "events", "fixed-priority:1",
         "fixed-priority:2", "edf:1", "edf:2", "let"]
    )
    needs_periods = executor in ("let", "edf:1", "edf:2")
    nodes, topics = [], []
    for index in range(dice.randint(2, 9)):
        name, match = f"n{index}", "each"
        # Triggers from earlier nodes only: no circles.
        if topics and dice.random() < 0.5:
            most = dice.choice([1, 2, 2, 3] if matches else [1, 1, 1, 2, 3])
            release = dice.sample(topics, min(len(topics), most))
            if matches and dice.random() < 0.9:
                match = f"approximate:{dice.choice([1, 2, 5, 10])}"
        else:
            release = dice.choice(PERIODS)
        place = "executor" if dice.random() < 0.8 else "thread"
        if needs_periods and not isinstance(release, int):
            place = "thread"
        publishes = []
        for _ in range(dice.choice([0, 1, 1, 2])):
            topic = f"/t{len(topics)}"
            publishes.append(topic)
            topics.append(topic)
        group = f"g{dice.randint(0, 2)}" if dice.random() < 0.5 else "-"
        nodes.append(
            (name, dice.randint(0, 4), release, match, dice.choice([0, 1, 1, 2, 3, 5, 8, 13]),
             group, place, publishes)
        )
    depths = {topic: dice.choice([1, 1, 2, 5, 20]) for topic in topics}
    times, share = ([5, 20, 60], 0.4) if matches else ([1, 3, 7], 0.2)
    delays = {topic: dice.choice(times) for topic in topics if dice.random() < share}
    stamps = {topic: dice.choice([1, 30, 70]) for topic in topics} if matches else {}
    return executor, nodes, depths, delays, stamps, 300


def words(executor, nodes, depths, delays, stamps, until):
    def node(name, priority, release, match, cost, group, place, publishes):
        every = isinstance(release, int)
        release = f"every:{release}" if every else f"{match}:" + "+".join(release)
        to = "+".join(publishes) or "-"
        return f"{name},{priority},{release},{cost},{group},{place},{to}"

    def each(key, values):
        return f"{key}=" + ",".join(f"{topic}:{value}" for topic, value in values.items())

    return " ".join([
        f"until={until}",
        f"executor={executor}",
        "nodes=" + ";".join(node(*parts) for parts in nodes),
        each("depths", depths),
        each("delays", delays),
        *([each("stamps", stamps)] if stamps else []),
    ])


def play(executor, nodes, depths, delays, stamps, until):
    made = [
        Node(index, name, priority, release, match, cost, name if group == "-" else group, *rest)
        for index, (name, priority, release, match, cost, group, *rest) in enumerate(nodes)
    ]
    Run(made, executor, depths, delays, stamps).run(until)
    lines = []
    for node in made:
        for due, start, end in node.ticks:
            # An unfinished tick has no end; what ends with the run has one.
            lines.append(f"{node.name} {due} {start} {'-' if end is None else end}\n")
    return lines


def fnv(text):
    value = 0xCBF29CE484222325
    for byte in text.encode():
        value = ((value ^ byte) * 0x100000001B3) % 2**64
    return value


def case(number):
    parts = graph(random.Random(number), matches=number >= 300)
    lines = play(*parts)
    return parts, lines


def main():
    if sys.argv[1:2] == ["show"]:
        parts, lines = case(int(sys.argv[2]))
        print(words(*parts))
        print("".join(lines), end="")
        return
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 500
    out = []
    for number in range(count):
        parts, lines = case(number)
        out.append(f"{words(*parts)}\nticks={len(lines)} hash={fnv(''.join(lines)):016x}\n")
    text = "\n".join(out)
    if len(sys.argv) > 1:
        print(text, end="")
    else:
        with open(__file__.replace(".py", ".txt"), "w") as file:
            file.write(text)


if __name__ == "__main__":
    main()
