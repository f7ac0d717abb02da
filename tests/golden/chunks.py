#!/usr/bin/env python3
"""An independent model of runs whose policy answers with chunks of actions, and the
golden file that it writes.

This file shares no code with the Rust crate. Time, links and faults come from
`honest.py`, physics from `reference.py`; chunks are said here a second time.

    python3 tests/golden/chunks.py             write the golden file
    python3 tests/golden/chunks.py --check     check it
    python3 tests/golden/chunks.py --table     starts that stand, by age and plan
    python3 tests/golden/chunks.py --more FROM TO FILE
                                               write other runs at random

chunks.txt (ASCII, "\\n" line ends)
-----------------------------------
Blocks with a blank line between them, each:
    run OPTION ...                as the command line has them (virtual clock)
    knob TIME KNOB                any number: turned at that time (s)
    got KEY=VALUE ...             what came of it
    chunks KEY=VALUE ...          the block `chunks` of the JSON
    fnv1a64=16 HEX DIGITS
The hash is FNV-1a, 64 bit, over every message of /obs, then of /chunk, then of
/action, then of /state, as in `honest.py`; the payload of a chunk is its actions, f32.
A topic has five figures: published, dropped, lost, overtaken, in flight at the end.
final_pole_angle (rad) is that of the last row, none without a row; push_age_ms is the
mean over time. Floats are shortest decimals, none where there is nothing to average.

Where the rules are silent
--------------------------
Each is one reading of several; a letter for each, so that one can name it.

The policy
 a  `lqr` has the gains for 20 ms under every plan, `hold` too, at every control rate;
    its terms are added in the order position, angle, velocity, angular velocity.
 b  `hold` asks the policy once (`random` draws once a chunk). `committed` does not ask
    it for actions that are committed: `random` draws only for the others.
 c  A chunk counts as made when its tick starts, whatever the plan, released or lost.
 d  The action committed for an instant before its chunk's origin (a sensor's clock that
    is ahead) is 0, as where there is no chunk.
 e  `max` takes in the costs of all ticks since the policy's start, also of those under
    another setting. The cost of a tick that hung is the time it hung.
 f  After a restart `plan`, `expect-delay`, `play` and `merge` are those of the start of
    the run, knobs before the run included; the draws of `random` begin anew, as they do
    where a knob names the policy.
 g  The model is not brought forward (`mj_forward`) before its first step.

The sensor
 u  A reading is compared with the last one that was not dropped as similar, at the start of
    its tick: squares of differences of the five f32 in f64, summed in their order. A live
    change keeps that one; after a restart there is none, and the distance is that of the
    start of the run.

The player
 h  Chunks that were delivered while it was down are there for the first tick after its
    restart. It has forgotten its published ticks (`executed`), too, and whether it
    ever had a chunk: no stalls until the next one.
 i  Index and `arrival` go by the start of the tick, late or not, in run time.
 j  A blend's plan is made by the ticks under `blend` alone; a new weight keeps it,
    another merge drops it. Where the knob comes back to `blend`, there is no plan, and
    so a stall, until a chunk is taken. `newest` and `ensemble` know all chunks taken.
 k  Several chunks taken in one tick are blended in one after the other.
 l  Weights may be 0: such an action went into the sum, and is `used`.
 m  A stall counts when its tick starts.

The figures
 n  They are the run's and outlive a crash of the player: the last published action, the
    ticks of the predicted age, the chunks taken since.
 o  What is taken counts at the start of the tick (expect_error), what is published at
    its release (used, predicted, seam, step).
 p  The predicted age is 0 for a chunk that was made under `hold`, whatever the plan now.
    Ticks of the player that published nothing are in the count like others.
 q  "Just the action" is equality of numbers: 0 is -0. Differences of actions in f64, sums
    in the order of time, then divided by the number. Mean times: the sum in ns, an
    integer, divided by the number, then by 1e6.
 r  expect_error_max is the greatest, with its sign.

The disturbance
 s  In the course's world j is 0 for the first control step, so that both worlds have
    the same force: with steps of 10 ms they stay the same, byte for byte.
 t  There, the strength is that of the instant at which the control step is taken.
"""

import argparse
import bisect
import math
import random
import shlex
import statistics
import struct
from dataclasses import dataclass, field, replace

import mujoco
import numpy as np
import honest
from honest import (
    CONTROL_STEP, MS, HERE, Line, Node, OwnWorld, fnv1a64, millis, nanoseconds, uniform,
)
from reference import MJCF, Plant, scripted, zero

DELTA = 20 * MS
# Position, angle, velocity, angular velocity: `lqr.txt`, actions held for one control step.
LQR_GAINS = (-0.36059849470389443, -6.7248603808512035, -0.6424484067636463, -1.3360537941988535)
FIVE = struct.Struct("<5f")
ONE = struct.Struct("<f")


def single(number):
    """The nearest f32, as a float."""
    return ONE.unpack(ONE.pack(number))[0]


# ----------------------------------------------------------------- policies


def lqr(obs):
    x, velocity, cos, sin, spin = map(float, obs)
    k = LQR_GAINS
    u = -(k[0] * x) - k[1] * math.atan2(sin, cos) - k[2] * velocity - k[3] * spin
    return np.float32(min(max(u, -1.0), 1.0))


class Random:
    """Uniform from -1 to 1, by numpy's generator for the seed and 1."""

    def __init__(self, seed):
        self.draws = np.random.Generator(np.random.PCG64([seed, 1]))

    def __call__(self, _obs):
        return np.float32(self.draws.uniform(-1.0, 1.0))


class Model:
    """What the policy believes the cart-pole to be."""

    def __init__(self, length):
        text = MJCF.replace('fromto="0 0 0 0 0 1.0"', f'fromto="0 0 0 0 0 {length}"')
        assert text.count(f"0 0 0 0 0 {length}") == 1
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        self.place, self.pace, self.ctrl = self.data.qpos, self.data.qvel, self.data.ctrl

    def begin(self, obs):
        x, velocity, cos, sin, spin = map(float, obs)
        mujoco.mj_resetData(self.model, self.data)
        self.place[:] = x, math.atan2(sin, cos)
        self.pace[:] = velocity, spin

    def observe(self):
        (x, hinge), (velocity, spin) = self.place.tolist(), self.pace.tolist()
        theta = (hinge + math.pi) % (2.0 * math.pi) - math.pi
        return FIVE.unpack(FIVE.pack(x, velocity, math.cos(theta), math.sin(theta), spin))

    def step(self, action):
        self.ctrl[0] = min(max(action, -1.0), 1.0)
        mujoco.mj_step(self.model, self.data, 2)


# ------------------------------------------------------------------- chunks


@dataclass
class Chunk:
    number: int  # among those made
    made: int  # the start of the tick (ns)
    origin: int
    ready: int  # when its maker expects it to be played from
    actions: list
    assumes: bool  # that the robot does something meanwhile
    taken: int = 0

    def index(self, at):
        return (at - self.origin) // DELTA

    def has(self, index):
        return 0 <= index < len(self.actions)


class Memory:
    """What a policy knows of its own past, and a crash takes from it."""

    def __init__(self):
        self.chunks = []
        self.last = self.greatest = 0  # costs

    def spent(self, cost):
        self.last, self.greatest = cost, max(self.greatest, cost)

    def expected(self, spec):
        word, _, margin = spec.partition("+")
        if word in ("last", "max"):
            cost = self.last if word == "last" else self.greatest
            return cost + (millis(margin) if margin else 0)
        return millis(word)

    def committed(self, at):
        chunk = next((chunk for chunk in reversed(self.chunks) if chunk.ready <= at), None)
        if chunk is None or at < chunk.origin:
            return 0.0
        return chunk.actions[min(chunk.index(at), len(chunk.actions) - 1)]


@dataclass
class Said:
    """An action to be published: what went into it are pairs of chunk and index."""

    action: float
    origin: float
    parts: frozenset


class Tray:
    """What a player has in hand, and a crash takes from it."""

    def __init__(self):
        self.chunks = []
        self.published = []  # starts of the ticks that did
        self.plan = {}  # of a blend: by number of the tick
        self.tick = -1

    def index(self, chunk, play, at):
        if play == "time":
            return chunk.index(at)
        if play == "arrival":
            return (at - chunk.taken) // DELTA
        assert play == "executed", play
        counted = bisect.bisect_left
        return counted(self.published, at) - counted(self.published, chunk.origin)

    def say(self, taken, play, merge, at):
        """The action of the tick at that time; None if there is none."""
        self.tick += 1
        for chunk in taken:
            chunk.taken = at
            self.chunks.append(chunk)
        name, _, value = merge.partition(":")
        if name == "blend":
            for chunk in taken:
                self.plan = self.blended(chunk, self.index(chunk, play, at), float(value))
            return self.plan.get(self.tick)
        self.plan = {}
        if name == "ensemble":
            return self.ensemble(play, float(value), at)
        assert name == "newest", merge
        if not self.chunks:
            return None
        chunk = self.chunks[-1]
        index = self.index(chunk, play, at)
        return alone(chunk, index) if chunk.has(index) else None

    def blended(self, chunk, begins, weight):
        plan = {}
        for index in range(max(begins, 0), len(chunk.actions)):
            tick = self.tick + index - begins
            new, old = alone(chunk, index), self.plan.get(tick)
            plan[tick] = new if old is None else Said(
                single((1.0 - weight) * old.action + weight * new.action),
                (1.0 - weight) * old.origin + weight * new.origin,
                old.parts | new.parts)
        return plan

    def ensemble(self, play, decay, at):
        weights = actions = ages = 0.0
        parts = []
        for chunk in self.chunks:
            index = self.index(chunk, play, at)
            if chunk.has(index):
                weight = math.exp(-decay * len(parts))
                weights += weight
                actions += weight * chunk.actions[index]
                ages += weight * (at - chunk.origin)
                parts.append((chunk.number, index))
        if not parts:
            return None
        return Said(single(actions / weights), at - round(ages / weights), frozenset(parts))


def alone(chunk, index):
    return Said(chunk.actions[index], float(chunk.origin), frozenset([(chunk.number, index)]))


class ChunkLine(Line):
    """A topic whose reader takes all."""

    def __init__(self, seed):
        super().__init__(1, seed, "/chunk")

    def publish(self, data, origin):
        self.buffer.append(data)

    def take(self):
        taken = list(self.buffer)
        self.buffer.clear()
        return taken


# ------------------------------------------------------------------ figures


def mean(numbers):
    total = 0.0
    for number in numbers:
        total += number
    return total / len(numbers) if numbers else None


def mean_ms(durations):
    return sum(durations) / len(durations) / 1e6 if durations else None


def p99(numbers):
    return sorted(numbers)[-(-99 * len(numbers) // 100) - 1] if numbers else None


@dataclass
class Figures:
    computed: int = 0
    used: set = field(default_factory=set)
    predicted: list = field(default_factory=list)  # ns
    seams: list = field(default_factory=list)
    steps: list = field(default_factory=list)
    errors: list = field(default_factory=list)  # ns
    stalls: int = 0
    ticks: list = field(default_factory=list)  # of the player: [start, what it said or held]
    newest: Chunk | None = None
    last: float | None = None  # published
    taken_since: bool = False

    def tick(self, now, taken):
        self.ticks.append([now, 0.0 if self.last is None else self.last])
        for chunk in taken:
            self.newest, self.taken_since = chunk, True
            self.errors.append(now - chunk.ready)

    def publish(self, said):
        began = self.ticks[-1][0]
        self.predicted.append(self.predicted_age(began))
        self.used |= said.parts
        if self.last is not None:
            differences = self.seams if self.taken_since else self.steps
            differences.append(abs(said.action - self.last))
        self.taken_since, self.last = False, said.action
        self.ticks[-1][1] = said.action

    def predicted_age(self, now):
        chunk, count = self.newest, 0
        if not chunk.assumes:
            return 0
        for at, said in reversed(self.ticks):
            if at < chunk.origin:
                break
            index = chunk.index(at)
            count += at < now and chunk.has(index) and chunk.actions[index] == said
        return count * DELTA

    def block(self):
        return {
            "computed": self.computed, "used": len(self.used),
            "predicted_ms": mean_ms(self.predicted),
            "seam_mean": mean(self.seams), "seam_p99": p99(self.seams),
            "step_mean": mean(self.steps), "step_p99": p99(self.steps),
            "expect_error_mean_ms": mean_ms(self.errors),
            "expect_error_max_ms": max(self.errors) / 1e6 if self.errors else None,
        }


# -------------------------------------------------------------- disturbance


class Disturbance:
    """A random force on the slider, another in every 20 ms."""

    def __init__(self, seed):
        self.seed = seed
        self.turned = []  # (time, N), the oldest that still matters first
        self.strength = 0.0
        self.known = None  # the last draw and its number

    def force(self, begins, number):
        while self.turned and self.turned[0][0] <= begins:
            self.strength = self.turned.pop(0)[1]
        if self.strength == 0.0:
            return 0.0
        if self.known is None or self.known[0] != number:
            u = uniform(self.seed, "disturb", "plant", number)
            self.known = number, statistics.NormalDist().inv_cdf(u) if u else 0.0
        return self.strength * self.known[1]


class DisturbedWorld(OwnWorld):
    def __init__(self, seed, step_ms):
        self.disturbance = Disturbance(seed)
        super().__init__(seed, step_ms)

    def disturb(self, begins):
        self.data.qfrc_applied[0] = self.disturbance.force(begins, begins // CONTROL_STEP)


class DisturbedPlant(Plant):
    """The course's: time stands still between its steps."""

    def __init__(self, seed):
        super().__init__(seed)
        self.disturbance, self.taken = Disturbance(seed), 0

    def step(self, action):
        self.data.qfrc_applied[0] = self.disturbance.force(honest.NEVER, self.taken)
        self.taken += 1
        return super().step(action)


# --------------------------------------------------------------------- runs


@dataclass(frozen=True)
class Config:
    """One run. Rates and times stay text, so that no float comes in between."""

    seed: int = 0
    duration_s: str = "10"
    world: str = "own"
    step_ms: int = 1
    depth: int = 1
    policy: str = "scripted"
    chunk: int | None = 50
    plan: str = "rollout"
    expect: str = "last"
    play: str = "time"
    merge: str = "newest"
    length: str = "1"
    control_hz: str = "50"
    sensor_hz: str = "50"
    think_ms: str = "none"
    setup: tuple = ()
    knobs: tuple = ()

    def options(self):
        """Of the command line; without those that say what holds anyway."""
        named = [("seed", self.seed), ("duration-s", self.duration_s), ("world", self.world)]
        usual = Config()
        if self.world == "own":
            named += [("world-step-ms", self.step_ms)]
        if self.chunk is not None:
            named += [("chunk", self.chunk)]
        named += [
            (name, getattr(self, attribute)) for name, attribute in [
                ("queue-depth", "depth"), ("policy", "policy"), ("plan", "plan"),
                ("expect-delay", "expect"), ("play", "play"), ("merge", "merge"),
                ("control-hz", "control_hz"), ("sensor-hz", "sensor_hz"),
                ("think-ms", "think_ms"),
            ] if getattr(self, attribute) != getattr(usual, attribute)]
        if self.length != usual.length:
            named += [("model", f"length:{self.length}")]
        named += [("knob", knob) for knob in self.setup]
        return [word for name, value in named for word in (f"--{name}", str(value))]

    def header(self):
        lines = ["run " + shlex.join(self.options())]
        lines += [f"knob {time} {knob}" for time, knob in self.knobs]
        return "\n".join(lines)


class Run(honest.Run):
    """A run with a player between policy and actuator, if there are chunks."""

    def build(self):
        config = self.config
        self.plant = (DisturbedWorld(config.seed, config.step_ms) if self.own
                      else DisturbedPlant(config.seed))
        self.chunk = ChunkLine(config.seed)
        self.model = Model(config.length)
        self.settings = {"plan": config.plan, "expect-delay": config.expect,
                         "play": config.play, "merge": config.merge}
        self.memory, self.tray, self.figures = Memory(), Tray(), Figures()
        self.made = 0
        self.similar, self.sent = 0.0, None
        sensor, policy = Node("sensor", 0), Node("policy", 1)
        player, actuator = Node("player", 2), Node("actuator", 3)
        self.nodes = [sensor, policy, player, actuator]
        self.work = {"sensor": self.sensor, "policy": self.planner, "player": self.player,
                     "actuator": self.actuator}
        self.topics = {"/obs": self.obs, "/chunk": self.chunk, "/action": self.action}
        if config.chunk is None:
            self.nodes.remove(player)
            self.work["policy"] = self.policy_node
            del self.topics["/chunk"]
        self.turn(f"policy {config.policy}", 0)
        self.first_settings, self.first_named = dict(self.settings), self.named
        self.turn(f"rate policy {config.control_hz}", 0)
        self.turn(f"rate sensor {config.sensor_hz}", 0)
        self.turn(f"takes policy {config.think_ms}", 0)

    # The sensor.

    def sensor(self, now):
        publish = super().sensor(now)
        plant = self.plant.at(now) if self.own else self.plant
        seen = list(map(float, plant.observe()))
        if self.sent is not None and distance(seen, self.sent) < self.similar:
            return lambda end: None
        self.sent = seen
        return publish

    # The policy.

    def policy_named(self, name):
        self.named = name
        if name == "random":
            return Random(self.config.seed)
        return {"scripted": scripted, "lqr": lqr, "zero": zero}[name]

    def planner(self, now):
        message = self.obs.latest()
        if message is None:
            return lambda end: None
        ready = now + self.memory.expected(self.settings["expect-delay"])
        plan = self.settings["plan"]
        actions = self.planned(plan, message, ready)
        chunk = Chunk(self.made, now, message.origin, ready, actions, plan != "hold")
        self.made += 1
        self.memory.chunks.append(chunk)
        shows = next(node for node in self.nodes if node.name == "policy").shows
        payload = struct.pack(f"<{len(actions)}f", *actions)

        def release(end):
            self.figures.computed += len(actions)
            self.chunk.send(chunk, payload, end, shows(end), message.origin)
        return release

    def planned(self, plan, message, ready):
        count = self.config.chunk
        if plan == "hold":
            return [float(self.policy(message.data))] * count
        blind = self.policy is zero or isinstance(self.policy, Random)
        actions = []
        self.model.begin(message.data)
        for i in range(count):
            instant = message.origin + i * DELTA
            if plan == "committed" and instant < ready:
                action = self.memory.committed(instant)
            else:
                action = float(self.policy(None if blind else self.model.observe()))
            actions.append(action)
            if not blind:
                self.model.step(action)
        return actions

    def cost(self, node, n):
        cost = super().cost(node, n)
        if node.name == "policy":
            self.memory.spent(cost)
        return cost

    # The player.

    def player(self, now):
        taken = self.chunk.take()
        tray, figures = self.tray, self.figures
        figures.tick(now, taken)
        said = tray.say(taken, self.settings["play"], self.settings["merge"], now)
        if said is None:
            figures.stalls += bool(tray.chunks)
            return lambda end: None
        shows = next(node for node in self.nodes if node.name == "player").shows

        def publish(end):
            tray.published.append(now)
            figures.publish(said)
            action = np.float32(said.action)
            self.action.send(action, ONE.pack(action), end, shows(end), round(said.origin))
        return publish

    # Knobs.

    def turn(self, knob, now):
        kind, _, value = knob.partition(" ")
        if kind in self.settings:
            self.settings[kind] = value
        elif kind == "set":
            assert value.startswith("sensor similar "), value
            self.similar = float(value.split()[2])
        elif kind == "disturb":
            self.plant.disturbance.turned.append((now, float(value)))
        elif kind in ("policy", "on-stale"):
            super().turn(f"send {'policy' if kind == 'policy' else 'actuator'} {value}", now)
        else:
            super().turn(knob, now)
            if kind in ("crash", "restart"):
                self.forget(value, kind == "restart")

    def forget(self, node, again):
        if node == "policy":
            self.memory = Memory()
        if node == "player":
            self.tray = Tray()
        if node == "sensor":
            self.sent = None
            self.similar = self.first_similar if again else self.similar
        if again and node in ("policy", "player"):
            names = {"policy": ("plan", "expect-delay"), "player": ("play", "merge")}[node]
            self.settings |= {name: self.first_settings[name] for name in names}
            if node == "policy":
                self.policy = self.policy_named(self.first_named)

    def execute(self):
        self.first_settings, self.first_named = dict(self.settings), self.named
        self.first_similar = self.similar
        super().execute()

    # What came of it.

    def push_age_ms(self):
        if self.first_push is None or self.end == self.first_push:
            return None
        return self.area / 2 / (self.end - self.first_push) / 1e6

    def got(self):
        got = {"verdict": self.verdict, "sim_time_ns": self.end, "steps": self.state.sent}
        got["final_pole_angle"] = float(theta(self.states[-1][4])) if self.states else None
        for name, topic in self.topics.items():
            got[name[1:]] = ",".join(map(str, (
                topic.sent, topic.dropped, topic.lost, topic.overtaken, len(topic.flying))))
        got["push_age_ms"] = self.push_age_ms()
        got["ticks"] = ",".join(str(node.started) for node in self.nodes)
        got["overruns"] = ",".join(str(node.overruns) for node in self.nodes)
        if self.config.chunk is not None:
            got["stalls"] = self.figures.stalls
        return got

    def digest(self):
        lines = self.obs.all + self.chunk.all + self.action.all + self.state.all
        return fnv1a64(b"".join(lines))


def distance(one, other):
    squares = 0.0
    for a, b in zip(one, other):
        squares += (a - b) * (a - b)
    return math.sqrt(squares)


def theta(state):
    return (state[1] + math.pi) % (2.0 * math.pi) - math.pi


def words(figures):
    return " ".join(f"{key}={'none' if value is None else value}" for key, value in figures.items())


def block(config):
    run = Run(config)
    lines = [config.header(), "got " + words(run.got())]
    if config.chunk is not None:
        lines.append("chunks " + words(run.figures.block()))
    return "\n".join(lines) + f"\nfnv1a64={run.digest():016x}\n"


# ---------------------------------------------------------- runs at random


def some_run(number):
    """A run for each number. Most are near what stands, for a fall ends a run early."""
    chance = random.Random(f"chunks {number}")
    pick, whole, maybe = chance.choice, chance.randrange, lambda p: chance.random() < p
    own = maybe(0.75)
    calm = maybe(0.6)
    control = pick(["50", "25", "20", "10", "10", "5", "5", "16", "33.3", "12.5", "3"])
    period = 1000 / float(control)
    think = pick(["none", f"{whole(1, 1 + int(0.9 * period))}", f"{period / 2:g}"])
    if not calm:
        think = pick([f"{whole(1, 250)}", f"{whole(40)}..{whole(40, 160)}",
                      f"lognormal:{whole(5, 80)},{whole(80, 300)}", think])
    exact = "0" if think == "none" else think if ".." not in think and ":" not in think else "80"

    def expectation():
        return pick(["last", "max", f"last+{whole(50)}", f"max+{whole(30)}.5", exact, exact,
                     f"{whole(200)}"])

    def merge():
        return pick(["newest", "blend:0.7", f"blend:0.{whole(10)}", "blend:1", "ensemble:0.01",
                     f"ensemble:0.{whole(30)}"])

    def link():
        parts = [
            pick(["", f"delay:{whole(1, 60)}", f"delay:{whole(30)}..{whole(30, 150)}",
                  f"delay:lognormal:{whole(2, 30)},{whole(30, 120)}", "delay:12.5"]),
            pick(["", "", "in-order"]),
            pick(["", "", f"loss:0.{whole(1, 5)}"]),
            pick(["", "", "", f"burst:0.0{whole(1, 9)},{whole(1, 4)}"]),
            pick(["", "", "", f"reliable:{whole(1, 40)}"]),
        ]
        return ",".join(filter(None, parts)) or "none"

    nodes = ["sensor", "policy", "player", "actuator"]

    def anywhere():
        topic = pick(["/chunk", "/chunk", "/obs", "/action"])
        node = pick(nodes)
        return pick([
            f"link {topic} {link()}", f"link {topic} {link()}",
            f"disturb {pick(['0', '0.3', '1', '2.5'])}", f"disturb 0.{whole(1, 10)}",
            f"takes {pick(['sensor', 'player', 'player', 'actuator'])} "
            f"{pick(['none', whole(1, 12), f'0..{whole(1, 30)}'])}",
            f"wakes {node} 0..{whole(1, 12)}", f"offset {node} {whole(25)}",
            f"read /obs {pick(['oldest', 'newest'])}", f"depth /obs {whole(1, 6)}",
            f"on-stale zero:{whole(40, 400)}",
            f"clock {pick(nodes[:3])} {whole(-30, 30)} {whole(-3000, 3000)}",
        ])

    def before():
        return pick([anywhere, anywhere, anywhere, lambda: f"lose /chunk {whole(30)}",
                     lambda: f"postpone /chunk {whole(30)} {whole(250)}"])()

    def live():
        return pick([
            lambda: f"plan {pick(['hold', 'rollout', 'committed'])}",
            lambda: f"play {pick(['time', 'arrival', 'executed'])}",
            lambda: f"merge {merge()}", lambda: f"merge {merge()}",
            lambda: f"expect-delay {expectation()}",
            lambda: f"policy {pick(['scripted', 'scripted', 'lqr', 'zero', 'random'])}",
            lambda: f"rate policy {pick(['50', '25', '10', '7', '33.3'])}",
            lambda: f"rate sensor {pick(['50', '100', '30', '60'])}",
            lambda: f"takes policy {pick(['none', whole(1, 120), f'0..{whole(1, 150)}'])}",
            lambda: f"crash {pick(nodes)}", lambda: f"restart {pick(nodes)}",
            lambda: f"restart {pick(['policy', 'player'])}",
            lambda: f"hang {pick(nodes)} {whole(1, 90)}",
            anywhere, anywhere,
        ])()

    knobs = [(f"{whole(1, 400) / 100:g}", live()) for _ in range(whole(0, 2 if calm else 6))]
    if maybe(0.25):
        node, begins = pick(["policy", "player"]), whole(10, 2_500_000)
        later = begins + pick([0, 20_000, whole(400_000)])
        knobs += [(f"{begins / 1e6:.6f}", f"crash {node}"),
                  (f"{later / 1e6:.6f}", f"restart {node}")]
    setup = [before() for _ in range(pick([0, 0, 1] if calm else [0, 1, 2, 3]))]
    if maybe(0.2):
        setup.append("takes player 3")
    once = {" ".join(knob.split()[:1 if knob.startswith(("disturb", "on-stale")) else 2]): knob
            for knob in setup if not (knob.startswith("clock actuator") and not own)}
    usual = calm and maybe(0.7)
    return Config(
        seed=pick([whole(100), chance.getrandbits(63)]),
        duration_s=pick(["3", "4.02", "2.5", "5.001"]),
        world="own" if own else "course", step_ms=pick([1, 1, 2, 5, 10]), depth=pick([1, 1, 1, 2, 4]),
        policy=pick(["scripted"] * 6 + ["lqr"] * 2 + ["zero", "random"]),
        chunk=pick([50, 50, 50, 25, 16, 100] if calm else [1, 2, 3, 5, 8, 10, 16, 25, 50, 100]),
        plan="committed" if usual else pick(["hold", "rollout", "rollout", "committed", "committed"]),
        expect=exact if usual else expectation(),
        play="time" if usual else pick(["time", "time", "arrival", "executed"]),
        merge="newest" if usual else merge(), length=pick(["1", "1", "1", "1.05", "1.2", "0.8", "2"]),
        control_hz=control, sensor_hz=pick(["50", "50", "50", "100", "25", "33.3", "60"]),
        think_ms=think,
        setup=tuple(once.values()),
        knobs=tuple(sorted(knobs, key=lambda knob: nanoseconds(knob[0]))))


def some_similar_run(number):
    """The same with a sensor that drops similar readings."""
    run, chance = some_run(number), random.Random(f"similar {number}")
    similar = lambda: f"set sensor similar {chance.choice(['0', '0.005', '0.02', '0.05', '0.2', '1'])}"
    knobs = [(f"{chance.randrange(1, 300) / 100:g}", similar()) for _ in range(chance.randrange(3))]
    return replace(
        run, setup=run.setup + (similar(),),
        knobs=tuple(sorted(run.knobs + tuple(knobs), key=lambda knob: nanoseconds(knob[0]))))


# --------------------------------------------------------------- the golden runs


def known(ms, hz, **more):
    """The policy commits itself to its chunks, and knows how long it thinks."""
    return Config(**{"plan": "committed", "think_ms": ms, "control_hz": hz, "expect": ms,
                     "duration_s": "4"} | more)


def short(**more):
    return Config(**{"duration_s": "3"} | more)


CONFIGS = [
    # Plans, without a cost and with one.
    Config(), short(plan="hold", seed=1), short(plan="committed", seed=2),
    short(plan="hold", think_ms="40", control_hz="25", seed=3),
    short(think_ms="40", control_hz="25", seed=4), short(think_ms="60", control_hz="16", seed=5),
    known("100", "10", duration_s="10"), known("100", "5", seed=1), known("200", "5", seed=2),
    known("300", "3", seed=3), known("300", "3", seed=3, expect="last"),
    known("200", "5", seed=4, length="1.2", setup=("disturb 1",)),
    known("200", "5", seed=5, length="0.8"), known("100", "10", seed=6, length="2"),
    # What it expects.
    known("lognormal:40,200", "10", seed=7, expect="max"),
    known("lognormal:40,200", "10", seed=8, expect="last+20.5"),
    known("20..90", "10", seed=9, expect="max+15"), known("20..90", "10", seed=10, expect="0"),
    known("20..90", "10", seed=11, expect="160"),
    # Which action belongs to now.
    known("80", "10", seed=12, play="arrival"), known("80", "10", seed=13, play="executed"),
    short(seed=14, play="arrival"), short(seed=15, play="executed", think_ms="30"),
    known("80", "10", seed=16, play="executed", chunk=8, setup=("disturb 0.5",)),
    # Where chunks overlap.
    short(seed=17, merge="blend:0.7"), short(seed=18, merge="blend:0.3", think_ms="25"),
    short(seed=19, merge="blend:1", plan="committed", think_ms="40", control_hz="20"),
    short(seed=20, merge="blend:0.55", play="arrival", think_ms="15"),
    short(seed=21, merge="ensemble:0.01", chunk=5), short(seed=22, merge="ensemble:0.5", chunk=3),
    short(seed=23, merge="ensemble:0", play="executed", chunk=4, plan="hold", think_ms="15"),
    # Horizons that are too short: stalls, held and not.
    known("100", "10", seed=24, chunk=1), known("100", "10", seed=25, chunk=5),
    known("90", "5", seed=26, chunk=14, setup=("on-stale zero:150",)),
    short(seed=27, chunk=1), short(seed=28, chunk=2, merge="blend:0.7"), short(seed=29, chunk=200),
    # Policies.
    known("60", "10", seed=30, policy="lqr"), short(seed=31, policy="lqr", control_hz="12.5"),
    short(seed=32, policy="random", plan="hold"),
    short(seed=33, policy="random", plan="committed", think_ms="70", control_hz="10", chunk=9),
    short(seed=34, policy="zero", plan="committed"),
    # Links of a chunk, of what it came from and of what came of it.
    known("40", "10", seed=35, expect="last+40", setup=("link /chunk delay:20..60",)),
    known("40", "25", seed=36, setup=("link /chunk delay:0..120",)),
    known("30", "20", seed=37, setup=("link /chunk loss:0.3,delay:10",)),
    known("30", "20", seed=38, merge="blend:0.6", setup=("link /chunk loss:0.2,reliable:35",)),
    known("30", "20", seed=39, setup=("link /obs delay:15..45", "link /action delay:20")),
    known("30", "20", seed=40, setup=("lose /chunk 10", "postpone /chunk 20 170", "takes player 3")),
    known("30", "20", seed=41, merge="ensemble:0.2", chunk=6, setup=("link /chunk burst:0.1,3",)),
    # Ticks of the player; rates, offsets, clocks.
    known("50", "12.5", seed=42, setup=("takes player 3..18", "wakes player 0..9", "offset player 7")),
    known("50", "12.5", seed=43, sensor_hz="100", setup=("takes player 25", "takes sensor 4")),
    known("50", "33.3", seed=44, sensor_hz="30", setup=("offset policy 11", "offset sensor 3")),
    known("20", "20", seed=45, setup=("clock sensor 35 0",)),
    known("20", "20", seed=46, setup=("clock player -7 300", "clock policy 4 -500")),
    # The course's world.
    short(world="course", seed=47), known("100", "10", world="course", seed=48),
    known("100", "10", world="course", seed=49, setup=("disturb 1",), step_ms=10),
    known("60", "10", seed=49, step_ms=10, setup=("disturb 1",)),
    known("60", "10", seed=50, step_ms=5, knobs=(("0.5", "disturb 2"), ("1.2137", "disturb 0.25"))),
    # Live: everything.
    known("100", "10", seed=51, knobs=(
        ("0.5", "plan rollout"), ("0.8", "plan committed"), ("1.5", "plan hold"),
        ("1.7", "plan committed"), ("2.5", "expect-delay 140"), ("3", "expect-delay last"))),
    known("40", "20", seed=52, knobs=(
        ("0.5", "play arrival"), ("0.8", "play time"), ("1.2", "play executed"), ("1.8", "play time"),
        ("2", "rate policy 10"), ("2.5", "takes policy 90"), ("3.005", "takes player 4"))),
    known("40", "20", seed=53, knobs=(
        ("0.5", "merge blend:0.7"), ("1.01", "merge blend:0.9"), ("1.5", "merge ensemble:0.1"),
        ("1.6", "merge newest"), ("2.2", "merge blend:0.5"), ("3", "link /chunk delay:5..30"))),
    known("40", "20", seed=54, knobs=(
        ("0.5", "crash player"), ("0.53", "restart player"), ("1.1", "crash policy"),
        ("1.21", "restart policy"), ("2", "hang policy 150"), ("2.6", "hang player 55"))),
    known("40", "20", seed=55, expect="max", merge="blend:0.8", knobs=(
        ("0.3", "plan rollout"), ("0.4", "restart policy"), ("0.9", "merge newest"),
        ("1", "restart player"), ("1.5", "policy lqr"), ("2.2", "policy scripted"))),
    known("40", "20", seed=2**63 + 5, play="executed", setup=("takes player 5",), knobs=(
        ("1", "crash sensor"), ("1.09", "restart sensor"), ("2", "crash player"),
        ("2.15", "restart player"), ("2.5", "policy random"), ("2.6", "policy scripted"))),
    # The end: releases at it and after it.
    known("20", "50", seed=56, duration_s="3.02"), known("30", "20", seed=57, duration_s="3.01"),
    known("30", "20", seed=58, duration_s="2.001", setup=("takes player 20",)),
]
CONFIGS += map(some_run, range(10))
CONFIGS += [
    known("100", "10", seed=59, setup=("set sensor similar 0.05", "disturb 1")),
    known("40", "25", seed=60, world="course", setup=("set sensor similar 0.1",), knobs=(
        ("1", "set sensor similar 0"), ("1.5", "set sensor similar 0.02"), ("2", "crash sensor"),
        ("2.05", "restart sensor"))),
]
CONFIGS += map(some_similar_run, range(10, 16))


# -------------------------------------------------------------------- table


TABLE = [("none", "50"), ("40", "25"), ("60", "16"), ("100", "10"), ("100", "5"), ("200", "5"),
         ("300", "3")]
COLUMNS = {
    "hold": {"plan": "hold"}, "rollout": {}, "blend": {"merge": "blend:0.7"},
    "ensemble": {"merge": "ensemble:0.01"}, "committed": {"plan": "committed"},
    "committed, long, pushed": {"plan": "committed", "length": "1.2", "setup": ("disturb 1",)},
}


def table():
    """Starts of ten that stand for 10 s, where the policy knows how long it thinks."""
    print("thinks, rate, mean data age if committed,", ", ".join(COLUMNS))
    for think, hz in TABLE:
        expect = "0" if think == "none" else think
        runs = {name: [Run(Config(seed=seed, think_ms=think, control_hz=hz, expect=expect, **options))
                       for seed in range(10)] for name, options in COLUMNS.items()}
        ages = [age for run in runs["committed"] for age in run.ages]
        stand = [sum(run.verdict == "balanced" for run in column) for column in runs.values()]
        print(think, hz, f"{sum(ages) / len(ages) / 1e6:.1f}", *stand, flush=True)


def main():
    assert mujoco.__version__ == "3.17.0", f"MuJoCo 3.17.0 is needed, not {mujoco.__version__}"
    parser = argparse.ArgumentParser(description="Write or check the golden file.")
    parser.add_argument("--check", action="store_true", help="check, and write nothing")
    parser.add_argument("--table", action="store_true", help="starts that stand")
    parser.add_argument("--more", nargs=3, metavar=("FROM", "TO", "FILE"), help="write other runs")
    arguments = parser.parse_args()
    if arguments.table:
        table()
    elif arguments.more:
        first, last, path = arguments.more
        numbers = range(int(first), int(last))
        runs = [some(number) for number in numbers for some in (some_run, some_similar_run)]
        with open(path, "w", encoding="ascii") as file:
            file.write("\n".join(map(block, runs)))
    else:
        text = "\n".join(map(block, CONFIGS))
        if arguments.check:
            assert (HERE / "chunks.txt").read_text(encoding="ascii") == text, "chunks.txt is out of date"
            print("chunks.txt: up to date")
        else:
            (HERE / "chunks.txt").write_text(text, encoding="ascii")


if __name__ == "__main__":
    main()
