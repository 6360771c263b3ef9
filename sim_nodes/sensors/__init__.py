"""Sensors that several vehicles share, from the true state and counter-based noise.

white_noise.py    three independent normal numbers
inertial.py       gyro with a wandering bias, accelerometer, and the message of both
star_tracker.py   attitude, turned by a small angle

Standard deviations are per sample and per axis; zero switches a source off. A sensor draws from its own stream, p.seed, at
t_ns; the draws of one sensor use the index ranges that stand in its module.
"""
