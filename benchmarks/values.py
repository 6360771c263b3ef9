"""One attitude law, written with values and with loops over arrays: CPU seconds to compile, nanoseconds a step.

    python benchmarks/values.py [--rounds 7]

Both forms do the same operations in the same order; the states at the end are compared bit for bit.
"""

import argparse
import sys
import time
from pathlib import Path

import numba
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from flight_math import Kinds, Mat3, Quaternion, Vec3, View, clip, cross, kernel, normalised, plain, quaternion, view, where

STEPS = 20_000
LAYOUT = np.dtype([("inertia", "f8", (3, 3)), ("gain", "f8", (3,)), ("limit", "f8"), ("h", "f8"), ("rates", "f8", (3,)),
                   ("attitude", "f8", (4,)), ("adaptive", "f8", (3,)), ("work", "f8", (4, 3)), ("turn", "f8", (4,))],
                  align=True)
KINDS = Kinds.of([("inertia", Mat3), ("gain", Vec3), ("rates", Vec3), ("attitude", Quaternion), ("adaptive", Vec3)])


def with_values():
    """The law with values, called for every step."""
    @kernel
    def step(x):
        rates = x.rates
        demand = -x.gain * rates - x.adaptive - cross(rates, x.inertia @ rates)
        torque = clip(demand, -x.limit, x.limit)
        x.adaptive = where(abs(demand) <= x.limit, x.adaptive + x.h * abs(rates), x.adaptive)
        x.rates = rates + x.h * (x.inertia @ torque)
        x.attitude = normalised(x.attitude + 0.5 * x.h * (x.attitude * quaternion(x.rates, 0.0)))

    @kernel
    def fly(record, steps):
        x = view(record[0], KINDS)
        for _ in range(steps):
            step(x)
    return fly


def with_loops():
    """The same with arrays and work arrays in the record."""
    compiled = numba.njit(error_model="numpy", nogil=True)

    @compiled
    def product(matrix, vector, out):
        for i in range(3):
            out[i] = matrix[i, 0] * vector[0] + matrix[i, 1] * vector[1] + matrix[i, 2] * vector[2]

    @compiled
    def cross_product(a, b, out):
        out[0] = a[1] * b[2] - a[2] * b[1]
        out[1] = a[2] * b[0] - a[0] * b[2]
        out[2] = a[0] * b[1] - a[1] * b[0]

    @compiled
    def step(x):
        rates, momentum, gyro, torque, push = x.rates, x.work[0], x.work[1], x.work[2], x.work[3]
        product(x.inertia, rates, momentum)
        cross_product(rates, momentum, gyro)
        for i in range(3):
            demand = -x.gain[i] * rates[i] - x.adaptive[i] - gyro[i]
            torque[i] = x.limit if demand > x.limit else -x.limit if demand < -x.limit else demand
            if abs(demand) <= x.limit:
                x.adaptive[i] = x.adaptive[i] + x.h * abs(rates[i])
        product(x.inertia, torque, push)
        for i in range(3):
            rates[i] = rates[i] + x.h * push[i]
        q, r, turn = x.attitude, rates, x.turn
        turn[0] = q[3] * r[0] + q[0] * 0.0 + q[1] * r[2] - q[2] * r[1]
        turn[1] = q[3] * r[1] - q[0] * r[2] + q[1] * 0.0 + q[2] * r[0]
        turn[2] = q[3] * r[2] + q[0] * r[1] - q[1] * r[0] + q[2] * 0.0
        turn[3] = q[3] * 0.0 - q[0] * r[0] - q[1] * r[1] - q[2] * r[2]
        for i in range(4):
            q[i] = q[i] + 0.5 * x.h * turn[i]
        length = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        for i in range(4):
            q[i] = q[i] / length

    @compiled
    def fly(record, steps):
        for _ in range(steps):
            step(record[0])
    return fly


def record():
    """The start of both."""
    made = np.zeros(1, LAYOUT)
    made["inertia"], made["gain"], made["limit"], made["h"] = np.diag([1.0, 0.8, 0.5]), (0.3, 0.2, 0.4), 0.2, 1e-3
    made["rates"], made["attitude"] = (0.5, -1.0, 0.7), (0.0, 0.0, 0.0, 1.0)
    return made


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=7)
    options = parser.parse_args()
    fly = numba.njit(lambda x: x + 1)
    fly(1)  # numba itself is loaded
    forms, ends = {"values": with_values(), "loops": with_loops()}, {}
    for name, function in forms.items():
        began = time.process_time()
        function(record(), 1)
        print(f"{name:>7}: compiled in {time.process_time() - began:.2f} s")
    times = {name: [] for name in forms}
    for _ in range(options.rounds):
        for name, function in forms.items():
            state = record()
            began = time.thread_time()
            function(state, STEPS)
            times[name].append((time.thread_time() - began) / STEPS * 1e9)
            ends[name] = b"".join(state[field].tobytes() for field in ("rates", "attitude", "adaptive"))
    for name, found in times.items():
        print(f"{name:>7}: {np.median(found):.0f} ns a step")
    print("equal bits:", ends["values"] == ends["loops"])
    x, step = View(record()[0], KINDS), plain(plain(forms["values"]).__closure__[0].cell_contents)
    step(x)
    began = time.process_time()
    for _ in range(200):
        step(x)
    print(f"plain Python: {(time.process_time() - began) / 200 * 1e6:.0f} us a step")


if __name__ == "__main__":
    main()
