"""Binary PLY files of triangle meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from reference_scenes import model


def write_ply(mesh: model.Mesh, path: Path) -> None:
    """Write a mesh (float32) with its triangles (int32) as little-endian binary PLY 1.0.

    Vertices have their position, then unit normals and texture coordinates if the mesh has them.
    """
    columns = {"x y z": np.array(mesh.vertices)}
    if mesh.normals is not None:
        normals = np.array(mesh.normals)
        columns["nx ny nz"] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    if mesh.uv is not None:
        columns["u v"] = np.array(mesh.uv)
    vertices = np.concatenate(list(columns.values()), axis=1).astype("<f4")
    properties = "".join(f"property float {name}\n" for name in " ".join(columns).split())
    faces = np.empty(len(mesh.triangles), dtype=[("count", "u1"), ("indices", "<i4", 3)])
    faces["count"] = 3
    faces["indices"] = mesh.triangles
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\n{properties}"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    path.write_bytes(header.encode("ascii") + vertices.tobytes() + faces.tobytes())
