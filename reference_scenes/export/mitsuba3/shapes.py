"""Shapes and instances."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

import numpy as np

from reference_scenes import model
from reference_scenes.export.mitsuba3.elements import add_float, add_matrix, add_point
from reference_scenes.export.mitsuba3.files import Files


def add_shape(parent: Element, shape: model.Shape, files: Files) -> Element:
    """A shape, without its material."""
    match shape:
        case model.Rectangle():
            element = SubElement(parent, "shape", type="rectangle")
            u, v = np.array(shape.half_u), np.array(shape.half_v)
            normal = np.cross(u, v) / (np.linalg.norm(u) * np.linalg.norm(v))
            add_matrix(element, u, v, normal, np.array(shape.center))
        case model.Disk():
            element = SubElement(parent, "shape", type="disk")
            normal = np.array(shape.normal) / np.linalg.norm(shape.normal)
            u = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
            u *= shape.radius / np.linalg.norm(u)
            add_matrix(element, u, np.cross(normal, u), normal, np.array(shape.center))
        case model.Sphere():
            element = SubElement(parent, "shape", type="sphere")
            add_point(element, "point", "center", shape.center)
            add_float(element, "radius", shape.radius)
        case model.Mesh():
            element = SubElement(parent, "shape", type="ply")
            SubElement(element, "string", name="filename", value=files.mesh(shape))
            SubElement(element, "boolean", name="face_normals", value="true" if shape.normals is None else "false")
    return element


def add_instances(root: Element, instances: model.Instances, files: Files) -> Element:
    """A group with the mesh and an instance of it for each transform; returns the mesh, without its material."""
    group = SubElement(root, "shape", type="shapegroup", id=f"group_{len(files.meshes)}")
    mesh = add_shape(group, instances.mesh, files)
    for transform in instances.transforms:
        instance = SubElement(root, "shape", type="instance")
        SubElement(instance, "ref", id=group.attrib["id"])
        add_matrix(instance, *np.array(transform).T)
    return mesh
