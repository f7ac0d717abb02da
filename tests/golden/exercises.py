#!/usr/bin/env python3
"""The figures of exercises 6 to 9 and 13, by the independent models in `honest.py` and
`chunks.py`.

    python3 tests/golden/exercises.py         print them

Their bands in `exercises/bands.toml` have these numbers, with the source "honest" or "chunks".
"""

import chunks
from honest import Config, Run

FAST = "rate actuator 500"
SEEDS = range(20)


def run(seed, *setup, duration_s="10"):
    return Run(Config(seed=seed, setup=setup, duration_s=duration_s))


def standing(seeds, *setup):
    return sum(run(seed, *setup).standing() for seed in seeds)


def one_law():
    for hz in (50, 25):
        for delay in range(0, 101, 10):
            count = standing(range(6), FAST, f"rate policy {hz}", f"link /action delay:{delay}")
            print(f"{hz} Hz, delay {delay} ms: starts up = {count}")


def deep_queue():
    for depth in (*range(1, 11), 100):
        for seed in range(3):
            got = run(seed, "rate policy 49", f"depth /obs {depth}", "read /obs oldest",
                      duration_s="30")
            print(f"depth {depth}, seed {seed}: {got.verdict} at {got.end / 1e9:.2f} s, "
                  f"{got.obs.dropped} dropped")


def jitter():
    for spec in ("70", "65..75", "60..80", "50..90", "40..100", "20..120", "0..140",
                 "0..18", "0..36", "0..72", "0..144"):
        print(f"delay {spec} ms: starts up = {standing(SEEDS, f'link /action delay:{spec}')}")


def hold_or_zero():
    for loss in ("0.5", "0.6", "0.7", "0.8", "0.9"):
        for stale in ("hold", "zero:0"):
            count = standing(SEEDS, f"link /action loss:{loss}", f"send actuator {stale}")
            print(f"loss {loss}, {stale}: starts up = {count}")


def slow_policy():
    def count(what, **options):
        runs = (chunks.Run(chunks.Config(seed=seed, **options)) for seed in SEEDS)
        print(f"{what}: starts up = {sum(run.verdict == 'balanced' for run in runs)}", flush=True)

    late = {"think_ms": "200", "control_hz": "5", "expect": "200"}
    for think in ("20", "40", "60", "100", "200"):
        count(f"thinking {think} ms", think_ms=think)
    for name, value in (("chunk", 100), ("merge", "blend:0.7"), ("merge", "ensemble:0.01"),
                        ("play", "arrival"), ("plan", "committed")):
        count(f"{name} {value}", **late | {name: value})
    for force in ("0", "0.5", "1", "1.5", "2", "2.5"):
        setup = (f"disturb {force}",)
        count(f"committed, {force} N", plan="committed", setup=setup, **late)
        count(f"at once, {force} N", chunk=None, setup=setup)


for figures in (one_law, deep_queue, jitter, hold_or_zero, slow_policy):
    figures()
