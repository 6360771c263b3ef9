"""Counter-based random numbers; they are in `flight_math.noise`."""

from flight_math.noise import bits, gaussian, mix, stream_key, uniform, unit_interval

__all__ = ["bits", "gaussian", "mix", "stream_key", "uniform", "unit_interval"]
