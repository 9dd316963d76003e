"""Who is graded: `submission.toml`, which says how to build and how to render."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from reference_scenes.export import FORMATS
from reference_scenes.loading import InvalidFile, read_toml, validate
from reference_scenes.model import Model

FILENAME = "submission.toml"
OUTPUTS = ("exr", "pfm", "hdr", "png")
RENDER_PLACEHOLDERS = ("source", "build", "scene", "output", "spp", "seed", "width", "height")
BUILD_PLACEHOLDERS = ("source", "build")

Argument = Annotated[str, Field(min_length=1)]
Command = Annotated[tuple[Argument, ...], Field(min_length=1)]


def _require_placeholders(command: tuple[str, ...], allowed: tuple[str, ...]) -> None:
    for argument in command:
        for name in re.findall(r"{([^{}]*)}", argument):
            if name not in allowed:
                raise ValueError(f"{{{name}}} in {argument!r} is not a placeholder; known: {', '.join(allowed)}")


class Build(Model):
    """Commands that build the submission, run in its source folder before the first image."""

    commands: Annotated[tuple[Command, ...], Field(min_length=1)]
    timeout: Annotated[float, Field(gt=0, le=3600)] = 300.0

    @model_validator(mode="after")
    def _placeholders_exist(self) -> Self:
        for command in self.commands:
            _require_placeholders(command, BUILD_PLACEHOLDERS)
        return self


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

    command: Command

    @model_validator(mode="after")
    def _placeholders_exist(self) -> Self:
        _require_placeholders(self.command, RENDER_PLACEHOLDERS)
        whole = " ".join(self.command)
        for needed in ("{scene}", "{output}"):
            if needed not in whole:
                raise ValueError(f"the command never mentions {needed}")
        return self


class RenderPython(_Render):
    """A Python function ``render(scene, output, spp, seed, width, height)`` that writes an image."""

    callable: Annotated[str, Field(pattern=r"^[A-Za-z_][\w.]*:[A-Za-z_]\w*$")]


class RenderImages(_Render):
    """Images that exist already; `{case}` in the pattern is the case's name."""

    images: Annotated[str, Field(min_length=1)]

    @model_validator(mode="after")
    def _stays_inside(self) -> Self:
        if "{case}" not in self.images:
            raise ValueError("the pattern never mentions {case}")
        if Path(self.images).is_absolute() or ".." in Path(self.images).parts:
            raise ValueError("the pattern leaves the submission's folder")
        return self


class _Submission(Model):
    name: Annotated[str, Field(min_length=1, max_length=200)]
    scene_format: str = "json"

    @model_validator(mode="after")
    def _format_exists(self) -> Self:
        if self.scene_format not in FORMATS:
            raise ValueError(f"scene_format {self.scene_format!r} is none of {', '.join(FORMATS)}")
        return self


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
    data = read_toml(file)
    kind = data.get("kind")
    if kind not in _KINDS:
        raise InvalidFile(f"{file}: /kind: {kind!r} is none of {', '.join(_KINDS)}")
    return validate(data, _KINDS[kind], str(file)), file.parent.resolve()
