"""SI in and out: the scales of a scene, and what a quantity such as ``6 uN/m`` is in the units of the model.

The model knows lengths in a0 (the initial diameter), times in a0^2/D, energies in kT and densities in c_r0 (Liu et al.
2007, section 2). A case that gives these scales under ``units`` may give any other key as a quantity; pint reads it.
"""

import functools
import re
from typing import NamedTuple

import numpy as np

from vesdyn.errors import CaseError
from vesdyn.refusals import printable, shown

_SCALE = {  # of `units`: what the scale stands for in units of the model, its dimension, and an example
    "diameter": ("a0", "length", "10 um"),
    "diffusivity": ("D", "area per time", "0.01 um^2/s"),
    "temperature": ("K", "temperature", "298 K"),
    "receptor_density": ("c_r0", "number per area", "1000/um^2"),
}
_SI = {"a0": "m", "D": "m^2/s", "K": "K", "c_r0": "1/m^2", "kT": "J"}
_EXAMPLE = {
    "a0": "20 nm",
    "a0^2/D": "2 h",
    "kT/a0^2": "6 uN/m",
    "kT/a0^3": "50 Pa",
    "kT D^-1 a0^-2": "1e6 Pa*s/m",
}
_PREFERRED = {  # dimension, as pint writes it: unit of SI, and handy ones, the largest first
    "[length]": ("m", ("mm", "um", "nm")),
    "[length] ** 2": ("m^2", ("mm^2", "um^2", "nm^2")),
    "[time]": ("s", ("d", "h", "min", "s", "ms")),
    "[mass] / [time] ** 2": ("N/m", ("N/m", "mN/m", "uN/m", "nN/m")),
    "[mass] / [length] / [time] ** 2": ("Pa", ("MPa", "kPa", "Pa", "mPa")),
    "[mass] * [length] ** 2 / [time] ** 2": ("J", ("J", "nJ", "pJ", "fJ", "aJ", "zJ")),
    "1 / [length] ** 2": ("1/m^2", ("1/um^2",)),
    "[mass] / [length] ** 2 / [time]": ("Pa*s/m", ("GPa*s/m", "MPa*s/m", "kPa*s/m", "Pa*s/m")),
}
_QUANTITY = re.compile(  # a number, then a space, a slash or two letters at least: 0x10 and 1e are none
    r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)(?:\s+(?=[^\W\d_]|[/°])|(?=/)|(?=[^\W\d_]{2}))(.{1,40}?)\s*"
)
_UNIT = re.compile(r"(1?\s*/)?\s*[^\W\d]+[\s\w^*/·²³⁻¹°-]*")
_MODEL_UNIT = re.compile(r"[ /]*(?:(?:a0|D|kT|c_r0)(?:\^-?\d)?[ /]*)+")


class Quantity(float):
    """A number in units of the model with the ``text`` that it was given as."""

    text: str

    def __new__(cls, value, text):
        number = super().__new__(cls, value)
        number.text = text
        return number

    def __reduce__(self):
        return Quantity, (float(self), self.text)


class Scales(NamedTuple):
    """What one unit of the model is, in SI."""

    diameter: float  # a0 [m]
    diffusivity: float  # D [m^2/s]
    temperature: float  # [K]
    receptor_density: float | None = None  # c_r0 [1/m^2]

    def of(self, unit: str) -> tuple[float, str] | None:
        """One ``unit`` of the model ("a0^2/D") as (number, SI unit); None where a scale is not given, or it is none."""
        if not is_model_unit(unit) or ("c_r0" in unit and self.receptor_density is None):
            return None
        quantity = self._quantity(unit)
        name = _si(quantity)
        return float(quantity.m_as(_parsed(name))), name

    def in_si(self, unit: str) -> str:
        """One ``unit`` of the model as text, "1e-10 m^2"; empty as for `of`."""
        found = self.of(unit)
        return f"{found[0]:.12g} {found[1]}" if found else ""

    def shown(self, value: float, unit: str) -> str | None:
        """The ``value`` [unit of the model] in a handy unit of SI, as "67.1 um^2"; None as for `of`."""
        if self.of(unit) is None:
            return None
        name = self.preferred(unit, value)
        number = (value * self._quantity(unit)).m_as(_parsed(name))
        return f"{number:.4g}{name[1:] if name.startswith('1/') else f' {name}'}"

    def preferred(self, unit: str, value: float) -> str:
        """Unit of SI in which ``value`` [unit of the model] is a handy number."""
        quantity = abs(value) * self._quantity(unit)
        _, names = _PREFERRED.get(str(quantity.dimensionality), ("", (_si(quantity),)))
        return next((name for name in names if quantity.m_as(_parsed(name)) >= 1.0), names[-1])

    def to(self, values: np.ndarray, unit: str, wanted: str) -> np.ndarray:
        """The ``values`` [unit of the model] in the unit ``wanted``, "um^2"; raise CaseError where it is no such unit."""
        if self.of(unit) is None:
            raise CaseError(f"{shown(unit)}: has no scale here; give it under units, or take the numbers as they are.")
        try:
            return np.asarray(values) * float(self._quantity(unit).m_as(_parsed(wanted)))
        except CaseError:
            raise
        except Exception:
            raise CaseError(f"{shown(wanted)}: is no unit for {printable(unit)}; take one such as {self.of(unit)[1]}.") from None

    def _quantity(self, unit):
        registry = _registry()
        scale = {
            "a0": self.diameter * registry.meter,
            "D": self.diffusivity * registry.meter**2 / registry.second,
            "kT": self.temperature * registry.kelvin * registry.boltzmann_constant,
            "c_r0": (self.receptor_density or np.nan) / registry.meter**2,
        }
        quantity, sign = registry.Quantity(1.0), 1
        for part in re.findall(r"/|\w+(?:\^-?\d)?", unit):
            if part == "/":
                sign = -1
                continue
            name, _, power = part.partition("^")
            quantity, sign = quantity * scale[name] ** (sign * int(power or 1)), 1
        return quantity


def beside(value: float, unit: str, scales: Scales | None) -> str:
    """The ``value`` [unit of the model] in SI behind an equals sign, " = 67.1 um^2"; empty where there is no scale for it."""
    told = scales.shown(value, unit) if scales else None
    return f" = {told}" if told else ""


def is_model_unit(unit: str) -> bool:
    """Whether ``unit`` is made of a0, D, kT and c_r0, as those of `vesdyn.diagnostics.COLUMNS` are."""
    return _MODEL_UNIT.fullmatch(unit) is not None


def unit_of(description: str) -> str | None:
    """Unit of the model that stands in brackets in the ``description`` of a key; None where none does."""
    return next((unit for unit in re.findall(r"\[([^\[\]]+)\]", description) if is_model_unit(unit)), None)


def is_quantity(value: object) -> bool:
    """Whether ``value`` is text that begins as a quantity does, a number and a unit."""
    return isinstance(value, str) and _QUANTITY.fullmatch(value) is not None


def scale(key: str, text: str | None) -> float:
    """The scale ``key`` of `units` in SI; raise CaseError, a sentence that begins with ``text``, where it is none."""
    symbol, dimension, example = _SCALE[key]
    if text is None:
        raise CaseError(f"missing; give it, such as {example}.")
    if not isinstance(text, str):
        raise CaseError(f"{shown(text)} has no unit; write a number and a unit, such as {example}.")
    value = _converted(text, _registry().Quantity(1.0, _parsed(_SI[symbol])), f"a {dimension}", example)
    if not 0.0 < value < float("inf"):
        raise CaseError(f"{shown(text)} is out of range; it must be greater than 0.")
    return value


def in_model_units(text: str, unit: str, scales: Scales) -> Quantity:
    """The quantity ``text`` in the ``unit`` of the model.

    A drag may be given as a viscosity, which is that of the drag times a0. Raises CaseError, a sentence that begins
    with ``text``, where it is no quantity of that dimension or a scale is missing.
    """
    example = _EXAMPLE.get(unit, "1")
    if scales.of(unit) is None:
        raise CaseError(f"{shown(text)} needs the scale of {unit}; give units.receptor_density: 1000/um^2.")
    one = scales._quantity(unit)
    if unit == "kT D^-1 a0^-2" and _has_dimension(text, one * scales._quantity("a0")):
        one = one * scales._quantity("a0")
    return Quantity(_converted(text, one, f"a quantity that is measured in {_si(one)}", example), text)


def _converted(text, one, what, example):
    """How many times ``one`` (a quantity) the ``text`` is."""
    found = _QUANTITY.fullmatch(text)
    if not found:
        raise CaseError(f"{shown(text)} is no quantity; write a number and a unit, such as {example}.")
    try:
        given = _registry().Quantity(float(found[1]), _parsed(found[2])).to_base_units()
        value = float(f"{(given / one.to_base_units()).m_as(''):.15g}")  # 50 nm of 10 um are 0.005
    except CaseError:
        raise
    except Exception:  # whatever pint makes of it
        raise CaseError(f"{shown(text)} is not {what}; write one such as {example}.") from None
    return value


def _has_dimension(text, one):
    found = _QUANTITY.fullmatch(text)
    try:
        return bool(found) and _parsed(found[2]).dimensionality == one.dimensionality
    except CaseError:
        return False


def _parsed(text):
    """The unit of ``text``; raise CaseError where there is none of that name."""
    plain = text.strip().replace("·", "*")
    if not _UNIT.fullmatch(plain) or re.search(r"(\^|\*\*)\s*-?\d\d", plain):
        raise CaseError(f"{shown(text)} is no unit; write one such as um, N/m or 1/um^2.")
    try:
        return _registry().parse_units(f"1{plain}" if plain.startswith("/") else plain)
    except Exception:  # pint's own, and those of Python's tokenizer
        raise CaseError(f"{shown(text)} is no unit; write one such as um, N/m or 1/um^2.") from None


def _si(quantity):
    """Name of the unit of SI for a ``quantity`` of that dimension."""
    name, _ = _PREFERRED.get(str(quantity.dimensionality), (f"{quantity.to_base_units().units:~C}".replace("**", "^"), ()))
    return name


@functools.cache
def _registry():
    """Pint's registry of units, read when it is first needed."""
    import pint

    registry = pint.UnitRegistry(autoconvert_offset_to_baseunit=True, cache_folder=None)
    return registry
