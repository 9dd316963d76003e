"""The quantities of light, radiometric and photometric, and values whose unit is checked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.arrays import Floats, InvalidArgument, finite, replace
from oracle.radiometry.units import Unit


@dataclass(frozen=True)
class Quantity:
    """A physical quantity with its name, its symbol, and its SI unit as text."""

    name: str
    symbol: str
    unit: str


RADIANT_ENERGY = Quantity("radiant energy", "Q", "J")
FLUX = Quantity("flux", "Phi", "W")
INTENSITY = Quantity("intensity", "I", "W/sr")
IRRADIANCE = Quantity("irradiance", "E", "W/m^2")
EXITANCE = Quantity("exitance", "M", "W/m^2")
RADIOSITY = Quantity("radiosity", "B", "W/m^2")
RADIANCE = Quantity("radiance", "L", "W/(m^2 sr)")

LUMINOUS_ENERGY = Quantity("luminous energy", "Q_v", "lm s")
LUMINOUS_FLUX = Quantity("luminous flux", "Phi_v", "lm")
LUMINOUS_INTENSITY = Quantity("luminous intensity", "I_v", "cd")
ILLUMINANCE = Quantity("illuminance", "E_v", "lx")
LUMINOUS_EMITTANCE = Quantity("luminous emittance", "M_v", "lm/m^2")
LUMINOSITY = Quantity("luminosity", "B_v", "lm/m^2")
LUMINANCE = Quantity("luminance", "L_v", "cd/m^2")

# In the same order: each quantity and its photometric counterpart.
RADIOMETRIC = (RADIANT_ENERGY, FLUX, INTENSITY, IRRADIANCE, EXITANCE, RADIOSITY, RADIANCE)
PHOTOMETRIC = (
    *(LUMINOUS_ENERGY, LUMINOUS_FLUX, LUMINOUS_INTENSITY, ILLUMINANCE, LUMINOUS_EMITTANCE, LUMINOSITY, LUMINANCE),
)


@dataclass(frozen=True, eq=False)
class Measure:
    """A number or an array of any shape with its unit, such as ``Measure([1, 2, 3], "W/(m^2 sr)")``."""

    value: Floats
    unit: str

    def __post_init__(self) -> None:
        Unit.parse(self.unit)
        replace(self, value=finite("value", self.value))

    def has_unit_of(self, quantity: Quantity) -> bool:
        """Whether it could be a value of this quantity; irradiance, exitance and radiosity share one unit."""
        return Unit.parse(self.unit).like(Unit.parse(quantity.unit))

    def of(self, quantity: Quantity, name: str = "measure") -> Floats:
        """Return the value in the SI unit of a quantity, right to an ulp.

        Raises
        ------
        InvalidArgument
            If the unit belongs to another quantity; `name` is what the message calls the value.
        """
        if not self.has_unit_of(quantity):
            raise InvalidArgument(f"{name} has the unit {self.unit}; {quantity.name} is in {quantity.unit}")
        exponent = Unit.parse(self.unit).exponent - Unit.parse(quantity.unit).exponent
        # Powers of ten are exact in float64, their inverses are not.
        scaled = self.value * 10.0**exponent if exponent >= 0 else self.value / 10.0**-exponent
        return finite(name, np.asarray(scaled))
