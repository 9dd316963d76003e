"""Renders the middle of the floor of a room under a lamp, and of a furnace.

Prints both, with the files of Embree and TBB that it runs on, as JSON.
"""

import json
from pathlib import Path

from oracle import Mesh, Rectangle
from oracle.tracer import Diffuse, Film, Object, RadianceMeter, Scene, render

WHITE, RED, GREEN = (0.75, 0.7, 0.65), (0.6, 0.05, 0.05), (0.1, 0.5, 0.1)

# The walls of a room from (-1, -1, 0) to (1, 1, 2), counter-clockwise as one sees them from inside.
CORNERS = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (0, 2)]
FLOOR, CEILING = (0, 4, 6, 2), (1, 3, 7, 5)
LEFT, RIGHT, FRONT, BACK = (0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3)


def wall(corners, reflectance, radiance=None):
    mesh = Mesh([CORNERS[corner] for corner in corners], [[0, 1, 2], [0, 2, 3]])
    return Object(mesh, Diffuse(reflectance), radiance)


def floor(objects, **how):
    """The radiance of the middle of the floor, seen from above."""
    meter = RadianceMeter(origin=(0, 0, 1), direction=(0, 0, -1))
    return render(Scene(objects), meter, Film(1, 1), spp=1 << 16, seed=1, **how).mean[0, 0].tolist()


colours = {FLOOR: WHITE, CEILING: WHITE, LEFT: RED, RIGHT: GREEN, BACK: WHITE}
room = [wall(corners, colour) for corners, colour in colours.items()]
lamp = Object(Rectangle(center=(0, 0, 1.99), half_u=(0.25, 0, 0), half_v=(0, -0.25, 0)), radiance=(17, 12, 4))
furnace = [wall(corners, (0.2, 0.5, 0.8), (1, 1, 1)) for corners in (*colours, FRONT)]
rendered = {"room": floor([*room, lamp], bounces=1), "furnace": floor(furnace)}

mapped = {line.split(maxsplit=5)[-1].strip() for line in Path("/proc/self/maps").read_text().splitlines()}
libraries = sorted(path for path in mapped if Path(path).name.startswith(("libembree", "libtbb")))
print(json.dumps({**rendered, "libraries": libraries}))
