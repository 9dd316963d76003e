"""What is seen of polygons past occluders, against scan lines across the emitter's plane, in ball arithmetic.

The emitter lies in the plane z = 0. Seen from the receiver, every occluder's edge casts a line on that plane. Where no
two of all those lines cross, a band of scan lines sees the emitter between always the same lines: what a band sees are
trapezoids. A scan line finds what it sees by sorting where the lines cut it. The irradiance of a trapezoid is Lambert's
formula, with 38 digits; that formula itself is verified elsewhere.
"""

from functools import cmp_to_key
from itertools import combinations, pairwise

import numpy as np
from flint import arb
from hypothesis import strategies as st
from verification import Form
from verified.geometry import (
    balls,
    between,
    cross,
    dot,
    minus,
    norm,
    number,
    plus,
    powers_of_ten,
    receivers,
    times,
    unit,
)

from oracle import emitters, shapes
from oracle.visibility import visible_projected_solid_angle

INFINITE = arb(10) ** 60
ZERO = arb(0)


def exact(configuration):
    """Projected solid angle of what is seen of the emitter, which is bright on both of its sides."""
    emitter, point, normal, occluders = configuration
    # With the receiver above, whichever side it is on.
    flip = -1 if point[2] < 0 else 1
    p, n = mirrored(point, flip), unit(mirrored(normal, flip))
    h = p[2]
    light = [minus(mirrored(v, flip), p) for v in emitter]
    outlines = [light]
    for occluder in occluders:
        above = upper([mirrored(v, flip) for v in occluder])
        if not all(v[2] == 0 for v in above):
            below = upper([times(minus(v, p), -1) for v in above])
            outlines.append([times(v, -1) for v in below])

    lines = [cross(a, b) for outline in outlines for a, b in sides(outline)]
    heights = sorted_balls(crossings([*lines, n], h, light))
    total, begun = ZERO, {}
    for low, high in pairwise(heights):
        seen = seen_along(outlines, n, h, middle((low + high) / 2))
        for ended in [run for run in begun if run not in seen]:
            total += trapezoid(ended, begun.pop(ended), low, lines, n, h)
        for run in seen:
            begun.setdefault(run, low)
    for run, low in begun.items():
        total += trapezoid(run, low, heights[-1], lines, n, h)
    return 0.0 if abs(total) < arb(10) ** -30 else number(total)


def mirrored(v, flip):
    x, y, z = balls(v)
    return [x, y, z * flip]


def middle(ball):
    return ball.mid()


def sides(outline):
    return list(zip(outline, [*outline[1:], *outline[:1]], strict=True))


def upper(outline):
    """The part of a polygon with z >= 0, where z is exactly 0 along the cut."""
    result = []
    for a, b in sides(outline):
        if a[2] >= 0:
            result.append(a)
        if a[2] * b[2] < 0:
            cut = plus(a, times(minus(b, a), a[2] / (a[2] - b[2])))
            result.append([cut[0], cut[1], ZERO])
    return result


def crossings(lines, h, light):
    """The ys, within the emitter, at which two of the lines l . (x, y, -h) = 0 cross; and those of its own corners."""
    ys = [v[1] for v in light]
    low, high = min(ys, key=float), max(ys, key=float)
    for a, b in combinations(lines, 2):
        direction = cross(a, b)
        if direction[2] != 0:
            y = -h * direction[1] / direction[2]
            if low < y < high:
                ys.append(y)
    return ys


def sorted_balls(ys):
    """In order, what is there twice once."""
    ordered = sorted(ys, key=cmp_to_key(lambda a, b: -1 if a.mid() < b.mid() else int(a.mid() > b.mid())))
    result = ordered[:1]
    for y in ordered[1:]:
        if y > result[-1]:
            result.append(y)
    return result


def seen_along(outlines, n, h, y):
    """What the scan line at y sees of the emitter, as pairs of lines, by index; -1 is the horizon."""
    events = []
    index = 0
    for which, outline in enumerate(outlines):
        for a, b in sides(outline):
            # Positive if the corner is seen beyond y.
            fa, fb = a[1] * h + y * a[2], b[1] * h + y * b[2]
            if fa * fb < 0:
                t = fa / (fa - fb)
                x, z = a[0] + t * (b[0] - a[0]), a[2] + t * (b[2] - a[2])
                x = -x * h / z if z < 0 else (INFINITE if x > 0 else -INFINITE)
                events.append((x, which, index))
            index += 1
    # What the horizon hides is one more outline.
    constant = n[1] * y - n[2] * h
    inside = [True] + [False] * len(outlines)
    below = len(outlines)
    if n[0] == 0:
        inside[below] = bool(constant < 0)
    else:
        events.append((-constant / n[0], below, -1))
        inside[below] = bool(n[0] > 0)
    inside[0] = False
    events.sort(key=cmp_to_key(lambda a, b: -1 if a[0].mid() < b[0].mid() else int(a[0].mid() > b[0].mid())))
    seen, start = [], None
    for _, which, line in events:
        was = inside[0] and not any(inside[1:])
        inside[which] = not inside[which]
        now = inside[0] and not any(inside[1:])
        if now and not was:
            start = line
        if was and not now and start != line:
            seen.append((start, line))
    return seen


def trapezoid(run, low, high, lines, n, h):
    """Lambert's formula for what is between two lines and two scan lines."""
    left, right = (n if line == -1 else lines[line] for line in run)

    def corner(line, y):
        return [(line[2] * h - line[1] * y) / line[0], y, -h]

    corners = [corner(left, low), corner(right, low), corner(right, high), corner(left, high)]
    total = ZERO
    for a, b in sides(corners):
        axis = cross(a, b)
        sine = norm(axis)
        if sine > 0:
            total += arb.atan2(sine, dot(a, b)) / sine * dot(n, axis)
    return abs(total) / 2


def computed(configuration):
    emitter, point, normal, occluders = configuration
    result = visible_projected_solid_angle(
        shapes.Polygon(emitter),
        emitters.Receivers(point, normal),
        [shapes.Polygon(occluder) for occluder in occluders],
        two_sided=True,
    )
    return float(result.value), float(result.error)


# ------------------------------------------------------------------------------------------------- strategies

OUTLINES = {
    "triangle": [[-1, -0.75], [1, -0.5], [0.125, 1]],
    "quad": [[-1, -1], [1, -1], [0.75, 0.5], [-1, 1]],
    "L": [[-1, -1], [1, -1], [1, -0.25], [0, 0], [0.25, 1], [-1, 1]],
    "star": [[0, 1], [-0.25, 0.25], [-1, 0], [-0.25, -0.25], [0, -1], [0.25, -0.25], [1, 0], [0.25, 0.25]],
}


@st.composite
def flat(draw, z, center=(0.0, 0.0), size=1.0):
    """A polygon, often not convex, in a plane of constant z, where float64 keeps it flat."""
    outline = np.array(OUTLINES[draw(st.sampled_from(sorted(OUTLINES)))])
    angle = draw(between(0, 6.25))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return np.column_stack([np.asarray(center) + size * (outline @ turn.T), np.full(len(outline), z)])


@st.composite
def triangles(draw, center, size):
    """A triangle anyhow in space, not too thin."""
    u = np.array([draw(between(-1, 1)) for _ in range(6)]).reshape(2, 3)
    u[0, draw(st.integers(0, 2))] += 1.5
    v = np.cross(u[0], u[1] + [0.3, 0.7, -0.2])
    v /= max(np.linalg.norm(v), 1e-2)
    w = np.cross(u[0], v) + 0.5 * v
    return np.asarray(center) + size * np.array([u[0], v - u[0] / 2, w / 2 - v - u[0] / 2])


@st.composite
def occluders(draw, emitter, point):
    """Something that hides a part, or nothing though it is near to doing so."""
    kind = draw(
        st.sampled_from(
            ["between", "between", "flat", "flat", "piercing", "at the receiver", "behind", "coplanar", "edge"]
        )
    )
    aim = np.array([draw(between(-1, 1)), draw(between(-1, 1)), 0.0])
    match kind:
        case "between":
            t = draw(between(0.05, 0.95))
            return draw(triangles(point + t * (aim - point), t * draw(powers_of_ten(-1, 0.3))))
        case "flat":
            t = draw(between(0.05, 0.95))
            center = point + t * (aim - point)
            return draw(flat(center[2], center[:2], t * draw(powers_of_ten(-1, 0.3))))
        case "piercing":
            return draw(triangles(aim, draw(powers_of_ten(-1, 0.3))))
        case "at the receiver":
            return draw(triangles(point, abs(point[2]) * draw(powers_of_ten(-1, 0.3))))
        case "behind":
            t = draw(st.sampled_from([-0.5, 1.5]))
            return draw(triangles(point + t * (aim - point), 0.2 * min(abs(point[2]), 1.0)))
        case "coplanar":
            return draw(flat(0.0, aim[:2]))
        case "edge":
            # Stands on an edge of the emitter.
            i = draw(st.integers(0, len(emitter) - 1))
            top = emitter[i] + draw(between(0.1, 0.9)) * (point - emitter[i]) + [draw(between(-1, 1)), 0.0, 0.0]
            return np.array([emitter[i], emitter[(i + 1) % len(emitter)], top])


@st.composite
def configurations(draw, nearest, furthest, most):
    emitter = draw(flat(0.0))
    point, normal = draw(receivers(nearest, furthest))
    hiding = [draw(occluders(emitter, point)) for _ in range(draw(st.integers(1, most)))]
    return emitter, point, normal, hiding


FORMS = [
    Form("visibility: polygon past one occluder", configurations(-1, 1, 1), computed, exact, share=0.12),
    Form("visibility: polygon past up to four occluders", configurations(-1, 1, 4), computed, exact, share=0.12),
    Form("visibility: near and far", configurations(-6, 6, 2), computed, exact, share=0.5),
]
