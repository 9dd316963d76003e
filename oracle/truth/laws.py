"""Formulas, as answers show them, and who found them. The modules of the closed forms derive them."""

from __future__ import annotations

from typing import Any

from oracle.truth import things
from oracle.truth.case import Law

# For each shape: what it adds up to at a receiver, weighted with the receiver's cosine, and clipped at its horizon.
_SHAPES: dict[type[Any], Law] = {
    things.Polygon: Law("1/2 sum_i Theta_i (n . Gamma_i)", "Lambert 1760; Nishita and Nakamae 1985; Arvo 1994"),
    things.Rectangle: Law("1/2 sum_i Theta_i (n . Gamma_i)", "Lambert 1760; Nishita and Nakamae 1985; Arvo 1994"),
    things.Mesh: Law(
        "1/2 sum_triangles sum_i Theta_i (n . Gamma_i)", "Lambert 1760; Nishita and Nakamae 1985; Arvo 1994"
    ),
    things.Disk: Law("1/2 closed integral n . (p x dp) / |p|^2", "Lambert 1760; Sparrow 1963"),
    things.Sphere: Law("pi (R/d)^2 cos(theta), cut at the horizon", "Lambert 1760; Snyder 1996"),
}

_EMITTERS: dict[type[Any], Law] = {
    things.PointEmitter: Law("I cos(theta) / r^2", "Lambert 1760"),
    things.SpotEmitter: Law(
        "I clip((cutoff - a) / (cutoff - beam), 0, 1) cos(theta) / r^2", "Lambert 1760; falloff linear in the angle"
    ),
    things.DirectionalEmitter: Law("E_0 cos(theta)", "Lambert 1760"),
    things.LineEmitter: Law("integral of I' sin(phi) cos(theta) / r^2 ds", "Lambert 1760"),
    things.ConstantEmitter: Law("pi L", "Lambert 1760"),
    things.CosineSkyEmitter: Law("integral of (Lh + (Lz - Lh) sin(elevation)) cos(theta) dw", "Lambert 1760"),
    things.OvercastSkyEmitter: Law(
        "integral of Lz (1 + 2 sin(elevation)) / 3 cos(theta) dw", "Lambert 1760; ISO 15469:2004 (CIE S 011), sky 16"
    ),
    things.MapEmitter: Law("sum over texels of L times their projected solid angle", "Lambert 1760"),
}


def projected_solid_angle_of(shape: things.Shape) -> Law:
    """The law of a shape's projected solid angle."""
    return next(law for kind, law in _SHAPES.items() if isinstance(shape, kind))


def irradiance_of(emitter: things.Emitter) -> Law:
    """The law of an emitter's irradiance."""
    if isinstance(emitter, things.AreaEmitter):
        law = projected_solid_angle_of(emitter)
        return Law(
            law.formula.replace("1/2", "L/2", 1) if law.formula.startswith("1/2") else f"L {law.formula}", law.source
        )
    return _EMITTERS[type(emitter)]
