#!/usr/bin/env python3
"""The figures of exercises 6 to 9, by the independent model in `honest.py`.

    python3 tests/golden/exercises.py         print them

Their bands in `exercises/bands.toml` have these numbers, with the source "honest".
"""

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


for figures in (one_law, deep_queue, jitter, hold_or_zero):
    figures()
