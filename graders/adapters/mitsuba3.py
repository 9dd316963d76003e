"""Mitsuba 3 as a submission: a real renderer that is not ours."""

from __future__ import annotations


def render(scene: str, output: str, spp: int, seed: int, width: int, height: int) -> None:
    """Render a Mitsuba XML file with the variant scalar_rgb to EXR."""
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    loaded = mitsuba.load_file(scene)
    image = mitsuba.render(loaded, spp=spp, seed=seed)
    mitsuba.Bitmap(image).write(output)
