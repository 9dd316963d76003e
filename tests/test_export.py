"""Exported scenes: complete, neutral, the same every time, and read by the renderers they are for."""

from __future__ import annotations

import re

import numpy as np
import pytest

from reference_scenes import model
from reference_scenes.export import FORMATS, export
from reference_scenes.families import FAMILIES
from reference_scenes.loading import load_scene

GREY = model.Diffuse(reflectance=(0.5, 0.4, 0.3))
TRIANGLES = model.Mesh(
    vertices=((0.0, 0.0, 0.1), (1.0, 0.0, 0.1), (1.0, 1.0, 0.1), (0.0, 1.0, 0.2)), triangles=((0, 1, 2), (0, 2, 3))
)
EVERYTHING = model.Scene(
    objects=tuple(
        model.Object(shape=shape, material=GREY)
        for shape in (
            model.Rectangle(center=(0.0, 0.0, 0.0), half_u=(3.0, 0.0, 0.0), half_v=(0.0, 3.0, 0.0)),
            model.Disk(center=(-1.0, 0.0, 0.3), normal=(0.2, 0.1, 1.0), radius=0.4),
            model.Sphere(center=(-1.0, 1.0, 0.4), radius=0.3),
            TRIANGLES,
        )
    ),
    emitters=(
        model.AreaEmitter(shape=TRIANGLES.model_copy(update={"triangles": ((0, 2, 1),)}), radiance=(1.0, 2.0, 3.0)),
        model.PointEmitter(position=(1.0, 1.0, 2.0), intensity=(1.0, 1.0, 1.0)),
        model.SpotEmitter(
            position=(0.0, 0.0, 3.0),
            direction=(0.0, 0.0, -1.0),
            intensity=(5.0, 5.0, 5.0),
            cutoff_angle=30.0,
            beam_width=20.0,
        ),
        model.DirectionalEmitter(direction=(0.1, 0.2, -1.0), irradiance=(0.5, 0.5, 0.5)),
        model.ConstantEmitter(radiance=(0.1, 0.1, 0.1)),
    ),
    camera=model.Camera(origin=(0.0, -4.0, 3.0), target=(0.0, 0.0, 0.0), fov_x=40.0),
    film=model.Film(width=24, height=16, filter=model.GaussianFilter(stddev=0.4)),
)


def files(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


@pytest.mark.parametrize("format_name", FORMATS)
@pytest.mark.parametrize("family", FAMILIES)
def test_the_same_seed_gives_the_same_bytes_and_another_others(tmp_path, family, format_name):
    for folder, seed in (("a", 3), ("b", 3), ("c", 4)):
        export(FAMILIES[family].member(seed), format_name, tmp_path / folder)
    assert files(tmp_path / "a") == files(tmp_path / "b")
    assert files(tmp_path / "a") != files(tmp_path / "c")


@pytest.mark.parametrize("format_name", FORMATS)
@pytest.mark.parametrize("family", FAMILIES)
def test_no_file_tells_which_family_it_is_of(tmp_path, family, format_name):
    export(FAMILIES[family].member(1), format_name, tmp_path)
    for name, content in files(tmp_path).items():
        assert "-" not in name
        if "-" in family:
            assert family.encode() not in content


def test_native_scenes_are_read_back_unchanged(tmp_path):
    assert load_scene(export(EVERYTHING, "json", tmp_path)) == EVERYTHING


def test_mitsuba_reads_every_shape_and_emitter(tmp_path):
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    loaded = mitsuba.load_file(str(export(EVERYTHING, "mitsuba3", tmp_path)))
    assert len(loaded.shapes()) == 5
    assert len(loaded.emitters()) == 5
    image = np.array(mitsuba.render(loaded, spp=16, seed=1))
    assert image.shape == (16, 24, 3)
    assert np.isfinite(image).all()
    assert image.mean() > 0


def test_surfaces_that_shine_are_black(tmp_path):
    text = export(EVERYTHING, "mitsuba3", tmp_path).read_text(encoding="utf-8")
    shining = re.findall(r"<shape(?:(?!</shape>).)*<emitter.*?</shape>", text, re.DOTALL)
    assert len(shining) == 1
    assert '"reflectance" value="0.0, 0.0, 0.0"' in shining[0]


def test_ply_files_hold_the_triangles(tmp_path):
    export(EVERYTHING, "mitsuba3", tmp_path)
    header, _, body = (tmp_path / "mesh_0.ply").read_bytes().partition(b"end_header\n")
    assert b"element vertex 4" in header
    assert b"element face 2" in header
    assert np.frombuffer(body[:48], "<f4").reshape(4, 3) == pytest.approx(np.array(TRIANGLES.vertices))
    faces = np.frombuffer(body[48:], [("count", "u1"), ("indices", "<i4", 3)])
    assert faces["count"].tolist() == [3, 3]
    assert faces["indices"].tolist() == [list(triangle) for triangle in TRIANGLES.triangles]
