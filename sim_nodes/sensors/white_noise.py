"""White noise of three axes."""

from flight_math import Vec3, gaussian, kernel, same


@kernel
def white_noise(key, tick, first_draw, sigma):
    """Three independent normal numbers of standard deviation sigma; nothing is drawn for sigma = 0.

    key: noise stream; tick: of the sample; first_draw: index of the first of three draws.
    """
    if sigma > 0.0:
        return sigma * Vec3(gaussian(key, tick, first_draw), gaussian(key, tick, first_draw + 1),
                            gaussian(key, tick, first_draw + 2))
    return same(0.0)
