"""Exported scenes: complete, neutral, the same every time, and read by the renderers they are for."""

from __future__ import annotations

import re

import numpy as np
import pytest

from reference_scenes import model
from reference_scenes.export import FORMATS, CannotExport, export
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


CONSTANT = model.ConstantEmitter(radiance=(1.0, 1.0, 1.0))
MATERIALS = {
    "diffuse": GREY,
    "mirror": model.Mirror(reflectance=(0.9, 0.8, 0.7)),
    "dielectric": model.Dielectric(eta=1.5),
    "conductor": model.Conductor(eta=(0.2, 0.9, 1.1), k=(3.9, 2.4, 2.2)),
    "rough conductor": model.RoughConductor(eta=(0.2, 0.9, 1.1), k=(3.9, 2.4, 2.2), alpha=0.3, separable=True),
    "rough dielectric": model.RoughDielectric(eta=1.5, alpha=0.2, separable=True),
    "plastic": model.Plastic(reflectance=(0.5, 0.4, 0.3), eta=1.5),
    "two-sided": model.TwoSided(front=GREY, back=model.Mirror()),
    "mix": model.Mix(first=GREY, second=model.Mirror(), weight=0.25),
    "mix on both sides": model.TwoSided(front=model.Mix(first=GREY, second=model.Mirror(), weight=0.25)),
}
MESH = model.Mesh(
    vertices=TRIANGLES.vertices,
    triangles=TRIANGLES.triangles,
    normals=((0.0, 0.0, 2.0), (0.0, 3.0, 4.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)),
    uv=((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 2.5)),
)
SENSORS = {
    "orthographic": model.OrthographicCamera(origin=(0.0, -4.0, 3.0), target=(0.0, 0.0, 0.0), width=3.0),
    "irradiance meter": model.IrradianceMeter(
        surface=model.Rectangle(center=(0.0, 0.0, 1.0), half_u=(1.0, 0.0, 0.0), half_v=(0.0, 1.0, 0.0))
    ),
    "radiance meter": model.RadianceMeter(origin=(0.0, 0.0, 2.0), direction=(0.0, 0.1, -1.0)),
}
EMITTERS = {
    "checker": model.AreaEmitter(shape=MESH, radiance=model.Checker(even=(5.0, 1.0, 0.0), odd=(0.0, 0.0, 0.0))),
    "bitmap": model.AreaEmitter(
        shape=EVERYTHING.objects[0].shape, radiance=model.Bitmap(texels=np.arange(12.0).reshape(2, 2, 3))
    ),
    "two-sided": model.AreaEmitter(shape=EVERYTHING.objects[1].shape, radiance=(1.0, 2.0, 3.0), two_sided=True),
    "sky": model.SkyEmitter(zenith=(1.0, 2.0, 3.0)),
    "image": model.ImageEmitter(radiance=np.arange(12.0).reshape(2, 2, 3)),
}


def with_part(part):
    """A scene with a material, sensor or emitter in it."""
    scene = {"objects": EVERYTHING.objects, "emitters": EVERYTHING.emitters, "film": EVERYTHING.film}
    scene["camera"] = EVERYTHING.camera
    if part in MATERIALS.values():
        scene["objects"] = (model.Object(shape=MESH, material=part), *EVERYTHING.objects)
    elif part in SENSORS.values():
        scene["camera"] = part
        scene["emitters"] = (EVERYTHING.emitters[0], CONSTANT)
        if isinstance(part, model.RadianceMeter):
            scene["film"] = model.Film(width=1, height=1)
    elif isinstance(part, model.AreaEmitter):
        scene["emitters"] = (*EVERYTHING.emitters, part)
    else:
        scene["emitters"] = (*EVERYTHING.emitters[:4], part)
    return model.Scene(**scene)


PARTS = MATERIALS | SENSORS | EMITTERS


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


@pytest.mark.parametrize("part", PARTS)
def test_every_part_of_a_native_scene_is_read_back_unchanged(tmp_path, part):
    scene = with_part(PARTS[part])
    assert load_scene(export(scene, "json", tmp_path)) == scene


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


@pytest.fixture
def read(tmp_path):
    """What Mitsuba makes of a scene."""
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    return lambda scene: mitsuba.load_file(str(export(scene, "mitsuba3", tmp_path)))


@pytest.mark.parametrize("part", PARTS)
def test_mitsuba_renders_every_part(read, part):
    import mitsuba

    image = np.array(mitsuba.render(read(with_part(PARTS[part])), spp=16, seed=1))
    assert np.isfinite(image).all()
    assert image.mean() > 0


def test_mitsuba_renders_a_medium(read):
    import mitsuba

    medium = model.Medium(absorption=(0.1, 0.0, 2.0), scattering=(0.1, 0.0, 0.5), asymmetry=0.5)
    near = EVERYTHING.emitters[:3]
    scene = model.Scene(
        objects=EVERYTHING.objects, emitters=near, medium=medium, camera=EVERYTHING.camera, film=EVERYTHING.film
    )
    image = np.array(mitsuba.render(read(scene), spp=16, seed=1))
    assert np.isfinite(image).all()
    assert image[..., 1].mean() > image[..., 2].mean() > 0


def test_mitsuba_takes_colours_of_any_size_as_they_are(read):
    import mitsuba

    radiance, reflectance = (2.5e4, 1e-3, 7.0), (0.9, 0.01, 0.35)
    metal = MATERIALS["conductor"]
    scene = model.Scene(
        objects=(
            model.Object(shape=TRIANGLES, material=model.Diffuse(reflectance=reflectance)),
            model.Object(shape=TRIANGLES, material=metal),
        ),
        emitters=(model.AreaEmitter(shape=EVERYTHING.objects[2].shape, radiance=radiance),),
        camera=EVERYTHING.camera,
        film=EVERYTHING.film,
    )
    loaded = read(scene)
    interaction = mitsuba.SurfaceInteraction3f()
    interaction.wi = mitsuba.Vector3f(0, 0, 1)
    emitted = loaded.emitters()[0].eval(interaction)
    assert np.array(emitted) == pytest.approx(radiance, rel=1e-6)
    materials = [shape.bsdf() for shape in loaded.shapes() if not shape.is_emitter()]
    # Mitsuba orders shapes as it likes; textually SmoothDiffuse comes after SmoothConductor.
    conductor, diffuse = sorted(materials, key=str)
    value = diffuse.eval(mitsuba.BSDFContext(), interaction, mitsuba.Vector3f(0, 0, 1))
    assert np.array(value) == pytest.approx(np.array(reflectance) / np.pi, rel=1e-6)
    parameters = mitsuba.traverse(conductor)
    assert np.array(parameters["eta.value"]).ravel() == pytest.approx(metal.eta, rel=1e-6)
    assert np.array(parameters["k.value"]).ravel() == pytest.approx(metal.k, rel=1e-6)


PHONG = model.Phong(reflectance=(0.5, 0.5, 0.5), exponent=10.0)
CORRELATED = model.RoughDielectric(eta=1.5, alpha=0.1)
PHONG_WITHIN = model.Mix(first=GREY, second=PHONG, weight=0.5)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (
            {"objects": (model.Object(shape=TRIANGLES, material=PHONG),)},
            "/objects/0/material/type: mitsuba3 has no phong",
        ),
        (
            {"objects": (model.Object(shape=TRIANGLES, material=model.TwoSided(front=GREY, back=PHONG_WITHIN)),)},
            "/objects/0/material/back/second/type: mitsuba3 has no phong",
        ),
        (
            {"objects": (model.Object(shape=TRIANGLES, material=CORRELATED),)},
            "/objects/0/material/separable: mitsuba3 multiplies masking and shadowing",
        ),
        ({"emitters": (CONSTANT, CONSTANT)}, "/emitters/1: mitsuba3 has room for one environment"),
        (
            {"emitters": (model.AreaEmitter(shape=TRIANGLES, radiance=(1.0, 1.0, 1.0), two_sided=True),)},
            "/emitters/0/two_sided: mitsuba3 has no two-sided emitters",
        ),
        (
            {"camera": SENSORS["irradiance meter"], "emitters": EVERYTHING.emitters},
            "/emitters/1/type: mitsuba3's irradiance meters do not see point emitters",
        ),
        ({"camera": SENSORS["radiance meter"]}, "/film: mitsuba3 has radiance meters of one pixel"),
    ],
    ids=["phong", "phong within", "facets", "environments", "two-sided mesh", "irradiance meter", "radiance meter"],
)
def test_what_mitsuba_cannot_say_is_refused_by_name_and_leaves_no_file(tmp_path, changed, message):
    scene = model.Scene(**{"camera": EVERYTHING.camera, "film": EVERYTHING.film} | changed)
    with pytest.raises(CannotExport) as caught:
        export(scene, "mitsuba3", tmp_path)
    assert str(caught.value).startswith(message)
    assert not list(tmp_path.iterdir())


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


def test_ply_files_hold_normals_of_length_1_and_texture_coordinates(tmp_path):
    scene = model.Scene(
        objects=(model.Object(shape=MESH, material=GREY),), camera=EVERYTHING.camera, film=EVERYTHING.film
    )
    text = export(scene, "mitsuba3", tmp_path).read_text(encoding="utf-8")
    assert '<boolean name="face_normals" value="false" />' in text
    header, _, body = (tmp_path / "mesh_0.ply").read_bytes().partition(b"end_header\n")
    properties = [line.split()[-1] for line in header.decode().splitlines() if line.startswith("property float")]
    assert properties == ["x", "y", "z", "nx", "ny", "nz", "u", "v"]
    columns = np.frombuffer(body[: 4 * 8 * 4], "<f4").reshape(4, 8)
    assert columns[:, 3:6] == pytest.approx(np.array([[0, 0, 1], [0, 0.6, 0.8], [0, 0, 1], [0, 0, 1]]))
    assert columns[:, 6:] == pytest.approx(np.array(MESH.uv))
