#!/usr/bin/env python3
"""An independent model of one virtual-clock run, and the golden files it writes.

This file shares no code with the Rust crate. It says a second time, in another
language, what a run must do, so that a slip in one of the two shows up as a
difference in bytes instead of as a belief held twice.

    python3 tests/golden/reference.py            write the golden files
    python3 tests/golden/reference.py --check    check them, and the known table

The contract
------------
Time      Integer nanoseconds since the run began. Tick k of a node at f Hz is
          due at anchor + floor(k * 1e9 / f), f being the decimal exactly as
          written ("33.3" is 333/10). Equal due times run by priority: sensor,
          policy, actuator. Ticks due at or before the duration run. A fall ends
          the run after the actuator tick that saw it.
Sensor    Publishes the observation of the present plant state.
Policy    On every tick, if there is an observation: takes the newest one and
          publishes an action that carries the observation's stamp.
Actuator  Always 50 Hz. Applies the newest action (0 if there is none yet),
          clipped to -1..1, for two physics steps. That is one control step;
          the first has number 1. Latency is the tick's time minus the stamp the
          action carries; there is one latency per tick with an action.
Topic     Holds the newest `depth` messages. Reading takes the newest and marks
          everything up to it as seen. A message pushed out before it was seen
          is dropped, and counted.
Knobs     (time, knob, value), applied in order of time (then as listed), each
          before any tick due at or after its time. Knobs later than the
          duration, or than the fall, do nothing.
            control-hz, sensor-hz  the anchor moves to the node's last due time;
                                   its next due time is the first
                                   anchor + floor(k * 1e9 / f), k >= 1, at or
                                   after the knob's time. A node that never
                                   ticked keeps its anchor and may start at k = 0.
            queue-depth            both topics. Shrinking pushes out the oldest,
                                   under the same rule of what counts as dropped.
Verdict   fell       |theta| > 0.2095 rad after a step
          left_rail  |x| > 2.4 m after a step, the angle within its limit
          balanced   neither, until the duration

The files (ASCII, "\n" line ends)
---------------------------------
runs.txt       Blocks of three lines, a blank line between blocks:
                 seed=U64 control_hz=DEC sensor_hz=DEC depth=INT policy=NAME
                   duration_s=DEC [knobs=TIME:KNOB:VALUE[,TIME:KNOB:VALUE...]]
                 steps=N obs_published=N obs_dropped=N action_published=N
                   action_dropped=N latency_count=N latency_sum_ns=N
                   verdict=WORD sim_time_ns=N
                 fnv1a64=16 HEX DIGITS
               (each of the first two is one line in the file). sim_time_ns is
               the time of the fall, or the duration. The hash is FNV-1a, 64 bit,
               over 80 little-endian bytes for each control step, in this order:
                 step u64; time_ns u64;
                 observation after the step 5 x f32;
                 applied action, after the clip, f32;
                 latency_ns i64, -1 without an action;
                 qpos[0], qpos[1], qvel[0], qvel[1] after the step, f64 each.
seed0_5hz.csv  One run in full (seed 0, control 5 Hz, sensor 50 Hz, depth 1,
               scripted, 10 s), a header and one row per control step. Numbers
               are the shortest decimals that read back to the same f32 (f64 for
               the two times, which are nanoseconds / 1e9), never with an
               exponent or a trailing ".0": what Rust's `{}` prints. The latency
               is empty while no action has arrived.
seeds.txt      One line per seed:
                 seed=U64 uniforms=H,H,H,H words=H,H,H,H
               H is 16 hex digits. uniforms: the bits of the four f64 reset
               values in -0.05..0.05, in drawing order (cart position, pole
               angle, cart velocity, pole angular velocity). words: the four u64
               that SeedSequence(seed).generate_state(4, u64) gives.
"""

import argparse
import math
import struct
from collections import deque
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

import mujoco
import numpy as np

HERE = Path(__file__).resolve().parent
SECOND = 1_000_000_000
ACTUATOR_HZ = "50"
FALL_ANGLE = 0.2095
RAIL_END = 2.4

MJCF = """
<mujoco model="cartpole">
  <option timestep="0.01" integrator="implicitfast"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="cart">
      <joint name="slider" type="slide" axis="1 0 0" limited="true" range="-2.9 2.9"/>
      <geom type="box" size="0.1 0.05 0.05" mass="1.0"/>
      <body name="pole">
        <joint name="hinge" type="hinge" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0 0 1.0" size="0.02" mass="0.1"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="slide_force" joint="slider" gear="10" ctrllimited="true" ctrlrange="-1 1"/>
  </actuator>
</mujoco>
"""


# ---------------------------------------------------------------- the plant


def reset_values(seed):
    """The four reset draws, in the order in which the state takes them."""
    rng = np.random.Generator(np.random.PCG64(seed))
    return [rng.uniform(-0.05, 0.05) for _ in range(4)]


class Plant:
    """The cart-pole. It knows physics and nothing of nodes or rates."""

    model = mujoco.MjModel.from_xml_string(MJCF)

    def __init__(self, seed):
        self.data = mujoco.MjData(self.model)
        x, angle, velocity, spin = reset_values(seed)
        self.data.qpos[:] = x, angle
        self.data.qvel[:] = velocity, spin
        self.data.ctrl[:] = 0.0
        mujoco.mj_forward(self.model, self.data)

    def state(self):
        """qpos and qvel as Python floats, which are the same 64 bits."""
        return [*map(float, self.data.qpos), *map(float, self.data.qvel)]

    def theta(self):
        """The hinge angle wrapped to -pi..pi: the hinge itself counts turns."""
        return (float(self.data.qpos[1]) + math.pi) % (2.0 * math.pi) - math.pi

    def observe(self):
        """The five f32 a policy sees. `math` and not numpy for the angle: it
        asks the C library, where numpy may pick a vector routine by CPU."""
        x, _, velocity, spin = self.state()
        theta = self.theta()
        return np.array([x, velocity, math.cos(theta), math.sin(theta), spin], np.float32)

    def step(self, action):
        """Hold the action for one control step; return what is applied."""
        applied = np.float32(min(max(action, np.float32(-1.0)), np.float32(1.0)))
        self.data.ctrl[0] = applied
        for _ in range(2):
            mujoco.mj_step(self.model, self.data)
        return applied

    def failure(self):
        """The verdict that ends the run here, or None. Falling comes first: a
        pole that is down is down wherever the cart is."""
        if abs(self.theta()) > FALL_ANGLE:
            return "fell"
        if abs(float(self.data.qpos[0])) > RAIL_END:
            return "left_rail"
        return None


def scripted(obs):
    """Linear feedback in f64, rounded to f32 only at the end."""
    x, velocity, cos, sin, spin = map(float, obs)
    u = 10.0 * math.atan2(sin, cos) + 2.0 * spin + 0.4 * x + 0.8 * velocity
    return np.float32(min(max(u, -1.0), 1.0))


def zero(_obs):
    """No control at all: what the plant does when left alone."""
    return np.float32(0.0)


POLICIES = {"scripted": scripted, "zero": zero}


# -------------------------------------------------------------- the runtime


@dataclass
class Message:
    data: object
    origin: int  # when the reading behind this value was sensed
    number: int


class Topic:
    """Latest wins, losses count; one subscriber is all this graph has."""

    def __init__(self, depth):
        self.depth = depth
        self.buffer = deque()
        self.published = 0
        self.dropped = 0
        self.seen = 0  # messages with a smaller number are old news

    def publish(self, data, origin):
        self.buffer.append(Message(data, origin, self.published))
        self.published += 1
        self.evict()

    def latest(self):
        if not self.buffer:
            return None
        self.seen = self.published
        return self.buffer[-1]

    def resize(self, depth):
        self.depth = depth
        self.evict()

    def evict(self):
        """Both ways to lose a message, by a newer one and by a smaller queue,
        come through here, so they cannot count differently."""
        while len(self.buffer) > self.depth:
            self.dropped += self.buffer.popleft().number >= self.seen


class Cadence:
    """When a node is due. Multiplied out from the anchor on every call, so no
    error of an earlier tick is carried into a later one."""

    def __init__(self, hz):
        self.hz = Fraction(hz)
        self.anchor = 0
        self.k = 0
        self.last = None

    def due(self):
        return self.anchor + math.floor(self.k * SECOND / self.hz)

    def advance(self):
        self.last = self.due()
        self.k += 1

    def change(self, hz, at):
        """Count from the last tick on, so that neither a burst nor a gap wider
        than one new period (or the wait for the knob itself) follows."""
        self.hz = Fraction(hz)
        self.k = 0
        if self.last is not None:
            self.anchor, self.k = self.last, 1
        while self.due() < at:
            self.k += 1


@dataclass(frozen=True)
class Config:
    """One run. Rates and times stay text, so that no float comes in between."""

    seed: int = 0
    control_hz: str = "50"
    sensor_hz: str = "50"
    depth: int = 1
    policy: str = "scripted"
    duration_s: str = "10"
    knobs: tuple = ()

    def header(self):
        words = (
            f"seed={self.seed} control_hz={self.control_hz} sensor_hz={self.sensor_hz} "
            f"depth={self.depth} policy={self.policy} duration_s={self.duration_s}"
        )
        knobs = ",".join(":".join(map(str, knob)) for knob in self.knobs)
        return f"{words} knobs={knobs}" if knobs else words


@dataclass
class Step:
    """One control step, as the actuator saw it."""

    number: int
    time: int
    obs: np.ndarray
    action: np.float32
    latency: int | None
    state: list

    def pack(self):
        latency = -1 if self.latency is None else self.latency
        numbers = (self.number, self.time, *self.obs, self.action, latency, *self.state)
        return struct.pack("<QQ6fq4d", *numbers)


@dataclass
class Run:
    """The graph while it runs, and all there is to know of it afterwards."""

    config: Config
    steps: list = field(default_factory=list)
    verdict: str = "balanced"
    end: int = 0

    def __post_init__(self):
        config = self.config
        self.plant = Plant(config.seed)
        self.policy = POLICIES[config.policy]
        self.obs = Topic(config.depth)
        self.action = Topic(config.depth)
        # In order of priority: min() takes the first of equals.
        self.nodes = [
            (Cadence(config.sensor_hz), self.sense),
            (Cadence(config.control_hz), self.think),
            (Cadence(ACTUATOR_HZ), self.act),
        ]
        self.execute()

    def sense(self, now):
        self.obs.publish(self.plant.observe(), now)

    def think(self, _now):
        reading = self.obs.latest()
        if reading is not None:
            self.action.publish(self.policy(reading.data), reading.origin)

    def act(self, now):
        message = self.action.latest()
        wanted = np.float32(0.0) if message is None else message.data
        latency = None if message is None else now - message.origin
        applied = self.plant.step(wanted)
        self.steps.append(
            Step(len(self.steps) + 1, now, self.plant.observe(), applied, latency, self.plant.state())
        )
        failure = self.plant.failure()
        if failure:
            self.verdict, self.end = failure, now

    def turn(self, knob, value, at):
        if knob == "queue-depth":
            self.obs.resize(int(value))
            self.action.resize(int(value))
        else:
            node = {"sensor-hz": 0, "control-hz": 1}[knob]
            self.nodes[node][0].change(value, at)

    def execute(self):
        duration = nanoseconds(self.config.duration_s)
        knobs = deque(sorted(((nanoseconds(t), k, v) for t, k, v in self.config.knobs),
                             key=lambda knob: knob[0]))
        while self.verdict == "balanced":
            cadence, tick = min(self.nodes, key=lambda node: node[0].due())
            now = cadence.due()
            if knobs and knobs[0][0] <= min(now, duration):
                at, knob, value = knobs.popleft()
                self.turn(knob, value, at)
                continue
            if now > duration:
                self.end = duration
                return
            tick(now)
            cadence.advance()

    def latencies(self):
        return [step.latency for step in self.steps if step.latency is not None]

    def mean_latency_ms(self):
        return sum(self.latencies()) / len(self.latencies()) / 1e6


def nanoseconds(seconds):
    """A decimal text of seconds as whole nanoseconds, refusing finer ones."""
    exact = Fraction(seconds) * SECOND
    assert exact.denominator == 1, f"{seconds} s is not a whole number of nanoseconds"
    return int(exact)


# ---------------------------------------------------------------- the files


def fnv1a64(data, value=0xCBF29CE484222325):
    """A hash of three lines, so that the other side needs no crate for it."""
    for byte in data:
        value = ((value ^ byte) * 0x100000001B3) & 0xFFFFFFFFFFFFFFFF
    return value


def block(config):
    run = Run(config)
    latencies = run.latencies()
    digest = fnv1a64(b"".join(step.pack() for step in run.steps))
    return (
        f"{config.header()}\n"
        f"steps={len(run.steps)} "
        f"obs_published={run.obs.published} obs_dropped={run.obs.dropped} "
        f"action_published={run.action.published} action_dropped={run.action.dropped} "
        f"latency_count={len(latencies)} latency_sum_ns={sum(latencies)} "
        f"verdict={run.verdict} sim_time_ns={run.end}\n"
        f"fnv1a64={digest:016x}\n"
    )


def shortest(number):
    """The shortest decimal that reads back the same, laid out as Rust does."""
    return np.format_float_positional(number, unique=True, trim="-")


def csv_row(step):
    latency = "" if step.latency is None else shortest(np.float64(step.latency / SECOND))
    return ",".join([
        str(step.number),
        shortest(np.float64(step.time / SECOND)),
        *map(shortest, step.obs),
        shortest(step.action),
        latency,
    ])


def csv(config):
    header = (
        "step,time_s,cart_position_m,cart_velocity_m_s,cos_theta,sin_theta,"
        "pole_angular_velocity_rad_s,action,latency_s"
    )
    return "\n".join([header, *map(csv_row, Run(config).steps)]) + "\n"


def seed_line(seed):
    uniforms = [struct.unpack("<Q", struct.pack("<d", u))[0] for u in reset_values(seed)]
    words = np.random.SeedSequence(seed).generate_state(4, np.uint64)
    return f"seed={seed} uniforms={hexes(uniforms)} words={hexes(words)}\n"


def hexes(numbers):
    return ",".join(f"{int(number):016x}" for number in numbers)


SEEDS = [
    *range(10), 42, 255, 12345, 2**31 - 1, 2**31, 2**32 - 1, 2**32, 2**32 + 1,
    2**53, 2**53 + 1, 2**63 - 1, 2**63, 2**63 + 5, 2**64 - 1,
]

CONFIGS = [
    # Rates that divide the plant's, and the ends of the range.
    Config(),
    Config(seed=1, control_hz="25"),
    Config(seed=2, control_hz="20", duration_s="8"),
    Config(seed=12345, control_hz="10"),
    Config(seed=4294967295, control_hz="200", sensor_hz="200", duration_s="6"),
    Config(seed=4294967296, control_hz="100", sensor_hz="50", depth=2, duration_s="4"),
    # Rates whose periods are no whole number of nanoseconds, or meet the
    # plant's ticks only now and then.
    Config(seed=3, control_hz="15"),
    Config(seed=4, control_hz="33.3", sensor_hz="200"),
    Config(seed=2**63 + 5, control_hz="12.5", sensor_hz="60", depth=2),
    Config(seed=5, control_hz="33.3", sensor_hz="33.3", depth=5, duration_s="7.5"),
    Config(seed=6, control_hz="30", sensor_hz="90", depth=2, duration_s="5"),
    Config(seed=2**64 - 1, control_hz="140", sensor_hz="70", duration_s="3"),
    # The cliff.
    Config(control_hz="7"),
    Config(seed=7, control_hz="7.5"),
    Config(seed=8, control_hz="7.75"),
    Config(control_hz="5"),
    Config(control_hz="5", depth=100),
    Config(seed=12345, control_hz="7.75", sensor_hz="30", depth=5),
    # No control.
    Config(policy="zero", control_hz="50", duration_s="2"),
    Config(seed=9, policy="zero", control_hz="7", sensor_hz="120", depth=2, duration_s="5"),
    # Knobs: on a tick, between ticks, both at once, one after another without
    # a tick in between, at the very start, and depth both ways.
    Config(knobs=(("2.5", "control-hz", "10"), ("4", "queue-depth", "100"))),
    Config(seed=1, control_hz="10", depth=100, knobs=(
        ("1.234567891", "queue-depth", "2"), ("3", "queue-depth", "5"), ("6.05", "queue-depth", "1"))),
    Config(seed=2, control_hz="33.3", knobs=(
        ("1.001", "control-hz", "15"), ("3.3", "sensor-hz", "70"), ("5.5", "control-hz", "7"))),
    Config(seed=3, control_hz="5", depth=5, knobs=(
        ("0.11", "control-hz", "6"), ("0.15", "control-hz", "50"), ("2", "sensor-hz", "200"))),
    Config(seed=4, sensor_hz="100", duration_s="6", knobs=(
        ("0", "control-hz", "20"), ("2", "control-hz", "33.3"), ("2", "sensor-hz", "30"),
        ("4", "control-hz", "50"))),
    Config(seed=5, control_hz="20", duration_s="9", knobs=(
        ("3", "control-hz", "5"), ("3.3", "control-hz", "50"), ("3.3", "queue-depth", "2"))),
    Config(control_hz="5", depth=100, knobs=(("0.39", "queue-depth", "1"),)),
    Config(seed=10, control_hz="33.3", sensor_hz="30", duration_s="3.333333333"),
]


def golden_files():
    return {
        "runs.txt": "\n".join(map(block, CONFIGS)),
        "seed0_5hz.csv": csv(Config(control_hz="5")),
        "seeds.txt": "".join(map(seed_line, SEEDS)),
    }


# --------------------------------------------------------------- the checks

# control rate: mean latency in ms (as printed, for seed 0), obs dropped, steps
# of seeds 0, 1 and 2. A run that balances takes 501 steps, and its latency and
# drops do not depend on the seed.
TABLE = {
    "50": ("0.0", 0, [501, 501, 501]),
    "25": ("9.98", 250, [501, 501, 501]),
    "20": ("23.9521", 300, [501, 501, 501]),
    "15": ("35.9281", 350, [501, 501, 501]),
    "10": ("39.9202", 400, [501, 501, 501]),
    "7": ("77.9", None, [281, 179, 228]),
    "5": ("85.1163", 37, [43, 60, 24]),
}

# control rate: how many of the seeds 0 to 199 balance for 10 s.
SURVIVORS = {"5": 0, "6": 1, "7": 15, "7.5": 199, "7.75": 58, "8": 198, "9": 200}


def check_table():
    """Known results first: a reference nobody checked is only a second opinion."""
    for hz, (mean, drops, steps) in TABLE.items():
        runs = [Run(Config(seed=seed, control_hz=hz)) for seed in range(3)]
        assert [len(run.steps) for run in runs] == steps, (hz, [len(run.steps) for run in runs])
        for run in runs:
            balanced = len(run.steps) == 501
            assert run.verdict == ("balanced" if balanced else "fell"), (hz, run.verdict)
            if balanced or run is runs[0]:
                digits = len(mean.split(".")[1])
                assert f"{run.mean_latency_ms():.{digits}f}" == mean, (hz, run.mean_latency_ms())
                assert drops in (None, run.obs.dropped), (hz, run.obs.dropped)
        print(f"{hz:>4} Hz: {runs[0].mean_latency_ms():.4f} ms, {runs[0].obs.dropped} dropped, steps {steps}")
    deep = Run(Config(control_hz="5", depth=100))
    assert (deep.obs.dropped, len(deep.steps)) == (0, 43)
    print("   5 Hz, depth 100: 0 dropped, the same 43 steps")


def check_survivors():
    for hz, expected in SURVIVORS.items():
        verdicts = [Run(Config(seed=seed, control_hz=hz)).verdict for seed in range(200)]
        assert verdicts.count("balanced") == expected, (hz, verdicts.count("balanced"))
        print(f"{hz:>4} Hz: {expected} of 200 seeds balance")


def check_draws():
    """Rebuild the draws from raw words: the formula is part of the contract."""
    for seed in SEEDS:
        raw = np.random.PCG64(seed).random_raw(4)
        units = [(int(word) >> 11) * 2.0**-53 for word in raw]
        assert [-0.05 + (0.05 - -0.05) * u for u in units] == reset_values(seed), seed


def check_rates_read_as_floats():
    """A rate read as f64 differs from the decimal in the 17th digit. No golden
    run may hang on that, so both readings must give the same due times."""
    rates = {rate for c in CONFIGS for rate in (c.control_hz, c.sensor_hz)}
    rates |= {value for c in CONFIGS for _, knob, value in c.knobs if knob != "queue-depth"}
    for rate in rates:
        exact, read = Fraction(rate), Fraction(float(rate))
        assert all(k * SECOND // exact == k * SECOND // read for k in range(2001)), rate


def check_files():
    for name, text in golden_files().items():
        assert (HERE / name).read_text(encoding="ascii") == text, f"{name} is out of date"
        print(f"{name}: up to date")


def main():
    assert mujoco.__version__ == "3.17.0", f"MuJoCo 3.17.0 is needed, not {mujoco.__version__}"
    assert fnv1a64(b"a") == 0xAF63DC4C8601EC8C
    parser = argparse.ArgumentParser(description="Write or check the golden files.")
    parser.add_argument("--check", action="store_true", help="check, and write nothing")
    if parser.parse_args().check:
        check_draws()
        check_rates_read_as_floats()
        check_table()
        check_survivors()
        check_files()
        return
    for name, text in golden_files().items():
        (HERE / name).write_text(text, encoding="ascii", newline="\n")
        print(f"wrote {name}")


if __name__ == "__main__":
    main()
