"""Any valid scene, for tests of what holds for all of them."""

from hypothesis import strategies as st

from reference_scenes import model
from reference_scenes.model import Scene

numbers = st.floats(-1e6, 1e6)
vectors = st.tuples(numbers, numbers, numbers)
lengths = st.floats(1e-6, 1e6)
directions = vectors.filter(lambda v: max(map(abs, v)) > 1e-6)
spectra = st.tuples(*[st.floats(0, 1e9)] * 3)
albedos = st.tuples(*[st.floats(0, 1)] * 3)


@st.composite
def rectangles(draw):
    a, b, scale = draw(lengths), draw(numbers), draw(lengths)
    return model.Rectangle(center=draw(vectors), half_u=(a, b, 0.0), half_v=(-b * 2.0, a * 2.0, 0.0 * scale))


@st.composite
def meshes(draw, textured=False):
    count = draw(st.integers(3, 6))
    vertices = tuple((float(i), float(i * i), draw(st.floats(-1, 1))) for i in range(count))
    corner = st.integers(0, count - 1)
    triangles = draw(st.lists(st.tuples(corner, corner, corner).filter(lambda t: len(set(t)) == 3), min_size=1))
    of_each = {"min_size": count, "max_size": count}
    places = st.lists(st.tuples(numbers, numbers), **of_each).map(tuple)
    return model.Mesh(
        vertices=vertices,
        triangles=tuple(triangles),
        normals=draw(st.none() | st.lists(directions, **of_each).map(tuple)),
        uv=draw(places if textured else st.none() | places),
    )


@st.composite
def instances(draw, textured=False):
    scales = st.floats(0.5, 2) | st.floats(-2, -0.5)
    rows = [[draw(scales) if i == j else draw(st.floats(-0.1, 0.1)) for j in range(3)] for i in range(3)]
    transform = tuple((*row, draw(numbers)) for row in rows)
    return model.Instances(mesh=draw(meshes(textured)), transforms=(transform,))


@st.composite
def images(draw, largest):
    height, width = draw(st.integers(1, 3)), draw(st.integers(1, 3))
    of_row = {"min_size": width, "max_size": width}
    return draw(st.lists(st.lists(st.tuples(*[st.floats(0, largest)] * 3), **of_row), min_size=height, max_size=height))


def textures(largest):
    colour = st.tuples(*[st.floats(0, largest)] * 3)
    return st.one_of(
        st.builds(model.Bitmap, texels=images(largest), smooth=st.booleans()),
        st.builds(model.Checker, even=colour, odd=colour, columns=lengths, rows=lengths),
    )


shapes = st.one_of(
    rectangles(),
    st.builds(model.Disk, center=vectors, normal=directions, radius=lengths),
    st.builds(model.Sphere, center=vectors, radius=lengths),
    meshes(),
)
emitters = st.one_of(
    st.builds(model.AreaEmitter, shape=shapes, radiance=spectra, two_sided=st.booleans()),
    st.builds(model.AreaEmitter, shape=rectangles() | meshes(textured=True), radiance=textures(1e9)),
    st.builds(model.PointEmitter, position=vectors, intensity=spectra),
    st.builds(
        model.SpotEmitter,
        position=vectors,
        direction=directions,
        intensity=spectra,
        beam_width=st.floats(0.1, 40),
        cutoff_angle=st.floats(40.5, 89),
    ),
)
distant = st.one_of(
    st.builds(model.DirectionalEmitter, direction=directions, irradiance=spectra),
    st.builds(model.ConstantEmitter, radiance=spectra),
    st.builds(model.SkyEmitter, up=directions, zenith=spectra, horizon=st.none() | spectra),
    st.builds(lambda radiance, x: model.ImageEmitter(radiance=radiance, front=(x, 1.0, 0.0)), images(1e9), numbers),
)
media = st.builds(model.Medium, absorption=spectra, scattering=spectra, asymmetry=st.floats(-0.99, 0.99))


def looking(kind, **fields):
    """A camera somewhere that looks somewhere else."""
    return st.builds(
        lambda origin, offset, **more: kind(
            origin=origin, target=(origin[0] + offset, origin[1] + 1.0, origin[2]), **more
        ),
        vectors,
        st.floats(-10, 10),
        **fields,
    )


cameras = st.one_of(
    looking(model.Camera, fov_x=st.floats(0.1, 179)),
    looking(model.OrthographicCamera, width=lengths),
    st.builds(model.IrradianceMeter, surface=rectangles()),
    st.builds(model.RadianceMeter, origin=vectors, direction=directions),
)
films = st.builds(
    model.Film,
    width=st.integers(1, 16384),
    height=st.integers(1, 16384),
    filter=st.one_of(st.builds(model.BoxFilter), st.builds(model.GaussianFilter, stddev=st.floats(0.01, 2))),
)


def materials(reflectances):
    roughness, eta, exponent = st.floats(1e-4, 1), st.floats(1.01, 3), st.floats(0, 10_000)
    opaque = st.one_of(
        st.builds(model.Diffuse, reflectance=reflectances),
        st.builds(model.Mirror, reflectance=reflectances),
        st.builds(model.Conductor, eta=spectra, k=spectra),
        st.builds(model.RoughConductor, eta=spectra, k=spectra, alpha=roughness),
        st.builds(model.Phong, reflectance=reflectances, exponent=exponent),
        st.builds(model.Plastic, reflectance=reflectances, eta=eta),
    )
    clear = st.builds(model.Dielectric, eta=eta) | st.builds(model.RoughDielectric, eta=eta, alpha=roughness)
    mixed = st.builds(model.Mix, first=opaque, second=opaque, weight=st.floats(0, 1))
    return st.one_of(
        opaque,
        clear,
        mixed,
        st.builds(model.Mix, first=opaque, second=clear, weight=st.floats(0, 1)),
        st.builds(model.TwoSided, front=opaque | mixed, back=st.none() | opaque | mixed),
    )


objects = st.one_of(
    st.builds(model.Object, shape=shapes | instances(), material=materials(albedos)),
    st.builds(
        model.Object,
        shape=st.one_of(rectangles(), meshes(textured=True), instances(textured=True)),
        material=materials(textures(1)),
    ),
)
scenes = st.builds(
    lambda near, far, **parts: Scene(emitters=(*near, *far), **parts),
    objects=st.lists(objects, max_size=3).map(tuple),
    near=st.lists(emitters, max_size=3),
    far=st.lists(distant, max_size=1),
    camera=cameras,
    film=films,
) | st.builds(
    Scene,
    emitters=st.lists(emitters, max_size=2).map(tuple),
    medium=media,
    camera=cameras,
    film=films,
)
