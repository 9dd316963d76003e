"""What hides what: exact penumbrae, shadow rays and the edges of shadows."""

from __future__ import annotations

from oracle.visibility.conics import ConicShadow, conic_shadow
from oracle.visibility.occlusion import visible
from oracle.visibility.penumbra import visible_projected_solid_angle
from oracle.visibility.shadow_edges import Shadow, polygon_shadow

__all__ = ["ConicShadow", "Shadow", "conic_shadow", "polygon_shadow", "visible", "visible_projected_solid_angle"]
