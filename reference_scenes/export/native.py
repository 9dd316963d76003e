"""The native format: the scene model itself as JSON."""

from __future__ import annotations

from pathlib import Path

from reference_scenes import model


def write(scene: model.Scene, path: Path) -> None:
    """Write the scene as JSON; `reference_scenes.loading.load_scene` reads it back unchanged."""
    path.write_text(scene.model_dump_json(indent=1) + "\n", encoding="utf-8")
