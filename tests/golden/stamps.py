"""Header stamps in graph files, with clocks that are wrong: a model that shares no code with
the crate.

The rules are those of docs/graphs.md (header stamps), docs/time.md (clocks) and
docs/executors.md (triggers). Times are whole nanoseconds here.

    python3 stamps.py          writes stamps.txt: 150 random graphs and their messages
    python3 stamps.py 5000     prints that many, for
                               RATELAB_STAMPS=FILE cargo test stamps
    python3 stamps.py show N   graph N, and its messages

A block is a graph file, and a line with the number of its messages and the FNV-1a hash (64 bits)
of their text: for each topic in the order of the file, for each message
`topic at header-stamp` and a line feed, in nanoseconds. For the last topic, that of the node
with several triggers, the line goes on with the run times at which the ticks began that published
the messages of the set, one for each trigger.
"""

import json
import random
import sys

from approximate import Matcher
from executors import fnv

MS = 1_000_000
UNTIL = 3_000 * MS


class Clock:
    """A clock with an error since run time zero."""

    def __init__(self, offset, ppm):
        self.offset, self.ppm = offset, ppm

    def reading(self, now):
        return now + self.offset + now * self.ppm // 1_000_000

    def shows(self, now):
        return max(0, self.reading(now))

    def when(self, shown):
        """The first run time at which it shows that."""
        ahead = max(0, shown - self.offset)
        return -(-ahead * 1_000_000 // (1_000_000 + self.ppm))


RIGHT = Clock(0, 0)


class Exact:
    def __init__(self, queue):
        self.queue, self.waiting = queue, {}

    def add(self, topic, stamp, number, topics):
        held = self.waiting.setdefault(stamp, {})
        held[topic] = number
        found = []
        if len(held) == topics:
            found.append([held[index] for index in range(topics)])
            self.waiting = {at: kept for at, kept in self.waiting.items() if at > stamp}
        while len(self.waiting) > self.queue:
            del self.waiting[min(self.waiting)]
        return found


class Each:
    def __init__(self):
        self.held = {}

    def add(self, topic, stamp, number, topics):
        self.held[topic] = number
        if len(self.held) < topics:
            return []
        found, self.held = [self.held[index] for index in range(topics)], {}
        return [found]


class Approximate:
    def __init__(self, queue, topics, interval):
        self.inner = Matcher(topics, queue, interval)

    def add(self, topic, stamp, number, topics):
        self.inner.add(topic, stamp, number)
        found, self.inner.sets = self.inner.sets, []
        return found


def rule(text, topics):
    kind, *numbers = text.split(":")
    if kind == "each" or topics == 1:
        return Each()
    if kind == "exact":
        return Exact(int(numbers[0]))
    interval = int(numbers[1]) * MS if numbers[1:] else None
    return Approximate(int(numbers[0]), topics, interval)


class Message:
    def __init__(self, at, stamp, began):
        self.at, self.stamp, self.began = at, stamp, began


class Node:
    def __init__(self, index, keys):
        self.index, self.keys = index, keys
        self.triggers, self.reads = keys.get("trigger", []), keys.get("reads", [])
        self.cost = keys.get("takes", 0) * MS
        self.clock = clock(keys.get("clock")) or RIGHT
        self.stamps_by = clock(keys.get("stamp_clock")) or self.clock
        inputs = self.triggers + self.reads
        self.stamp = keys.get("stamp", inputs[0] if inputs else "now")
        self.queues = {topic: [] for topic in self.triggers}
        self.last = {}              # topic: the message read last
        self.turn = 0
        self.taken = {topic: [] for topic in self.triggers}
        self.sets = []
        self.match = rule(keys.get("match", "each"), len(self.triggers))
        self.running = None         # (begin, end)
        self.shown = None           # the due time of the next tick, by its clock
        if "rate" in keys:
            self.period = 1_000_000_000 // keys["rate"]
            self.shown = keys.get("offset", 0) * MS
            first = self.clock.reading(0)
            while self.shown < first:
                self.shown += self.period

    def due(self):
        return None if self.shown is None else self.clock.when(self.shown)

    def ready(self, now):
        if self.shown is not None:
            return self.due() == now
        return self.running is None and bool(self.sets or any(self.queues.values()))

    def find_set(self):
        """Takes one message of each topic in turn, until there is a set."""
        while not self.sets and any(self.queues.values()):
            place, topic = self.turn, self.triggers[self.turn]
            self.turn = (self.turn + 1) % len(self.triggers)
            if self.queues[topic]:
                message = self.queues[topic].pop(0)
                self.taken[topic].append(message)
                number = len(self.taken[topic]) - 1
                self.sets = self.match.add(place, message.stamp, number, len(self.triggers))
        if not self.sets:
            return False
        chosen = self.sets.pop(0)
        for topic, number in zip(self.triggers, chosen):
            self.last[topic] = self.taken[topic][number]
        return True


def clock(text):
    if text is None:
        return None
    offset, ppm = text.split()
    return Clock(round(float(offset) * MS), int(ppm))


class Run:
    def __init__(self, nodes, depths):
        self.nodes = [Node(index, keys) for index, keys in enumerate(nodes.values())]
        self.depths, self.newest = depths, {}
        self.messages = {topic: [] for keys in nodes.values() for topic in keys["publishes"]}
        now = 0
        while now is not None and now <= UNTIL:
            while self.step(now):
                pass
            times = [node.due() for node in self.nodes if node.shown is not None]
            times += [node.running[1] for node in self.nodes if node.running]
            now = min((at for at in times if at > now), default=None)

    def step(self, now):
        for node in self.nodes:
            if node.running and node.running[1] == now:
                self.end(node, now)
                return True
        for node in self.nodes:
            if node.ready(now):
                self.work(node, now)
                return True
        return False

    def work(self, node, now):
        if node.shown is not None:
            node.shown += node.period
            if node.running:
                return
        elif not node.find_set():
            return
        for topic in node.reads:
            if topic in self.newest:
                node.last[topic] = self.newest[topic]
        stamp = node.stamps_by.shows(now)
        if node.stamp in node.last:
            stamp = node.last[node.stamp].stamp
        speaks = node.last or not (node.triggers or node.reads)
        sources = [node.last[topic].began for topic in node.triggers]
        node.running = (now, now + node.cost, stamp if speaks else None, sources)
        if node.cost == 0:
            self.end(node, now)

    def end(self, node, now):
        began, _, stamp, sources = node.running
        node.running = None
        if stamp is None:
            return
        for topic in node.keys["publishes"]:
            message = Message(now, stamp, began)
            self.messages[topic].append((message, sources))
            self.newest[topic] = message
            for reader in self.nodes:
                if topic in reader.queues:
                    queue = reader.queues[topic]
                    queue.append(message)
                    if len(queue) > self.depths.get(topic, 1):
                        queue.pop(0)


def error(dice):
    return f"{dice.randint(-400, 400) / 4} {dice.choice([0, 0, 50, -300, 20000])}"


def clocks(dice, keys):
    if dice.random() < 0.3:
        keys["clock"] = error(dice)
    if dice.random() < 0.4:
        keys["stamp_clock"] = error(dice)


def graph(dice):
    nodes, topics = {}, []
    for number in range(dice.randint(2, 3)):
        keys = {"rate": dice.choice([5, 10, 20, 25, 50])}
        if dice.random() < 0.4:
            keys["offset"] = dice.randint(1, 40)
        if dice.random() < 0.4:
            keys["takes"] = dice.randint(1, 60)
        if dice.random() < 0.1:
            keys["stamp"] = "now"
        clocks(dice, keys)
        nodes[f"source{number}"] = keys
        topics.append(f"/s{number}")
        keys["publishes"] = topics[-1:]
    for number in range(dice.randint(0, 3)):
        inputs = dice.sample(topics, min(len(topics), dice.choice([1, 2, 2])))
        if dice.random() < 0.5:
            keys = {"trigger": inputs[:1], "reads": inputs[1:]}
        else:
            keys = {"rate": dice.choice([10, 20, 40]), "reads": inputs}
        if dice.random() < 0.5:
            keys["stamp"] = dice.choice(inputs + ["now"])
        if dice.random() < 0.5:
            keys["takes"] = dice.randint(1, 30)
        clocks(dice, keys)
        nodes[f"relay{number}"] = keys
        topics.append(f"/r{number}")
        keys["publishes"] = topics[-1:]
    triggers = dice.sample(topics, min(len(topics), dice.choice([2, 2, 2, 3])))
    match = dice.choice(["each", "exact:3", "exact:10", "approximate:2", "approximate:10",
                         "approximate:10:20"])
    keys = {"trigger": triggers, "match": match, "publishes": ["/out"]}
    rest = [topic for topic in topics if topic not in triggers]
    if rest and dice.random() < 0.3:
        keys["reads"] = dice.sample(rest, 1)
    if dice.random() < 0.5:
        keys["stamp"] = dice.choice(triggers + keys.get("reads", []) + ["now"])
    if dice.random() < 0.4:
        keys["takes"] = dice.randint(1, 40)
    clocks(dice, keys)
    nodes["sync"] = keys
    depths = {topic: dice.choice([2, 5, 20]) for topic in topics if dice.random() < 0.5}
    depths = {topic: depth for topic, depth in depths.items() if topic in triggers}
    return nodes, depths


def file(nodes, depths):
    """The graph file, with a chain from each publisher of a trigger."""
    lines = ['name = "stamps"', "[node]"]
    for name, keys in nodes.items():
        pairs = [f"{key} = {json.dumps(value)}" for key, value in keys.items() if value != []]
        lines.append(f"{name} = {{ {', '.join(pairs)} }}")
    lines += ["[topic]"] if depths else []
    lines += [f'"{topic}" = {{ depth = {depth} }}' for topic, depth in depths.items()]
    lines.append("[chain]")
    makers = {topic: name for name, keys in nodes.items() for topic in keys["publishes"]}
    for number, topic in enumerate(nodes["sync"]["trigger"]):
        path = json.dumps([makers[topic], topic, "sync", "/out"])
        lines.append(f"c{number} = {{ path = {path} }}")
    return lines


def play(nodes, depths):
    lines = []
    for topic, messages in Run(nodes, depths).messages.items():
        for message, sources in messages:
            words = [topic, message.at, message.stamp] + (sources if topic == "/out" else [])
            lines.append(" ".join(map(str, words)) + "\n")
    return lines


def case(number):
    parts = graph(random.Random(number))
    return file(*parts), play(*parts)


def main():
    if sys.argv[1:2] == ["show"]:
        known, lines = case(int(sys.argv[2]))
        print("\n".join(known))
        print("".join(lines), end="")
        return
    out = []
    for number in range(int(sys.argv[1]) if len(sys.argv) > 1 else 150):
        known, lines = case(number)
        result = f"messages={len(lines)} hash={fnv(''.join(lines)):016x}\n"
        out.append("\n".join([*known, result]))
    text = "\n".join(out)
    if len(sys.argv) > 1:
        print(text, end="")
    else:
        with open(__file__.replace(".py", ".txt"), "w") as to:
            to.write(text)


if __name__ == "__main__":
    main()
