"""Binary PLY files of triangle meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from reference_scenes import model


def write_ply(mesh: model.Mesh, path: Path) -> None:
    """Write positions (float32) and triangles (int32) as little-endian binary PLY 1.0."""
    vertices = np.array(mesh.vertices, dtype="<f4")
    faces = np.empty(len(mesh.triangles), dtype=[("count", "u1"), ("indices", "<i4", 3)])
    faces["count"] = 3
    faces["indices"] = mesh.triangles
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    path.write_bytes(header.encode("ascii") + vertices.tobytes() + faces.tobytes())
