"""Reading files into models, with errors that name the file, the field, the value and what is allowed."""

from __future__ import annotations

import difflib
import json
import tomllib
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from reference_scenes.model import Scene

M = TypeVar("M", bound=BaseModel)


class InvalidFile(ValueError):
    """A file that cannot be used; its message is one line."""


def load_scene(path: Path) -> Scene:
    """Read a scene from native JSON.

    Raises
    ------
    InvalidFile
        If the file cannot be read or is not a scene.
    """
    return load_json(path, Scene)


def load_json(path: Path, kind: type[M]) -> M:
    """Read a model from a JSON file; errors as for `load_scene`."""
    try:
        data = json.loads(_read(path))
    except json.JSONDecodeError as error:
        raise InvalidFile(f"{path}: line {error.lineno}, column {error.colno}: not JSON: {error.msg}") from None
    except RecursionError:
        raise InvalidFile(f"{path}: nested too deeply") from None
    return validate(data, kind, str(path))


def load_toml(path: Path, kind: type[M]) -> M:
    """Read a model from a TOML file; errors as for `load_scene`."""
    return validate(read_toml(path), kind, str(path))


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file as plain data; errors as for `load_scene`."""
    try:
        return tomllib.loads(_read(path))
    except tomllib.TOMLDecodeError as error:
        raise InvalidFile(f"{path}: not TOML: {error}") from None
    except RecursionError:
        raise InvalidFile(f"{path}: nested too deeply") from None


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InvalidFile(f"{path}: byte {error.start} is not UTF-8") from None
    except OSError as error:
        raise InvalidFile(f"{path}: {error.strerror or error}") from None


def validate(data: Any, kind: type[M], source: str) -> M:
    """Make a model of plain data.

    Raises
    ------
    InvalidFile
        Naming `source`, the JSON pointer of the first offending field, its value and what is allowed.
    """
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        # Several complaints often have one cause: an unknown key explains a missing one.
        details = sorted(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
        more = f" (and {len(details) - 1} more)" if len(details) > 1 else ""
        raise InvalidFile(f"{source}: {_explain(details[0], data, kind)}{more}") from None


def suggest(word: str, known: list[str]) -> str:
    """What the writer of an unknown word may have meant."""
    close = difflib.get_close_matches(word, known, n=1)
    return f"did you mean {close[0]!r}?" if close else f"known: {', '.join(known)}"


def _explain(error: ErrorDetails, data: Any, kind: type[BaseModel]) -> str:
    pointer, parent = _pointer(error["loc"], data)
    match error["type"]:
        case "missing":
            return f"{pointer} is missing"
        case "extra_forbidden":
            key = str(error["loc"][-1])
            allowed = sorted(_keys_at(error["loc"], data, kind))
            return f"{pointer} is not a known key; {suggest(key, allowed)}"
        case "union_tag_invalid" | "union_tag_not_found":
            tags = error.get("ctx", {}).get("expected_tags", "")
            found = parent.get("type") if isinstance(parent, dict) else None
            return f"{pointer}/type: {_shown(found)} is none of {tags or 'the known types'}"
        case "value_error":
            message = str(error["ctx"]["error"])
            return f"{pointer}: {_shown(error['input'])} {message}" if _is_small(error["input"]) else f"{pointer}: {message}"
        case _:
            message = error["msg"][0].lower() + error["msg"][1:]
            return f"{pointer}: {_shown(error['input'])}: {message}"


def _pointer(location: tuple[int | str, ...], data: Any) -> tuple[str, Any]:
    """JSON pointer of an error and the value there; pydantic's names of union members are left out."""
    parts: list[str] = []
    current = data
    for index, part in enumerate(location):
        last = index == len(location) - 1
        if isinstance(current, dict) and part in current:
            current = current[part]
        elif isinstance(current, list | tuple) and isinstance(part, int) and part < len(current):
            current = current[part]
        elif not last:
            continue
        elif isinstance(current, dict) and current.get("type") == part:
            continue
        parts.append(str(part).replace("~", "~0").replace("/", "~1"))
    return "/" + "/".join(parts), current


def _keys_at(location: tuple[int | str, ...], data: Any, kind: type[BaseModel]) -> set[str]:
    """The keys that the model knows beside an unknown one."""
    candidates: list[Any] = [kind]
    current = data
    for part in location[:-1]:
        current = current[part] if isinstance(current, dict) and part in current else current
        found: list[Any] = []
        for candidate in candidates:
            if isinstance(candidate, type) and issubclass(candidate, BaseModel):
                if isinstance(part, str) and part in candidate.model_fields:
                    found += _models_in(candidate.model_fields[part].annotation)
                else:
                    found.append(candidate)
        tagged = [c for c in found if "type" in c.model_fields and c.model_fields["type"].default == part]
        candidates = tagged or found
    return {field.alias or name for c in candidates for name, field in c.model_fields.items()}


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for argument in get_args(annotation) for found in _models_in(argument)]


def _is_small(value: Any) -> bool:
    return len(repr(value)) <= 80


def _shown(value: Any) -> str:
    """A value in an error message: short, and on one line."""
    text = json.dumps(value, default=repr, ensure_ascii=True) if not isinstance(value, float) else repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
