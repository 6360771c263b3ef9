"""uncompiled: the bits of the compiled kernel, without compiling one."""

from flight_math import Vec3, kernel, norm, power, sincos, uncompiled


@kernel
def turned(angle):
    sine, cosine = sincos(angle)
    return Vec3(cosine, sine, 0.0)


def scaled(by):
    @kernel
    def stretch(angle, exponent):
        return by * power(norm(turned(angle) + 1.0), exponent) * turned(-angle)
    return stretch


def test_the_same_bits_without_compiling():
    stretch = scaled(3.0)
    found = [uncompiled(stretch)(0.1 * i, 0.3 * i - 2.0).parts() for i in range(50)]
    assert stretch.signatures == [] and turned.signatures == []
    assert found == [stretch(0.1 * i, 0.3 * i - 2.0).parts() for i in range(50)]
