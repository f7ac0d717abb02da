#!/usr/bin/env python3
"""A policy that answers with chunks, behind the interface of LeRobot's policies.

A policy of LeRobot takes the place of `Planner`: `ACTPolicy.from_pretrained(...)`, with tensors
in the batch, and `predict_action_chunk(batch)[0, :, 0].tolist()` below.
"""
import json, math, os, sys, time

DT = 0.02  # of an action (s)
GAINS = 0.4, 0.8, 10.0, 2.0  # of position, velocity, angle, spin
CART, POLE, HALF, G = 1.0, 0.1, 0.5, 9.81  # kg, kg, m, m/s2


def law(state):
    return max(-1.0, min(1.0, sum(k * value for k, value in zip(GAINS, state))))


def step(state, action):
    """Cart and pole after one action, in two steps."""
    x, v, angle, spin = state
    for _ in range(2):
        sin, cos, m = math.sin(angle), math.cos(angle), POLE * HALF
        a11, a12, a22 = CART + POLE, m * cos, POLE * HALF**2 * 4 / 3
        b1, b2 = 10 * action + m * spin**2 * sin, m * G * sin
        det = a11 * a22 - a12 * a12
        v += DT / 2 * (b1 * a22 - b2 * a12) / det
        spin += DT / 2 * (b2 * a11 - b1 * a12) / det
        x, angle = x + DT / 2 * v, angle + DT / 2 * spin
    return x, v, angle, spin


class Planner:
    """Rolls its model out: first with the actions that it has committed, then by its law."""

    def __init__(self, horizon):
        self.horizon = horizon
        self.reset()

    def reset(self):
        self.own = []  # its chunks: when they begin to be played, of which time, the actions
        self.queue = []

    def committed(self, at):
        for begins, origin, actions in reversed(self.own):
            if begins <= at + 1e-9:
                return actions[min(int((at - origin) / DT + 1e-6), len(actions) - 1)]
        return 0.0

    def predict_action_chunk(self, batch):
        time.sleep(float(os.environ.get("THINK_MS", 0)) / 1e3)  # a large network
        x, v, cos, sin, spin = batch["observation.state"]
        state, actions = (x, v, math.atan2(sin, cos), spin), []
        origin, begins = batch["time"], batch["time"] + batch["delay"]
        for index in range(self.horizon):
            at = origin + index * DT
            action = self.committed(at) if at < begins else law(state)
            state = step(state, action)
            actions.append(action)
        self.own = self.own[-9:] + [(begins, origin, actions)]
        return actions

    def select_action(self, batch):
        """One action at a time, as LeRobot's loop without a delay asks for it."""
        self.queue = self.queue or self.predict_action_chunk(batch)
        return self.queue.pop(0)


def say(line):
    print(json.dumps(line), flush=True)


greeting = json.loads(sys.stdin.readline())
if greeting["chunk"] is None:
    sys.exit("chunks.py answers with chunks: give --chunk H")
policy = Planner(greeting["chunk"])
say({"ready": "chunks"})
for line in sys.stdin:
    question = json.loads(line)
    batch = {"observation.state": question["observation"], "time": question["time"]}
    batch["delay"] = question["delay_ms"] / 1e3
    say({"id": question["id"], "actions": policy.predict_action_chunk(batch)})
