"""What a canonical family is: a law of light and the scenes that show it, one for each seed."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from reference_scenes import model


class Parameters(model.Model):
    """What distinguishes the members of a family; every field states its range and unit."""


P = TypeVar("P", bound=Parameters)


@dataclass(frozen=True)
class Family(Generic[P]):
    """A canonical family of scenes.

    Attributes
    ----------
    name : str
        How commands and rubrics call it.
    law : str
        The law it tests, in one sentence.
    concept : str
        Where the lecture treats it.
    formula : str
        The closed form of what it shows.
    source : str
        Where the formula comes from: author, year, equation.
    spp : int
        Samples per pixel and image that suit it.
    parameters : type
        Model of its parameters with their ranges.
    draw : callable
        Draws parameters from a random generator.
    build : callable
        Makes the scene of given parameters.
    """

    name: str
    law: str
    concept: str
    formula: str
    source: str
    spp: int
    parameters: type[P]
    draw: Callable[[np.random.Generator], P]
    build: Callable[[P], model.Scene]

    def member(self, seed: int) -> model.Scene:
        """The scene that `seed` draws; the same seed gives the same scene on every machine."""
        return self.build(self.draw(self.generator(seed)))

    def generator(self, seed: int) -> np.random.Generator:
        """Random numbers of one member, independent between families and seeds."""
        digest = hashlib.sha256(f"{self.name}/{seed}".encode()).digest()
        return np.random.Generator(np.random.PCG64(int.from_bytes(digest[:16], "little")))
