"""What ``from oracle import ...`` gives, and that occluders reach the right closed form."""

import subprocess
import sys

import numpy as np
import pytest

import oracle
from oracle import Area, Constant, Directional, Disk, Line, Mesh, Point, Receivers, Rectangle, Sphere, irradiance
from oracle.arrays import InvalidArgument

FLOOR = Receivers([[0, 0, 0], [0, 0, 0.5]], [0, 0, 1])
LAMP = Rectangle([0, 0, 2], [0, 0.5, 0], [0.5, 0, 0])
# Above the first receiver and below the second.
SHADE = Rectangle([0, 0, 0.25], [1, 0, 0], [0, 1, 0])


@pytest.mark.parametrize("name", oracle.__all__)
def test_every_public_name_is_there(name):
    assert getattr(oracle, name).__module__.startswith("oracle.")


def test_a_public_function_is_never_hidden_by_a_module_of_its_name():
    # Modules are loaded in this order by other parts of the project.
    statement = (
        "import oracle.irradiances, oracle.vector_irradiances, oracle.solid_angles, oracle.visibility, oracle\n"
        "print(callable(oracle.irradiance) and callable(oracle.solid_angle) and callable(oracle.vector_irradiance))"
    )
    finished = subprocess.run([sys.executable, "-c", statement], capture_output=True, text=True, check=True)
    assert finished.stdout.strip() == "True"


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'oracle' has no attribute 'illuminance'"):
        oracle.illuminance  # noqa: B018


@pytest.mark.parametrize(
    "light", [Point([0, 0, 2], [1.0, 2.0]), Directional([0, 0, -1], [1.0, 2.0]), Area(LAMP, [1.0, 2.0])]
)
def test_an_occluder_hides_the_light_from_what_is_behind_it(light):
    open_sky, shaded = irradiance(light, FLOOR), irradiance(light, FLOOR, [SHADE])
    assert (open_sky.value > 0).all()
    np.testing.assert_array_equal(shaded.value[0], 0)
    np.testing.assert_allclose(shaded.value[1], open_sky.value[1], rtol=1e-14)


def test_several_emitters_are_hidden_each_on_its_own():
    point = Point([0, 0, 0.1], [1.0])
    together = irradiance([point, Area(LAMP, [1.0])], FLOOR, [SHADE])
    # The point is below the shade, the lamp above.
    np.testing.assert_allclose(together.value[0], irradiance(point, FLOOR).value[0], rtol=1e-14)


def test_a_mesh_hides_its_own_parts_if_it_is_an_occluder():
    roof = Mesh(
        [[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1], [-1, -1, 2], [1, -1, 2], [1, 1, 2], [-1, 1, 2]],
        [[0, 2, 1], [0, 3, 2], [4, 6, 5], [4, 7, 6]],
    )
    below = Receivers([0.1, 0.2, 0], [0, 0, 1])
    lower = Mesh(roof.vertices[:4], roof.triangles[:2])
    expected = irradiance(Area(lower, [1.0]), below)
    np.testing.assert_allclose(irradiance(Area(roof, [1.0]), below, [roof]).value, expected.value, rtol=1e-13)
    assert irradiance(Area(roof, [1.0]), below).value > 1.2 * expected.value


@pytest.mark.parametrize(
    ("light", "kind"),
    [
        (Area(Disk([0, 0, 2], [0, 0, -1], 1), [1.0]), "Disk"),
        (Area(Sphere([0, 0, 2], 1), [1.0]), "Sphere"),
        (Line([0, 0, 2], [1, 0, 2], [1.0]), "Line"),
        (Constant([1.0]), "Constant"),
    ],
)
def test_a_light_without_a_closed_form_past_occluders_is_refused(light, kind):
    with pytest.raises(InvalidArgument, match=f"^occluders: no closed form for a {kind} past occluders"):
        irradiance(light, FLOOR, [SHADE])


@pytest.mark.parametrize(
    ("emitters", "message"),
    [
        ([], "emitter is an empty sequence"),
        ([Point([0, 0, 2], [1.0]), 3], "emitter[1] is a int, not one of oracle.emitters"),
        ([Point([0, 0, 2], [1.0]), Constant([1.0, 2.0])], "emitter[1] has 2 channels, emitter[0] has 1"),
    ],
)
def test_a_sequence_that_cannot_shine_together_is_refused(emitters, message):
    with pytest.raises(InvalidArgument) as caught:
        irradiance(emitters, FLOOR)
    assert str(caught.value) == message
