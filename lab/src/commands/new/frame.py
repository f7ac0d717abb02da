#!/usr/bin/env python3
"""TITLE as a policy of ratelab.

Check MODEL, observation and action: docs/policies.md says what the numbers are.
"""
import json
import math
import os
import sys

# What libraries print goes to standard error: standard output is for answers.
lines, sys.stdout = sys.stdout, sys.stderr

IMPORTS

MODEL = "NAME"  # beside this program
PATH = os.path.join(os.path.dirname(os.path.abspath(__file__)), MODEL)


def observation(x, v, cos, sin, spin):
    """What the model saw in training: the same numbers in the same order and units."""
    theta, omega = math.atan2(sin, cos), spin
    return [
        x,  # position of the cart, m
        v,  # velocity of the cart, m/s
        theta,  # angle of the pole, rad: 0 is upright, positive leans towards +x
        omega,  # angular velocity of the pole, rad/s
    ]


def action(outputs):
    """The push from -1 to 1, in units of 10 N towards +x."""
    if len(outputs) == 2:  # logits or values of two choices: left, right
        return 1.0 if outputs[1] > outputs[0] else -1.0
    (push,) = outputs
    scale = 1.0  # 1.0 if the model answers from -1 to 1, 0.1 if it answers in newtons
    return max(-1.0, min(1.0, scale * push))


ASK


def say(line):
    print(json.dumps(line), file=lines, flush=True)


sys.stdin.readline()  # the greeting
action(ask(observation(0.0, 0.0, 1.0, 0.0, 0.0)))  # what does not fit ends here, before the run
if hasattr(model, "reset"):
    model.reset()  # a recurrent network forgets that
say({"ready": "actions"})
for line in sys.stdin:
    question = json.loads(line)
    outputs = ask(observation(*question["observation"]))
    say({"id": question["id"], "action": action(outputs)})
