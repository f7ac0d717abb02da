#!/usr/bin/env python3
"""The scripted policy in another language: one line of JSON in, one out."""
import json, math, sys


def answer(line):
    print(json.dumps(line), flush=True)


sys.stdin.readline()  # {"protocol": 1, "seed": ..., "control_hz": ..., "chunk": ..., "action_ms": 20.0}
answer({"ready": "actions"})
for line in sys.stdin:
    question = json.loads(line)
    x, v, cos, sin, spin = question["observation"]
    push = 10.0 * math.atan2(sin, cos) + 2.0 * spin + 0.4 * x + 0.8 * v
    answer({"id": question["id"], "action": max(-1.0, min(1.0, push))})
