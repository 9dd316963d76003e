"""Writes what the documentation takes from the code: the JSON Schemas and the page of families.

``make generate`` runs it; a test fails while what is there differs.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, Field, TypeAdapter

from graders.result import Result
from graders.rubric import Rubric
from graders.submission import Submission
from oracle.truth import AnyCase
from reference_scenes.families import FAMILIES
from reference_scenes.model import Scene
from reference_scenes.references import About

HERE = Path(__file__).parent


def generated() -> dict[Path, str]:
    """Every generated file and what it should hold."""
    kinds = {
        "scene": Scene,
        "submission": Submission,
        "rubric": Rubric,
        "result": Result,
        "reference": About,
        "truth": Annotated[list[AnyCase], Field(title="Cases")],
    }
    files = {HERE / "schema" / f"{name}.schema.json": _schema(kind) for name, kind in kinds.items()}
    files[HERE / "families.md"] = _families()
    return files


def _schema(kind: type[BaseModel] | object) -> str:
    adapter: TypeAdapter[object] = TypeAdapter(kind)
    document = {"$schema": "https://json-schema.org/draft/2020-12/schema", **adapter.json_schema()}
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


def _families() -> str:
    lines = [
        "# Families",
        "",
        "Each canonical scene is a family: a seed draws one member, with its camera, sizes, colours and positions. The",
        "same seed gives the same member everywhere. All expectations are closed forms, exact for any number of",
        "bounces, as nothing but the receiver reflects. `oracle scenes show NAME --seed N` prints what a seed draws.",
    ]
    for family in FAMILIES.values():
        document = (family.parameters.__doc__ or "").strip()
        lines += [
            "",
            f"## {family.name}",
            f"**{family.law}**",
            "",
            document,
            "",
            f"- Lecture: {family.concept}",
            f"- Formula: `{family.formula}`",
            f"- Source: {family.source}",
            f"- Samples per pixel and image: {family.spp}",
        ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    for path, text in generated().items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
