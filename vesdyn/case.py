"""A case: everything that decides what a run computes, validated once and frozen.

The keys are the public interface; each is declared once, below, with its default, its limits and its unit.
Units: length a0 (initial diameter), time a0^2/D, energy kT, receptor density c_r0 (initial density).

A key that is not given has a default, and a default gives way to what is given: the frames of the default end where
the run does, a default step is no longer than the run, a default edge is no coarser than the other one. On a meridian
edges and step that are not given are `auto`. Of keys given at several levels (`--set`, file, base) the more specific
one wins, also where it contradicts another key of a less specific level. How files are read: `vesdyn.case_file`.
"""

import hashlib
import json
import math
import os
import re
import stat
import warnings
from typing import Annotated, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainValidator,
    TypeAdapter,
    ValidationError,
    model_validator,
)
from pydantic_core import PydanticCustomError

from vesdyn import plain_yaml, units
from vesdyn.budget import TOLERANCE_PER_ACCURACY
from vesdyn.errors import CaseError
from vesdyn.refusals import joined, number, printable, printable_path, refusals, shown, suggestion

Auto = Literal["auto"]
SAME_TIME = 1e-9  # relative: times no further apart are one
_LEAST = 1e-15  # what is neither 0 nor as large as this is a slip, and its products underflow
_NODES_A_WAVE = 4, 10  # of a perturbation about the axis: that the mesh must have, and should have
_MANY_STEPS = 1_000_000
_MOST_FRAMES = 1_000
_FLATTEST, _LONGEST = 0.1, 10.0  # equatorial over polar axis of a start shape
_THICK = 0.1  # [a0]
_LONG_STEP = 0.004  # [a0^2/D]
_SOFTEST = 1e3  # adhesion energy over shear modulus: beyond, a number is one of SI
_LATEST = 1e3  # end of a run, in times of diffusion and of drag: beyond, likewise
_FEEBLE = 1e-3  # adhesion energy over shear modulus

# The keys ------------------------------------------------------------------------------------------------


class _Section(BaseModel):
    """Frozen; unknown keys, NaN, infinities, and text or true/false in the place of numbers are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False, validate_default=True)

    def __init__(self, /, **keys):
        try:
            super().__init__(**{key: _plain(value) for key, value in keys.items()})
        except ValidationError as error:
            raise _refusal(error, str, {key: [] for key in type(self).model_fields}) from None

    __init__.__pydantic_base_init__ = True  # pydantic: as good as its own, not to be called for a section in a case

    def model_copy(self, *, update=None, deep=False):
        """Return a copy with the keys of ``update``, validated. Raises CaseError."""
        return type(self)(**({key: getattr(self, key) for key in self.model_fields_set} | (update or {})))

    def __setattr__(self, key, value=None):
        raise CaseError(f"{printable(key)}: a case cannot be changed in place; case.changed(...) makes another.")

    __delattr__ = __setattr__


def _zero_or_at_least(least):
    """A validator of numbers that are 0 or not too small."""

    def validate(value):
        if 0 < value < least:
            raise PydanticCustomError("zero_or_at_least", "0 or more", {"least": least})
        return value + 0.0  # and no negative zero

    return AfterValidator(validate)


def _at_least(least):
    """A validator of numbers above 0 that are not too small."""

    def validate(value):
        if value < least:
            raise PydanticCustomError("greater_than_equal", "at least", {"ge": least})
        return value

    return AfterValidator(validate)


def _or_auto(least, **limits):
    """A validator of numbers within ``limits``, no smaller than ``least``, and of the word auto."""
    adapter = TypeAdapter(
        Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0, **limits), _at_least(least)]
    )

    def validate(value):
        if isinstance(value, str) and value == "auto":
            return value
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise PydanticCustomError("neither_number_nor_auto", "neither a number nor auto")
        return adapter.validate_python(value)

    return PlainValidator(validate)


def _no_truth(value):
    if isinstance(value, (bool, float)):  # equal to a whole number, but none
        raise PydanticCustomError("literal_error", "a choice", {"expected": "1 or 2"})
    return value


_NoTruth = BeforeValidator(_no_truth)
NotTiny = Annotated[float, _zero_or_at_least(_LEAST)]
Instant = Annotated[float, Field(gt=0, le=1e6), _at_least(1e-9)]  # [a0^2/D]


class Membrane(_Section):
    shear_modulus: Annotated[float, Field(gt=0), _at_least(1e-9)] = Field(
        1.81, le=1e12, description="in-plane shear modulus K = G h [kT/a0^2]"
    )
    thickness: Annotated[float, _zero_or_at_least(1e-6)] = Field(
        0.01, ge=0, le=0.5, description="shell thickness h [a0], bending stiffness K h^2/3; 0: a pure membrane"
    )
    prestretch: float = Field(
        1.0, ge=1, le=10, description="stretch of the initial sphere against its stress-free state"
    )


class Adhesion(_Section):
    traction: NotTiny = Field(
        2.416, ge=0, le=1e12, description="largest traction T_max at the initial density [kT/a0^3]"
    )
    cutoff: Annotated[float, Field(gt=0), _at_least(1e-6)] = Field(
        0.1, le=1, description="gap d_c beyond which the traction vanishes [a0]"
    )
    ligand_ratio: Annotated[float, Field(gt=0), _at_least(1e-6)] = Field(
        8.0, le=1e6, description="ligands waiting for each receptor, q = c_l / c_r0"
    )
    law: Literal["linear", "double_well"] = Field(
        "linear", description="traction against gap: linear, or double_well: bonds, a barrier, a weak attraction"
    )
    well: float = Field(0.3, ge=0.01, le=0.99, description="double_well: range of the bonds [cutoff]")
    barrier: NotTiny = Field(
        0.3, ge=0, le=10, description="double_well: largest repulsion of the barrier [traction]"
    )
    tail: NotTiny = Field(0.05, ge=0, le=1, description="double_well: largest attraction beyond it [traction]")


class Ligands(_Section):
    pattern: Literal["even", "disc", "stripe", "stripes", "squares"] = Field(
        "even", description="where the ligands are: even, a disc, a stripe along y, stripes, or squares"
    )
    width: Annotated[float, Field(gt=0), _at_least(1e-6)] = Field(
        0.3, le=100, description="diameter of the disc, width of stripe or square [a0]"
    )
    period: Annotated[float, Field(gt=0), _at_least(1e-6)] = Field(
        0.6, le=100, description="distance of stripes or squares from middle to middle [a0]"
    )
    elsewhere: NotTiny = Field(
        0.0, ge=0, le=1, description="density of the ligands elsewhere, relative to that within"
    )
    blur: Annotated[float, Field(gt=0), _at_least(1e-6)] = Field(
        0.02, le=10, description="width of the border across which it changes [a0]"
    )

    @property
    def breaks_axis(self):
        return self.pattern not in ("even", "disc")

    @property
    def repeats(self):
        return self.pattern in ("stripes", "squares")


class Receptors(_Section):
    mobility: NotTiny | None = Field(
        2.1875, ge=0, le=1e9, description="mobility number; drift number = mobility x ligand_ratio"
    )
    drift_number: NotTiny | None = Field(
        None, ge=0, le=1e9, description="drift number itself, in the place of mobility"
    )
    frozen: bool = Field(False, description="true: the density stays as it is")


class Perturbation(_Section):
    mode: int = Field(
        2, ge=1, le=10**6, description="azimuthal mode m of the initial density, c = 1 + amplitude cos(m angle)"
    )
    amplitude: NotTiny = Field(0.0, ge=0, lt=1, description="its amplitude [c_r0]; 0: an even density")
    front: NotTiny = Field(
        0.0, ge=0, le=0.2, description="largest random displacement of the contact front, of its radius; 0: none"
    )
    at: Instant = Field(0.14, description="time of that displacement [a0^2/D]")
    seed: int = Field(0, ge=0, le=2**63 - 1, description="seed of its random numbers")
    restart: bool = Field(
        False, description="whether the motion begins anew at that time, as it does where the front is displaced: a control"
    )

    @property
    def restarts(self):
        return self.restart or self.front > 0

    @property
    def breaks_axis(self):
        return self.amplitude > 0 or self.front > 0


class Mesh(_Section):
    front_edge: Annotated[float | Auto, _or_auto(1e-5, le=0.5)] = Field(
        0.015, description="edge length where the membrane will touch [a0]; auto: as accuracy allows"
    )
    far_edge: Annotated[float | Auto, _or_auto(1e-5, le=0.5)] = Field(
        0.05, description="edge length far above the substrate [a0]; auto: as accuracy allows"
    )
    fine_angle: float = Field(
        80.0, ge=5, le=180, description="slope of the start shape up to which edges are those of the front [degrees]"
    )
    difficulty: float = Field(
        1.0, ge=0, le=1e6, description="error of the mesh against that in the paper's cases; auto edges: as scouts measure"
    )
    layout: Literal["scalloped", "rings", "spiral"] = Field(
        "scalloped", description="how the vertices are laid out: scalloped, rings or spiral"
    )
    axes: tuple[Annotated[float, Field(gt=0, le=1e6), _at_least(1e-6)], ...] = Field(
        (1.0, 1.0),
        strict=False,
        min_length=2,
        max_length=2,
        description="equatorial and polar axis of the start shape; only their ratio counts, [1, 1]: a sphere",
    )
    file: Annotated[str, Field(min_length=1), AfterValidator(os.path.abspath)] | None = Field(
        None, description="closed triangle mesh to start from (PLY, OBJ, STL or OFF), scaled to the volume pi/6 a0^3"
    )
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")] | None = Field(
        None, description="SHA-256 of that file; follows from it, and is stored with the run"
    )


class Time(_Section):
    end: Instant = Field(1.2, description="end of the run [a0^2/D]")
    step: Annotated[float | Auto, _or_auto(1e-9, le=1e6)] = Field(
        0.001, description="coupling step, shortened to land on the frames [a0^2/D]; auto: as accuracy allows"
    )
    order: Annotated[Literal[1, 2], _NoTruth] = Field(
        2, description="order of the coupling step; 1: the paper's staggering"
    )
    stop_when_steady: bool = Field(True, description="end the run early once nothing moves (step: auto)")


class Output(_Section):
    frames: tuple[Annotated[float, Field(le=1e6)], ...] = Field(
        (0.008, 0.044, 0.128, 0.56),
        strict=False,
        max_length=_MOST_FRAMES,
        description="times of the stored shapes, beside t = 0 [a0^2/D]; or {every: 0.01}, or {count: 50}",
    )
    checkpoint_minutes: float = Field(
        0.5, ge=0, le=1e6, description="wall time between checkpoints [min]; 0: every step"
    )


class Solver(_Section):
    tolerance: Annotated[float | Auto, _or_auto(1e-13, lt=1)] = Field(
        "auto", description="largest scaled out-of-balance force of a node; auto: 0.04 x accuracy"
    )
    method: Literal["relaxation", "newton", "auto"] = Field(
        "auto", description="how the balance is solved: relaxation, newton (axisymmetric), or auto: the faster"
    )
    damping: Literal["viscous", "kinetic"] = Field("viscous", description="damping: viscous or kinetic")
    max_iterations: int = Field(
        20000, ge=1, le=10**9, description="iterations after which a step is given up"
    )


class Units(_Section):
    diameter: str | None = Field(None, description="initial diameter a0, such as 10 um; null: no units of SI")
    diffusivity: str | None = Field(None, description="diffusivity D of the receptors, such as 0.01 um^2/s")
    temperature: str = Field("298 K", description="temperature T in kT")
    receptor_density: str | None = Field(None, description="initial density c_r0 of the receptors, such as 1000/um^2")


class Case(_Section):
    """Everything that decides what a run computes. Frozen, comparable, hashable, picklable.

    Made by `vesdyn.load_case`, by `changed`, or of keys: ``Case(name="soft", membrane={"shear_modulus": 0.3})``, in
    which dotted keys do as well: ``Case(name="soft", **{"membrane.shear_modulus": 0.3})``. Two cases are equal where
    all their values are, whether given or by default.

    Raises CaseError: a sentence a line, each with the key, what is wrong with it and what to do.
    """

    name: str = Field(
        max_length=100,
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._=-]*$",
        description="name of the case and of its directory in runs/",
    )
    model: Literal["surface", "axisymmetric", "auto"] = Field(
        "surface", description="body: surface (triangles), axisymmetric (meridian) or auto: the least that serves"
    )
    accuracy: float = Field(
        0.01, ge=1e-4, le=0.2, description="wished relative error of the binding area once it has passed a tenth of its final value; 1% or 0.01"
    )
    membrane: Membrane = Membrane()
    adhesion: Adhesion = Adhesion()
    ligands: Ligands = Ligands()
    receptors: Receptors = Receptors()
    perturbation: Perturbation = Perturbation()
    drag: NotTiny = Field(
        0.07, ge=0, le=1e12, description="drag per unit reference area [kT D^-1 a0^-2]; 0: statics at each step"
    )
    mesh: Mesh = Mesh()
    time: Time = Time()
    output: Output = Output()
    solver: Solver = Solver()
    units: Units = Units()

    def __init__(self, /, **keys):
        try:
            BaseModel.__init__(self, **in_full(keys))
        except ValidationError as error:
            raise _refusal(error, str) from None

    __init__.__pydantic_base_init__ = True  # as in _Section

    # What was given

    def given(self, key):
        """Return whether the dotted ``key`` (or any key of a section) was given, and is no default.

        Raises CaseError if there is no such key.
        """
        section, _, inner = key.partition(".")
        if section not in SECTIONS or (inner and inner not in SECTIONS[section]):
            raise CaseError(f"{printable(key)}: unknown key, {suggestion(key.split('.'), SECTIONS)}")
        if inner or SECTIONS[section]:
            given = getattr(self, section).model_fields_set
            return inner in given if inner else bool(given)
        return section in self.model_fields_set

    def given_keys(self):
        """Return the keys that were given, as nested dicts of plain values that `Case` takes; quantities as texts."""
        given = {key: value for key, value in flattened(self.resolved()).items() if self.given(key)}
        return _nested(given | self.quantities)

    def changed(self, **changes):
        """Return this case with ``changes``, dotted keys or nested dicts, over what was given; validated anew.

        What is changed wins over what was given before: a drift number over a mobility, an end over later frames
        (of which a warning tells). A section, such as ``mesh=other.mesh``, takes the place of the whole section.

        Raises CaseError.
        """
        given = {k: v for k, v in self.given_keys().items() if not isinstance(changes.get(k), _Section)}
        keys, notes = merged([given, in_full(changes)])
        for key, sentence in notes:
            warnings.warn(f"{key}: {sentence}", stacklevel=2)
        return validated(keys)

    def model_copy(self, *, update=None, deep=False):
        """Return `changed` (**update): pydantic's name for it, which here validates."""
        return self.changed(**(update or {}))

    def with_defaults(self, defaults, origin=str):
        """Return this case with ``defaults``, nested dicts of keys that were not given, in the place of ours.

        So a case that another version stored keeps what that version's defaults were. ``origin`` as for `validated`.
        Raises CaseError.
        """
        keys, _ = merged([defaults, self.given_keys()])
        case = validated(keys, origin)
        for key in SECTIONS:
            if SECTIONS[key]:
                object.__setattr__(case, key, _marked(getattr(case, key), getattr(self, key).model_fields_set))
        marked = _marked(case, self.model_fields_set)
        marked.__dict__["_given_quantities"] = self.quantities
        return marked

    # What follows from what was given

    @property
    def on_meridian(self):
        """Whether the body is a meridian, or will be once `auto` is decided."""
        return self.model == "axisymmetric" or (self.model == "auto" and not self.breaks_axis)

    @property
    def breaks_axis(self):
        """Whether the scene is not symmetric about z."""
        return self.perturbation.breaks_axis or self.ligands.breaks_axis or self.mesh.file is not None

    @model_validator(mode="wrap")
    @classmethod
    def _with_quantities(cls, keys, validate):
        """Take quantities for numbers, and keep how they were given."""
        problems = []
        keys = _in_model_units(keys, problems)
        given = _quantities(keys)
        keys = _with_listed_frames(keys, problems)
        if problems:
            raise ValueError("\n".join(problems))
        case = validate(keys)
        case.__dict__["_given_quantities"] = given
        return case

    def get(self, key):
        """The value of the dotted ``key``."""
        section, _, inner = key.partition(".")
        return getattr(getattr(self, section), inner) if inner else getattr(self, section)

    @property
    def quantities(self):
        """What was given as quantities, text by dotted key; lists, and frames that were not listed, as they were given."""
        return self.__dict__.get("_given_quantities", {})

    @property
    def scales(self):
        """The `vesdyn.units.Scales` of the case; None where it gives none."""
        return _scales(dict(self.units), [])

    @model_validator(mode="after")
    def _consistent(self):
        """Let defaults give way to what is given, and check what concerns several keys at once."""
        problems = []
        values = {}
        values |= self._edges(problems)
        values |= self._start_shape(problems)
        values |= self._times(problems)
        values |= self._drift(problems)
        values |= self._pattern(problems)
        self._check_method(problems)
        self._check_perturbation(problems)
        if problems:
            raise ValueError("\n".join(problems))
        for section in dict.fromkeys(key.partition(".")[0] for key in values):
            new = {k.partition(".")[2]: v for k, v in values.items() if k.startswith(f"{section}.")}
            object.__setattr__(self, section, _with(getattr(self, section), new))
        return self

    def _edges(self, problems):
        front, far = self.mesh.front_edge, self.mesh.far_edge
        front_given, far_given = self.given("mesh.front_edge"), self.given("mesh.far_edge")
        if self.on_meridian:
            front, far = front if front_given else "auto", far if far_given else "auto"
        elif "auto" not in (front, far) and front > far:
            if not far_given:
                far = front
            elif not front_given:
                front = far
        if "auto" not in (front, far) and front > far:
            problems.append(
                f"mesh.front_edge: {number(front)} is longer than far_edge = {number(far)};"
                " the mesh is finest at the front, so exchange or equal them."
            )
        return {"mesh.front_edge": front, "mesh.far_edge": far}

    def _start_shape(self, problems):
        mesh, digest = self.mesh, self.mesh.sha256
        ratio = mesh.axes[0] / mesh.axes[1]
        if not _FLATTEST <= ratio <= _LONGEST:
            problems.append(f"mesh.axes: are as {number(ratio)} to 1, and must be as {_FLATTEST:g} to {_LONGEST:g}; take a rounder shape.")
        if mesh.file is None:
            if digest is not None:
                problems.append("mesh.sha256: is that of a file, and mesh.file is not given; leave it out.")
            return {}
        if self.model == "axisymmetric":
            problems.append("mesh.file: an axisymmetric body has no triangles; set model to surface or auto.")
        if digest is None:
            try:
                if not stat.S_ISREG(os.stat(mesh.file).st_mode):
                    raise ValueError("is not a regular file")  # a pipe or a device may never end
                with open(mesh.file, "rb") as file:
                    digest = hashlib.file_digest(file, "sha256").hexdigest()
            except (OSError, ValueError) as error:
                why = getattr(error, "strerror", None) or ("is not a path" if "\0" in mesh.file else str(error))
                path = printable_path(mesh.file)
                problems.append(f"mesh.file: {path}: {why}; give the path of a closed triangle mesh.")
        return {"mesh.sha256": digest}

    def _times(self, problems):
        end, step, at = self.time.end, self.time.step, self.perturbation.at
        frames, restarts = self.output.frames, self.perturbation.restarts
        end_given, step_given = self.given("time.end"), self.given("time.step")
        at_given, frames_given = self.given("perturbation.at"), self.given("output.frames")
        if not end_given:
            after = _default("time.end") - _default("perturbation.at")
            end = max(
                end,
                *(frames if frames_given else ()),
                step if step_given and step != "auto" else 0.0,
                at + after if at_given and restarts else 0.0,
            )
        if not step_given:
            step = "auto" if self.on_meridian else min(step, end)
        elif step != "auto" and step > end:
            if same_time(step, end):
                step = end
            else:
                problems.append(
                    f"time.step: {number(step)} is longer than the whole run, end = {number(end)}; shorten it."
                )
        if restarts and (at >= end or same_time(at, end)):
            if not at_given:
                at = end / 2
            else:
                problems.append(
                    f"perturbation.at: {number(at)} is not before the end of the run, {number(end)};"
                    f" set it earlier, raise time.end, or set {'front to 0' if self.perturbation.front > 0 else 'restart to false'}."
                )
        if not frames_given:
            frames = tuple(t for t in frames if t <= end or same_time(t, end))
        if any(t <= 0 for t in frames):
            problems.append(
                f"output.frames: {number(min(frames))} is not after t = 0, which is always stored; leave it out."
            )
        elif frames and min(frames) < 1e-9:
            problems.append(f"output.frames: {number(min(frames))} is out of range; a time is at least 1e-09.")
        if any(b <= a for a, b in zip(frames, frames[1:])):
            a, b = next((a, b) for a, b in zip(frames, frames[1:]) if b <= a)
            problems.append(
                f"output.frames: {number(b)} after {number(a)} does not increase; sort the times and drop repetitions."
            )
        frames = _joined_times(frames, (end, at) if restarts else (end,))
        if any(t > end for t in frames):
            problems.append(
                f"output.frames: {number(max(frames))} is after the end of the run, {number(end)};"
                " leave it out or raise time.end."
            )
        return {"time.end": end, "time.step": step, "perturbation.at": at, "output.frames": frames}

    def _drift(self, problems):
        mobility, drift_number = self.receptors.mobility, self.receptors.drift_number
        ligand_ratio = self.adhesion.ligand_ratio
        if drift_number is None:
            mobility = _default("receptors.mobility") if mobility is None else mobility
            drift_number = mobility * ligand_ratio
        elif mobility is None or not self.given("receptors.mobility"):
            mobility = drift_number / ligand_ratio
        elif not math.isclose(drift_number, mobility * ligand_ratio, rel_tol=1e-12):
            problems.append(
                f"receptors.drift_number: {number(drift_number)} contradicts mobility x ligand_ratio ="
                f" {mobility * ligand_ratio:g}; give only one of the two (null leaves one out)."
            )
        return {"receptors.mobility": mobility, "receptors.drift_number": drift_number}

    def _pattern(self, problems):
        width, period = self.ligands.width, self.ligands.period
        if self.model == "axisymmetric" and self.ligands.breaks_axis:
            problems.append(
                f"ligands.pattern: an axisymmetric body cannot follow {self.ligands.pattern}; set model to surface or"
                " auto, or take even or disc."
            )
        if self.ligands.repeats and width >= period:
            if not self.given("ligands.period"):
                period = 2 * width
            elif not self.given("ligands.width"):
                width = period / 2
            else:
                problems.append(
                    f"ligands.width: {number(width)} leaves nothing between {self.ligands.pattern} with a period of"
                    f" {number(period)}; make it smaller than the period."
                )
        return {"ligands.width": width, "ligands.period": period}

    def _check_method(self, problems):
        if self.solver.method == "newton" and not self.on_meridian:
            why = "a surface" if self.model == "surface" else "a scene without axis, which auto makes a surface"
            problems.append(
                f"solver.method: newton cannot solve the balance of {why}; take relaxation, or set model to axisymmetric."
            )

    def _check_perturbation(self, problems):
        perturbation, edge = self.perturbation, self.mesh.front_edge
        for key in ("amplitude", "front"):
            if getattr(perturbation, key) > 0 and self.model == "axisymmetric":
                problems.append(
                    f"perturbation.{key}: an axisymmetric body cannot carry it; set model to surface or auto, or"
                    f" {key} to 0."
                )
        if perturbation.amplitude > 0 and self.receptors.frozen:
            problems.append(
                "perturbation.amplitude: frozen receptors are computed with an even density; set it to 0, or"
                " receptors.frozen to false."
            )
        if perturbation.amplitude > 0 and edge != "auto" and self.mesh.file is None:
            nodes = self._nodes_a_wave()
            if nodes < _NODES_A_WAVE[0]:
                key = "mode" if self.given("perturbation.mode") else "amplitude"
                problems.append(
                    f"perturbation.{key}: the mesh has {nodes:.2g} nodes a wave of mode {perturbation.mode} at the most,"
                    f" and {_NODES_A_WAVE[0]} are the least; lower the mode to"
                    f" {math.floor(math.pi / (_NODES_A_WAVE[0] * edge))} or refine mesh.front_edge."
                )

    def _nodes_a_wave(self):
        """Edges in one wave of the perturbation's mode along the largest circle of the vesicle."""
        return math.pi / (self.perturbation.mode * self.mesh.front_edge)

    @property
    def drift_number(self):
        """Drift number mobility x ligand_ratio, from whichever of ``mobility`` and ``drift_number`` was given."""
        return self.receptors.drift_number

    @property
    def tolerance(self):
        """Largest scaled out-of-balance force of a node; `auto` leaves a tenth of the accuracy wish to it."""
        return TOLERANCE_PER_ACCURACY * self.accuracy if self.solver.tolerance == "auto" else self.solver.tolerance

    @property
    def marks(self):
        """Times the steps must meet: the frames, the end, and when the motion begins anew [a0^2/D]."""
        times = {*self.output.frames, self.time.end}
        return tuple(sorted(times | ({self.perturbation.at} if self.perturbation.restarts else set())))

    @property
    def _is_all_fixed(self):
        """Whether accuracy decides no more than the tolerance."""
        return "auto" not in (self.model, self.mesh.front_edge, self.mesh.far_edge, self.time.step)

    # What is doubtful

    def idle(self):
        """Return the keys that decide nothing in this case, dotted, each with the reason as a clause."""
        adhesion, receptors, perturbation, mesh = self.adhesion, self.receptors, self.perturbation, self.mesh
        idle = {}
        if self.model == "axisymmetric":
            idle["mesh.layout"] = "a meridian is laid out in one way only"
        if mesh.file is not None:  # its content counts, not its path
            keys = ("mesh.front_edge", "mesh.far_edge", "mesh.fine_angle", "mesh.layout", "mesh.axes")
            idle |= dict.fromkeys(keys, "the mesh is that of mesh.file")
        if perturbation.amplitude == 0:
            idle["perturbation.mode"] = "perturbation.amplitude is 0"
        if perturbation.front == 0:
            idle["perturbation.seed"] = "perturbation.front is 0"
        else:
            idle["perturbation.restart"] = "the motion begins anew with any displacement of the front"
        if not perturbation.restarts:
            idle["perturbation.at"] = "perturbation.front is 0 and restart false"
        if adhesion.law == "linear":
            idle |= dict.fromkeys(("adhesion.well", "adhesion.barrier", "adhesion.tail"), "adhesion.law is linear")
        if self.ligands.pattern == "even":
            keys = ("ligands.width", "ligands.period", "ligands.elsewhere", "ligands.blur")
            idle |= dict.fromkeys(keys, "ligands.pattern is even")
        elif not self.ligands.repeats:
            idle["ligands.period"] = f"a {self.ligands.pattern} does not repeat"
        if self.solver.method == "newton":
            idle["solver.damping"] = "solver.method is newton"
        if self.time.step != "auto":
            idle["time.stop_when_steady"] = "a run with a fixed time.step goes on to its end"
            if self._is_all_fixed and self.solver.tolerance != "auto":
                idle["accuracy"] = "model, mesh, time.step and solver.tolerance are all fixed"
        if receptors.frozen or adhesion.traction == 0:
            why = "receptors.frozen is true" if receptors.frozen else "adhesion.traction is 0"
            idle |= dict.fromkeys(("receptors.mobility", "receptors.drift_number"), why)
            if adhesion.traction == 0 or (adhesion.ligand_ratio >= 1 and self.ligands.pattern == "even"):
                idle["adhesion.ligand_ratio"] = why
        return idle

    def warnings(self):
        """Return a sentence for each thing that can be computed but is doubtful, or is given and decides nothing."""
        membrane, adhesion, mesh, step = self.membrane, self.adhesion, self.mesh, self.time.step
        doubts = []
        if membrane.thickness > _THICK:
            doubts.append(
                f"membrane.thickness: {membrane.thickness:g} is above {_THICK:g}, a fifth of the radius, where a thin shell"
                " is a rough model."
            )
        if mesh.front_edge != "auto" and mesh.file is None and adhesion.cutoff < 3 * mesh.front_edge:
            doubts.append(
                f"adhesion.cutoff: {adhesion.cutoff:g} is shorter than three front edges ({3 * mesh.front_edge:g}),"
                " so the traction is poorly resolved; refine mesh.front_edge."
            )
        if step != "auto" and step > _LONG_STEP and not self.receptors.frozen:
            doubts.append(
                f"time.step: {step:g} is above {_LONG_STEP:g}, where the error of the early binding area passes"
                " about 5 %; shorten it, or write `step: auto`."
            )
        if step != "auto" and self.time.end / step > _MANY_STEPS:
            doubts.append(
                f"time.step: {step:g} makes {self.time.end / step:.2g} steps up to the end, {self.time.end:g}; write"
                " `step: auto` or end the run earlier."
            )
        if adhesion.traction * adhesion.cutoff / 2 < _FEEBLE * membrane.shear_modulus:
            doubts.append(
                "adhesion.traction: the adhesion energy traction x cutoff / 2 ="
                f" {adhesion.traction * adhesion.cutoff / 2:g} is under a thousandth of the shear modulus,"
                " so the vesicle will hardly spread."
            )
        if adhesion.ligand_ratio < 1:
            doubts.append(
                f"adhesion.ligand_ratio: {adhesion.ligand_ratio:g} leaves receptors without ligands from the start,"
                " so the traction is capped below adhesion.traction."
            )
        if self.drag == 0 and not self.receptors.frozen:
            doubts.append(
                "drag: without drag the vesicle jumps to static equilibrium in the first step, and how it then spreads"
                " follows from the receptors alone; the paper's cases need drag: 0.07."
            )
        if self.perturbation.amplitude > 0 and mesh.front_edge != "auto" and self._nodes_a_wave() < _NODES_A_WAVE[1]:
            doubts.append(
                f"perturbation.mode: the mesh has {self._nodes_a_wave():.2g} nodes a wave of mode"
                f" {self.perturbation.mode} at the most, so the wave is poorly resolved; refine mesh.front_edge."
            )
        if self.perturbation.front > 0 and adhesion.traction == 0:
            doubts.append(
                "perturbation.front: without adhesion.traction the membrane is not bound, so there may be no front to"
                " displace; set it to 0 or give a traction."
            )
        agrees = {"time.stop_when_steady": not self.time.stop_when_steady, "perturbation.restart": self.perturbation.restart}
        reach = adhesion.traction * adhesion.cutoff
        for key, odd in (
            ("membrane.shear_modulus", reach > 2.0 * _SOFTEST * membrane.shear_modulus),
            ("time.end", reach > 0.0 and self.time.end > _LATEST * (1.0 + self.drag / reach)),
        ):
            if odd and self.scales is None and self.given(key):
                doubts.append(
                    f"{key}: {number(self.get(key))} {UNIT_OF[key]} is far from any vesicle; a number of SI needs its unit"
                    " and units: {diameter: ..., diffusivity: ...} (docs/cases.md)."
                )
        for key, why in self.idle().items():
            if self.given(key) and not agrees.get(key, False):
                doubts.append(f"{key}: is given and decides nothing here, since {why}.")
        return doubts

    def missed_wish(self, mesh_error, step_error):
        """Return a sentence for each of the given mesh and step that cannot keep the accuracy that was given.

        ``mesh_error`` and ``step_error`` are the estimated relative errors of the binding area (`vesdyn.planning`).
        """
        wish, sentences = self.accuracy, []
        for key, error in (("mesh.front_edge", mesh_error), ("time.step", step_error)):
            section, inner = key.split(".")
            value = getattr(getattr(self, section), inner)
            if self.given("accuracy") and self.given(key) and key not in self.idle() and value != "auto" and error > wish:
                sentences.append(
                    f"{key}: {value:g} is estimated to cost {error:.1%} of the binding area, and accuracy asks for"
                    f" {wish:.2g}; reduce it or write `{inner}: auto`."
                )
        return sentences

    # To other forms

    def resolved(self):
        """Return every key with its value, defaults included, as plain dicts, lists, text and numbers."""
        return _plain({key: getattr(self, key) for key in SECTIONS}, whole=True)

    def to_yaml(self):
        """Return the case as YAML that `vesdyn.load_case` reads back to an equal case.

        What was given stands as it was given, so that it can be changed; under ``defaults`` stands what the rest came
        to, which counts as not given.
        """
        given = self.given_keys()
        if self.mesh.file is not None:  # so that the case can be read where the file is not
            given["mesh"] = given["mesh"] | {"sha256": self.mesh.sha256}
        rest = {
            key: value
            for key, value in flattened(self.resolved()).items()
            if not self.given(key)
            and key not in ("receptors.drift_number", "mesh.sha256")
            and not (key.startswith("units.") and self.scales is None)
        }
        if self.given("receptors.drift_number"):
            rest.pop("receptors.mobility", None)
        return plain_yaml.write(given | ({"defaults": _nested(rest)} if rest else {}))

    @property
    def hash(self):
        """SHA-256, in hexadecimal, of all that decides the numbers of the run, whether given or by default.

        That is physics, body, mesh, step, order, accuracy, tolerance, damping, perturbation and the times the steps
        must meet; not the name, the interval of checkpoints, the limit of iterations, or a key that is idle here.
        """
        return hashlib.sha256(json.dumps(self._decisive(), sort_keys=True).encode()).hexdigest()

    def _decisive(self):
        """Value of each dotted key that decides numbers."""
        flat = flattened(self.resolved())
        flat["solver.tolerance"] = self.tolerance
        for key in (*_UNDECISIVE, *self.idle(), *(("accuracy",) if self._is_all_fixed else ())):
            flat.pop(key, None)
        return {key: value + 0.0 if isinstance(value, float) else value for key, value in flat.items()}


_UNDECISIVE = (
    *(f"units.{key}" for key in Units.model_fields),
    *("name", "mesh.file", "output.checkpoint_minutes", "solver.max_iterations", "receptors.mobility"),
)


def _field(key):
    """The field of the dotted ``key``."""
    section, _, inner = key.partition(".")
    field = Case.model_fields[section]
    return type(field.default).model_fields[inner] if inner else field


SECTIONS = {  # each top-level key, and the keys in it where it is a section
    key: list(type(field.default).model_fields) if isinstance(field.default, _Section) else []
    for key, field in Case.model_fields.items()
}
KEYS = [f"{section}.{key}" if key else section for section, keys in SECTIONS.items() for key in keys or [""]]
UNIT_OF = {  # of the dotted keys that stand for quantities, the unit of the model
    key: unit for key in KEYS if (unit := units.unit_of(_field(key).description or ""))
}


def continuation_conflicts(stored, wanted, time):
    """Return what forbids that ``wanted`` goes on from a checkpoint of the case ``stored`` at ``time`` [a0^2/D].

    An empty list allows it. Else a clause for each key: "drag: 0.07 there, 0.1 here". Allowed is what could not have
    changed what was computed up to ``time``: another name, interval of checkpoints, limit of iterations or tolerance
    (what a failed run is advised to change); an end and frames that lie ahead, unless steps of fixed length were
    shortened to meet the end of before; and no longer stopping when steady. Equal cases have no conflicts, and a
    finished run is one at its last time.
    """
    free = {"time.end", "output.frames", "solver.tolerance", "time.stop_when_steady"}
    there, here = stored._decisive(), wanted._decisive()
    conflicts = [
        f"{key}: {_told(there.get(key))} there, {_told(here.get(key))} here"
        for key in dict.fromkeys([*there, *here])
        if key not in free and there.get(key) != here.get(key)
    ]
    if here.get("time.stop_when_steady") and not there.get("time.stop_when_steady", True):
        conflicts.append("time.stop_when_steady: false there, true here")
    reached = time * (1.0 + SAME_TIME)
    if wanted.time.end < time and not same_time(wanted.time.end, time):
        conflicts.append(f"time.end: {number(wanted.time.end)} here, and t = {number(time)} is reached there")
    passed, wished = ([t for t in case.output.frames if t <= reached] for case in (stored, wanted))
    if same_time(stored.time.end, time):  # a frame at the very end is as good as one that was asked for
        passed, wished = ([t for t in times if not same_time(t, time)] for times in (passed, wished))
    if len(passed) != len(wished) or not all(map(same_time, passed, wished)):
        conflicts.append(f"output.frames: {passed} there, {wished} here, up to t = {number(time)} that is reached")
    step, end = stored.time.step, stored.time.end
    if step != "auto" and time > 0 and not same_time(end, wanted.time.end):
        last = max((t for t in stored.marks if t < min(time, end) and not same_time(t, min(time, end))), default=0.0)
        met = min(t for t in stored.marks if t > last)
        length = (met - last) / math.ceil((met - last) / step * (1.0 - SAME_TIME))
        if met == end and length < step * (1.0 - SAME_TIME):
            conflicts.append(
                f"time.end: {number(end)} there, {number(wanted.time.end)} here, and the steps up to t = {number(time)}"
                f" were shortened from {number(step)} to meet the former"
            )
    return conflicts


def _told(value):
    return number(value) if isinstance(value, float) else "nothing" if value is None else f"{value}"


def check_is_case(case):
    """Raise CaseError for anything but a `Case`, such as the name of one."""
    if not isinstance(case, Case):
        raise CaseError(f"{shown(case)}: is no case; make one by vesdyn.load_case(...) or vesdyn.Case(...).")


def same_time(a, b):
    """Whether the times ``a`` and ``b`` differ by rounding only."""
    return abs(a - b) <= SAME_TIME * max(abs(a), abs(b))


def _joined_times(times, anchors):
    """The increasing ``times``, those that are one joined; what is one with an anchor is that."""
    joined = []
    for t in times:
        t = next((anchor for anchor in anchors if same_time(t, anchor)), t)
        if not (joined and same_time(joined[-1], t)) or joined[-1] > t:
            joined.append(t)
    return tuple(joined)


# Keys as nested dicts ------------------------------------------------------------------------------------


def validated(keys, origin=str):
    """Return the case of the nested dict ``keys``; ``origin`` turns a dotted key into the words that name it.

    Raises CaseError with a sentence for each fault, of very many for the first.
    """
    try:
        return Case.model_validate(in_full(keys))
    except ValidationError as error:
        raise _refusal(error, origin) from None


def _refusal(error, origin, sections=None):
    pairs = refusals(error.errors(include_url=False), SECTIONS if sections is None else sections)
    return CaseError(joined(f"{origin(key)}: {sentence}" for key, sentence in pairs))


def in_full(keys, keep_null=False):
    """Return ``keys`` as nested dicts of plain values: dotted keys, sections, `mesh: auto`, `accuracy: 1%` in full.

    A mobility or drift number of null is left out, or kept for `merged`, where it hides one of a lower level.
    Raises CaseError for a key given twice and for one inside a key that holds a value.
    """
    full = {}
    for key, value in keys.items():
        value = _plain(value)
        if key == "mesh" and isinstance(value, str) and value == "auto":
            value = {"front_edge": "auto", "far_edge": "auto"}
        elif value is None and SECTIONS.get(key):
            value = {}
        elif key == "accuracy" and isinstance(value, str):
            value = _percentage(value)
        _put(full, key, value)
    receptors = full.get("receptors")
    if isinstance(receptors, dict) and not keep_null:
        full["receptors"] = {
            k: v for k, v in receptors.items() if v is not None or k not in ("mobility", "drift_number")
        }
    return full


def _put(full, key, value):
    """Put ``value`` at the dotted ``key`` of the nested dict ``full``."""
    *parents, last = str(key).split(".")
    if parents and SECTIONS.get(parents[0]) == [] or len(parents) > 1 and parents[1] in SECTIONS.get(parents[0], ()):
        holder = printable(parents[0] if SECTIONS.get(parents[0]) == [] else ".".join(parents[:2]))
        raise CaseError(f"{printable(key)}: {holder} holds a value and has no keys in it; see `vesdyn template`.")
    inner = full
    for part in parents:
        inner = inner.setdefault(part, {})
        if not isinstance(inner, dict):
            raise CaseError(
                f"{printable(key)}: {printable(part)} holds a value and has no keys in it; see `vesdyn template`."
            )
    if last not in inner:
        inner[last] = dict(value) if isinstance(value, dict) else value
    elif isinstance(inner[last], dict) and isinstance(value, dict) and not inner[last].keys() & value.keys():
        inner[last].update(value)
    else:
        raise CaseError(f"{printable(key)}: is given twice; give it once.")


def _percentage(text):
    percent = re.fullmatch(r"\s*([0-9.eE+-]{1,40})\s*%\s*", text)
    try:
        return float(percent[1]) / 100.0 if percent else text
    except ValueError:
        return text


def _plain(value, depth=3, whole=False):
    """``value`` without numpy's types and without sections: of those the keys that were given, or the ``whole``."""
    if isinstance(value, _Section):
        keys = type(value).model_fields if whole else value.model_fields_set
        return {key: _plain(getattr(value, key), depth - 1) for key in type(value).model_fields if key in keys}
    if isinstance(value, dict) and depth:
        return {key: _plain(inner, depth - 1, whole) for key, inner in value.items()}
    if isinstance(value, (list, tuple, range)) and depth:
        return [_plain(inner, depth - 1) for inner in value]
    if hasattr(value, "tolist") and not isinstance(value, type):
        return value.tolist()
    return value


def merged(levels):
    """Return the nested dicts ``levels``, the most specific last, as one; and what gave way, as (key, sentence).

    Sections are merged key by key. Where keys of different levels contradict each other the less specific one gives
    way: mobility or drift number is left out, frames after the end fall away, a step is no longer than the run, one
    edge becomes as long as the other. Keys of one level that contradict each other are left as they are.
    """
    keys = {}
    for level in levels:
        keys = _over(keys, level)
    if keys.get("units"):
        levels = [_in_model_units(level | {"units": keys["units"]}, []) for level in levels]
        keys = _in_model_units(keys, [])
    notes = []

    def rank(key):
        section, inner = key.split(".")
        holding = (i for i, level in enumerate(levels) if isinstance(level.get(section), dict) and inner in level[section])
        return max(holding, default=-1)

    def drop(key):
        section, inner = key.split(".")
        keys[section] = {k: v for k, v in keys[section].items() if k != inner}

    def replace(key, value, sentence):
        section, inner = key.split(".")
        keys[section] = keys[section] | {inner: value}
        notes.append((key, sentence))

    mobility, drift_number = "receptors.mobility", "receptors.drift_number"
    m, d = _number_at(keys, mobility), _number_at(keys, drift_number)
    if m is not None and d is not None:
        ratio = _number_at(keys, "adhesion.ligand_ratio")
        ratio = _default("adhesion.ligand_ratio") if ratio is None else ratio
        if not math.isclose(d, m * ratio, rel_tol=1e-12):
            if rank(mobility) != rank(drift_number):
                drop(min(mobility, drift_number, key=rank))
            elif rank("adhesion.ligand_ratio") > rank(mobility) and _agreed(levels[: rank(mobility) + 1], m, d):
                drop(drift_number)

    if -1 < rank("mesh.sha256") < rank("mesh.file"):
        drop("mesh.sha256")

    end, step = _number_at(keys, "time.end"), _number_at(keys, "time.step")
    if end is not None and step is not None and step > end and rank("time.step") < rank("time.end"):
        replace("time.step", end, f"{number(step)} is longer than the run, end = {number(end)}, and gives way to it.")
    front, far = _number_at(keys, "mesh.front_edge"), _number_at(keys, "mesh.far_edge")
    if front is not None and far is not None and front > far:
        if rank("mesh.far_edge") < rank("mesh.front_edge"):
            shorter = f"{number(far)} is below front_edge = {number(front)}"
            replace("mesh.far_edge", front, f"{shorter} and gives way to it.")
        elif rank("mesh.front_edge") < rank("mesh.far_edge"):
            longer = f"{number(front)} is above far_edge = {number(far)}"
            replace("mesh.front_edge", far, f"{longer} and gives way to it.")
    frames = keys["output"].get("frames") if isinstance(keys.get("output"), dict) else None
    if end is not None and isinstance(frames, list) and rank("output.frames") < rank("time.end"):
        late = [t for t in frames if _is_number(t) and t > end and not same_time(t, end)]
        if late:
            several = f"{number(late[0])} and {len(late) - 1} more are" if len(late) > 1 else f"{number(late[0])} is"
            replace(
                "output.frames",
                [t for t in frames if t not in late],
                f"{several} after the end of the run, {number(end)}, and left out.",
            )
    return keys, notes


def _in_model_units(keys, problems):
    """The nested dict ``keys`` with numbers for quantities; what cannot be read is left, and a sentence of ``problems``."""
    if not isinstance(keys, dict):
        return keys
    given = keys.get("units")
    scales = _scales(given, problems) if isinstance(given, dict) and given else None
    if problems:
        return keys

    def converted(key, value):
        if isinstance(value, list):
            return [converted(f"{key}[{i}]", inner) for i, inner in enumerate(value)]
        unit = UNIT_OF.get(key.partition("[")[0].removesuffix(".every"))
        if unit is None or not units.is_quantity(value):
            return value
        if scales is None:
            problems.append(
                f"{key}: {shown(value)} needs the scales of the scene; give units: {{diameter: 10 um, diffusivity:"
                " 0.01 um^2/s}, or a plain number."
            )
            return value
        try:
            return units.in_model_units(value, unit, scales)
        except CaseError as error:
            problems.append(f"{key}: {error}")
            return value

    def walk(nested, prefix=""):
        return {
            key: walk(value, f"{prefix}{key}.") if isinstance(value, dict) else converted(f"{prefix}{key}", value)
            for key, value in nested.items()
        }

    return walk(keys)


def _with_listed_frames(keys, problems):
    """``keys`` with the times of ``output.frames`` listed where they are given as {every: interval} or {count: number}."""
    output = keys.get("output") if isinstance(keys, dict) else None
    frames = output.get("frames") if isinstance(output, dict) else None
    if not isinstance(frames, dict):
        return keys
    end = _number_at(keys, "time.end")
    end = _default("time.end") if end is None else end
    (way, value), *more = frames.items() or [("", None)]
    if more or way not in ("every", "count"):
        problems.append("output.frames: is neither a list of times nor {every: 0.01} nor {count: 50}; write one of them.")
    elif way == "count" and (isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= _MOST_FRAMES):
        problems.append(f"output.frames.count: {shown(value)} is not a number of frames; give 1 to {_MOST_FRAMES}.")
    elif way == "every" and not (_is_number(value) and value > 0.0 and 1.0 <= end / value * (1.0 + SAME_TIME) <= _MOST_FRAMES + 0.5):
        least = number(float(f"{end / _MOST_FRAMES:.2g}"))
        problems.append(f"output.frames.every: {shown(value)} is no interval of the run; give one from {least} to {number(end)}.")
    else:
        every = end / value if way == "count" else value
        times = [float(f"{(k + 1) * every:.15g}") for k in range(math.floor(end / every * (1.0 + SAME_TIME)))]
        return keys | {"output": output | {"frames": times}}
    return keys


def _scales(given, problems):
    """The `vesdyn.units.Scales` of the section ``given``; None where it names no diameter."""
    given = {key: field.default for key, field in Units.model_fields.items()} | given
    named = {key: value for key, value in given.items() if key in Units.model_fields and value is not None}
    if not {"diameter", "diffusivity"} & named.keys():
        return None
    found = {}
    for key in dict.fromkeys(["diameter", "diffusivity", *named]):
        try:
            found[key] = units.scale(key, named.get(key))
        except CaseError as error:
            problems.append(f"units.{key}: {error}")
    return None if problems else units.Scales(**found)


def _quantities(keys):
    """Texts of the quantities among ``keys``, by dotted key; lists as they were given."""
    texts, flat = {}, flattened(keys) if isinstance(keys, dict) else {}
    for key, value in flat.items():
        if isinstance(value, units.Quantity):
            texts[key] = value.text
        elif isinstance(value, list) and any(isinstance(inner, units.Quantity) for inner in value):
            texts[key] = [getattr(inner, "text", inner) for inner in value]
    ways = {key: texts.pop(key, flat[key]) for key in flat if key.startswith("output.frames.")}
    if ways:
        texts["output.frames"] = {key.rpartition(".")[2]: value for key, value in ways.items()}
    return texts


def _agreed(levels, mobility, drift_number):
    """Whether mobility and drift number agreed at the ligand ratio of these ``levels``."""
    ratios = [_number_at(level, "adhesion.ligand_ratio") for level in levels]
    ratio = next((r for r in reversed(ratios) if r is not None), _default("adhesion.ligand_ratio"))
    return math.isclose(drift_number, mobility * ratio, rel_tol=1e-12)


def _over(defaults, keys):
    """``keys`` over ``defaults``, section by section; sections of the latter are not changed."""
    both = {k for k in keys if isinstance(keys[k], dict) and isinstance(defaults.get(k), dict)}
    return defaults | {k: defaults[k] | keys[k] if k in both else keys[k] for k in keys}


def _number_at(level, key):
    """The number at the dotted ``key`` of the nested dict ``level``, or None."""
    section, inner = key.split(".")
    value = level[section].get(inner) if isinstance(level.get(section), dict) else None
    return value if _is_number(value) else None


def _is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= 1e300


def _default(key):
    """The default of the dotted ``key`` of a section."""
    return _field(key).default


def _with(section, values):
    """Return a copy of ``section`` with ``values``, which are valid; what was given stays what was given."""
    return type(section).model_construct(_fields_set=set(section.model_fields_set), **(dict(section) | values))


def _marked(section, given):
    """Return a copy of ``section`` in which the keys ``given``, and no others, count as given."""
    return type(section).model_construct(_fields_set=set(given), **dict(section))


def flattened(nested, prefix=""):
    """Return a nested dict as one of dotted keys."""
    flat = {}
    for key, value in nested.items():
        flat |= flattened(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return flat


def _nested(flat):
    """Return a dict of dotted keys as a nested one."""
    nested = {}
    for key, value in flat.items():
        _put(nested, key, value)
    return nested
