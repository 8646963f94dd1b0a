"""Three-vectors as tuples, for floats and lanes alike."""

from dem.kernel.arithmetic import any_lane, minimum, sqrt
from dem.kernel.decorator import law

TINY = 1e-30


@law
def dot(a, b):
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@law
def cross(a, b):
    """Vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@law
def add(a, b):
    """a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@law
def subtract(a, b):
    """a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@law
def scale(factor, a):
    """factor * a."""
    return (factor * a[0], factor * a[1], factor * a[2])


@law
def reject(a, n):
    """The part of `a` that is normal to the unit vector `n`."""
    return subtract(a, scale(dot(a, n), n))


@law
def turned_about(a, n, angle):
    """`a`, normal to the unit vector `n`, turned about it by a small angle [rad]; its length is
    kept to angle^4 / 8."""
    return add(scale(1.0 - 0.5 * angle * angle, a), scale(angle, cross(n, a)))


@law
def at_most(limit, a):
    """`a`, shortened to the length `limit` where it is longer. Neither root nor division where no
    lane is: most contacts of a packing stick. Where both are nothing the quotient is no number,
    which `minimum` does not choose."""
    square = dot(a, a)
    if any_lane(square >= limit * limit):
        a = scale(minimum(limit / sqrt(square), 1.0), a)
    return a
