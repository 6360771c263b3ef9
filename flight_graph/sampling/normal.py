"""The standard normal distribution and its inverse, with the same bits on every machine.

Quantile: algorithm AS 241 (PPND16) of M. J. Wichura, Applied Statistics 37 (1988) 477-484; relative error about 1e-16.
Distribution: Taylor series at zero as in G. Marsaglia, Journal of Statistical Software 11 (2004) 4, and Laplace's
continued fraction in the tail (Abramowitz and Stegun 26.2.14).
"""

import math

from flight_math import elementary
from flight_math.uncompiled import uncompiled

exp, log = uncompiled(elementary.exp), uncompiled(elementary.log)
ROOT_TWO_PI = 2.5066282746310002  # [-] sqrt(2 pi)
TAIL = 3.0  # [-] beyond it the continued fraction
TERMS = 120  # [-] of the continued fraction; at TAIL 100 are enough for 1e-16

CENTRE = ((3.3871328727963666080e0, 1.3314166789178437745e+2, 1.9715909503065514427e+3, 1.3731693765509461125e+4,
           4.5921953931549871457e+4, 6.7265770927008700853e+4, 3.3430575583588128105e+4, 2.5090809287301226727e+3),
          (1.0, 4.2313330701600911252e+1, 6.8718700749205790830e+2, 5.3941960214247511077e+3,
           2.1213794301586595867e+4, 3.9307895800092710610e+4, 2.8729085735721942674e+4, 5.2264952788528545610e+3))
SIDE = ((1.42343711074968357734e0, 4.63033784615654529590e0, 5.76949722146069140550e0, 3.64784832476320460504e0,
         1.27045825245236838258e0, 2.41780725177450611770e-1, 2.27238449892691845833e-2, 7.74545014278341407640e-4),
        (1.0, 2.05319162663775882187e0, 1.67638483018380384940e0, 6.89767334985100004550e-1,
         1.48103976427480074590e-1, 1.51986665636164571966e-2, 5.47593808499534494600e-4, 1.05075007164441684324e-9))
FAR = ((6.65790464350110377720e0, 5.46378491116411436990e0, 1.78482653991729133580e0, 2.96560571828504891230e-1,
        2.65321895265761230930e-2, 1.24266094738807843860e-3, 2.71155556874348757815e-5, 2.01033439929228813265e-7),
       (1.0, 5.99832206555887937690e-1, 1.36929880922735805310e-1, 1.48753612908506148525e-2,
        7.86869131145613259100e-4, 1.84631831751005468180e-5, 1.42151175831644588870e-7, 2.04426310338993978564e-15))


def quantile(p: float) -> float:
    """z with distribution(z) = p, for 0 < p < 1."""
    q = p - 0.5
    if abs(q) <= 0.425:
        return q * _ratio(CENTRE, 0.180625 - q * q)
    r = math.sqrt(-log(p if q < 0.0 else 1.0 - p))
    z = _ratio(SIDE, r - 1.6) if r <= 5.0 else _ratio(FAR, r - 5.0)
    return -z if q < 0.0 else z


def distribution(z: float) -> float:
    """Probability that a standard normal variate is below z; in the lower tail with its full relative precision."""
    if z >= TAIL:
        return 1.0 - distribution(-z)
    density = exp(-0.5 * z * z) / ROOT_TWO_PI
    if z <= -TAIL:
        fraction = -z
        for k in range(TERMS, 0, -1):
            fraction = -z + k / fraction
        return density / fraction
    term = total = z
    k = 1
    while abs(term) > 1e-17 * abs(total):
        k += 2
        term *= z * z / k
        total += term
    return 0.5 + density * total


def _ratio(coefficients, x):
    above, below = coefficients
    top = bottom = 0.0
    for a, b in zip(reversed(above), reversed(below)):
        top, bottom = top * x + a, bottom * x + b
    return top / bottom
