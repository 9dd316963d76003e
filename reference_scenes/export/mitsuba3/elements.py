"""The values of Mitsuba's XML: numbers, colours and transforms."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

import numpy as np

from oracle.arrays import Floats
from reference_scenes import model


def add_float(parent: Element, name: str, value: float) -> None:
    """A number."""
    SubElement(parent, "float", name=name, value=repr(float(value)))


def add_rgb(parent: Element, name: str, value: model.Vector) -> None:
    """A colour, which the RGB variants take as it is."""
    SubElement(parent, "rgb", name=name, value=_list(value))


def add_point(parent: Element, tag: str, name: str, value: model.Vector) -> None:
    """A point or vector."""
    x, y, z = value
    SubElement(parent, tag, name=name, x=repr(x), y=repr(y), z=repr(z))


def add_look_at(parent: Element, origin: model.Vector, target: model.Vector, up: model.Vector) -> None:
    """The transform of what stands at `origin` and looks at `target`."""
    look_at(SubElement(parent, "transform", name="to_world"), origin, target, up)


def look_at(transform: Element, origin: model.Vector, target: model.Vector, up: model.Vector) -> None:
    """The same as a part of a transform."""
    SubElement(transform, "lookat", origin=_list(origin), target=_list(target), up=_list(up))


def add_matrix(parent: Element, u: Floats, v: Floats, w: Floats, translation: Floats) -> None:
    """The transform that maps the axes to u, v, w and the origin to `translation`."""
    rows = np.vstack([np.column_stack([u, v, w, translation]), [0.0, 0.0, 0.0, 1.0]])
    transform = SubElement(parent, "transform", name="to_world")
    SubElement(transform, "matrix", value=" ".join(repr(float(number)) for number in rows.ravel()))


def _list(vector: model.Vector) -> str:
    return ", ".join(repr(float(number)) for number in vector)
