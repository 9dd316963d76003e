"""Materials and textures."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

import numpy as np

from oracle.arrays import Floats
from reference_scenes import model
from reference_scenes.export.errors import CannotExport
from reference_scenes.export.mitsuba3.elements import add_float, add_rgb
from reference_scenes.export.mitsuba3.files import Files


def add_material(parent: Element, material: model.Material, where: str, files: Files) -> None:
    """A BSDF; `where` is the material's place in the scene."""
    match material:
        case model.Diffuse():
            element = SubElement(parent, "bsdf", type="diffuse")
            add_colour(element, "reflectance", material.reflectance, files)
        case model.Mirror():
            # Mitsuba's conductors have a black back.
            _mirror(SubElement(parent, "bsdf", type="twosided"), material, files)
        case model.Dielectric():
            _index(SubElement(parent, "bsdf", type="dielectric"), material.eta)
        case model.Conductor():
            element = SubElement(parent, "bsdf", type="conductor")
            add_rgb(element, "eta", material.eta)
            add_rgb(element, "k", material.k)
        case model.RoughConductor():
            element = SubElement(parent, "bsdf", type="roughconductor")
            _facets(element, material, where)
            add_rgb(element, "eta", material.eta)
            add_rgb(element, "k", material.k)
        case model.RoughDielectric():
            element = SubElement(parent, "bsdf", type="roughdielectric")
            _facets(element, material, where)
            _index(element, material.eta)
        case model.Plastic():
            element = SubElement(parent, "bsdf", type="plastic")
            _index(element, material.eta)
            SubElement(element, "boolean", name="nonlinear", value="true")
            add_colour(element, "diffuse_reflectance", material.reflectance, files)
        case model.Phong():
            raise CannotExport(f"{where}/type", "mitsuba3 has no phong; take rough_conductor, or another format")
        case model.TwoSided():
            element = SubElement(parent, "bsdf", type="twosided")
            for name, side in (("front", material.front), ("back", material.back)):
                if isinstance(side, model.Mirror):
                    _mirror(element, side, files)
                elif side is not None:
                    add_material(element, side, f"{where}/{name}", files)
        case model.Mix():
            element = SubElement(parent, "bsdf", type="blendbsdf")
            add_float(element, "weight", material.weight)
            add_material(element, material.first, f"{where}/first", files)
            add_material(element, material.second, f"{where}/second", files)


def _mirror(parent: Element, mirror: model.Mirror, files: Files) -> None:
    element = SubElement(parent, "bsdf", type="conductor")
    SubElement(element, "string", name="material", value="none")
    add_colour(element, "specular_reflectance", mirror.reflectance, files)


def _index(element: Element, eta: float) -> None:
    add_float(element, "int_ior", eta)
    add_float(element, "ext_ior", 1.0)


def _facets(element: Element, material: model.RoughConductor | model.RoughDielectric, where: str) -> None:
    if not material.separable:
        raise CannotExport(f"{where}/separable", "mitsuba3 multiplies masking and shadowing; set it to true")
    SubElement(element, "string", name="distribution", value="ggx")
    add_float(element, "alpha", material.alpha)


def add_colour(parent: Element, name: str, colour: model.Vector | model.Texture, files: Files) -> None:
    """A reflectance: a colour or a texture."""
    if isinstance(colour, model.Checker):
        element = SubElement(parent, "texture", type="checkerboard", name=name)
        add_rgb(element, "color0", colour.even)
        add_rgb(element, "color1", colour.odd)
        _repeat_fields(element, colour)
    else:
        add_emission(parent, name, colour, files)


def add_emission(parent: Element, name: str, colour: model.Vector | model.Texture, files: Files) -> None:
    """A colour or a texture of any values; Mitsuba's checkerboard takes none above 1, its bitmap does."""
    match colour:
        case model.Bitmap():
            _bitmap(parent, name, colour.texels.array, colour.smooth, files)
        case model.Checker():
            fields = np.array([[colour.odd, colour.even], [colour.even, colour.odd]])
            _repeat_fields(_bitmap(parent, name, fields, False, files), colour)
        case _:
            add_rgb(parent, name, colour)


def _bitmap(parent: Element, name: str, texels: Floats, smooth: bool, files: Files) -> Element:
    element = SubElement(parent, "texture", type="bitmap", name=name)
    # Mitsuba's row 0 is at v = 0.
    SubElement(element, "string", name="filename", value=files.image(texels[::-1]))
    SubElement(element, "string", name="filter_type", value="bilinear" if smooth else "nearest")
    SubElement(element, "string", name="wrap_mode", value="repeat")
    SubElement(element, "boolean", name="raw", value="true")
    return element


def _repeat_fields(element: Element, checker: model.Checker) -> None:
    """Two fields along each axis become as many as there are."""
    transform = SubElement(element, "transform", name="to_uv")
    SubElement(transform, "scale", x=repr(checker.columns / 2), y=repr(checker.rows / 2))
