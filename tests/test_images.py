"""Images that scenes name: read from their own folder only, linear, and refused in one line otherwise."""

import json

import numpy as np
import OpenImageIO as oiio
import pytest

from reference_scenes import model
from reference_scenes.images import write_exr
from reference_scenes.loading import InvalidFile, load_scene

TEXELS = np.random.default_rng(0).uniform(0, 1, (2, 3, 3)).astype(np.float32).astype(np.float64)


def write(path, texels, kind=oiio.FLOAT):
    spec = oiio.ImageSpec(texels.shape[1], texels.shape[0], texels.shape[2], kind)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec)
    assert output.write_image(texels)
    output.close()


@pytest.fixture
def load(tmp_path):
    """Load a scene in a folder of its own with a texture of that name; returns the texels."""
    folder = tmp_path / "scene"
    folder.mkdir()

    def texels_of(name):
        board = {"type": "rectangle", "center": [0, 0, 0], "half_u": [1, 0, 0], "half_v": [0, 1, 0]}
        material = {"type": "diffuse", "reflectance": {"type": "bitmap", "texels": name}}
        scene = {
            "objects": [{"shape": board, "material": material}],
            "camera": {"origin": [0, 0, 1], "target": [0, 0, 0], "up": [0, 1, 0], "fov_x": 40},
            "film": {"width": 4, "height": 3},
        }
        (folder / "scene.json").write_text(json.dumps(scene), encoding="utf-8")
        return load_scene(folder / "scene.json").objects[0].material.reflectance.texels.array

    texels_of.folder = folder
    return texels_of


@pytest.fixture
def complaint(load):
    """What loading such a scene says, without file and field."""

    def of(name):
        with pytest.raises(InvalidFile) as caught:
            load(name)
        before, _, message = str(caught.value).partition(f"/texels: {json.dumps(name)} ")
        assert before == f"{load.folder / 'scene.json'}: /objects/0/material/reflectance"
        assert message.isprintable()
        return message

    return of


def test_what_is_written_is_read_back(load):
    write_exr(load.folder / "a.exr", TEXELS)
    assert (load("a.exr") == TEXELS).all()


def test_images_may_lie_below_the_scene(load):
    (load.folder / "textures").mkdir()
    write_exr(load.folder / "textures" / "a.exr", TEXELS)
    assert (load("textures/a.exr") == TEXELS).all()


def test_a_single_channel_is_grey(load):
    write(load.folder / "a.exr", TEXELS[..., :1].astype(np.float32))
    assert (load("a.exr") == TEXELS[..., :1]).all()


def test_png_is_decoded_from_srgb(load):
    encoded = np.array([[[0, 8, 128], [255, 188, 1]]], dtype=np.uint8)
    write(load.folder / "a.png", encoded, oiio.UINT8)
    # By the formula of IEC 61966-2-1 with more digits than 8 bits have.
    expected = [[[0, 0.0024282, 0.2158605], [1, 0.5028865, 0.0003035]]]
    assert load("a.png") == pytest.approx(np.array(expected), abs=1e-7)


def test_loaded_scenes_hold_the_texels_themselves(load):
    write_exr(load.folder / "a.exr", TEXELS)
    load("a.exr")
    scene = load_scene(load.folder / "scene.json")
    (load.folder / "a.exr").unlink()
    assert model.Scene.model_validate_json(scene.model_dump_json()) == scene


def test_only_the_loader_reads_files():
    with pytest.raises(ValueError, match="is the name of a file, which only the loader of scene files reads"):
        model.Bitmap(texels="a.exr")


def test_nothing_outside_of_the_scene_s_folder_is_read(load, complaint):
    outside = load.folder.parent / "a.exr"
    write_exr(outside, TEXELS)
    (load.folder / "link.exr").symlink_to(outside)
    for name in ("../a.exr", str(outside), "link.exr", "textures/../../a.exr"):
        assert complaint(name) == "lies outside of the scene's folder; copy it there"


def test_what_is_no_image_is_refused(load, complaint):
    (load.folder / "folder.exr").mkdir()
    (load.folder / "loop.exr").symlink_to("loop.exr")
    (load.folder / "a.txt").touch()
    (load.folder / "a.exr").write_bytes(b"\x89PNG\r\n\x1a\n")
    write_exr(load.folder / "whole.exr", TEXELS)
    (load.folder / "cut.exr").write_bytes((load.folder / "whole.exr").read_bytes()[:100])
    (load.folder / "cut.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    for name in ("none.exr", "folder.exr", "loop.exr", ""):
        assert complaint(name) == "is no file in the scene's folder"
    with pytest.raises(InvalidFile, match="is no file in the scene's folder"):
        load("x" * 5000 + ".exr")
    assert complaint("a\0.exr") == "embedded null byte"
    assert complaint("a.txt") == "is neither .png nor .exr"
    assert complaint("a.exr") == "is no EXR file, whatever its name says"
    assert complaint("cut.exr").startswith("is broken: ")
    assert complaint("cut.png").startswith("is broken: ")


def test_images_hold_light_in_three_channels(load, complaint):
    write(load.folder / "four.exr", np.ones((2, 3, 4), dtype=np.float32))
    assert complaint("four.exr") == "has 4 channels; save it with three, or with one for grey"
    write(load.folder / "nan.exr", np.full((2, 3, 3), np.nan, dtype=np.float32))
    assert complaint("nan.exr") == "holds NaN or infinite values"
    write(load.folder / "negative.exr", -np.ones((2, 3, 3), dtype=np.float32))
    assert complaint("negative.exr") == "texels[0, 0, 0] is -1.0, light is at least 0"


def test_large_images_are_refused_before_they_are_read(load, complaint, monkeypatch):
    write_exr(load.folder / "a.exr", TEXELS)
    monkeypatch.setattr("reference_scenes.images.MOST_TEXELS", 5)
    assert complaint("a.exr") == "has 3 x 2 texels; 5 are the most"
