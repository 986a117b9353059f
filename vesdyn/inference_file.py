"""The file of an inference: unknowns with priors, cases that depend on them, data; read, checked and frozen.

configs/inference/ holds examples, whose comments say what each key means.
"""

import copy
import csv
import itertools
import os
import re
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from vesdyn import plain_yaml
from vesdyn.case_file import LARGEST_FILE, load_case
from vesdyn.errors import CaseError
from vesdyn.files import check_regular
from vesdyn.quantities import COLUMNS, Formula, Quantity
from vesdyn.refusals import printable_path

MOST_TIMES = 200  # of a measured curve: each is emulated
Range = float | tuple[float, float]


class _Section(BaseModel):
    """Frozen; unknown keys are refused, `2%` is 0.02."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Unknown(_Section):
    """A key of the cases whose value is asked for, between ``low`` and ``high``."""

    low: float
    high: float
    prior: Literal["log-uniform", "uniform"] = "log-uniform"

    @model_validator(mode="after")
    def _is_range(self):
        if not self.low < self.high or (self.prior == "log-uniform" and self.low <= 0):
            raise ValueError(f"{self.low:g} to {self.high:g} is no range of a {self.prior} prior; order or shift it")
        return self

    def value(self, place):
        """Values at the ``place`` in [0, 1], on which the prior is even."""
        if self.prior == "uniform":
            return self.low + place * (self.high - self.low)
        return self.low * (self.high / self.low) ** place

    def place(self, value):
        """Place in [0, 1] of a value."""
        if self.prior == "uniform":
            return (value - self.low) / (self.high - self.low)
        return np.log(value / self.low) / np.log(self.high / self.low)

    def density(self, value):
        """Prior density of a value, zero outside of the range."""
        inside = (value >= self.low) & (value <= self.high)
        if self.prior == "uniform":
            return inside / (self.high - self.low)
        return inside / (np.abs(value) * np.log(self.high / self.low))


class Scene(_Section):
    """A case file, what is ``set`` in it, and by how much an unknown is multiplied in it (``times``)."""

    file: str
    set: dict = {}
    times: dict[str, float] = {}


class Datum(_Section):
    """What is known of a ``value``, a formula of quantities, or of a curve (``file``) of a ``case``."""

    claim: str
    figure: str | int = ""
    says: str = ""
    value: str | list[str] | None = None
    printed: float | None = None
    error: float = Field(0.0, ge=0)
    to: float | None = Field(None, gt=0)
    legend: float | None = Field(None, gt=0)
    above: Range | None = None
    below: Range | None = None
    file: str | None = None
    case: str | None = None
    column: Literal[COLUMNS] = "binding_area"
    when: dict[str, str] = {}

    @model_validator(mode="after")
    def _of_one_kind(self):
        kinds = [kind for kind in ("printed", "above", "below", "file") if getattr(self, kind) is not None]
        if len(kinds) != 1:
            raise ValueError(f"{self.claim}: give one of printed, above, below and file")
        if (self.value is None) != (self.file is not None) or (self.case is None) != (self.file is None):
            raise ValueError(f"{self.claim}: give a value, or else the file of a curve and its case")
        threshold = self.above if self.above is not None else self.below
        if isinstance(threshold, tuple) and not 0 < threshold[0] < threshold[1]:
            raise ValueError(f"{self.claim}: the threshold's range {threshold} must be positive and increase")
        return self


class Design(_Section):
    """How many points fill the space, refine it and are checked, and at which accuracy wishes."""

    points: int = Field(64, ge=8)
    refined: int = Field(16, ge=0)
    checks: int = Field(4, ge=0)
    accuracy: float = Field(0.02, ge=1e-4, le=0.2)
    checked_at: float = Field(0.005, ge=1e-4, le=0.2)
    seed: int = 0


class Variant(_Section):
    """Another choice of what the data do not say, by which the answer is tried: what is not given stays as it is.

    ``without`` names claims that are left out, ``thresholds`` the end of their ranges at which all thresholds are.
    """

    name: str
    model_error: Range | None = None
    slip: float | None = Field(None, ge=0, lt=1)
    thresholds: Literal["low", "high"] | None = None
    without: list[str] = []
    unknowns: dict[str, Unknown] = {}


class Specification(_Section):
    """The keys of an inference file."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._=-]*$")
    unknowns: dict[str, Unknown] = Field(min_length=1)
    cases: dict[str, Scene] = Field(min_length=1)
    data: list[Datum] = Field(min_length=1)
    readings: dict[str, list[str]] = {}
    model_error: Range = 0.0
    slip: float = Field(0.0, ge=0, lt=1)
    design: Design = Design()
    variants: list[Variant] = []


class Term(NamedTuple):
    """One factor of the likelihood: what is known of the value of a formula, or of any of several."""

    claim: str
    figure: str
    says: str
    formulas: tuple  # of `Formula`
    printed: float | None
    error: float  # of reading or measuring it
    to: float | None  # what it was rounded to
    legend: float | None  # distance of the levels of a scale of which it is the top
    above: tuple | None  # ends of a threshold's range
    below: tuple | None
    when: dict  # the readings under which it counts


class Inference:
    """An inference file, read and checked: its ``name``, ``unknowns``, ``readings``, ``terms`` and ``quantities``.

    Raises CaseError with a sentence for each fault.
    """

    def __init__(self, path):
        self.path = Path(path)
        given = _specification(self.path)
        self.name, self.unknowns, self.scenes, self.design = given.name, given.unknowns, given.cases, given.design
        self.readings, self.slip, self.variants = given.readings, given.slip, tuple(given.variants)
        self.model_error = _range(given.model_error)
        self._check(given.data)
        self.terms = tuple(term for datum in given.data for term in self._terms(datum))
        every = (q for term in self.terms for formula in term.formulas for q in formula.quantities)
        self.quantities = tuple(dict.fromkeys(every))

    @property
    def claims(self):
        """Names of the claims in the order of the file."""
        return tuple(dict.fromkeys(term.claim for term in self.terms))

    @property
    def combinations(self):
        """Every combination of the readings, a dict of kind and reading each."""
        return [dict(zip(self.readings, some)) for some in itertools.product(*self.readings.values())]

    def with_terms(self, terms):
        """The same inference with other data, `Term`s of the same quantities."""
        other = copy.copy(self)
        other.terms = tuple(terms)
        return other

    def varied(self, variant):
        """The same inference with the choices of a ``variant``, but for the claims that it leaves out."""
        other, terms = copy.copy(self), self.terms
        if variant.thresholds is not None:
            end = ("low", "high").index(variant.thresholds)
            ends = [{side: (limits[end], limits[end]) for side in ("above", "below") if (limits := getattr(term, side))}
                    for term in terms]  # fmt: skip
            terms = tuple(term._replace(**changed) for term, changed in zip(terms, ends))
        other.terms, other.unknowns = terms, {**self.unknowns, **variant.unknowns}
        if variant.model_error is not None:
            other.model_error = _range(variant.model_error)
        if variant.slip is not None:
            other.slip = variant.slip
        return other

    def values(self, places):
        """Values (..., n_unknowns) of the unknowns at ``places`` (..., n_unknowns) in [0, 1]."""
        return np.stack([u.value(places[..., k]) for k, u in enumerate(self.unknowns.values())], axis=-1)

    def places(self, values):
        """Places in [0, 1] of ``values`` (..., n_unknowns)."""
        return np.stack([u.place(values[..., k]) for k, u in enumerate(self.unknowns.values())], axis=-1)

    def settings(self, name, values):
        """What is changed in the file of the case ``name`` where the unknowns have ``values``: key to value."""
        scene = self.scenes[name]
        unknowns = {k: float(f"{v * scene.times.get(k, 1.0):.8g}") for k, v in zip(self.unknowns, values)}
        return {**scene.set, **unknowns}

    def case(self, name, settings, accuracy):
        """The case ``name`` with ``settings`` and a wish of ``accuracy``. Raises CaseError."""
        changes = {**settings, "accuracy": accuracy}
        overrides = [f"{key}={_on_one_line(value)}" for key, value in changes.items()]
        return load_case(self.path.parent / self.scenes[name].file, overrides)

    def _check(self, data):
        """Raise CaseError where names do not fit together or a case cannot be read."""
        faults = []
        for name, scene in self.scenes.items():
            if not name.isidentifier():
                faults.append(f"cases: {name} is no name for a formula; use letters, digits and _.")
            if unknown := set(scene.times) - set(self.unknowns):
                faults.append(f"cases: {name}: times: {', '.join(sorted(unknown))} is no unknown; leave it out.")
        for datum in data:
            for kind, reading in datum.when.items():
                if reading not in self.readings.get(kind, ()):
                    faults.append(f"data: {datum.claim}: when: there is no reading {kind}: {reading}; see readings.")
            if datum.case is not None and datum.case not in self.scenes:
                faults.append(f"data: {datum.claim}: there is no case {datum.case}; see cases.")
        for variant in self.variants:
            for key, other in variant.unknowns.items():
                own = self.unknowns.get(key)
                if own is None or other.low < own.low or other.high > own.high:
                    faults.append(f"variants: {variant.name}: {key} must be an unknown, its range within that of the prior.")
            for claim in set(variant.without) - {datum.claim for datum in data}:
                faults.append(f"variants: {variant.name}: without: there is no claim {claim}; see data.")
        if not faults:
            middle = self.values(np.full(len(self.unknowns), 0.5))
            for name in self.scenes:
                try:
                    self.case(name, self.settings(name, middle), self.design.accuracy)
                except CaseError as error:
                    faults.append(f"cases: {name}: {error}")
        if faults:
            raise CaseError("\n".join(f"{self.path}: {fault}" for fault in faults))

    def _terms(self, datum):
        common = {"claim": datum.claim, "figure": str(datum.figure), "says": datum.says, "when": datum.when}
        if datum.file is None:
            formulas = datum.value if isinstance(datum.value, list) else [datum.value]
            try:
                formulas = tuple(Formula(text, self.scenes) for text in formulas)
            except CaseError as error:
                raise CaseError(f"{self.path}: data: {datum.claim}: {error}") from None
            limits = {kind: _range(getattr(datum, kind)) for kind in ("above", "below")}
            return [Term(formulas=formulas, printed=datum.printed, error=datum.error, to=datum.to,
                         legend=datum.legend, **limits, **common)]  # fmt: skip
        columns = () if datum.column == "binding_area" else (datum.column,)
        return [
            Term(formulas=(Formula.of(Quantity("at", datum.case, (float(time), *columns))),), printed=value, error=error,
                 to=None, legend=None, above=None, below=None, **common)
            for time, value, error in read_measured(self.path.parent / datum.file)
        ]  # fmt: skip


def read_held(inference, texts):
    """Unknowns and the values at which they are held, from ``texts`` of the form key=value. Raises CaseError."""
    held = {}
    for text in texts:
        key, _, value = text.partition("=")
        try:
            held[key] = float(value)
            place = inference.unknowns[key].place(held[key])
        except KeyError:
            raise CaseError(f"--hold {text}: no unknown; there are {', '.join(inference.unknowns)}.") from None
        except ValueError:
            raise CaseError(f"--hold {text}: not of the form key=number; write for instance --hold drag=0.07.") from None
        if not 0.0 <= place <= 1.0:
            raise CaseError(f"--hold {text}: outside of the prior's range; give a value inside.")
    if len(held) == len(inference.unknowns):
        raise CaseError("--hold: nothing is left to infer; leave one unknown free.")
    return held


def read_measured(path):
    """Rows (time [a0^2/D], value, standard error) of a CSV file with these columns. Raises CaseError."""
    try:
        lines = _contents(path).decode("utf-8-sig").splitlines()
        rows = [tuple(float(row[key]) for key in ("time", "value", "error")) for row in csv.DictReader(lines)]
    except CaseError:
        raise
    except OSError as error:
        raise CaseError(f"{path}: {error.strerror}; give the path of a CSV file.") from None
    except (KeyError, TypeError, ValueError, csv.Error):
        raise CaseError(f"{path}: not a curve; give a CSV file with the columns time, value and error.") from None
    if not 0 < len(rows) <= MOST_TIMES:
        raise CaseError(f"{path}: {len(rows)} times; give 1 to {MOST_TIMES}, thinned out if need be.")
    if not all(np.isfinite(row).all() and row[0] > 0 and row[2] > 0 for row in rows):
        raise CaseError(f"{path}: not a curve; times and errors must be positive numbers.")
    return rows


def _specification(path):
    try:
        raw = plain_yaml.read(_contents(path), printable_path(path))
    except OSError as error:
        raise CaseError(f"{printable_path(path)}: {error.strerror}; give the path of an inference file.") from None
    if not isinstance(raw, dict):
        raise CaseError(f"{path}: not a mapping of keys to values; configs/inference/ has examples.")
    try:
        return Specification.model_validate(_without_percents(raw))
    except ValidationError as error:
        sentences = (f"{'.'.join(map(str, e['loc']))}: {e['msg'].removeprefix('Value error, ')}" for e in error.errors())
        raise CaseError("\n".join(f"{path}: {sentence}; correct it." for sentence in sentences)) from None


def _contents(path):
    """The bytes of the regular file ``path``; raise CaseError where it is larger than an input may be."""
    check_regular(path)
    if os.path.getsize(path) > LARGEST_FILE:
        raise CaseError(f"{printable_path(path)}: has more than {LARGEST_FILE:,} bytes; give a smaller file.")
    return path.read_bytes()


def _without_percents(raw):
    """``raw`` with `2%` as 0.02, except inside what is set in a case."""
    if isinstance(raw, dict):
        return {key: value if key == "set" else _without_percents(value) for key, value in raw.items()}
    if isinstance(raw, list):
        return [_without_percents(value) for value in raw]
    if isinstance(raw, str) and (number := re.fullmatch(r"\s*(\d+\.?\d*)\s*%\s*", raw)):
        return float(number[1]) / 100.0
    return raw


def _range(limits):
    """Two ends of ``limits``, which are given as one number or as two; None where there are none."""
    return limits if limits is None or isinstance(limits, tuple) else (limits, limits)


def _on_one_line(value):
    return plain_yaml.write(value, width=float("inf"), flow=True).strip()
