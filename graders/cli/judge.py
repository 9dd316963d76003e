"""`oracle judge`."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

from graders import wording
from graders.cli.console import output, print_table
from graders.cli.scenes import family_named
from graders.decoding import BadImage, read_image
from graders.errors import UsageError
from graders.grading import case_of, judge_images
from graders.result import EvidenceResult
from graders.rubric import CaseOfRubric, Rubric
from graders.submission import OUTPUTS
from oracle.statistics import Verdict


def run_judge(images: tuple[Path, ...], scene: str, seed: int, tolerance: float, encoding: str, as_json: bool) -> str:
    """Judge images of one scene and print what was found; return the verdict."""
    family = family_named(scene)
    if math.isnan(tolerance):
        raise UsageError("--tolerance nan is no number")
    wanted = CaseOfRubric(family=family.name, tolerance=tolerance)
    detectable = max(Rubric.model_fields["detectable_bias"].default, 4 * tolerance)
    rubric = Rubric(name="judge", tolerance=tolerance, detectable_bias=min(detectable, 1.0), cases=(wanted,))
    case = case_of(wanted, rubric, seed)
    film = case.scene.film
    outputs = [path.suffix.lower().removeprefix(".") for path in images]
    for path, output_format in zip(images, outputs, strict=True):
        if not path.exists():
            raise UsageError(f"{path}: no such file")
        if output_format not in OUTPUTS:
            raise UsageError(f"{path}: format {output_format!r} is none of {', '.join(OUTPUTS)}")
        if (output_format == "png") != (encoding == "srgb"):
            raise UsageError(f"{path}: --encoding srgb is for PNG, which needs it, and for nothing else")
    try:
        decoded = [
            read_image(path, output_format, film.width, film.height)
            for path, output_format in zip(images, outputs, strict=True)
        ]
    except BadImage as error:
        if as_json:
            print(json.dumps({"verdict": Verdict.UNGRADABLE, "reason": str(error), "evidence": None}, indent=1))
        else:
            print(f"oracle: ungradable: {error}", file=sys.stderr)
        return Verdict.UNGRADABLE

    # Of several formats, the coarsest says how exact the images can be.
    evidence = judge_images(case, decoded, "hdr" if "hdr" in outputs else outputs[0])
    reason, data = wording.reason(evidence), EvidenceResult.of(evidence)
    if as_json:
        document = {"verdict": evidence.verdict, "reason": reason, "evidence": data.model_dump(mode="json")}
        print(json.dumps(document, indent=1))
        return evidence.verdict
    console = output()
    console.print(f"{evidence.verdict}: {reason}", markup=False)
    rows = [
        (name, f"{100 * ratio.estimate:.3f} %", f"{100 * ratio.low:.3f} % ... {100 * ratio.high:.3f} %")
        for name, ratio in data.ratios.items()
    ]
    print_table(console, ("channel", "observed / expected", "99 % interval"), rows)
    for assumption in data.assumptions:
        console.print(f"assumed: {assumption}", markup=False)
    return evidence.verdict
