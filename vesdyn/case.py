"""A case: everything that decides what a run computes, read from YAML, validated once and frozen.

The keys are the public interface; each is declared once, below, with its default, its limits and its unit.
Units: length a0 (initial diameter), time a0^2/D, energy kT, receptor density c_r0 (initial density).
"""

import copy
import difflib
import itertools
import math
import re
from pathlib import Path
from typing import Annotated, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from vesdyn.errors import CaseError


Auto = Literal["auto"]
TOLERANCE_PER_ACCURACY = 0.04  # a tolerance costs 2.5 times itself in binding area (README, "Accuracy")

# The keys ------------------------------------------------------------------------------------------------


class _Section(BaseModel):
    """Frozen; unknown keys, NaN, infinities, and text or true/false in the place of numbers are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False, validate_default=True)


class Membrane(_Section):
    shear_modulus: float = Field(1.81, gt=0, description="in-plane shear modulus K = G h [kT/a0^2]")
    thickness: float = Field(
        0.01, ge=0, le=0.5, description="shell thickness h [a0], bending stiffness K h^2/3; 0: a pure membrane"
    )
    prestretch: float = Field(1.0, ge=1, description="stretch of the initial sphere against its stress-free state")


class Adhesion(_Section):
    traction: float = Field(2.416, ge=0, description="largest traction T_max at the initial density [kT/a0^3]")
    cutoff: float = Field(0.1, gt=0, description="gap d_c beyond which the traction vanishes [a0]")
    ligand_ratio: float = Field(8.0, gt=0, description="ligands waiting for each receptor, q = c_l / c_r0")
    law: Literal["linear", "double_well"] = Field(
        "linear", description="traction against gap: linear, or double_well: bonds, a barrier, a weak attraction"
    )
    well: float = Field(0.3, gt=0, lt=1, description="double_well: range of the bonds [cutoff]")
    barrier: float = Field(0.3, ge=0, le=10, description="double_well: largest repulsion of the barrier [traction]")
    tail: float = Field(0.05, ge=0, le=1, description="double_well: largest attraction beyond it [traction]")


class Ligands(_Section):
    pattern: Literal["even", "disc", "stripe", "stripes", "squares"] = Field(
        "even", description="where the ligands are: even, a disc, a stripe along y, stripes, or squares"
    )
    width: float = Field(0.3, gt=0, le=100, description="diameter of the disc, width of stripe or square [a0]")
    period: float = Field(0.6, gt=0, le=100, description="distance of stripes or squares from middle to middle [a0]")
    elsewhere: float = Field(0.0, ge=0, le=1, description="density of the ligands elsewhere, relative to that within")
    blur: float = Field(0.02, gt=0, le=10, description="width of the border across which it changes [a0]")

    @property
    def breaks_axis(self):
        return self.pattern not in ("even", "disc")


class Receptors(_Section):
    mobility: float | None = Field(2.1875, ge=0, description="mobility number; drift number = mobility x ligand_ratio")
    drift_number: float | None = Field(None, ge=0, description="drift number itself, in the place of mobility")
    frozen: bool = Field(False, description="true: the density stays as it is")

    def resolved(self, ligand_ratio):
        """Return a copy with both ``mobility`` and ``drift_number``, from whichever of them was given.

        Raises ValueError if both were given and disagree.
        """
        mobility, drift_number = self.mobility, self.drift_number
        if drift_number is None:
            mobility = type(self).model_fields["mobility"].default if mobility is None else mobility
            drift_number = mobility * ligand_ratio
        elif mobility is None or "mobility" not in self.model_fields_set:
            mobility = drift_number / ligand_ratio
        elif not math.isclose(drift_number, mobility * ligand_ratio, rel_tol=1e-12):
            raise ValueError(
                f"receptors.drift_number: {drift_number:g} contradicts mobility x ligand_ratio ="
                f" {mobility * ligand_ratio:g}; give only one of the two (null leaves one out)."
            )
        return self.model_copy(update={"mobility": mobility, "drift_number": drift_number})


class Perturbation(_Section):
    mode: int = Field(2, ge=1, description="azimuthal mode m of the initial density, c = 1 + amplitude cos(m angle)")
    amplitude: float = Field(0.0, ge=0, lt=1, description="its amplitude [c_r0]; 0: an even density")
    front: float = Field(
        0.0, ge=0, le=0.2, description="largest random displacement of the contact front, of its radius; 0: none"
    )
    at: float = Field(0.14, gt=0, description="time of that displacement [a0^2/D]")
    seed: int = Field(0, ge=0, description="seed of its random numbers")

    @property
    def breaks_axis(self):
        return self.amplitude > 0 or self.front > 0


class Mesh(_Section):
    front_edge: Annotated[float, Field(gt=0)] | Auto = Field(
        0.015, description="edge length where the membrane will touch [a0]; auto: as accuracy allows"
    )
    far_edge: Annotated[float, Field(gt=0, le=0.5)] | Auto = Field(
        0.05, description="edge length far above the substrate [a0]; auto: as accuracy allows"
    )
    layout: Literal["scalloped", "rings", "spiral"] = Field(
        "scalloped", description="how the vertices are laid out: scalloped, rings or spiral"
    )


class Time(_Section):
    end: float = Field(1.2, gt=0, description="end of the run [a0^2/D]")
    step: Annotated[float, Field(ge=1e-9)] | Auto = Field(
        0.001, description="coupling step, shortened to land on the frames [a0^2/D]; auto: as accuracy allows"
    )
    order: Literal[1, 2] = Field(2, description="order of the coupling step; 1: the paper's staggering")
    stop_when_steady: bool = Field(True, description="end the run early once nothing moves (step: auto)")


class Output(_Section):
    frames: tuple[float, ...] = Field(
        (0.008, 0.044, 0.128, 0.56), strict=False, description="times of the stored shapes, beside t = 0 [a0^2/D]"
    )
    checkpoint_minutes: float = Field(0.5, ge=0, description="wall time between checkpoints [min]; 0: every step")


class Solver(_Section):
    tolerance: Annotated[float, Field(gt=0, lt=1)] | Auto = Field(
        "auto", description="largest scaled out-of-balance force of a node; auto: 0.04 x accuracy"
    )
    damping: Literal["viscous", "kinetic"] = Field("viscous", description="damping: viscous or kinetic")
    max_iterations: int = Field(20000, ge=1, description="iterations after which a step is given up")


class Case(_Section):
    """Everything that decides what a run computes. Frozen, comparable, picklable; made by ``load_case``."""

    name: str = Field(
        max_length=100,
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._=-]*$",
        description="name of the case and of its directory in runs/",
    )
    model: Literal["surface", "axisymmetric", "auto"] = Field(
        "surface", description="body: surface (triangles), axisymmetric (meridian) or auto: the least that serves"
    )
    accuracy: float = Field(
        0.01, ge=1e-4, le=0.2, description="wished relative error of the binding area after t = 0.01; 1% or 0.01"
    )
    membrane: Membrane = Membrane()
    adhesion: Adhesion = Adhesion()
    ligands: Ligands = Ligands()
    receptors: Receptors = Receptors()
    perturbation: Perturbation = Perturbation()
    drag: float = Field(0.07, ge=0, description="drag per unit reference area [kT D^-1 a0^-2]; 0: statics at each step")
    mesh: Mesh = Mesh()
    time: Time = Time()
    output: Output = Output()
    solver: Solver = Solver()

    @model_validator(mode="before")
    @classmethod
    def _short_forms(cls, raw):
        return _in_full(raw)

    @model_validator(mode="after")
    def _consistent(self):
        """Check what concerns several keys at once, and resolve the drift number."""
        problems = []
        edges = self.mesh.front_edge, self.mesh.far_edge
        if "auto" not in edges and self.mesh.front_edge > self.mesh.far_edge:
            problems.append(
                f"mesh.front_edge: {self.mesh.front_edge:g} is longer than far_edge = {self.mesh.far_edge:g};"
                " the mesh is finest at the front, so exchange or equal them."
            )
        if self.time.step != "auto" and self.time.step > self.time.end:
            problems.append(
                f"time.step: {self.time.step:g} is longer than the whole run, end = {self.time.end:g}; shorten it."
            )
        for key in ("amplitude", "front"):
            if getattr(self.perturbation, key) > 0 and self.model == "axisymmetric":
                problems.append(
                    f"perturbation.{key}: an axisymmetric body cannot carry it; set model to surface or auto, or"
                    f" {key} to 0."
                )
        if self.model == "axisymmetric" and self.ligands.breaks_axis:
            problems.append(
                f"ligands.pattern: an axisymmetric body cannot follow {self.ligands.pattern}; set model to surface or"
                " auto, or take even or disc."
            )
        if self.perturbation.front > 0 and self.perturbation.at >= self.time.end:
            problems.append(
                f"perturbation.at: {self.perturbation.at:g} is not before the end of the run, {self.time.end:g};"
                " set it earlier, raise time.end, or set front to 0."
            )
        frames = self.output.frames
        if any(t <= 0 for t in frames):
            problems.append(f"output.frames: {min(frames):g} is not after t = 0, which is always stored; leave it out.")
        if any(t > self.time.end for t in frames):
            problems.append(
                f"output.frames: {max(frames):g} is after the end of the run, {self.time.end:g};"
                " leave it out or raise time.end."
            )
        if any(b <= a for a, b in zip(frames, frames[1:])):
            problems.append(f"output.frames: {list(frames)} does not increase; sort it and drop repetitions.")
        try:
            object.__setattr__(self, "receptors", self.receptors.resolved(self.adhesion.ligand_ratio))
        except ValueError as contradiction:
            problems.append(str(contradiction))
        if problems:
            raise ValueError("\n".join(problems))
        return self

    @property
    def drift_number(self):
        """Drift number mobility x ligand_ratio, from whichever of ``mobility`` and ``drift_number`` was given."""
        return self.receptors.drift_number

    @property
    def breaks_axis(self):
        """Whether the scene is not symmetric about z."""
        return self.perturbation.breaks_axis or self.ligands.breaks_axis

    def warnings(self):
        """Return a sentence for each thing that can be computed but is doubtful."""
        membrane, adhesion, mesh = self.membrane, self.adhesion, self.mesh
        doubts = []
        if membrane.thickness > 0.1:
            doubts.append(
                f"membrane.thickness: {membrane.thickness:g} is above 0.1, a fifth of the radius, where a thin shell is"
                " a rough model."
            )
        if mesh.front_edge != "auto" and adhesion.cutoff < 3 * mesh.front_edge:
            doubts.append(
                f"adhesion.cutoff: {adhesion.cutoff:g} is shorter than three front edges ({3 * mesh.front_edge:g}),"
                " so the traction is poorly resolved; refine mesh.front_edge."
            )
        if self.time.step != "auto" and self.time.step > 0.004 and not self.receptors.frozen:
            doubts.append(
                f"time.step: {self.time.step:g} is above 0.004, where the error of the early binding area passes"
                " about 5 %; shorten it, or write `step: auto`."
            )
        if adhesion.traction * adhesion.cutoff / 2 < 1e-3 * membrane.shear_modulus:
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
        return doubts

    @property
    def tolerance(self):
        """Largest scaled out-of-balance force of a node; `auto` leaves a tenth of the accuracy wish to it."""
        return TOLERANCE_PER_ACCURACY * self.accuracy if self.solver.tolerance == "auto" else self.solver.tolerance

    @property
    def marks(self):
        """Times the steps must meet: the frames, the displacement of the front and the end [a0^2/D]."""
        times = {*self.output.frames, self.time.end}
        return tuple(sorted(times | ({self.perturbation.at} if self.perturbation.front > 0 else set())))

    def resolved(self):
        """Return every key with its value, defaults included, as plain dicts, lists, text and numbers."""
        return self.model_dump(mode="json")

    def to_yaml(self):
        """Return the resolved case as YAML that ``load_case`` reads back to an equal case."""
        return yaml.safe_dump(self.resolved(), sort_keys=False, default_flow_style=None, width=110)


def template():
    """Return a commented case file with every key, its default, its meaning and its unit."""
    lines = [
        "# A vesdyn case. Units: length a0 (initial diameter), time a0^2/D, energy kT, density c_r0.",
        "",
        "# base: other.yaml                        # case file whose keys are the defaults of this one",
        "# sweep: {adhesion.cutoff: [0.06, 0.1]}   # many cases, one of each combination of values (vesdyn batch)",
    ]

    def add(key, field, default, indent=""):
        value = _as_yaml(default)
        key = f"# {key}" if default is None else key
        lines.append(f"{indent + key + ': ' + value:<42}# {field.description}")

    for key, field in Case.model_fields.items():
        if isinstance(field.default, _Section):
            lines.append(f"{key}:")
            for subkey, subfield in type(field.default).model_fields.items():
                default = subfield.default
                add(subkey, subfield, list(default) if isinstance(default, tuple) else default, "  ")
        else:
            add(key, field, "typical" if field.is_required() else field.default)
    return "\n".join(lines) + "\n"


def _as_yaml(value):
    """Return ``value`` as YAML on one line."""
    return yaml.safe_dump(value, default_flow_style=True, width=math.inf).removesuffix("...\n").strip()


# Reading -------------------------------------------------------------------------------------------------


class _Loader(yaml.SafeLoader):
    """YAML as a case needs it: ``1e-3`` is a number, and a key given twice is an error."""

    def construct_mapping(self, node, deep=False):
        seen = set()
        for key_node, _ in node.value:
            if key_node.value in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {key_node.value} is given twice", key_node.start_mark
                )
            seen.add(key_node.value if isinstance(key_node.value, str) else id(key_node))
        return super().construct_mapping(node, deep)


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"), list("-+.0123456789")
)


def load_case(path, overrides=()):
    """Read and validate a case.

    ``path`` is the YAML file; ``overrides`` are strings ``key.sub=value`` that replace what it says, their
    values read as YAML. The keys of the file under ``base`` (a path relative to the one that names it) are
    its defaults, all but ``name``. A mapping under ``provenance``, as a run stores it, is passed over.

    Raises CaseError, also for a file with a ``sweep``, which is many cases (`load_sweep`).
    """
    raw, origin = _read(path, overrides)
    if raw.pop("sweep", None):
        raise CaseError(f"{origin('sweep')}: makes many cases of this file; run them by `vesdyn batch {path}`.")
    return _validated(raw, origin)


def load_sweep(path, overrides=()):
    """Read and validate the cases of one file: every combination of the values under its ``sweep``.

    ``sweep`` maps dotted keys to lists of values; ``<name>-<key>=<value>`` is the name of each case. Without
    one the file is one case. ``path`` and ``overrides`` as for `load_case`.

    Raises CaseError.
    """
    raw, origin = _read(path, overrides)
    sweep = raw.pop("sweep", None) or {}
    if not isinstance(sweep, dict):
        raise CaseError(f"{origin('sweep')}: not a grid; write for instance {{adhesion.cutoff: [0.06, 0.1]}}.")
    for key, values in sweep.items():
        if not isinstance(values, list) or not values:
            raise CaseError(f"{origin('sweep')}: {key}: not a list of values; write one such as [0.06, 0.1].")
        if origin(key).startswith("--set"):
            raise CaseError(f"{origin(key)}: is swept in {path}; change it there or by --set sweep={{...}}.")

    def swept(key):
        return f"{origin('sweep')}: {key}" if key in sweep else origin(key)

    cases = []
    for values in itertools.product(*sweep.values()):
        one = copy.deepcopy(raw)
        for key, value in zip(sweep, values):
            _put(one, key, value, f"{origin('sweep')}: {key}")
            if isinstance(one.get("name"), str):
                one["name"] += "-" + re.sub(r"[^\w.=-]+", "_", f"{str(key).split('.')[-1]}={_as_yaml(value)}")
        cases.append(_validated(one, swept))
    return cases


def _read(path, overrides):
    """The keys of a case file, of its bases and ``overrides``; a function that says whence a key is."""
    layers = _layers(Path(path), [])
    raw = {}
    for _, layer in reversed(layers):
        raw = _merged(raw, layer)
    replaced = [_override(raw, text) for text in overrides]

    def origin(key):
        if any(key == k or key.startswith((f"{k}.", f"{k}[")) for k in replaced):
            return f"--set {key}"
        parts = re.sub(r"\[\d+\]$", "", key).split(".")
        return f"{next((file for file, layer in layers if _holds(layer, parts)), path)}: {key}"

    return raw, origin


def _layers(path, above):
    """(file, keys) of a case file and of its bases, the file itself first; ``above`` are those that led to it."""
    whence = f"{above[-1]}: base: " if above else ""
    if any(path.resolve() == file.resolve() for file in above):
        circle = " -> ".join(map(str, [*above, path]))
        raise CaseError(f"{whence}leads in a circle ({circle}); take one of these bases out.")
    try:
        raw = _parse(path.read_bytes(), path)
    except OSError as error:
        raise CaseError(f"{whence}{path}: {error.strerror or error}; give the path of a case file.") from None
    if raw is None:
        raise CaseError(f"{path}: the file is empty; `vesdyn template` prints one to start from.")
    if not isinstance(raw, dict):
        raise CaseError(f"{path}: not a mapping of keys to values; `vesdyn template` prints one to start from.")
    for key in ("provenance", "name") if above else ("provenance",):
        raw.pop(key, None)
    base = raw.pop("base", None)
    if not isinstance(base, str | None):
        raise CaseError(f"{path}: base: {_as_yaml(base)} is not a path; give one relative to this file.")
    below = [] if base is None else _layers(path.parent / base, [*above, path])
    return [(path, _in_full(raw)), *below]


def _merged(defaults, keys):
    """``keys`` over ``defaults``, section by section; sections of the latter are not changed."""
    both = {k for k in keys if isinstance(keys[k], dict) and isinstance(defaults.get(k), dict)}
    return defaults | {k: _merged(defaults[k], keys[k]) if k in both else keys[k] for k in keys}


def _holds(layer, parts):
    """Whether the nested dict ``layer`` has the key at ``parts``."""
    for part in parts:
        if not isinstance(layer, dict) or part not in layer:
            return False
        layer = layer[part]
    return True


def _in_full(raw):
    """``raw`` with `mesh: auto` and `accuracy: 1%` written out."""
    if raw.get("mesh") == "auto":
        raw = raw | {"mesh": {"front_edge": "auto", "far_edge": "auto"}}
    percent = re.fullmatch(r"\s*([0-9.eE+-]+)\s*%\s*", str(raw.get("accuracy")))
    if percent:
        try:
            raw = raw | {"accuracy": float(percent[1]) / 100.0}
        except ValueError:
            pass  # said by the check of the type
    return raw


def _validated(raw, origin):
    """The case of the keys ``raw``; raise CaseError with a sentence for each fault."""
    try:
        return Case.model_validate(raw)
    except ValidationError as error:
        sentences = [s for e in _without_alternatives(error.errors()) for s in _sentences(e)]
        raise CaseError("\n".join(f"{origin(key)}: {text}" for key, text in sentences)) from None


def _parse(text, source):
    """Return the YAML ``text`` as plain Python; raise CaseError naming ``source`` and the line."""
    try:
        return yaml.load(text, _Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = error.problem or error.context
        raise CaseError(f"{source}: line {mark.line + 1}: {problem}; correct the YAML.") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise CaseError(f"{source}: not readable as YAML ({str(error).splitlines()[0]}); correct it.") from None


def _override(raw, text):
    """Put ``key.sub=value`` into the nested dict ``raw``; return the key."""
    key, equals, value = text.partition("=")
    key = key.strip()
    if not equals or not all(key.split(".")):
        raise CaseError(f"--set {text}: not of the form key.sub=value; write for instance --set time.end=0.5.")
    _put(raw, key, _parse(value, f"--set {key}"), f"--set {key}")
    return key


def _put(raw, key, value, source):
    """Put ``value`` at the dotted ``key`` of the nested dict ``raw``; ``source`` begins the error."""
    *sections, last = str(key).split(".")
    for section in sections:
        raw = raw.setdefault(section, {})
        if not isinstance(raw, dict):
            raise CaseError(f"{source}: {section} holds a value and has no keys in it; see `vesdyn template`.")
    raw[last] = value


# Errors as sentences -------------------------------------------------------------------------------------


_NUMBER = "is not a number; write a plain one such as 0.07, without quotes or units."
_WRONG = {  # pydantic's error type: what to say after the value
    "float_type": _NUMBER,
    "neither_number_nor_auto": "is neither a number nor auto; write one of them, without quotes or units.",
    "finite_number": "is not a finite number; give a finite one.",
    "int_type": "is not a whole number; write one such as 20000.",
    "bool_type": "is neither true nor false; write one of them.",
    "string_type": "is not text; put it in quotes.",
    "string_pattern_mismatch": "cannot name a directory; use letters, digits and, not first, '.', '_', '-', '='.",
    "string_too_long": "is too long; use at most {max_length} characters.",
    "tuple_type": "is not a list; write one such as [0.1, 0.2].",
    "model_type": "is not a section with keys; write for instance `{{key: value}}`, or leave it out.",
    "literal_error": "is not available; choose {expected}.",
    "greater_than": "is out of range; it must be greater than {gt:g}.",
    "greater_than_equal": "is out of range; it must be at least {ge:g}.",
    "less_than": "is out of range; it must be less than {lt:g}.",
    "less_than_equal": "is out of range; it must be at most {le:g}.",
}


def _without_alternatives(errors):
    """Join what pydantic says of a key that takes a number or `auto`: one error, at the key itself."""
    joined = {}
    for error in errors:
        alternative = error["loc"] and str(error["loc"][-1]) in ("constrained-float", "float", "literal['auto']")
        loc = error["loc"][:-1] if alternative else error["loc"]
        if alternative and isinstance(error["input"], str):
            error = error | {"type": "neither_number_nor_auto"}
        if loc not in joined or error["type"] != "literal_error":
            joined[loc] = error | {"loc": loc}
    return list(joined.values())


def _sentences(error):
    """Return (key, sentence) pairs for one of pydantic's errors."""
    if error["type"] == "value_error":  # from Case._consistent: sentences already
        return [line.split(": ", 1) for line in str(error["ctx"]["error"]).splitlines()]
    key = ".".join(str(part) for part in error["loc"])
    key = re.sub(r"\.(\d+)$", r"[\1]", key)
    if error["type"] == "missing":
        return [(key, "missing; give it.")]
    if error["type"] in ("extra_forbidden", "invalid_key"):
        return [(key, f"unknown key, {_suggestion(error['loc'])}")]
    value = _as_yaml(error["input"])
    value = value if len(value) <= 60 else f"{value[:57]}..."
    wrong = _WRONG.get(error["type"])
    wrong = wrong.format(**error.get("ctx", {})) if wrong else f"is refused: {error['msg']}."
    return [(key, f"{value} {wrong}")]


def _suggestion(location):
    """Return which key may have been meant by the unknown one at ``location``."""
    defaults = {key: field.default for key, field in Case.model_fields.items()}
    sections = {key: type(value).model_fields for key, value in defaults.items() if isinstance(value, _Section)}
    *parents, unknown = (str(part) for part in location)
    siblings = list(sections[parents[0]] if parents else Case.model_fields)
    if near := difflib.get_close_matches(unknown, siblings, n=1):
        return f"did you mean {near[0]}?"
    elsewhere = {subkey: f"{key}.{subkey}" for key, subkeys in sections.items() for subkey in subkeys}
    elsewhere |= {key: key for key in Case.model_fields}
    if near := difflib.get_close_matches(unknown, elsewhere, n=1):
        return f"did you mean {elsewhere[near[0]]}?"
    return f"leave it out; the keys here are {', '.join(siblings)}."
