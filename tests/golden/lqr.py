#!/usr/bin/env python3
"""Gains of the linear-quadratic regulator, from another solver.

Linearises the plant with MuJoCo's own Python package and solves the discrete
algebraic Riccati equation with SciPy, which does it by an ordered Schur form;
ratelab doubles instead. Prints a line for each number of control steps that an
action is held for: the gains on cart position, pole angle, cart velocity and
pole velocity.

    python3 -m pip install mujoco==3.17.0 numpy==2.4.6 scipy==1.17.1
    python3 tests/golden/lqr.py > tests/golden/lqr.txt
"""

from pathlib import Path

import mujoco
import numpy as np
import scipy.linalg

MODEL = Path(__file__).parents[2] / "crates" / "cart-pole" / "src" / "cartpole.xml"
PHYSICS_STEPS = 2  # in a control step
POSITION_M, ANGLE_RAD, ACTION = 2.4, 0.2095, 1.0  # Bryson's rule: the limits


def physics_step():
    """A and B of one physics step at upright rest."""
    model = mujoco.MjModel.from_xml_path(str(MODEL))
    data = mujoco.MjData(model)
    a, b = np.zeros((4, 4)), np.zeros((4, 1))
    mujoco.mjd_transitionFD(model, data, 1e-6, True, a, b, None, None)
    return a, b


def held(a, b, steps):
    """A and B of several steps with the action held."""
    both = np.block([[a, b], [np.zeros((1, 4)), np.eye(1)]])
    power = np.linalg.matrix_power(both, steps)
    return power[:4, :4], power[:4, 4:]


def main():
    q = np.diag([POSITION_M**-2, ANGLE_RAD**-2, 0.0, 0.0])
    r = np.array([[ACTION**-2]])
    for steps in (1, 2, 3, 4, 5, 10):
        a, b = held(*physics_step(), PHYSICS_STEPS * steps)
        x = scipy.linalg.solve_discrete_are(a, b, q, r)
        gains = np.linalg.solve(r + b.T @ x @ b, b.T @ x @ a)[0]
        print(f"steps={steps}", "gains=" + ",".join(repr(float(g)) for g in gains))


if __name__ == "__main__":
    main()
