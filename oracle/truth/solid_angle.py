"""How much of what a point sees a shape covers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal, Self, TypeAlias

import numpy as np
from pydantic import Field

from oracle.bounded import Bounded
from oracle.irradiances import projected_solid_angle
from oracle.truth.case import Case, Law, building
from oracle.truth.fields import Angle, Model, TwoSided, Vector
from oracle.truth.laws import projected_solid_angle_of
from oracle.truth.light import receivers_of
from oracle.truth.things import Disk, Polygon, Receiver, Rectangle, Shape, Sphere, shape_of

_EPSILON = float(np.finfo(np.float64).eps)


class Cone(Model):
    """A circular cone of directions by the angle [rad] between its axis and its side."""

    type: Literal["cone"] = "cone"
    half_angle: Angle


SolidShape: TypeAlias = Annotated[Polygon | Rectangle | Disk | Sphere | Cone, Field(discriminator="type")]
_FAN = Law(
    "sum over a fan of triangles of 2 atan2(a . (b x c), abc + (a.b)c + (b.c)a + (c.a)b)",
    "van Oosterom and Strackee 1983",
)
_LAWS: dict[type[Any], Law] = {
    Polygon: _FAN,
    Rectangle: _FAN,
    Disk: Law("complete elliptic integrals of the first and third kind", "Paxton 1959"),
    Sphere: Law("4 pi sin^2(a/2), sin(a) = R/d", "Archimedes"),
    Cone: Law("4 pi sin^2(a/2)", "Archimedes"),
}


class SolidAngle(Case):
    """Solid angle [sr] that a shape covers as seen from a point, from whichever side; a cone is the same everywhere."""

    unit = "sr"
    varying = "point"

    quantity: Literal["solid_angle"]
    shape: SolidShape
    point: Vector = (0.0, 0.0, 0.0)

    def law(self) -> Law:
        """The closed form for the kind of shape."""
        return _LAWS[type(self.shape)]

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Solid angles (N,)."""
        from oracle.solid_angles import cone, solid_angle

        shape = together[0].shape
        if isinstance(shape, Cone):
            with building("shape"):
                value = np.full(len(together), cone(shape.half_angle))
            # Right to a few ulp.
            return Bounded(value, 4 * _EPSILON * value)
        with building("shape"):
            built = shape_of(shape)
        return solid_angle(built, np.array([case.point for case in together]))


class ProjectedSolidAngle(Case):
    """Solid angle [sr] of a shape's front, or both sides, at a receiver, weighted with the receiver's cosine."""

    unit = "sr"
    varying = "receiver"

    quantity: Literal["projected_solid_angle"]
    shape: Shape
    receiver: Receiver
    two_sided: TwoSided = False

    def law(self) -> Law:
        """The closed form for the kind of shape."""
        return projected_solid_angle_of(self.shape)

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Projected solid angles (N,)."""
        with building("shape"):
            built = shape_of(together[0].shape)
        return projected_solid_angle(built, receivers_of([case.receiver for case in together]), together[0].two_sided)
