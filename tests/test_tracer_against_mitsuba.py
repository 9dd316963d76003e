"""The tracer and Mitsuba show the same where no closed form says what is right.

Mitsuba's images were rendered once, by `second_opinion.py`, to a fraction of what would be seen; everything here is
seeded, so that the outcome is the same every time. Blocks of 8 x 8 pixels and the image as a whole are compared in each
channel by Welch's two-sample test [Welch 1947]. Of all seeds one in a thousand would fail a right tracer in any scene.
"""

import numpy as np
import pytest
import second_opinion
from scipy import stats

from oracle.tracer import render
from oracle.tracer.rendering import REPLICATES
from reference_scenes.tracing import to_tracer
from reference_scenes.without_closed_form import SCENES

# Half of the error that is allowed in all goes to the images as a whole, half to their blocks.
FAMILY_WISE = 1e-3
CHANNELS = 3
BLOCKS = 64
AS_A_WHOLE = FAMILY_WISE / 2 / (len(SCENES) * CHANNELS)
IN_A_BLOCK = FAMILY_WISE / 2 / (len(SCENES) * CHANNELS * BLOCKS)
# What is allowed for the tracer's mean of each channel, so that with Mitsuba's half a percent is seen.
WANTED = 3.5e-3
# Both render in single precision.
ROUNDING = 1e-5


def of_the_whole(image):
    """Mean of each channel over an image of the tracer, and its standard error."""
    return image.mean.mean(axis=(0, 1)), np.sqrt(image.variance.mean(axis=(0, 1)) / image.mean[..., 0].size)


def freedom_of(image):
    """Degrees of freedom of the standard error of an image's mean."""
    return (REPLICATES - 1) * image.mean[..., 0].size


def compare(mean, error, freedom, other_mean, other_error, other_freedom, level):
    """Difference in units of what is allowed, and that, of means whose errors have so many degrees of freedom."""
    a, b = np.square(error), np.square(other_error)
    with np.errstate(invalid="ignore", divide="ignore"):
        together = np.nan_to_num((a + b) ** 2 / (a**2 / freedom + b**2 / other_freedom), nan=1.0)
    allowed = stats.t.isf(level / 2, together) * np.sqrt(a + b) + ROUNDING * np.abs(other_mean)
    return np.abs(mean - other_mean) / np.maximum(allowed, 1e-300), allowed


@pytest.fixture(scope="module")
def traced():
    """Renderings of the tracer, made once each."""
    made = {}

    def of(name):
        if name not in made:
            scene = to_tracer(SCENES[name]())
            # A first look, with samples that are not used otherwise, tells how many it takes.
            first = render(*scene, spp=64 if scene[2].width > 1 else 1 << 17, seed=0)
            mean, error = of_the_whole(first)
            allowed = stats.t.isf(AS_A_WHOLE / 2, freedom_of(first)) * error
            more = max(1, np.ceil((allowed / mean / WANTED).max() ** 2))
            made[name] = render(*scene, spp=int(more) * first.spp, seed=1)
        return made[name]

    return of


@pytest.mark.parametrize("name", SCENES)
def test_mitsuba_s_images_are_of_the_scene_as_it_is(name):
    assert second_opinion.load(name).scene == second_opinion.identity(name), "run `make second-opinion`"


@pytest.mark.parametrize("name", SCENES)
def test_the_mean_of_the_image_agrees(traced, name):
    other, image = second_opinion.load(name), traced(name)
    mean, error = of_the_whole(image)
    ratio, allowed = compare(mean, error, freedom_of(image), other.mean, other.error, other.renderings - 1, AS_A_WHOLE)
    assert ratio.max() < 1, f"{mean} differs from {other.mean}"
    # And half a percent of difference would not have been allowed.
    assert (allowed / mean).max() < 5e-3


@pytest.mark.parametrize("name", SCENES)
def test_all_parts_of_the_image_agree(traced, name):
    other, image = second_opinion.load(name), traced(name)
    means = second_opinion.blocks(image.mean)
    pixels = image.mean.size // means.size
    errors = np.sqrt(second_opinion.blocks(image.variance) / pixels)
    by_mitsuba = np.array(other.blocks), np.array(other.block_errors), other.renderings - 1
    ratio, _ = compare(means, errors, (REPLICATES - 1) * pixels, *by_mitsuba, IN_A_BLOCK)
    assert ratio.max() < 1, f"block {np.unravel_index(ratio.argmax(), ratio.shape)}"


@pytest.mark.parametrize("name", SCENES)
def test_mitsuba_still_shows_what_it_showed(name):
    pytest.importorskip("mitsuba")
    other = second_opinion.load(name)
    spp = 4 if SCENES[name]().film.width > 1 else 2048
    mean, error = second_opinion.summary(second_opinion.renderings(name, spp, range(8)).mean(axis=(1, 2)))
    ratio, _ = compare(mean, error, 7, other.mean, other.error, other.renderings - 1, AS_A_WHOLE)
    assert ratio.max() < 1, f"{mean} differs from {other.mean}"
