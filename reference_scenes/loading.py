"""Reading files into models, with errors that name the file, the field, the value and what is allowed."""

from __future__ import annotations

import difflib
import json
import tomllib
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from reference_scenes.images import read_texels
from reference_scenes.model import Scene

M = TypeVar("M", bound=BaseModel)


class InvalidFile(ValueError):
    """A file that cannot be used; its message is one line."""


def load_scene(path: Path) -> Scene:
    """Read a scene from native JSON, with the images it names, which lie in its folder.

    Raises
    ------
    InvalidFile
        If the file or an image cannot be read or is not a scene.
    """
    return validate(_read_json(path), Scene, str(path), {"read_texels": partial(read_texels, path.parent)})


def load_json(path: Path, kind: type[M]) -> M:
    """Read a model from a JSON file; errors as for `load_scene`."""
    return validate(_read_json(path), kind, str(path))


def _read_json(path: Path) -> Any:
    text = _read(path)
    try:
        return json.loads(text, object_pairs_hook=_without_repetition)
    except json.JSONDecodeError as error:
        raise InvalidFile(f"{path}: line {error.lineno}, column {error.colno}: not JSON: {error.msg}") from None
    except _RepeatedKey as error:
        raise InvalidFile(f"{path}: an object names the key {_shown(error.args[0])} twice") from None
    except RecursionError:
        raise InvalidFile(f"{path}: nested too deeply") from None
    except ValueError:
        # The only other complaint of the parser.
        raise InvalidFile(f"{path}: not JSON: a number has too many digits") from None


class _RepeatedKey(ValueError):
    """An object that names a key twice: one of the two values would be ignored."""


def _without_repetition(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, value in pairs:
        if key in result:
            raise _RepeatedKey(key)
        result[key] = value
    return result


def load_toml(path: Path, kind: type[M]) -> M:
    """Read a model from a TOML file; errors as for `load_scene`."""
    return validate(read_toml(path), kind, str(path))


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file as plain data; errors as for `load_scene`."""
    text = _read(path)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InvalidFile(f"{path}: not TOML: {error}") from None
    except RecursionError:
        raise InvalidFile(f"{path}: nested too deeply") from None
    except ValueError:
        # A number with thousands of digits is TOML, but too much for Python.
        raise InvalidFile(f"{path}: not TOML: a number has too many digits") from None


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InvalidFile(f"{path}: byte {error.start} is not UTF-8") from None
    except OSError as error:
        raise InvalidFile(f"{path}: {error.strerror or error}") from None


def validate(data: Any, kind: type[M], source: str, context: dict[str, Any] | None = None) -> M:
    """Make a model of plain data; `context` is what its validators need to know beyond the data.

    Raises
    ------
    InvalidFile
        Naming `source`, the JSON pointer of the first offending field, its value and what is allowed.
    """
    try:
        return kind.model_validate(data, context=context)
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
    pointer, parent = _pointer(error["loc"], data, error["type"] == "missing")
    value = error["input"]
    match error["type"]:
        case "missing":
            return f"{pointer} is missing"
        case "extra_forbidden":
            key = str(error["loc"][-1])
            allowed = sorted({alias for model in _models_at(error["loc"][:-1], data, kind) for alias in _keys(model)})
            return f"{pointer} is not a known key; {suggest(key, allowed)}"
        case "union_tag_invalid" | "union_tag_not_found" if isinstance(parent, dict):
            tags = [model.model_fields["type"].default for model in _models_at(error["loc"], data, kind)]
            if "type" not in parent:
                return f"{pointer}/type is missing; known: {', '.join(tags)}"
            found = parent["type"]
            meant = suggest(found if isinstance(found, str) else "", tags)
            return f"{pointer}/type: {_shown(found)} is not a known type; {meant}"
        case "model_type" | "model_attributes_type" | "union_tag_not_found":
            return f"{pointer}: {_shown(value)} is not an object"
        case "value_error":
            message = str(error["ctx"]["error"])
            return f"{pointer}: {_shown(value)} {message}" if _is_small(value) else f"{pointer}: {message}"
        case _:
            message = error["msg"][0].lower() + error["msg"][1:]
            return f"{pointer}: {_shown(value)}: {message}"


def _pointer(location: tuple[int | str, ...], data: Any, last_is_missing: bool) -> tuple[str, Any]:
    """JSON pointer of an error and the value there; pydantic's names of union members are left out."""
    parts: list[str] = []
    current = data
    for index, part in enumerate(location):
        if _has(current, part):
            current = current[part]
        elif not (last_is_missing and index == len(location) - 1):
            continue
        parts.append(_printable(str(part)).replace("~", "~0").replace("/", "~1"))
    return "/" + "/".join(parts), current


def _has(container: Any, part: int | str) -> bool:
    if isinstance(container, list | tuple):
        return isinstance(part, int) and part < len(container)
    return isinstance(container, dict) and part in container


def _models_at(location: tuple[int | str, ...], data: Any, kind: type[BaseModel]) -> list[type[BaseModel]]:
    """The models that an object at a location may be: one, or those of a union whose member is not known."""
    candidates = [kind]
    for part in location:
        fields = [model.model_fields[part] for model in candidates if part in model.model_fields]
        tagged = [
            model for model in candidates if "type" in model.model_fields and model.model_fields["type"].default == part
        ]
        if fields:
            candidates = [model for field in fields for model in _models_in(field.annotation)]
        elif tagged:
            candidates = tagged
    return candidates


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for argument in get_args(annotation) for found in _models_in(argument)]


def _keys(model: type[BaseModel]) -> set[str]:
    return {field.alias or name for name, field in model.model_fields.items()}


def _is_small(value: Any) -> bool:
    try:
        return len(repr(value)) <= 80
    except RecursionError:
        return False


def _shown(value: Any) -> str:
    """A value in an error message: short, and on one line."""
    try:
        text = json.dumps(value, default=repr, ensure_ascii=True) if not isinstance(value, float) else repr(value)
    except RecursionError:
        text = "(nested too deeply to be shown)"
    return text if len(text) <= 80 else text[:77] + "..."


def _printable(text: str) -> str:
    """Text with line breaks, control characters and lone surrogates written as escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape", "surrogatepass").decode("ascii") for c in text)
