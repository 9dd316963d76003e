"""Files beside the scene: meshes and images, written last, so that a scene that is refused leaves none."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from oracle.arrays import Floats
from reference_scenes import model
from reference_scenes.export.ply import write_ply
from reference_scenes.images import write_exr


@dataclass
class Files:
    """Meshes and images under neutral names."""

    meshes: list[model.Mesh] = field(default_factory=list)
    images: list[Floats] = field(default_factory=list)

    def mesh(self, mesh: model.Mesh) -> str:
        """Note a mesh; return its file's name."""
        self.meshes.append(mesh)
        return f"mesh_{len(self.meshes) - 1}.ply"

    def image(self, texels: Floats) -> str:
        """Note an image of shape (H, W, 3); return its file's name."""
        self.images.append(texels)
        return f"image_{len(self.images) - 1}.exr"

    def write(self, folder: Path) -> None:
        """Write all of them."""
        for index, mesh in enumerate(self.meshes):
            write_ply(mesh, folder / f"mesh_{index}.ply")
        for index, texels in enumerate(self.images):
            write_exr(folder / f"image_{index}.exr", texels)
