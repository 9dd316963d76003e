"""Mitsuba 3 XML with PLY meshes and OpenEXR images.

Emitters that are surfaces get a black BSDF, so that they reflect nothing in any version of the renderer. What it says
otherwise than the scene is small and listed in `docs/scene-format.md`; what it cannot say is refused.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from reference_scenes import model
from reference_scenes.export.mitsuba3.emitters import add_emitter
from reference_scenes.export.mitsuba3.files import Files
from reference_scenes.export.mitsuba3.materials import add_material
from reference_scenes.export.mitsuba3.sensors import add_medium, add_sensor
from reference_scenes.export.mitsuba3.shapes import add_instances, add_shape


def write(scene: model.Scene, path: Path) -> None:
    """Write the scene as XML; meshes go beside it as mesh_0.ply, ..., images as image_0.exr, ...

    Raises
    ------
    CannotExport
        If the scene holds what Mitsuba 3 cannot say.
    """
    root = Element("scene", version="3.0.0")
    files = Files()
    SubElement(root, "default", name="spp", value="64")
    # Surfaces that are there for the sensor's sake alone let light pass, which `path` does not know.
    passing = scene.medium is not None or isinstance(scene.camera, model.IrradianceMeter)
    SubElement(root, "integrator", type="volpathmis" if passing else "path")
    if scene.medium is not None:
        add_medium(root, scene.medium)
    add_sensor(root, scene)
    for index, scene_object in enumerate(scene.objects):
        if isinstance(scene_object.shape, model.Instances):
            shape = add_instances(root, scene_object.shape, files)
        else:
            shape = add_shape(root, scene_object.shape, files)
        add_material(shape, scene_object.material, f"/objects/{index}/material", files)
    constant = False
    for index, emitter in enumerate(scene.emitters):
        add_emitter(root, emitter, f"/emitters/{index}", files, constant)
        constant = constant or isinstance(emitter, model.ConstantEmitter)
    files.write(path.parent)
    ElementTree.indent(root)
    path.write_bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")
