"""Writes graphs/robots/plans.safetensors: the plans of a pendulum that is led to its other side.

Needs numpy and safetensors from PyPI. Nothing is learned: what linear feedback does over half a second is
linear in angle, speed and side, and these are the three units of the hidden layer.
"""

import sys

import numpy as np
from safetensors.numpy import save_file

ACTIONS, PERIOD_S, STEPS = 25, 0.02, 20
GRAVITY, TORQUE = 9.81, 3.0  # m/s²; N·m of the whole action, on 1 kg at 1 m
SIDE_RAD, RATE = 0.1, 5.0  # where a plan leads, and how fast (1/s)
SMALL, SHARP = 1e-3, 50.0  # tanh is linear there; it knows the side


def plan(angle, speed, side):
    """The actions from a state, led to -side."""
    actions = []
    for _ in range(ACTIONS):
        wanted = -(RATE**2) * (angle + side * SIDE_RAD) - 2 * RATE * speed
        actions.append((wanted - GRAVITY * angle) / TORQUE)
        for _ in range(STEPS):
            speed += PERIOD_S / STEPS * (GRAVITY * angle + TORQUE * actions[-1])
            angle += PERIOD_S / STEPS * speed
    return actions


columns = [plan(1, 0, 0), plan(0, 1, 0), plan(0, 0, 1)]
hidden = np.array([[SMALL, 0], [0, SMALL], [SHARP, 0]])
outputs = np.array(columns).T / [SMALL, SMALL, 1]
tensors = {"0.weight": hidden, "0.bias": np.zeros(3), "2.weight": outputs, "2.bias": np.zeros(ACTIONS)}
save_file(
    {f"actor_mean.{name}": np.ascontiguousarray(values, np.float32) for name, values in tensors.items()},
    sys.argv[1],
)
