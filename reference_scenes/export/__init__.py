"""Scenes in the formats that renderers read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from reference_scenes import model
from reference_scenes.export import mitsuba3, native
from reference_scenes.export.errors import CannotExport

__all__ = ["FORMATS", "CannotExport", "Format", "export"]


@dataclass(frozen=True)
class Format:
    """A scene format: its name, the main file's name, and what writes it (with its meshes) into a directory."""

    name: str
    filename: str
    write: Callable[[model.Scene, Path], None]


FORMATS: dict[str, Format] = {
    format_.name: format_
    for format_ in (
        Format("json", "scene.json", native.write),
        Format("mitsuba3", "scene.xml", mitsuba3.write),
    )
}


def export(scene: model.Scene, format_name: str, directory: Path) -> Path:
    """Write a scene into `directory` (made if needed) under a neutral name; return its main file.

    Raises
    ------
    CannotExport
        If the format cannot say the scene; the message names the field.
    """
    chosen = FORMATS[format_name]
    directory.mkdir(parents=True, exist_ok=True)
    chosen.write(scene, directory / chosen.filename)
    return directory / chosen.filename
