#!/usr/bin/env python3
"""An independent model of runs in which ticks take time and the world does not wait,
and the golden file that it writes.

This file shares no code with the Rust crate: physics, policy and draws of the start
come from `reference.py`, everything about time is said here a second time. It was
written from `docs/time.md` and `README.md` here, and does not look like the crate on purpose: it has no
queue of events, but goes from instant to instant and asks everybody.

    python3 tests/golden/honest.py            write the golden file
    python3 tests/golden/honest.py --check    check it, and the facts known before
    python3 tests/golden/honest.py --more 1000 FILE
                                              write so many other runs at random, for
                                              RATELAB_HONEST=FILE cargo test --test library time

honest.txt (ASCII, "\\n" line ends)
-----------------------------------
Blocks with a blank line between them, each:
    run seed=U64 world=NAME [step_ms=INT] depth=INT duration_s=DEC
    setup KNOB                    any number of lines: turned before the run
    knob TIME KNOB                any number: turned at that time (s)
    got KEY=VALUE ...             what came of it
    fnv1a64=16 HEX DIGITS
The hash is FNV-1a, 64 bit, over every message of /obs, then of /action, then of
/state, little-endian: stamp u64, seq u64, origin u64 (2^64 - 1 for none), then the
payload: five f32; one f32; the 80 bytes of `reference.py` without their time.
obs_way and action_way, where a link did something: lost, overtaken, in flight at the end.
push_area is twice the integral of the push age since the first push (ns^2).
"""

import argparse
import hashlib
import math
import random
import statistics
import struct
from dataclasses import dataclass, field, replace
from fractions import Fraction

import mujoco
import numpy as np
from reference import (
    FALL_ANGLE, HERE, MJCF, RAIL_END, SECOND, Plant, Topic, fnv1a64, nanoseconds, reset_values,
    scripted, zero,
)

MS = 1_000_000
CONTROL_STEP = 20 * MS
POLICIES = {"scripted": scripted, "zero": zero}
NEVER = 2**64 - 1


# ------------------------------------------------------------------- chance


def uniform(seed, what, name, n):
    digest = hashlib.sha256(f"{seed} {what} {name} {n}".encode("ascii")).digest()
    return (int.from_bytes(digest[:8], "little") >> 11) * 2.0**-53


def millis(text):
    return round(Fraction(text) * MS)


def drawn(spec, u):
    """The duration in ns that belongs to u."""
    spec = spec.removeprefix("busy ")
    if spec == "none":
        return 0
    if spec.startswith("lognormal:"):
        median, p99 = map(millis, spec.removeprefix("lognormal:").split(","))
        if u == 0.0:
            return 0
        sigma = math.log(p99 / median) / 2.3263478740408408
        return round(median * math.exp(sigma * statistics.NormalDist().inv_cdf(u)))
    if ".." in spec:
        low, high = map(millis, spec.split(".."))
        return low + math.floor(u * (high - low))
    return millis(spec)


# -------------------------------------------------------------------- links


class Link:
    """What a link does to one message after the other."""

    def __init__(self, spec, seed, topic):
        self.seed, self.topic = seed, topic
        self.delay, self.loss, self.burst, self.rto, self.ordered = "none", 0.0, None, None, False
        pieces = [] if spec == "none" else spec.split(",")
        while pieces:
            name, _, value = pieces.pop(0).partition(":")
            if name == "burst" or value.startswith("lognormal"):
                value += "," + pieces.pop(0)
            if name == "delay":
                self.delay = value
            elif name == "loss":
                self.loss = float(value)
            elif name == "burst":
                self.burst = tuple(map(float, value.split(",")))
            elif name == "reliable":
                self.rto, self.ordered = millis(value), True
            else:
                assert name == "in-order", name
                self.ordered = True
        self.bad = False

    def draw(self, what, number):
        return uniform(self.seed, what, self.topic, number)

    def sent_in_vain(self, number, told):
        """For how long (ns); None if the message is lost."""
        lost = told or self.draw("loss", number) < self.loss
        if self.burst:
            p, n = self.burst
            u = self.draw("burst", number)
            if self.bad:
                self.bad = not u < 1 / n
            else:
                self.bad = u < p
            lost = lost or self.bad
        if not lost:
            return 0
        if self.rto is None:
            return None
        retry = 1
        while self.draw("loss", f"{number}.{retry}") < self.loss:
            retry += 1
        return retry * self.rto

    def flight(self, number):
        return drawn(self.delay, self.draw("delay", number))


# ---------------------------------------------------------------- the plants


class OwnWorld(Plant):
    """Moves by itself: `at(t)` is the state at run time t."""

    def __init__(self, seed, step_ms):
        self.model = mujoco.MjModel.from_xml_string(MJCF)
        self.model.opt.timestep = step_ms / 1000.0
        super().__init__(seed)
        self.step_ns = step_ms * MS
        self.taken = 0
        self.pushes = []  # (time, action), the oldest that still matters first
        self.input = np.float32(0.0)

    def at(self, now):
        while (self.taken + 1) * self.step_ns <= now:
            begins = self.taken * self.step_ns
            while self.pushes and self.pushes[0][0] <= begins:
                self.input = self.pushes.pop(0)[1]
            self.data.ctrl[0] = self.input
            self.disturb(begins)
            mujoco.mj_step(self.model, self.data)
            self.taken += 1
        return self

    def disturb(self, begins):
        """What else acts on the step that begins then: nothing, here."""

    def push(self, now, action):
        applied = np.float32(min(max(action, np.float32(-1.0)), np.float32(1.0)))
        self.pushes.append((now, applied))


# -------------------------------------------------------------------- nodes


@dataclass
class Node:
    name: str
    priority: int
    hz: Fraction = Fraction(50)
    anchor: int = 0
    k: int = 0
    last: int | None = None
    clock: tuple = (0, 0, 0)  # wrong since, by so much (ns), and so much more (10^-12)
    crashed: bool = False
    hang: int | None = None
    takes: str = "none"
    wakes: str = "none"
    late: str = "skip"  # what becomes of due times that pass while it is busy
    line: list = field(default_factory=list)  # due times that wait, each with what its clock showed
    waiting: int | None = None  # when the late tick starts
    ends: int | None = None  # when the tick in progress is over
    started: int = 0
    overruns: int = 0
    spent: int = 0

    def instant(self):
        """What the node's clock shows when its next tick is due."""
        return self.anchor + math.floor(self.k * SECOND / self.hz)

    def reading(self, now):
        since, offset, drift = self.clock
        return now + offset + (now - since) * drift // 10**12

    def shows(self, now):
        """The same as a stamp."""
        return max(0, self.reading(now))

    def due(self):
        """The first ns at which the clock shows the instant, by bisection."""
        if self.crashed:
            return NEVER
        since, offset, drift = self.clock
        if not offset and not drift:
            return self.instant()
        low, high = since, since + 1
        while self.reading(high) < self.instant():
            high = since + 2 * (high - since)
        while low < high:
            middle = (low + high) // 2
            low, high = (low, middle) if self.reading(middle) >= self.instant() else (middle + 1, high)
        return low

    def occupied(self):
        return self.waiting is not None or self.ends is not None

    def pass_by(self):
        self.last = self.instant()
        self.k += 1

    def give_up(self, now):
        """Overruns among the due times that wait: those that did so for too many periods."""
        if self.late == "catch-up":
            return
        periods = 0 if self.late == "skip" else int(self.late.removeprefix("queue:"))
        # Due times are rounded to a nanosecond.
        oldest = now - (periods * math.floor(SECOND / self.hz) + 1 if periods else 0)
        while self.line and self.line[0][0] < oldest:
            self.last = self.line.pop(0)[1]
            self.overruns += 1

    def begin_anew(self, now):
        """Forgets the due times that wait: there will be others."""
        self.give_up(now)
        self.line = []

    def move_to(self, now):
        """The first due time at or after now that finds the node free."""
        while self.instant() < self.reading(self.clock[0]):
            self.k += 1
        while self.due() < now or self.due() < (self.ends or 0) or (
                self.waiting is not None and self.due() <= self.waiting):
            self.k += 1

    def set_clock(self, value, now):
        self.begin_anew(now)
        offset, drift = value.split()
        self.clock = (now, millis(offset), round(Fraction(drift) * 10**6))
        self.k = 0
        self.move_to(now)

    def crash(self, now):
        self.begin_anew(now)
        self.crashed, self.waiting, self.ends, self.hang = True, None, None, None

    def restart(self, now):
        if not self.crashed:
            self.crash(now)
        self.crashed = False
        self.k = 0
        self.move_to(now)

    def rate(self, hz, now):
        self.begin_anew(now)
        self.hz, self.k = Fraction(hz), 0
        if self.last is not None:
            self.anchor, self.k = self.last, 1
        self.move_to(now)

    def offset(self, ms, now):
        self.begin_anew(now)
        self.anchor, self.k = millis(ms), 0
        self.move_to(now)


@dataclass(frozen=True)
class Config:
    """One run. Rates and times stay text, so that no float comes in between."""

    seed: int = 0
    world: str = "own"
    step_ms: int = 1
    depth: int = 1
    duration_s: str = "10"
    setup: tuple = ()
    knobs: tuple = ()

    def header(self):
        step = f" step_ms={self.step_ms}" if self.world == "own" else ""
        lines = [f"run seed={self.seed} world={self.world}{step} depth={self.depth} "
                 f"duration_s={self.duration_s}"]
        lines += [f"setup {knob}" for knob in self.setup]
        lines += [f"knob {time} {knob}" for time, knob in self.knobs]
        return "\n".join(lines)


class Line(Topic):
    """A topic that remembers all messages, behind a link."""

    def __init__(self, depth, seed, name):
        super().__init__(depth)
        self.all = []
        self.link = Link("none", seed, name)
        self.flying = []  # (delivery, number, data, origin)
        self.lose, self.postpone = set(), {}
        self.sent = self.lost = self.overtaken = self.highest = self.latest_delivery = 0
        self.oldest = False

    def send(self, data, payload, now, stamp, origin):
        origin_bytes = NEVER if origin is None else origin
        self.all.append(struct.pack("<QQQ", stamp, self.sent, origin_bytes) + payload)
        number, self.sent = self.sent, self.sent + 1
        vain = self.link.sent_in_vain(number, number in self.lose)
        if vain is None:
            self.lost += 1
            return
        at = now + vain + self.link.flight(number)
        if self.link.ordered:
            at = max(at, self.latest_delivery)
        at += self.postpone.get(number, 0)
        self.latest_delivery = max(self.latest_delivery, at)
        self.flying.append((at, number, data, stamp if origin is None else origin))
        if at == now:
            self.arrive(now)

    def arrive(self, now):
        here = sorted(f[:2] for f in self.flying if f[0] == now)
        for _, number in here:
            flight = next(f for f in self.flying if f[1] == number)
            self.flying.remove(flight)
            if number < self.highest:
                self.overtaken += 1
                continue
            self.highest = number + 1
            self.published = number
            self.publish(*flight[2:])

    def latest(self):
        """The message to be read."""
        unread = [message for message in self.buffer if message.number >= self.seen]
        if self.oldest and unread:
            self.seen = unread[0].number + 1
            return unread[0]
        return super().latest()


@dataclass
class Run:
    config: Config
    verdict: str = "balanced"
    end: int = 0
    ages: list = field(default_factory=list)
    states: list = field(default_factory=list)

    def __post_init__(self):
        config = self.config
        self.own = config.world == "own"
        self.policy = scripted
        self.obs, self.action, self.state = (
            Line(depth, config.seed, name)
            for depth, name in [(config.depth, "/obs"), (config.depth, "/action"), (1, "/state")])
        self.build()
        self.results = {}  # what a tick in progress is going to do, by node
        self.limit = None  # (ns): a push of an older sensing is none
        self.force = None  # (since, origin) of the push in force
        self.area = 0
        self.first_push = None
        for knob in config.setup:
            self.turn(knob, 0)
        self.first_policy, self.first_limit = self.policy, self.limit
        self.execute()

    def build(self):
        config = self.config
        self.plant = OwnWorld(config.seed, config.step_ms) if self.own else Plant(config.seed)
        self.nodes = [Node("sensor", 0), Node("policy", 1), Node("actuator", 2)]
        self.work = {"sensor": self.sensor, "policy": self.policy_node, "actuator": self.actuator}
        self.topics = {"/obs": self.obs, "/action": self.action}

    # What the nodes do: read at the start, and return what to do at the end.

    def sensor(self, now):
        reading = self.plant.at(now).observe() if self.own else self.plant.observe()

        node = self.nodes[0]
        began = node.shows(now)

        def publish(end):
            stamp = node.shows(end)
            origin = began if stamp != began else None
            self.obs.send(reading, reading.tobytes(), end, stamp, origin)
        return publish

    def policy_node(self, _now):
        message = self.obs.latest()
        if message is None:
            return lambda end: None
        action = self.policy(message.data)
        shows = self.nodes[1].shows
        return lambda end: self.action.send(
            action, struct.pack("<f", action), end, shows(end), message.origin)

    def actuator(self, _now):
        message = self.action.latest()

        def to_apply(end):
            stale = self.limit is not None and end - message.origin > self.limit
            return np.float32(0.0) if stale else message.data

        def apply(end):
            if message is not None:
                self.ages.append(max(0, end - message.origin))
                self.put_in_force(end, message.origin)
            if not self.own:
                wanted = np.float32(0.0) if message is None else to_apply(end)
                applied = self.plant.step(wanted)
                self.publish_state(len(self.states) + 1, end, applied)
                self.judge(end)
            elif message is not None:
                self.plant.at(end).push(end, to_apply(end))
        return apply

    # The world.

    def put_in_force(self, now, origin):
        self.close_force(now)
        self.force = (now, origin)
        self.first_push = now if self.first_push is None else self.first_push

    def close_force(self, now):
        if self.force is not None:
            since, origin = self.force
            self.area += max(0, now - origin) ** 2 - max(0, since - origin) ** 2
            self.force = (now, origin)

    def publish_state(self, number, now, applied):
        origin = None if self.force is None else self.force[1]
        latency = -1 if origin is None else max(0, now - origin)
        obs, state = self.plant.observe(), self.plant.state()
        payload = struct.pack("<Q6fq4d", number, *obs, applied, latency, *state)
        self.states.append((number, now, obs.tobytes(), struct.pack("<f", applied), state))
        stamp = now if self.own else self.nodes[2].shows(now)
        self.state.send(None, payload, now, stamp, origin)

    def judge(self, now):
        failure = self.plant.failure()
        if failure:
            self.verdict, self.end = failure, now

    def look(self, now):
        self.plant.at(now)
        if now > 0:
            self.publish_state(now // CONTROL_STEP, now, self.plant.input)
        self.judge(now)

    # Ticks.

    def start(self, node, now):
        n = node.started
        node.started += 1
        finish = self.work[node.name](now)
        cost = self.cost(node, n)
        if cost == 0:
            finish(now)
        else:
            node.ends = now + cost
            self.results[node.name] = (finish, cost)

    def cost(self, node, n):
        cost = drawn(node.takes, uniform(self.config.seed, "takes", node.name, n))
        if node.hang is not None:
            cost, node.hang = node.hang, None
        return cost

    def release(self, node, now):
        finish, cost = self.results.pop(node.name)
        node.ends = None
        node.spent += cost
        node.give_up(now)
        finish(now)

    def come_due(self, node, now):
        if node.occupied() and node.late != "skip" or node.line:
            node.line.append((now, node.instant()))
            node.k += 1
            return
        node.pass_by()
        if node.occupied():
            node.overruns += 1
            return
        u = uniform(self.config.seed, "wakes", node.name, node.started)
        late = drawn(node.wakes, u)
        if late == 0:
            self.start(node, now)
        else:
            node.waiting = now + late

    def turn(self, knob, now):
        kind, target, value = (knob + " ").split(" ", 2)
        value = value.strip()
        topic = self.topics.get(target)
        if topic is not None:
            self.turn_topic(topic, kind, target, value)
            return
        node = next((node for node in self.nodes if node.name == target), None)
        if kind == "rate":
            node.rate(value, now)
        elif kind == "offset":
            node.offset(value, now)
        elif kind == "takes":
            node.takes = value
        elif kind == "wakes":
            node.wakes = value
        elif kind == "late":
            node.give_up(now)
            node.late = value
        elif kind == "hang":
            node.hang = millis(value)
        elif kind == "clock":
            node.set_clock(value, now)
        elif kind == "crash":
            self.results.pop(node.name, None)
            node.crash(now)
        elif kind == "restart":
            self.results.pop(node.name, None)
            node.restart(now)
            if target == "policy":
                self.policy = self.first_policy
            if target == "actuator":
                self.limit = self.first_limit
        else:
            assert kind == "send", kind
            if target == "actuator":
                self.limit = None if value == "hold" else millis(value.removeprefix("zero:"))
                return
            self.policy = self.policy_named(value)

    def policy_named(self, name):
        return POLICIES[name]

    def turn_topic(self, topic, kind, name, value):
        if kind == "depth":
            topic.resize(int(value))
        elif kind == "link":
            topic.link = Link(value, self.config.seed, name)
        elif kind == "read":
            topic.oldest = value == "oldest"
        elif kind == "lose":
            topic.lose.add(int(value))
        else:
            assert kind == "postpone", kind
            number, ms = value.split()
            topic.postpone[int(number)] = millis(ms)

    # The order of all that happens.

    def execute(self):
        duration = nanoseconds(self.config.duration_s)
        knobs = sorted(((nanoseconds(t), knob) for t, knob in self.config.knobs),
                       key=lambda knob: knob[0])
        next_look = 0
        while True:
            times = [node.due() for node in self.nodes]
            times += [node.waiting for node in self.nodes if node.waiting is not None]
            times += [node.ends for node in self.nodes if node.ends is not None]
            times += [knobs[0][0]] if knobs else []
            times += [next_look] if self.own else []
            times += [flight[0] for topic in self.topics.values() for flight in topic.flying]
            now = min(times)
            if now > duration:
                self.end = duration
                break
            while knobs and knobs[0][0] == now:
                self.turn(knobs.pop(0)[1], now)
            if not self.instant(now, next_look):
                break
            if now == next_look:
                next_look += CONTROL_STEP
        self.close_force(self.end)
        for node in self.nodes:
            if node.occupied():
                node.give_up(self.end + 1)

    def instant(self, now, next_look):
        """All that happens at `now`, in order; false if that ended the run."""
        for node in self.nodes:
            if node.ends == now and self.standing():
                self.release(node, now)
        for topic in self.topics.values():
            topic.arrive(now)
        if self.own and now == next_look and self.standing():
            self.look(now)
        for node in self.nodes:
            if node.due() == now and (self.standing() or node.occupied()):
                self.come_due(node, now)
            if node.waiting == now and self.standing():
                node.waiting = None
                node.give_up(now)
                self.start(node, now)
            while node.line and not node.occupied() and self.standing():
                node.last = node.line.pop(0)[1]
                self.start(node, now)
        return self.standing()

    def standing(self):
        return self.verdict == "balanced"

    def results_line(self):
        got = {
            "steps": self.state.sent,
            "obs_published": self.obs.sent, "obs_dropped": self.obs.dropped,
            "action_published": self.action.sent, "action_dropped": self.action.dropped,
            "latency_count": len(self.ages), "latency_sum_ns": sum(self.ages),
            "push_first_ns": "none" if self.first_push is None else self.first_push,
            "push_area": self.area,
            "ticks": ",".join(str(node.started) for node in self.nodes),
            "overruns": ",".join(str(node.overruns) for node in self.nodes),
            "spent_ns": ",".join(str(node.spent) for node in self.nodes),
            "verdict": self.verdict, "sim_time_ns": self.end,
        }
        for name, topic in [("obs", self.obs), ("action", self.action)]:
            if topic.lost or topic.overtaken or topic.flying:
                got[f"{name}_way"] = f"{topic.lost},{topic.overtaken},{len(topic.flying)}"
        return "got " + " ".join(f"{key}={value}" for key, value in got.items())

    def digest(self):
        return fnv1a64(b"".join(self.obs.all + self.action.all + self.state.all))


def block(config):
    run = Run(config)
    return f"{config.header()}\n{run.results_line()}\nfnv1a64={run.digest():016x}\n"


def takes(policy, **more):
    return Config(setup=(f"takes policy {policy}",), **more)


CONFIGS = [
    # The own world alone: every step of physics, fast and slow control, a fall.
    Config(),
    Config(seed=1, step_ms=2, setup=("rate policy 25",)),
    Config(seed=2, step_ms=5, setup=("rate policy 10", "rate sensor 100")),
    Config(seed=3, step_ms=10, setup=("rate policy 33.3", "rate sensor 60")),
    Config(seed=4, setup=("rate policy 5",)),
    Config(seed=5, setup=("send policy zero",)),
    Config(seed=6, step_ms=5, setup=("rate actuator 500", "rate sensor 300", "rate policy 400"),
           duration_s="3"),
    Config(seed=7, setup=("rate actuator 7", "rate policy 33.3"), duration_s="3"),
    # Costs: within a period, of exactly a period, of several, of all nodes.
    takes("15"), takes("20", seed=1), takes("30", seed=2), takes("60", seed=3), takes("60.000001"),
    takes("70", seed=4), takes("lognormal:12,40", seed=12345), takes("5..45", seed=2**63 + 5),
    takes("busy 0..30", seed=8, step_ms=5),
    Config(seed=9, setup=("takes sensor 4", "takes policy 7..13", "takes actuator 2.5",
                          "rate sensor 100", "rate policy 90"), depth=3),
    Config(seed=10, setup=("takes actuator 25", "rate sensor 200"), duration_s="5"),
    Config(seed=11, step_ms=10, setup=("takes policy 13", "takes actuator 3.3", "takes sensor 1")),
    # Costs in the course's world: the actuator's moves the whole step.
    takes("30", seed=1, world="course"),
    takes("lognormal:20,80", seed=2, world="course"),
    Config(seed=3, world="course", setup=("takes actuator 12", "takes sensor 3")),
    Config(seed=4, world="course", setup=("takes actuator 30", "takes policy 20"), duration_s="5"),
    # Offsets, small, beyond the period, of a whole period.
    Config(seed=5, setup=("offset policy 7", "offset sensor 13.5")),
    Config(seed=6, setup=("offset policy 45", "rate policy 20", "offset actuator 3")),
    Config(seed=7, setup=("offset policy 50", "rate policy 20"), world="course"),
    # Lateness.
    Config(seed=8, setup=("wakes policy 3",)),
    Config(seed=9, setup=("wakes policy 0..25", "wakes sensor 0..30", "wakes actuator 0..5")),
    Config(seed=10, setup=("wakes policy lognormal:2,20", "takes policy 5..30", "rate policy 40")),
    Config(seed=11, setup=("wakes policy 20",), duration_s="4"),
    Config(seed=12, setup=("wakes policy 0..2", "takes actuator 0..2", "offset sensor 19"),
           world="course"),
    # Live: everything, also while busy, and at the instant of a release.
    Config(seed=13, setup=("takes policy 30",), knobs=(
        ("1", "takes policy 10..20"), ("2", "takes policy none"), ("3", "takes policy 55"),
        ("4.01", "rate policy 33.3"), ("5", "offset policy 9"), ("6.003", "takes policy 12"),
        ("7", "rate policy 50"), ("8", "wakes policy 0..4"))),
    Config(seed=14, setup=("takes policy 70", "rate policy 10"), knobs=(
        ("0.05", "rate policy 40"), ("1.07", "offset policy 33"), ("2.2", "takes policy 8"),
        ("3", "rate actuator 100"), ("4.5", "depth /obs 5"), ("5", "depth /obs 1"))),
    Config(seed=15, world="course", knobs=(
        ("1", "takes sensor 5..60"), ("3", "takes sensor none"), ("4", "offset actuator 10"),
        ("5", "wakes actuator 1..9"), ("6.5", "wakes actuator none"))),
    # The end: a release at the very end, one after it, overruns at it.
    takes("20", duration_s="3.02"), takes("40", duration_s="3.06", seed=1),
    takes("100", duration_s="2", seed=2),
    Config(seed=3, setup=("rate policy 5", "takes policy 90", "takes sensor 41")),
]


def combinations(chance, seeds):
    """Runs with links, reading and clocks at random, beside all that there was."""
    pick, number = chance.choice, chance.randrange

    def link():
        parts = [
            pick(["", f"delay:{number(1, 60)}", f"delay:{number(30)}..{number(30, 90)}",
                  f"delay:lognormal:{number(2, 30)},{number(30, 120)}", "delay:12.5"]),
            pick(["", "", "in-order"]),
            pick(["", f"loss:0.{number(1, 7)}"]),
            pick(["", "", f"burst:0.0{number(1, 9)},{number(1, 8)}", "burst:0.1,2.5"]),
            pick(["", "", f"reliable:{number(1, 40)}"]),
        ]
        return ",".join(filter(None, parts)) or "none"

    def knobs(live):
        topic, node = pick(["/obs", "/action"]), pick(["sensor", "policy", "actuator"])
        node_of_clock = pick(["sensor", "policy"])
        return pick([
            f"link {topic} {link()}", f"link {topic} {link()}", f"link {topic} {link()}",
            f"read {topic} {pick(['oldest', 'newest'])}", f"read {topic} oldest",
            f"depth {topic} {number(1, 12)}",
            f"takes {node} {pick(['none', f'{number(1, 40)}', f'0..{number(1, 30)}'])}",
            f"wakes {node} 0..{number(1, 15)}", f"offset {node} {number(25)}",
            f"rate {node_of_clock} {pick(['49', '50', '60', '33.3', '100', '20'])}",
            f"lose {topic} {number(200, 480)}", f"postpone {topic} {number(200, 480)} {number(99)}",
            f"clock {node_of_clock} {number(-30, 30)} {number(-3000, 3000)}",
        ] + ([f"hang {node} {number(1, 90)}", f"crash {node}", f"restart {node}",
              f"restart {node}"] if live else []))

    for seed in seeds:
        setup = {" ".join(knob.split()[:2]): knob for knob in (knobs(False) for _ in range(5))}
        times = sorted(number(1, 400) for _ in range(number(6)))
        yield Config(
            seed=seed, world=pick(["own", "own", "own", "course"]), step_ms=pick([1, 2, 5, 10]),
            depth=number(1, 4), duration_s=pick(["4", "3.02", "5.001"]), setup=tuple(setup.values()),
            knobs=tuple((f"{time / 100:g}", knobs(True)) for time in times))


def more(count, chance):
    """The same for any number of seeds, with finer times, longer distributions and all
    knobs of faults more often."""
    pick, number = chance.choice, chance.randrange
    for config in combinations(chance, (chance.getrandbits(63) for _ in range(count))):
        node = pick(["sensor", "policy", "actuator"])
        begins = number(1, 2_500_000) / 1e6
        later = begins + pick([0, 20_000, number(1, 900_000)]) / 1e6
        extra = pick([
            (), ((begins, f"crash {node}"), (later, f"restart {node}")),
            ((begins, f"hang {node} {number(1, 200) / 8}"),),
            ((begins, f"takes {node} lognormal:{number(1, 20)},{number(20, 90)}"),
             (later, f"takes {node} busy 0..{number(40)}.5")),
            ((begins, f"send actuator zero:{number(90)}"), (later, f"restart actuator")),
            ((begins, "send policy zero"), (later, "restart policy")),
            ((begins, f"clock {node if node != 'actuator' else 'policy'} {number(-200, 200) / 8} "
                      f"{number(-99_999, 99_999)}"),),
        ])
        knobs = [*config.knobs, *((f"{time:.6f}", knob) for time, knob in extra)]
        yield replace(config, knobs=tuple(sorted(knobs, key=lambda knob: nanoseconds(knob[0]))))


LINKS = [
    Config(setup=("link /action delay:60",)),
    Config(seed=1, setup=("link /obs loss:0.8",)),
    Config(seed=2, setup=("depth /obs 10", "read /obs oldest", "rate policy 49")),
    Config(seed=3, setup=("link /action delay:0..90",)),
    Config(seed=4, setup=("link /action delay:0..90,in-order",)),
    Config(seed=5, setup=("link /action loss:0.3,reliable:15",)),
    Config(seed=6, setup=("link /obs burst:0.05,4", "link /action delay:lognormal:10,60")),
    Config(seed=7, setup=("link /obs loss:0.2,burst:0.1,3,reliable:7,delay:3..9",)),
    Config(seed=8, setup=("lose /obs 100", "lose /obs 101", "postpone /action 150 55")),
    Config(seed=9, setup=("link /obs delay:20", "takes policy 20", "depth /obs 1"), depth=3),
    Config(seed=10, knobs=(("2", "crash policy"), ("2.07", "restart policy"))),
    Config(seed=11, knobs=(("2", "crash sensor"),)),
    Config(seed=12, setup=("takes policy 5",), knobs=(("1", "hang policy 71"), ("3", "hang sensor 33"))),
    Config(seed=13, setup=("clock sensor 15 0",)),
    Config(seed=14, setup=("clock sensor -15 200", "clock policy 7.5 -35.25")),
    Config(seed=15, setup=("takes sensor 3",), knobs=(("1.005", "clock sensor 100 500"),
                                                      ("2", "clock sensor 0 0"),
                                                      ("3", "rate sensor 70"))),
    *combinations(random.Random(15), range(100, 140)),
    # What the actuator does with a stale action.
    Config(setup=("send actuator zero:50",), knobs=(("2", "crash policy"),)),
    Config(seed=1, setup=("send actuator zero:20", "link /obs loss:0.7")),
    Config(seed=2, setup=("send actuator zero:20", "link /action delay:20"), world="course"),
    Config(seed=3, knobs=(("1", "send actuator zero:0"), ("1.1", "send actuator hold"))),
    Config(seed=4, setup=("send actuator zero:10", "link /obs delay:8"), knobs=(
        ("1", "send actuator hold"), ("2", "crash actuator"), ("2.05", "restart actuator"))),
    *more(60, random.Random("links and faults")),
]


def late(count, chance):
    """The same with due times that wait for a node."""
    pick, number = chance.choice, chance.randrange

    def spec():
        return pick(["skip", "queue:1", f"queue:{number(2, 5)}", "catch-up", "catch-up"])

    def knob(node):
        return pick([f"late {node} {spec()}", f"late {node} {spec()}", f"hang {node} {number(20, 120)}",
                     f"hang {node} {number(20, 120)}", f"takes {node} {pick([5, 20, 30, '0..60'])}"])

    for config in more(count, chance):
        names = ["sensor", "policy", "actuator"]
        setup = [f"late {node} {spec()}" for node in names if chance.random() < 0.7]
        knobs = [(f"{number(1, 3_000) / 1e3:.3f}", knob(pick(names))) for _ in range(number(1, 8))]
        yield replace(config, setup=config.setup + tuple(setup), knobs=tuple(sorted(
            [*config.knobs, *knobs], key=lambda knob: nanoseconds(knob[0]))))


# A tick that waited for the one before it begins in its place among all of the instant.
LATE = [
    *(Config(seed=seed, setup=("takes policy 20", f"late policy {spec}"), duration_s="3",
             knobs=(("1", "hang policy 50"),))
      for seed, spec in enumerate(["skip", "queue:1", "queue:2", "catch-up"])),
    Config(seed=4, setup=("takes policy 10", "late policy catch-up", "wakes policy 3"),
           knobs=(("1", "hang policy 130"),)),
    *late(40, random.Random("late")),
]


def check_facts():
    """With H = 10 ms and nothing asked for, both worlds are one to the policy."""
    for seed, control in [(0, "50"), (1, "25"), (2, "10"), (3, "5"), (4, "12.5")]:
        setup = (f"rate policy {control}",)
        own = Run(Config(seed=seed, step_ms=10, setup=setup))
        course = Run(Config(seed=seed, world="course", setup=setup))
        common = min(len(own.states), len(course.states))
        assert common > 10
        for mine, theirs in zip(own.states, course.states):
            assert mine[0] == theirs[0] and mine[2:] == theirs[2:], (seed, control, mine[0])
        if own.verdict == "balanced":
            assert len(own.states) == len(course.states) - 1 == 500
        else:
            assert own.end == course.end + CONTROL_STEP, (own.end, course.end)
        print(f"{control:>4} Hz, seed {seed}: {common} rows are the same in both worlds")


def check_file(text):
    assert (HERE / "honest.txt").read_text(encoding="ascii") == text, "honest.txt is out of date"
    print("honest.txt: up to date")


def main():
    assert mujoco.__version__ == "3.17.0", f"MuJoCo 3.17.0 is needed, not {mujoco.__version__}"
    parser = argparse.ArgumentParser(description="Write or check the golden file.")
    parser.add_argument("--check", action="store_true", help="check, and write nothing")
    parser.add_argument("--more", nargs=2, metavar=("COUNT", "FILE"), help="write other runs")
    parser.add_argument("--seed", default="0", help="of those")
    arguments = parser.parse_args()
    if arguments.more:
        count, path = arguments.more
        runs = [run for make in (more, late)
                for run in make(int(count) // 2, random.Random(f"more {arguments.seed}"))]
        with open(path, "w", encoding="ascii") as file:
            file.write("\n".join(map(block, runs)))
        return
    check_facts()
    text = "\n".join(map(block, CONFIGS + LINKS + LATE))
    if arguments.check:
        check_file(text)
    else:
        (HERE / "honest.txt").write_text(text, encoding="ascii")


if __name__ == "__main__":
    main()
