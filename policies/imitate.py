#!/usr/bin/env python3
"""Learns a policy that answers with chunks, by imitating a planner.

    python3 -m pip install numpy==2.4.6 safetensors==0.8.0
    python3 policies/imitate.py chunks
    python3 policies/imitate.py sides

The planner rolls the course's linear feedback out on the plant of `train.py`: from a state
its next actions, 20 ms each. The network learns to say them at once, as the head of ACT
does (Zhao et al., *Learning Fine-Grained Bimanual Manipulation with Low-Cost Hardware*,
2023, here without its transformer): least squares by Adam.

`chunks` keeps the cart in the middle. `sides` keeps it on a side, and has two plans for
that: a chunk leads to the other side of where the cart is.

The same seed gives the same weights on the same machine and numpy.
"""

import argparse
from pathlib import Path

import numpy as np
from safetensors.numpy import save_file

from train import MOTOR, NAMES, SUBSTEPS, physics_step

WIDTH = 64
STATES, EPOCHS, BATCH, RATE = 40_000, 60, 250, 0.003
SPREAD = np.array([[1.5], [0.2], [1.5], [1.5]])
# The number of actions, and how far from the middle (m) they lead.
PLANS = {"chunks": (50, 0.0), "sides": (10, 1.6)}
# Of cart position, angle, velocity and angular velocity, as in scripted.rs.
GAINS = np.array([0.4, 10.0, 0.8, 2.0])


def planned(state, horizon, place):
    """The chunks of the planner, a row for each column of states."""
    goal = np.zeros_like(state)
    goal[0] = -np.copysign(place, state[0])
    actions = []
    for _ in range(horizon):
        actions.append(np.clip(GAINS @ (state - goal), -1, 1))
        for _ in range(SUBSTEPS):
            state = physics_step(state, MOTOR * actions[-1])
        state = np.clip(state, -10, 10)
    return np.stack(actions, axis=1)


def seen(state):
    x, theta, v, omega = state
    return np.stack([x, v, np.cos(theta), np.sin(theta), omega], axis=1)


def slopes(network, inputs, wanted):
    """Of the mean square error by each weight and bias."""
    layers = [inputs]
    for i in (0, 2, 4):
        layer = layers[-1] @ network[i].T + network[i + 1]
        layers.append(np.tanh(layer) if i < 4 else layer)
    back = 2 * (layers[3] - wanted) / wanted.size
    found = []
    for i in (4, 2, 0):
        found = [back.T @ layers[i // 2], back.sum(axis=0)] + found
        back = back @ network[i] * (1 - layers[i // 2] ** 2)
    return found, np.mean((layers[3] - wanted) ** 2)


def learn(seed, horizon, place):
    """The network that says what the planner does."""
    rng = np.random.default_rng(seed)
    # Small states matter as much as large ones: of all sizes down to a thirtieth.
    state = SPREAD * rng.uniform(-1, 1, (4, STATES)) * 10 ** -rng.uniform(0, 1.5, STATES)
    inputs, wanted = seen(state), planned(state, horizon, place)
    shapes = [(WIDTH, 5), (WIDTH,), (WIDTH, WIDTH), (WIDTH,), (horizon, WIDTH), (horizon,)]
    network = [rng.normal(0, 1 / np.sqrt(s[-1]), s) if len(s) > 1 else np.zeros(s) for s in shapes]
    first = [np.zeros(s) for s in shapes]
    second = [np.zeros(s) for s in shapes]
    step, steps = 0, EPOCHS * STATES // BATCH
    for epoch in range(EPOCHS):
        errors = []
        for batch in rng.permutation(STATES).reshape(-1, BATCH):
            step += 1
            found, error = slopes(network, inputs[batch], wanted[batch])
            errors.append(error)
            rate = RATE * (1 + np.cos(np.pi * step / steps)) / 2
            for part, slope, m, s in zip(network, found, first, second):
                m += 0.1 * (slope - m)
                s += 0.001 * (slope**2 - s)
                scale = np.sqrt(s / (1 - 0.999**step)) + 1e-8
                part -= rate * m / (1 - 0.9**step) / scale
        if epoch % 10 == 9:
            print(f"epoch {epoch + 1}: off by {np.mean(errors) ** 0.5:.4f}", flush=True)
    return network


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", choices=PLANS, help="of the planner, and of the file")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    network = learn(args.seed, *PLANS[args.name])
    tensors = dict(zip(NAMES, (part.astype(np.float32) for part in network)))
    save_file(tensors, Path(__file__).parent / f"{args.name}.safetensors")


if __name__ == "__main__":
    main()
