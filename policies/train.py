#!/usr/bin/env python3
"""Learns a policy for the cart-pole by an evolution strategy, in numpy alone.

    python3 -m pip install numpy==2.4.6 safetensors==0.8.0
    python3 policies/train.py prompt  --holds 1 1
    python3 policies/train.py patient --holds 1 9

Nothing about the pole is told to the learner but a reward: it tries weights,
keeps to the directions that were better, and tries again (Salimans et al.,
*Evolution Strategies as a Scalable Alternative to Reinforcement Learning*,
2017: mirrored samples, ranks for rewards, Adam).

The plant is the one in crates/cart-pole/src/cartpole.xml, written down a second time as
equations of motion, thousands of them side by side. Each episode holds every
action for a number of 20 ms steps drawn from --holds: a policy that learns with
1 to 9 has met control rates of 50 Hz down to 5.6 Hz.

The same seed gives the same weights on the same machine and numpy; elsewhere
sums of floats may round differently.
"""

import argparse
from pathlib import Path

import numpy as np
from safetensors.numpy import save_file

WIDTH = 32
SHAPES = [(WIDTH, 5), (WIDTH,), (WIDTH, WIDTH), (WIDTH,), (1, WIDTH), (1,)]
NAMES = [f"actor_mean.{i}.{part}" for i in (0, 2, 4) for part in ("weight", "bias")]

PAIRS = 48  # mirrored samples in a generation
EPISODES = 12  # that each sample plays, the same for all of a generation
SIGMA = 0.05  # spread of the samples
RATE = 0.03  # of learning

# The plant, in SI units.
CART, POLE, HALF, GRAVITY, MOTOR = 1.0, 0.1, 0.5, 9.81, 10.0
RADIUS = 0.02
TIMESTEP, SUBSTEPS, STEPS = 0.01, 2, 500
ANGLE_LIMIT, RAIL_LIMIT = 0.2095, 2.4


def capsule_inertia():
    """Of the pole about its middle: a cylinder and two half spheres."""
    cylinder, sphere = np.pi * RADIUS**2, 4 / 3 * np.pi * RADIUS**3
    density = POLE / (cylinder + sphere)
    middle = density * cylinder * (1 / 12 + RADIUS**2 / 4)
    ends = 2 / 5 * RADIUS**2 + HALF**2 + 3 / 4 * RADIUS * HALF
    return middle + density * sphere * ends


INERTIA = capsule_inertia() + POLE * HALF**2


def physics_step(state, force):
    """One semi-implicit Euler step of all plants."""
    x, theta, v, omega = state
    sin, cos = np.sin(theta), np.cos(theta)
    lever = POLE * HALF
    push = force + lever * omega**2 * sin
    torque = lever * GRAVITY * sin
    mass, cross = CART + POLE, lever * cos
    det = mass * INERTIA - cross**2
    v = v + TIMESTEP * (INERTIA * push - cross * torque) / det
    omega = omega + TIMESTEP * (mass * torque - cross * push) / det
    return np.stack([x + TIMESTEP * v, theta + TIMESTEP * omega, v, omega])


def split(vectors):
    """Weights and biases of every sample from its row of numbers."""
    ends = np.cumsum([np.prod(shape) for shape in SHAPES])
    parts = np.split(vectors, ends[:-1], axis=-1)
    return [part.reshape(*vectors.shape[:-1], *shape) for part, shape in zip(parts, SHAPES)]


def act(network, state):
    """The actions of all samples in all their episodes."""
    x, theta, v, omega = state
    layer = np.stack([x, v, np.cos(theta), np.sin(theta), omega], axis=-1)
    for i in (0, 2, 4):
        weight, bias = network[i], network[i + 1]
        layer = layer @ weight.swapaxes(-1, -2) + bias[:, None, :]
        if i < 4:
            layer = np.tanh(layer)
    return np.clip(layer[..., 0], -1, 1)


def rewards(vectors, starts, holds):
    """What each sample earns: a little less than one per step that it lasts."""
    network = split(vectors)
    shape = (len(vectors), len(holds))
    state = np.broadcast_to(starts[:, None, :], (4, *shape)).copy()
    alive = np.ones(shape, bool)
    action = np.zeros(shape)
    total = np.zeros(shape)
    for step in range(STEPS):
        due = step % holds == 0
        action[:, due] = act(network, state[:, :, due])
        for _ in range(SUBSTEPS):
            state = physics_step(state, MOTOR * action)
        # The lost would otherwise fly away to where numbers end.
        state = np.clip(state, -10, 10)
        alive &= (abs(state[1]) < ANGLE_LIMIT) & (abs(state[0]) < RAIL_LIMIT)
        price = 0.2 * abs(state[0]) / RAIL_LIMIT + 0.6 * abs(state[1]) / ANGLE_LIMIT
        total += alive * (1 - price - 0.1 * action**2)
        if not alive.any():
            break
    return total.mean(axis=1), alive.mean()


def learn(seed, generations, holds):
    """The weights after so many generations."""
    rng = np.random.default_rng(seed)
    parts = [rng.normal(0, 1 / np.sqrt(s[-1]), s) if len(s) > 1 else np.zeros(s) for s in SHAPES]
    parts[4] *= 0.1
    weights = np.concatenate([part.ravel() for part in parts])
    first, second = np.zeros_like(weights), np.zeros_like(weights)
    for generation in range(1, generations + 1):
        noise = rng.normal(size=(PAIRS, weights.size))
        spread = np.array([[0.6], [0.15], [0.5], [0.3]])
        starts = rng.uniform(-spread, spread, (4, EPISODES))
        held = np.linspace(holds[0], holds[1], EPISODES).round().astype(int)
        samples = weights + SIGMA * np.concatenate([noise, -noise])
        earned, lasted = rewards(samples, starts, held)
        ranks = earned.argsort().argsort() / (2 * PAIRS - 1) - 0.5
        slope = (ranks[:PAIRS] - ranks[PAIRS:]) @ noise / (2 * PAIRS * SIGMA)
        first = 0.9 * first + 0.1 * slope
        second = 0.99 * second + 0.01 * slope**2
        corrected = first / (1 - 0.9**generation), second / (1 - 0.99**generation)
        rate = RATE * (1 - generation / (generations + 1))
        weights += rate * corrected[0] / (np.sqrt(corrected[1]) + 1e-8)
        if generation % 20 == 0:
            print(f"generation {generation}: earned {earned.mean():.1f} of {STEPS}, "
                  f"{100 * lasted:.0f} % up at the end", flush=True)
    return weights


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", help="of the file, beside this one")
    parser.add_argument("--holds", type=int, nargs=2, required=True, metavar=("LEAST", "MOST"),
                        help="20 ms steps that an action is held for")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--generations", type=int, default=300)
    args = parser.parse_args()
    weights = learn(args.seed, args.generations, args.holds)
    tensors = dict(zip(NAMES, (part.astype(np.float32) for part in split(weights))))
    save_file(tensors, Path(__file__).parent / f"{args.name}.safetensors")


if __name__ == "__main__":
    main()
