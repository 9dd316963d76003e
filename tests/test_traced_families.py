"""The reference tracer before the judge, as any renderer, but for a tolerance of 0.05 %."""

import numpy as np
import pytest

from oracle.statistics import judge
from oracle.statistics.evidence import Verdict
from oracle.tracer import render
from reference_scenes.closed_form import closed_form
from reference_scenes.families import FAMILIES
from reference_scenes.tracing import to_tracer

TOLERANCE = 5e-4
# Called right only if a bias of this size would have been found.
DETECTABLE = 2e-3
# For all families together; the seeds are fixed, so that this is about the choice of seeds.
ERROR_BUDGET = 1e-6
# The judge may look as often as it likes.
LOOKS = (16, 24, 32, 48)
# Where the outlines of light and shadow make noise, Sobol' points and more of them help. Where there is hardly any,
# what rounding leaves of it with such points is not independent from pixel to pixel.
SAMPLES = {"point-angle": 256, "directional": 256, "hard-shadow": 256, "rectangle-horizon": 768, "two-lights": 128}


@pytest.mark.parametrize("family", FAMILIES)
def test_the_judge_finds_the_tracer_right_in_every_closed_form_case(family):
    scene = FAMILIES[family].member(3)
    stage, expected = to_tracer(scene), closed_form(scene)
    spp = SAMPLES.get(family, 64)
    images = []
    for look in LOOKS:
        for seed in range(len(images), look):
            images.append(render(*stage, spp=spp, seed=seed, sampler="independent" if spp == 64 else "sobol").mean)
        evidence = judge(expected, np.array(images), TOLERANCE, ERROR_BUDGET / len(FAMILIES), DETECTABLE)
        if evidence.verdict is not Verdict.UNDECIDED:
            break
    assert evidence.verdict is Verdict.RIGHT, evidence
