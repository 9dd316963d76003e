"""Averages over pixels against exact areas and moments, and the promise that the stated bound covers the error.

The shapes here have linear radiance, so that the exact mean follows from area and centroid of what a pixel sees.
"""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from oracle import pixels
from oracle.pixels import average

quick = settings(derandomize=True, deadline=None, max_examples=30)

WIDTH, HEIGHT = 11, 8
# An edge is located to 1e-6 of a cell of 1/8 pixel or less.
LOCATED = 1e-6


def between(low, high):
    return st.floats(low, high, allow_subnormal=False)


def linear(x, y, coefficients):
    return coefficients[0] + coefficients[1] * x + coefficients[2] * y


def picture(inside, inner=(1, 0, 0), outer=(0, 0, 0)):
    """An image with linear radiance inside and outside of a shape, which is also its label."""

    def image(x, y):
        label = inside(x, y)
        return np.where(label, linear(x, y, inner), linear(x, y, outer))[:, None], label.astype(np.int64)

    return image


def counted(image):
    """The image, and a list of how many points were asked for at a time."""
    calls = []

    def asked(x, y):
        calls.append(len(x))
        return image(x, y)

    return asked, calls


def polygon_moments(corners, width, height):
    """Area and first moments of a convex counter-clockwise polygon within each pixel, shape (height, width, 3)."""
    moments = np.zeros((height, width, 3))
    for row, column in np.ndindex(height, width):
        piece = np.asarray(corners, float)
        for axis, sign, limit in ((0, 1, column), (0, -1, column + 1), (1, 1, row), (1, -1, row + 1)):
            piece = cut(piece, sign * (piece[:, axis] - limit)) if len(piece) else piece
        for i in range(1, len(piece) - 1):
            (ax, ay), (bx, by), (cx, cy) = piece[0], piece[i], piece[i + 1]
            area = ((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)) / 2
            moments[row, column] += area * np.array([1, (ax + bx + cx) / 3, (ay + by + cy) / 3])
    return moments


def cut(corners, heights):
    """The part of a polygon whose heights are positive."""
    kept = []
    for (a, ha), (b, hb) in pairwise([*zip(corners, heights, strict=True), (corners[0], heights[0])]):
        if ha >= 0:
            kept.append(a)
        if ha * hb < 0:
            kept.append(a + ha / (ha - hb) * (b - a))
    return np.array(kept).reshape(-1, 2)


def disk_moments(center, radius, width, height):
    """Like `polygon_moments`, for a disk, by quadrature over x between all kinks of the integrand."""
    (cx, cy), moments = center, np.zeros((height, width, 3))
    for row, column in np.ndindex(height, width):

        def span(x, row=row):
            half = np.sqrt(max(radius**2 - (x - cx) ** 2, 0))
            low, high = max(row, cy - half), min(row + 1, cy + half)
            return max(high - low, 0), max(high**2 - low**2, 0) / 2 if high > low else 0

        reach = [np.sqrt(max(radius**2 - (y - cy) ** 2, 0)) for y in (row, row + 1)] + [radius]
        kinks = sorted(
            {min(max(cx + s * r, column), column + 1) for s in (1, -1) for r in reach} | {column, column + 1}
        )
        for low, high in pairwise(kinks):
            if high > low:
                for index, integrand in enumerate(
                    (lambda x: span(x)[0], lambda x: x * span(x)[0], lambda x: span(x)[1])
                ):
                    moments[row, column, index] += quad(integrand, low, high, epsabs=1e-11)[0]
    return moments


def exact(moments, inner=(1, 0, 0), outer=(0, 0, 0)):
    row, column = np.mgrid[: moments.shape[0], : moments.shape[1]] + 0.5
    return moments @ np.subtract(inner, outer) + linear(column, row, outer)


def assert_covered(image, expected):
    """The average is right within its bound, or within what the location of edges allows.

    Of 1200 random pictures like those below, none had an error of more than half the bound plus 2e-7.
    """
    height, width = expected.shape
    mean, bound = average(image, width, height)
    error = np.abs(mean[..., 0] - expected)
    contrast = np.ptp(image(*(axis.ravel() for axis in np.meshgrid(np.arange(width), np.arange(height))))[0])
    excess = error - bound[..., 0]
    worst = np.unravel_index(excess.argmax(), excess.shape)
    assert excess[worst] <= LOCATED * max(contrast, 1), (worst, error[worst], bound[worst])
    return mean[..., 0], bound[..., 0]


def rectangle(center, angle, half_width, half_height):
    """Corners of a turned rectangle, counter-clockwise, and its inside."""
    u, v = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    corners = [
        np.add(center, a * half_width * u + b * half_height * v) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]

    def inside(x, y):
        dx, dy = x - center[0], y - center[1]
        return (np.abs(dx * u[0] + dy * u[1]) <= half_width) & (np.abs(dx * v[0] + dy * v[1]) <= half_height)

    return corners, inside


slopes = st.tuples(between(-0.04, 0.04), between(-0.04, 0.04))
centers = st.tuples(between(2, WIDTH - 2), between(2, HEIGHT - 2))
angles = between(0, 6.28)


# ------------------------------------------------------------------------------------------------ exact areas


@quick
@given(centers, angles, slopes, slopes)
def test_half_planes_have_their_exact_mean(point, angle, inner, outer):
    # A rectangle so large that one of its sides alone crosses the film.
    far = np.add(point, 1000 * np.array([np.cos(angle), np.sin(angle)]))
    corners, inside = rectangle(far, angle, 1000, 1000)
    inner, outer = (1, *inner), (2, *outer)
    expected = exact(polygon_moments(corners, WIDTH, HEIGHT), inner, outer)
    assert_covered(picture(inside, inner, outer), expected)


@quick
@given(centers, angles, between(0.5, 4), between(0.5, 4), slopes, slopes)
def test_rectangles_have_their_exact_mean(center, angle, half_width, half_height, inner, outer):
    corners, inside = rectangle(center, angle, half_width, half_height)
    inner, outer = (1, *inner), (0.5, *outer)
    expected = exact(polygon_moments(corners, WIDTH, HEIGHT), inner, outer)
    assert_covered(picture(inside, inner, outer), expected)


@quick
@given(centers, between(0.35, 6), slopes, slopes)
def test_disks_have_their_exact_mean(center, radius, inner, outer):
    inner, outer = (1, *inner), (0.5, *outer)
    expected = exact(disk_moments(center, radius, WIDTH, HEIGHT), inner, outer)
    image = picture(lambda x, y: (x - center[0]) ** 2 + (y - center[1]) ** 2 <= radius**2, inner, outer)
    assert_covered(image, expected)


@quick
@given(centers, angles, between(0.3, 1))
def test_strips_from_a_third_of_a_pixel_have_their_exact_mean(center, angle, breadth):
    # The widest gap between the 17 points of a pixel and its neighbours is 0.29 pixels.
    corners, inside = rectangle(center, angle, 40, breadth / 2)
    assert_covered(picture(inside), exact(polygon_moments(corners, WIDTH, HEIGHT)))


@quick
@given(centers, angles, between(0.08, 0.3))
def test_a_strip_from_a_twelfth_of_a_pixel_is_followed_from_where_it_is_seen(center, angle, breadth):
    corners, inside = rectangle(center, angle, 40, breadth / 2)
    corners_of_head, inside_of_head = rectangle(center, angle, 0.6, 0.6)
    # A strip with a head that cannot be overlooked.
    strip, head = (polygon_moments(c, WIDTH, HEIGHT) for c in (corners, corners_of_head))
    both = polygon_moments(rectangle(center, angle, 0.6, breadth / 2)[0], WIDTH, HEIGHT)
    image = picture(lambda x, y: inside(x, y) | inside_of_head(x, y))
    assert_covered(image, exact(strip + head - both))


@pytest.mark.parametrize("offset", [0.0, 0.25, 0.5, 1.0])
def test_edges_along_the_pixel_grid_are_exact(offset):
    corners, inside = rectangle((5 + offset, 4 + offset), 0, 2, 1.5)
    assert_covered(picture(inside), exact(polygon_moments(corners, WIDTH, HEIGHT)))


def test_the_corner_where_three_surfaces_meet_is_measured():
    corners = [[0, 0], [5.3, 0], [5.3, 3.7], [0, 3.7]]
    left = polygon_moments(corners, WIDTH, HEIGHT)[..., 0]
    right = polygon_moments([[5.3, 0], [WIDTH, 0], [WIDTH, 3.7], [5.3, 3.7]], WIDTH, HEIGHT)[..., 0]

    def image(x, y):
        label = np.where(y > 3.7, 2, np.where(x > 5.3, 1, 0))
        return np.array([1.0, 3.0, 7.0])[label][:, None], label

    assert_covered(image, left + 3 * right + 7 * (1 - left - right))


def test_a_whole_disk_between_the_points_of_a_pixel_has_its_area():
    # The largest that could hide has a radius of 0.2.
    for center in ((3.5, 2.5), (3.35, 2.3), (3.0, 2.0), (4.0, 2.5), (3.32, 2.64)):
        image = picture(lambda x, y, c=center: (x - c[0]) ** 2 + (y - c[1]) ** 2 <= 0.21**2)
        mean, _ = average(image, WIDTH, HEIGHT)
        assert abs(mean.sum() / (np.pi * 0.21**2) - 1) < 1e-3


# ------------------------------------------------------------------------------------------- smooth functions


def one_label(function):
    return lambda x, y: (function(x, y)[:, None], np.zeros(len(x), np.int64))


def test_polynomials_up_to_the_fifth_degree_are_exact():
    mean, _ = average(one_label(lambda x, y: (x**5 + 1) * (2 + y**5)), 3, 2)
    column, row = np.arange(3), np.arange(2)[:, None]
    along_x = ((column + 1) ** 6 - column**6) / 6 + 1
    along_y = 2 + ((row + 1) ** 6 - row**6) / 6
    np.testing.assert_allclose(mean[..., 0], along_x * along_y, rtol=1e-13)


@quick
@given(between(0.1, 6), between(0.1, 6))
def test_smooth_functions_are_within_the_bound(a, b):
    # The mean of sin(a x) sin(b y) + 2 in closed form.
    column, row = np.arange(WIDTH), np.arange(HEIGHT)[:, None]
    along_x = (np.cos(a * column) - np.cos(a * (column + 1))) / a
    along_y = (np.cos(b * row) - np.cos(b * (row + 1))) / b
    image = one_label(lambda x, y: np.sin(a * x) * np.sin(b * y) + 2)
    mean, bound = average(image, WIDTH, HEIGHT)
    assert np.all(np.abs(mean[..., 0] - along_x * along_y - 2) <= bound[..., 0] + 1e-13)


def test_a_smooth_pixel_gets_a_higher_order_before_it_is_split():
    # 1/(x + 1) has exact means.
    image, calls = counted(lambda x, y: ((1 / (x + 1))[:, None], np.zeros(len(x), dtype=np.int64)))
    mean, error = average(image, 6, 1, relative_tolerance=1e-9)
    left = np.arange(6.0) + 1
    assert (np.abs(mean[0, :, 0] - np.log1p(1 / left)) <= error[0, :, 0]).all()
    np.testing.assert_allclose(mean[0, :, 0], np.log1p(1 / left), rtol=1e-9)
    # 17 points at first, then as many as all orders together have; splitting takes 21,000.
    assert sum(calls) <= 6 * (17 + 9 + 25 + 64 + 169)


def test_an_edge_that_only_a_higher_order_sees_is_followed():
    # A disk between the 17 points of a pixel, on a slope too curved for three nodes.
    def image(x, y):
        inside = (x - 0.62) ** 2 + (y - 0.35) ** 2 < 0.06**2
        return np.where(inside, 5.0, 1 / (x + 0.3))[:, None], inside.astype(np.int64)

    mean, _ = average(image, 1, 1, relative_tolerance=1e-7)
    hidden, _ = quad(lambda x: 2 * np.sqrt(max(0.06**2 - (x - 0.62) ** 2, 0)) / (x + 0.3), 0.56, 0.68)
    np.testing.assert_allclose(mean[0, 0, 0], np.log(1.3 / 0.3) - hidden + 5 * np.pi * 0.06**2, rtol=1e-4)


def test_a_peak_is_resolved():
    # 1 / (h^2 + r^2) over a peak 0.05 pixels wide has the mean that quadrature along x of the closed form in y gives.
    h = 0.05

    def along_y(x):
        root = np.sqrt(h**2 + (x - 1.3) ** 2)
        return (np.arctan((2 - 1.4) / root) - np.arctan((1 - 1.4) / root)) / root

    expected = quad(along_y, 1, 2, points=[1.3], epsabs=1e-10)[0]
    mean, bound = average(one_label(lambda x, y: 1 / (h**2 + (x - 1.3) ** 2 + (y - 1.4) ** 2)), 3, 3)
    assert abs(mean[1, 1, 0] - expected) <= bound[1, 1, 0]
    assert bound[1, 1, 0] < 1e-4 * expected


# -------------------------------------------------------------------------------------------- size and bound


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (7, 1), (2, 3), (130, 1)])
def test_films_of_any_size_are_averaged(size):
    width, height = size
    corners, inside = rectangle((0.4 * width, 0.6 * height), 0.3, 0.4 * width, 0.3 * height)
    expected = exact(polygon_moments(corners, width, height))
    mean, bound = average(picture(inside), width, height)
    assert mean.shape == bound.shape == (height, width, 1)
    assert_covered(picture(inside), expected)


def test_channels_are_averaged_alike():
    _, inside = rectangle((5, 4), 0.3, 2, 1.5)
    one = picture(inside, (1, 0.02, 0.01))

    def three(x, y):
        value, label = one(x, y)
        return value * [1.0, 10.0, 0.1], label

    mean, bound = average(three, WIDTH, HEIGHT)
    assert mean.shape == bound.shape == (HEIGHT, WIDTH, 3)
    np.testing.assert_allclose(mean[..., 1], 10 * mean[..., 0], rtol=1e-12)
    np.testing.assert_allclose(mean[..., 2], 0.1 * mean[..., 0], rtol=1e-12)


@pytest.mark.parametrize("cells_at_once", [30, 64])
def test_the_size_of_chunks_does_not_matter(monkeypatch, cells_at_once):
    # Edges of every kind, in chunks that part them.
    _, inside = rectangle((5, 4), 0.3, 3, 0.1)
    image = picture(lambda x, y: inside(x, y) | ((x - 8) ** 2 + (y - 3) ** 2 < 2.1), (1, 0.02, 0.01))
    mean, bound = average(image, WIDTH, HEIGHT)
    monkeypatch.setattr(pixels, "_CELLS_AT_ONCE", cells_at_once)
    in_chunks, bound_in_chunks = average(image, WIDTH, HEIGHT)
    assert np.all(np.abs(in_chunks - mean) <= bound + bound_in_chunks)
    np.testing.assert_allclose(bound_in_chunks.sum(), bound.sum(), rtol=0.5)


def test_the_bound_is_as_small_as_asked_for_where_edges_are_simple():
    _, inside = rectangle((5, 4), 0.3, 100, 2)
    _, bound = average(picture(inside), WIDTH, HEIGHT)
    assert bound.max() < 1e-5


def test_a_looser_tolerance_costs_less():
    def cost(tolerance):
        asked, calls = counted(picture(lambda x, y: (x - 5) ** 2 + (y - 4) ** 2 < 7))
        average(asked, WIDTH, HEIGHT, tolerance)
        return sum(calls)

    assert cost(1e-2) < cost(1e-5) < cost(1e-8)


def test_an_edge_between_equal_radiances_changes_nothing():
    _, inside = rectangle((5, 4), 0.3, 2, 1.5)
    mean, _ = average(picture(inside, (1, 0.02, 0.01), (1, 0.02, 0.01)), WIDTH, HEIGHT)
    row, column = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    np.testing.assert_allclose(mean[..., 0], linear(column, row, (1, 0.02, 0.01)), rtol=1e-7)


def test_a_constant_image_is_its_own_mean_and_known_without_error():
    mean, bound = average(one_label(lambda x, y: np.full(len(x), 0.7)), WIDTH, HEIGHT)
    np.testing.assert_allclose(mean, 0.7, rtol=1e-15)
    assert bound.max() < 1e-15


def test_a_black_image_is_black():
    mean, bound = average(one_label(lambda x, y: 0 * x), WIDTH, HEIGHT)
    assert not mean.any()
    assert not bound.any()
