"""`oracle scenes`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from graders.cli.console import output, print_table
from graders.errors import UsageError
from reference_scenes.closed_form import NoClosedForm, require_closed_form
from reference_scenes.export import FORMATS, export
from reference_scenes.families import FAMILIES
from reference_scenes.families.family import Family
from reference_scenes.loading import InvalidFile, load_scene, suggest


def family_named(name: str) -> Family[Any]:
    """The family of that name; raises UsageError with a suggestion."""
    if name not in FAMILIES:
        raise UsageError(f"there is no scene {name!r}; {suggest(name, list(FAMILIES))}")
    return FAMILIES[name]


def run_list(as_json: bool) -> None:
    """Print all families."""
    if as_json:
        print(json.dumps([_description(family) for family in FAMILIES.values()], indent=1))
        return
    rows = [(family.name, family.law) for family in FAMILIES.values()]
    print_table(output(), ("name", "law"), rows)


def _description(family: Family[Any]) -> dict[str, Any]:
    return {
        "name": family.name,
        "law": family.law,
        "concept": family.concept,
        "formula": family.formula,
        "source": family.source,
        "spp": family.spp,
        "expectation": "closed form",
        "formats": list(FORMATS),
    }


def run_show(name: str, seed: int, as_json: bool) -> None:
    """Print one family and the parameters that a seed draws."""
    family = family_named(name)
    parameters = family.draw(family.generator(seed)).model_dump(mode="json")
    if as_json:
        scene = family.member(seed).model_dump(mode="json")
        print(json.dumps({**_description(family), "seed": seed, "parameters": parameters, "scene": scene}, indent=1))
        return
    console = output()
    for label in ("name", "law", "concept", "formula", "source", "spp"):
        console.print(f"{label + ':':<9} {_description(family)[label]}", markup=False)
    print_table(console, ("parameter", f"seed {seed}"), [(key, json.dumps(value)) for key, value in parameters.items()])


def run_export(names: tuple[str, ...], every: bool, format_name: str, out: Path, seed: int) -> None:
    """Write members of families in one format."""
    if bool(names) == every:
        raise UsageError("give names of scenes, or --all for every one")
    if format_name not in FORMATS:
        raise UsageError(f"there is no format {format_name!r}; {suggest(format_name, list(FORMATS))}")
    chosen = list(FAMILIES.values()) if every else [family_named(name) for name in names]
    for family in chosen:
        try:
            print(export(family.member(seed), format_name, out / family.name))
        except OSError as error:
            raise UsageError(f"{out}: cannot write there: {error.strerror}") from None


def run_validate(files: tuple[Path, ...], as_json: bool) -> bool:
    """Check scene files; return whether all are valid."""
    documents = []
    for path in files:
        document: dict[str, Any] = {"file": str(path), "valid": True, "error": None, "closed_form": True, "hint": None}
        try:
            require_closed_form(load_scene(path))
        except InvalidFile as error:
            document.update(valid=False, error=str(error), closed_form=None)
        except NoClosedForm as error:
            document.update(closed_form=False, hint=str(error))
        documents.append(document)
    if as_json:
        print(json.dumps(documents, indent=1))
    else:
        for document in documents:
            if document["error"]:
                print(f"oracle: {document['error']}", file=sys.stderr)
            else:
                hint = f"; no closed form: {document['hint']}" if document["hint"] else ""
                print(f"{document['file']}: valid{hint}")
    return all(document["valid"] for document in documents)
