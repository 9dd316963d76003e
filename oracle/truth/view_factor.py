"""Light that one surface sends to another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, Self, TypeAlias

import numpy as np
from pydantic import Field

from oracle.bounded import Bounded
from oracle.emitters import Receivers
from oracle.truth.case import Case, Law, building
from oracle.truth.fields import Model, UnitVector, Vector
from oracle.truth.things import Disk, Mesh, Polygon, Rectangle, Shape, Sphere, shape_of


class Element(Model):
    """A differential piece of a surface: its `point` [m] and unit normal."""

    type: Literal["element"] = "element"
    point: Vector
    normal: UnitVector


Source: TypeAlias = Annotated[Element | Polygon | Rectangle | Disk | Sphere | Mesh, Field(discriminator="type")]


class ViewFactor(Case):
    """Fraction of the power leaving the front of `source` diffusely that reaches the front of `target` unhindered."""

    unit = "1"
    varying = "source"

    quantity: Literal["view_factor"]
    source: Source
    target: Shape

    def law(self) -> Law:
        """The definition; which closed form computes it depends on how both lie."""
        if isinstance(self.source, Element):
            return Law("1/pi integral of cos(theta) dw over the target", "Lambert 1760; Howell's catalogue, B")
        return Law("1/(pi A1) integrals of cos(theta1) cos(theta2) / r^2 dA1 dA2", "Howell's catalogue, C")

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """View factors, shape (N,)."""
        from oracle.view_factors import view_factor, view_factors

        with building("target"):
            target = shape_of(together[0].target)
        elements = [case.source for case in together if isinstance(case.source, Element)]
        shapes = []
        with building("source"):
            shapes = [shape_of(case.source) for case in together if not isinstance(case.source, Element)]
        value, error = np.empty(len(together)), np.empty(len(together))
        is_element = np.array([isinstance(case.source, Element) for case in together])
        if elements:
            points, normals = (np.array([getattr(one, name) for one in elements]) for name in ("point", "normal"))
            found = view_factor(Receivers(points, normals), target)
            value[is_element], error[is_element] = found.value, found.error
        if shapes:
            found = view_factors(shapes, [target])
            value[~is_element], error[~is_element] = found.value[:, 0], found.error[:, 0]
        return Bounded(value, error)
