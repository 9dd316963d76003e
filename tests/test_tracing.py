"""Scenes as the reference tracer is given them: everything in its place, angles in radians."""

import numpy as np
import pytest
from any_scene import scenes
from hypothesis import given, settings

from oracle import emitters, shapes
from oracle.arrays import InvalidArgument
from oracle.tracer import scene as tracer
from reference_scenes import model
from reference_scenes.families import FAMILIES
from reference_scenes.tracing import to_tracer

quick = settings(derandomize=True, deadline=None, max_examples=60)

CAMERA = model.Camera(origin=(0.0, -3.0, 2.0), target=(0.0, 0.0, 1.0), fov_x=90.0)
FILM = model.Film(width=4, height=3)
SPHERE = model.Sphere(center=(1.0, 2.0, 3.0), radius=2.0)
MESH = model.Mesh(
    vertices=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    triangles=((0, 1, 2),),
    normals=((0.0, 0.0, 5.0), (0.0, 3.0, 4.0), (0.0, 0.0, 1.0)),
    uv=((0.0, 0.0), (1.0, 0.0), (0.0, 2.0)),
)
BOARD = model.Rectangle(center=(1.0, 0.0, 0.0), half_u=(2.0, 0.0, 0.0), half_v=(0.0, 1.5, 0.0))
GREY = model.Diffuse(reflectance=(0.5, 0.4, 0.3))
GOLD = model.RoughConductor(eta=(0.2, 0.9, 1.1), k=(3.9, 2.4, 2.2), alpha=0.3, separable=True)


def traced(**parts):
    """Objects, emitters and medium of a scene, its sensor and film."""
    scene, sensor, film = to_tracer(model.Scene(**{"camera": CAMERA, "film": FILM} | parts))
    return scene.objects, scene.emitters, scene.medium, sensor, film


def material_of(material, shape=BOARD):
    return traced(objects=(model.Object(shape=shape, material=material),))[0][0].material


@quick
@given(scenes)
def test_every_scene_is_translated(scene):
    traced_scene, _, film = to_tracer(scene)
    shining = sum(isinstance(emitter, model.AreaEmitter) for emitter in scene.emitters)
    assert len(traced_scene.objects) == len(scene.objects) + shining
    assert len(traced_scene.emitters) == len(scene.emitters) - shining
    assert (film.width, film.height) == (scene.film.width, scene.film.height)


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_is_translated(family):
    scene = FAMILIES[family].member(0)
    assert len(to_tracer(scene)[0].objects) >= len(scene.objects)


def test_shapes_keep_their_numbers():
    disk = model.Disk(center=(1.0, 2.0, 3.0), normal=(0.0, 3.0, 4.0), radius=0.5)
    objects = traced(objects=tuple(model.Object(shape=shape, material=GREY) for shape in (BOARD, disk, SPHERE, MESH)))[
        0
    ]
    board, disk, sphere, mesh = (one.shape for one in objects)
    assert isinstance(board, shapes.Rectangle)
    assert (board.center, board.half_u, board.half_v) == (
        pytest.approx([1, 0, 0]),
        pytest.approx([2, 0, 0]),
        pytest.approx([0, 1.5, 0]),
    )
    assert (disk.center, disk.normal, disk.radius) == (pytest.approx([1, 2, 3]), pytest.approx([0, 0.6, 0.8]), 0.5)
    assert (sphere.center, sphere.radius) == (pytest.approx([1, 2, 3]), 2)
    assert mesh.vertices.tolist() == [list(vertex) for vertex in MESH.vertices]
    assert mesh.triangles.tolist() == [[0, 1, 2]]
    assert mesh.normals == pytest.approx(np.array([[0, 0, 1], [0, 0.6, 0.8], [0, 0, 1]]))
    assert mesh.uv.tolist() == [[0, 0], [1, 0], [0, 2]]


def test_instances_keep_their_transforms():
    turned = ((0.0, -2.0, 0.0, 5.0), (2.0, 0.0, 0.0, 6.0), (0.0, 0.0, 2.0, 7.0))
    copies = model.Instances(mesh=MESH, transforms=(turned,))
    (instances,) = traced(objects=(model.Object(shape=copies, material=GREY),))[0]
    assert isinstance(instances, tracer.Instances)
    assert instances.transforms.tolist() == [[list(row) for row in turned]]
    assert isinstance(instances.material, tracer.Diffuse)


def test_materials_keep_their_numbers():
    assert material_of(GREY).reflectance == pytest.approx([0.5, 0.4, 0.3])
    assert material_of(model.Mirror()).reflectance == pytest.approx([1, 1, 1])
    assert material_of(model.Dielectric(eta=1.5)).eta == 1.5
    conductor = material_of(model.Conductor(eta=(0.2, 0.9, 1.1), k=(3.9, 2.4, 2.2)))
    assert isinstance(conductor, tracer.Conductor)
    assert (conductor.eta, conductor.k) == (pytest.approx([0.2, 0.9, 1.1]), pytest.approx([3.9, 2.4, 2.2]))
    gold = material_of(GOLD)
    assert (gold.eta, gold.k) == (pytest.approx([0.2, 0.9, 1.1]), pytest.approx([3.9, 2.4, 2.2]))
    assert (gold.alpha, gold.separable) == (0.3, True)
    frosted = material_of(model.RoughDielectric(eta=1.5, alpha=0.2))
    assert (frosted.eta, frosted.alpha, frosted.separable) == (1.5, 0.2, False)
    phong = material_of(model.Phong(reflectance=(0.5, 0.4, 0.3), exponent=20.0))
    assert (phong.reflectance, phong.exponent) == (pytest.approx([0.5, 0.4, 0.3]), 20)
    plastic = material_of(model.Plastic(reflectance=(0.5, 0.4, 0.3), eta=1.3))
    assert (plastic.reflectance, plastic.eta) == (pytest.approx([0.5, 0.4, 0.3]), 1.3)


def test_materials_within_materials_are_translated_too():
    mixed = model.Mix(first=GREY, second=model.Dielectric(eta=1.5), weight=0.25)
    mix = material_of(mixed)
    assert (type(mix.first), type(mix.second), mix.weight) == (tracer.Diffuse, tracer.Dielectric, 0.25)
    blades = material_of(model.TwoSided(front=GREY, back=model.Mix(first=GREY, second=GOLD, weight=0.5)))
    assert isinstance(blades.front, tracer.Diffuse)
    assert isinstance(blades.back.second, tracer.RoughConductor)
    assert material_of(model.TwoSided(front=GREY)).back is None


def test_textures_keep_their_numbers():
    texels = np.random.default_rng(0).uniform(0, 1, (2, 3, 3))
    bitmap = material_of(model.Diffuse(reflectance=model.Bitmap(texels=texels, smooth=False))).reflectance
    assert (bitmap.texels == texels).all()
    assert not bitmap.smooth
    checker = model.Checker(even=(0.9, 0.8, 0.7), odd=(0.1, 0.2, 0.3), columns=3.0, rows=5.0)
    shining = traced(emitters=(model.AreaEmitter(shape=BOARD, radiance=checker),))[0][0].radiance
    assert (shining.even, shining.odd) == (pytest.approx([0.9, 0.8, 0.7]), pytest.approx([0.1, 0.2, 0.3]))
    assert (shining.columns, shining.rows) == (3, 5)


@pytest.mark.parametrize("two_sided", [True, False])
def test_area_emitters_are_black_objects_that_shine(two_sided):
    emitter = model.AreaEmitter(shape=SPHERE, radiance=(1.0, 2.0, 3.0), two_sided=two_sided)
    (one,) = traced(emitters=(emitter,))[0]
    assert one.material is None
    assert one.radiance == pytest.approx([1, 2, 3])
    assert one.two_sided == two_sided


def test_other_emitters_keep_their_numbers_and_angles_become_radians():
    point = model.PointEmitter(position=(1.0, 2.0, 3.0), intensity=(4.0, 5.0, 6.0))
    spot = model.SpotEmitter(
        position=(1.0, 2.0, 3.0),
        direction=(0.0, 0.0, -2.0),
        intensity=(4.0, 5.0, 6.0),
        beam_width=30.0,
        cutoff_angle=45.0,
    )
    sun = model.DirectionalEmitter(direction=(0.0, 3.0, -4.0), irradiance=(4.0, 5.0, 6.0))
    a, b, c = traced(emitters=(point, spot, sun))[1]
    assert (a.position, a.intensity) == (pytest.approx([1, 2, 3]), pytest.approx([4, 5, 6]))
    assert (b.position, b.direction) == (pytest.approx([1, 2, 3]), pytest.approx([0, 0, -1]))
    assert (b.beam_width, b.cutoff_angle) == (pytest.approx(np.pi / 6), pytest.approx(np.pi / 4))
    assert (c.direction, c.irradiance) == (pytest.approx([0, 0.6, -0.8]), pytest.approx([4, 5, 6]))


def test_constant_environments_add_up():
    (one,) = traced(emitters=tuple(model.ConstantEmitter(radiance=(1.0, 2.0, level)) for level in (3.0, 4.0)))[1]
    assert isinstance(one, emitters.Constant)
    assert one.radiance == pytest.approx([2, 4, 7])


def test_skies_and_images_keep_their_axes():
    (overcast,) = traced(emitters=(model.SkyEmitter(up=(0.0, 3.0, 4.0), zenith=(3.0, 6.0, 9.0)),))[1]
    assert (overcast.up, overcast.horizon) == (pytest.approx([0, 0.6, 0.8]), pytest.approx([1, 2, 3]))
    (sky,) = traced(emitters=(model.SkyEmitter(zenith=(3.0, 6.0, 9.0), horizon=(5.0, 0.0, 1.0)),))[1]
    assert (sky.horizon, sky.zenith) == (pytest.approx([5, 0, 1]), pytest.approx([3, 6, 9]))
    texels = np.random.default_rng(0).uniform(0, 1, (2, 3, 3))
    (image,) = traced(emitters=(model.ImageEmitter(radiance=texels, front=(0.0, 2.0, 0.0)),))[1]
    assert (image.radiance == texels).all()
    assert (image.up, image.front) == (pytest.approx([0, 0, 1]), pytest.approx([0, 1, 0]))


def test_a_medium_keeps_its_coefficients():
    fog = model.Medium(absorption=(0.1, 0.2, 0.3), scattering=(0.4, 0.5, 0.6), asymmetry=-0.5)
    medium = traced(medium=fog)[2]
    assert (medium.absorption, medium.scattering) == (pytest.approx([0.1, 0.2, 0.3]), pytest.approx([0.4, 0.5, 0.6]))
    assert medium.asymmetry == -0.5
    assert traced()[2] is None


def test_sensors_keep_their_numbers_and_fields_of_view_become_radians():
    perspective = traced()[3]
    assert (perspective.origin, perspective.target) == (pytest.approx([0, -3, 2]), pytest.approx([0, 0, 1]))
    assert (perspective.up, perspective.fov_x) == (pytest.approx([0, 0, 1]), pytest.approx(np.pi / 2))
    above = model.OrthographicCamera(origin=(0.0, 0.0, 2.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), width=5.0)
    orthographic = traced(camera=above)[3]
    assert (orthographic.up, orthographic.width) == (pytest.approx([0, 1, 0]), 5)
    meter = traced(camera=model.IrradianceMeter(surface=BOARD))[3]
    assert meter.surface.half_v == pytest.approx([0, 1.5, 0])
    ray = traced(camera=model.RadianceMeter(origin=(1.0, 2.0, 3.0), direction=(0.0, 3.0, 4.0)))[3]
    assert (ray.origin, ray.direction) == (pytest.approx([1, 2, 3]), pytest.approx([0, 0.6, 0.8]))


def test_films_keep_their_filter():
    assert traced()[4] == tracer.Film(4, 3)
    soft = model.Film(width=4, height=3, filter=model.GaussianFilter(stddev=0.7))
    assert traced(film=soft)[4] == tracer.Film(4, 3, 0.7)


def test_a_triangle_like_a_line_is_named():
    needle = model.Mesh(vertices=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1e-15, 0.0)), triangles=((0, 1, 2),))
    with pytest.raises(InvalidArgument, match=r"triangles\[0\]"):
        traced(objects=(model.Object(shape=needle, material=GREY),))
