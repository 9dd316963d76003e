"""Renderings of the reference tracer beside what they must show: closed forms averaged over pixels."""

import numpy as np

from oracle import Area, Mesh, Receivers, irradiance
from oracle.tracer import Object, Orthographic, Scene

# Relative bias that still counts as right, wherever nothing tighter can be asked.
TOLERANCE = 5e-4

# So many surfaces that rays are no longer tried with each of them in turn; far below all receivers.
_CELL = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
CROWD = Object(
    Mesh(
        np.concatenate([_CELL + np.array([x, y, -50.0]) for x in range(20) for y in range(20)]),
        np.arange(1200).reshape(-1, 3),
    )
)


def unit(vector):
    """The vector scaled to length 1."""
    vector = np.asarray(vector, float)
    return vector / np.linalg.norm(vector)


def scene_of(emitters, *objects):
    """A scene with these emitters of `oracle` and more objects."""
    shining = [Object(one.shape, None, one.radiance, one.two_sided) for one in emitters if isinstance(one, Area)]
    return Scene([*shining, *objects], [one for one in emitters if not isinstance(one, Area)])


def looking_down(surface, height=1e-3):
    """A camera just above a rectangle that shows of it, pixel by pixel, what an irradiance meter measures on it."""
    origin = surface.center + height * surface.normal
    return Orthographic(origin, surface.center, surface.half_v, 2 * np.linalg.norm(surface.half_u))


def pixel_means(function, surface, film, nodes=6):
    """A function of points on a rectangle, (N, 3) to (N, C), averaged over each pixel of a meter (Gauss quadrature)."""
    positions, weights = np.polynomial.legendre.leggauss(nodes)

    def coordinates(count):
        return 2 * ((np.arange(count)[:, None] + (positions + 1) / 2) / count).ravel() - 1

    a, b = coordinates(film.width), -coordinates(film.height)
    points = surface.center + a[None, :, None] * surface.half_u + b[:, None, None] * surface.half_v
    values = function(points.reshape(-1, 3)).reshape(film.height, nodes, film.width, nodes, -1)
    return np.einsum("yixjc,i,j->yxc", values, weights / 2, weights / 2)


def irradiances(emitters, surface, film, occluders=(), nodes=6):
    """What a meter on the rectangle must measure."""
    return pixel_means(
        lambda points: irradiance(emitters, Receivers(points, surface.normal), occluders).value, surface, film, nodes
    )


def assert_right(rendering, expected, known_to=1e-4):
    """The image as a whole, and every pixel, is right to 0.05 % or five standard errors.

    The image as a whole has a relative standard error below `known_to`, so that something is known at all.
    """
    mean, variance = rendering.mean, rendering.variance
    assert mean.shape == np.shape(expected)
    lit = expected > 1e-12
    assert (mean[~lit] <= 1e-12).all()
    total = expected.sum(axis=(0, 1))
    error = np.sqrt(variance.sum(axis=(0, 1))) / total
    assert error.max() < known_to
    off = mean.sum(axis=(0, 1)) / total - 1
    assert (np.abs(off) < np.maximum(TOLERANCE, 5 * error)).all(), (off, error)
    # One pixel's standard error is itself uncertain; that of all pixels is less so.
    squares = variance[lit] / expected[lit] ** 2
    pixel_error = np.sqrt(np.maximum(squares, squares.mean()))
    off = mean[lit] / expected[lit] - 1
    assert (np.abs(off) < TOLERANCE + 7 * pixel_error).all(), (off.min(), off.max(), pixel_error.max())
