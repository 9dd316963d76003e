"""Who is graded: `submission.toml`, which says how to build and how to render."""

from __future__ import annotations

import re
import stat
from pathlib import Path
from typing import Annotated, Literal, Self, TypeVar

from pydantic import AfterValidator, Field, model_validator

from graders.processes import one_line, printable
from reference_scenes.export import FORMATS
from reference_scenes.loading import InvalidFile, read_toml, suggest, validate
from reference_scenes.model import Model

T = TypeVar("T")

FILENAME = "submission.toml"
OUTPUTS = ("exr", "pfm", "hdr", "png")
RENDER_PLACEHOLDERS = ("source", "build", "scene", "output", "spp", "seed", "width", "height")
BUILD_PLACEHOLDERS = ("source", "build")

# A submission.toml is a page, whoever wrote it.
_LARGEST = 1 << 20


def _require_plain(text: str) -> str:
    if printable(text.encode()) != text or "\n" in text or "\t" in text:
        raise ValueError("is not one line of plain text")
    return text


def _require_placeholders(arguments: tuple[str, ...], allowed: tuple[str, ...]) -> None:
    for argument in arguments:
        if "\0" in argument:
            raise ValueError("has a NUL character, which no program can be given")
        for name in re.findall(r"{([^{}]*)}", argument):
            if name not in allowed:
                raise ValueError(f"has no placeholder to fill in for {{{name}}}; {suggest(name, list(allowed))}")


def _require_some(values: tuple[T, ...]) -> tuple[T, ...]:
    if not values:
        raise ValueError("is empty; at least one is needed")
    return values


def _require_build_command(command: tuple[str, ...]) -> tuple[str, ...]:
    _require_placeholders(command, BUILD_PLACEHOLDERS)
    return command


def _require_render_command(command: tuple[str, ...]) -> tuple[str, ...]:
    _require_placeholders(command, RENDER_PLACEHOLDERS)
    for needed in ("{scene}", "{output}"):
        if not any(needed in argument for argument in command):
            raise ValueError(f"never mentions {needed}")
    return command


def _require_pattern(pattern: str) -> str:
    _require_placeholders((pattern,), ("case",))
    parts = Path(pattern).parts
    if "{case}" not in pattern:
        raise ValueError("never mentions {case}")
    if Path(pattern).is_absolute() or ".." in parts:
        raise ValueError("leaves the submission's folder")
    if any("**" in part and part != "**" for part in parts):
        raise ValueError("has ** beside something else; it stands for whole folders")
    return pattern


def _require_function(name: str) -> str:
    if not re.fullmatch(r"[^\W\d][\w.]*:[^\W\d]\w*", name):
        raise ValueError("is not MODULE:FUNCTION")
    return name


def _require_format(name: str) -> str:
    if name not in FORMATS:
        raise ValueError(f"is no scene format; {suggest(name, list(FORMATS))}")
    return name


Command = Annotated[tuple[Annotated[str, Field(min_length=1)], ...], AfterValidator(_require_some)]
BuildCommand = Annotated[Command, AfterValidator(_require_build_command)]
RenderCommandLine = Annotated[Command, AfterValidator(_require_render_command)]


class Build(Model):
    """Commands that build the submission, run in its source folder before the first image."""

    commands: Annotated[tuple[BuildCommand, ...], AfterValidator(_require_some)]
    timeout: Annotated[float, Field(gt=0, le=3600)] = 300.0


class _Render(Model):
    output: Literal["exr", "pfm", "hdr", "png"]
    encoding: Literal["linear", "srgb"] = "linear"

    @model_validator(mode="after")
    def _encoding_fits(self) -> Self:
        if self.output == "png" and self.encoding != "srgb":
            raise ValueError('png holds sRGB values: declare encoding = "srgb", or write exr, pfm or hdr')
        if self.output != "png" and self.encoding != "linear":
            raise ValueError(f'{self.output} holds linear radiance: leave encoding = "srgb" to png')
        return self


class RenderCommand(_Render):
    """A program that reads a scene and writes an image, once for each seed."""

    command: RenderCommandLine


class RenderPython(_Render):
    """A Python function ``render(scene, output, spp, seed, width, height)`` that writes an image."""

    callable: Annotated[str, AfterValidator(_require_function)]


class RenderImages(_Render):
    """Images that exist already; `{case}` in the pattern is the case's name."""

    images: Annotated[str, AfterValidator(_require_pattern)]


class _Submission(Model):
    name: Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_require_plain)]
    scene_format: Annotated[str, AfterValidator(_require_format)] = "json"


class CommandSubmission(_Submission):
    """A program, built first if it needs that."""

    kind: Literal["command"]
    build: Build | None = None
    render: RenderCommand


class PythonSubmission(_Submission):
    """A Python function, called in a process of its own."""

    kind: Literal["python"]
    render: RenderPython


class ImagesSubmission(_Submission):
    """Images without a renderer."""

    kind: Literal["images"]
    render: RenderImages


Submission = CommandSubmission | PythonSubmission | ImagesSubmission

_KINDS: dict[str, type[CommandSubmission] | type[PythonSubmission] | type[ImagesSubmission]] = {
    "command": CommandSubmission,
    "python": PythonSubmission,
    "images": ImagesSubmission,
}


def load_submission(path: Path) -> tuple[Submission, Path]:
    """Read a submission from its folder or its file; return it with the folder.

    Raises
    ------
    InvalidFile
        If there is none or it is not valid.
    """
    file = path / FILENAME if path.is_dir() else path
    _require_small_file(file)
    try:
        data = read_toml(file)
    except InvalidFile:
        raise
    except ValueError as error:
        # A number with thousands of digits is TOML, but too much for Python.
        raise InvalidFile(f"{file}: not TOML: {one_line(str(error))}") from None
    if "kind" not in data:
        raise InvalidFile(f"{file}: /kind is missing; known: {', '.join(_KINDS)}")
    kind = data["kind"]
    if not isinstance(kind, str) or kind not in _KINDS:
        shown = one_line(repr(kind))[:80]
        raise InvalidFile(f"{file}: /kind: {shown} is no kind of submission; {suggest(str(kind), list(_KINDS))}")
    return validate(data, _KINDS[kind], str(file)), file.parent.resolve()


def _require_small_file(file: Path) -> None:
    """Keep a pipe without a writer, or a device without an end, from stopping the grading of a class."""
    try:
        status = file.stat()
    except OSError as error:
        raise InvalidFile(f"{file}: {error.strerror}") from None
    if not stat.S_ISREG(status.st_mode):
        raise InvalidFile(f"{file}: not a regular file")
    if status.st_size > _LARGEST:
        raise InvalidFile(f"{file}: {status.st_size} bytes are too many")
