"""Case files: YAML, the bases under a file, sweeps and `--set`; each fault told with where it was written.

Levels, the more specific first: what is given in Python or by `--set`, the sweep, the file, its base, the base of that
one; defaults come last. A stored case has its ``defaults`` with it, which hold as long as nothing else is asked for.
"""

import difflib
import itertools
import os
import re
import stat
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from vesdyn import plain_yaml
from vesdyn.case import SECTIONS, Case, in_full, merged, validated
from vesdyn.errors import CaseError
from vesdyn.refusals import argument, name_shown, printable, printable_path, shown

LARGEST_FILE = 1_000_000  # bytes
MOST_BASES = 20
MOST_CASES = 10_000
_PACKAGE = Path(__file__).parent
SHIPPED = (_PACKAGE / "configs", _PACKAGE.parent / "configs")  # as installed, and in a checkout of the sources


class _Level(NamedTuple):
    """Keys of one level; ``where`` begins the sentences about them, before the key."""

    where: str
    keys: dict


def load_case(path: str | os.PathLike, overrides: Sequence[str] = (), **changes) -> Case:
    """Read and validate a case.

    ``path`` is the YAML file, or the name of a shipped case (`shipped_case`) if there is no such file; ``overrides``
    are strings ``key.sub=value`` over what it says, their values read as YAML; ``changes`` are dotted keys or nested
    dicts over both: ``load_case("typical", membrane={"thickness": 0}, **{"time.end": 0.5})``. The keys of the file
    under ``base`` (a path relative to the one that names it) are its defaults, all but ``name``. A mapping under
    ``provenance``, as a run stores it, is passed over.

    Warns of what gave way to a more specific key. Raises CaseError, also for a file with a ``sweep``, which is many
    cases (`load_sweep`).
    """
    scene = _read(path, overrides, changes)
    if scene.sweep:
        batch = f"vesdyn batch {argument(os.fsdecode(path))}"
        raise CaseError(f"{scene.sweep_where}: makes many cases of this file; run them by `{batch}`.")
    case = _case(scene.levels, scene.path)
    return _with_stored_defaults(case, scene) if scene.defaults is not None else case


def load_sweep(path, overrides=(), **changes):
    """Read and validate the cases of one file: every combination of the values under its ``sweep``.

    ``sweep`` maps dotted keys to lists of values; ``<name>-<key>=<value>`` is the name of each case. Without
    one the file is one case. ``path``, ``overrides`` and ``changes`` as for `load_case`.

    Raises CaseError.
    """
    overrides = [overrides] if isinstance(overrides, str) else list(overrides)
    scene = _read(path, overrides, changes)
    sweep, where = scene.sweep, scene.sweep_where
    if not sweep:
        return [load_case(path, overrides, **changes)]
    if not isinstance(sweep, dict):
        raise CaseError(f"{where}: not a grid; write for instance {{adhesion.cutoff: [0.06, 0.1]}}.")
    combinations = 1
    for key, values in sweep.items():
        if not isinstance(values, list) or not values:
            raise CaseError(f"{where}: {printable(key)}: not a list of values; write one such as [0.06, 0.1].")
        for level in scene.levels:
            if _is_set(level) and _holding(level.keys)(key) and not isinstance(_at(level.keys, key), dict):
                raise CaseError(
                    f"{level.where}{printable(key)}: is swept in {scene.path}; change it there or by --set sweep={{...}}."
                )
        combinations *= len(values)
    if combinations > MOST_CASES:
        raise CaseError(f"{where}: makes {combinations:,} cases; make at most {MOST_CASES:,} at once.")
    below = [level for level in scene.levels if not _is_set(level)]
    above = [level for level in scene.levels if _is_set(level)]
    name = merged([level.keys for level in scene.levels])[0].get("name")
    cases = []
    for values in itertools.product(*sweep.values()):
        swept = [_level(f"{where}: ", {key: value}, scene.sweep_folder) for key, value in zip(sweep, values)]
        one = _Level(f"{where}: ", _together(swept))
        levels = [*below, one, *above]
        if isinstance(name, str):
            parts = (f"{str(key).split('.')[-1]}={_on_one_line(value)}" for key, value in zip(sweep, values))
            named = "-".join([name, *(re.sub(r"[^\w.=-]+", "_", part, flags=re.ASCII) for part in parts)])
            levels.append(_Level(next((l.where for l in reversed(levels) if "name" in l.keys), ""), {"name": named}))
        cases.append(_case(levels, scene.path))
    return cases


def shipped_case(name):
    """Return the path of the case that comes with vesdyn as ``name``, "typical" or "real/red-cell"; None if none does."""
    name = str(name).removesuffix(".yaml")
    if re.fullmatch(r"(real/)?[\w.=-]+", name):
        for folder in SHIPPED:
            if os.path.isfile(file := folder / f"{name}.yaml"):
                return file
    return None


# Levels --------------------------------------------------------------------------------------------------


class _Scene(NamedTuple):
    path: str  # as it is shown
    levels: list  # of _Level, the most specific last
    sweep: object
    sweep_where: str
    sweep_folder: Path  # from which paths in it are taken
    defaults: dict | None  # of a stored case as it stands


def _read(path, overrides, changes):
    """What a case file, its bases, ``overrides`` and ``changes`` say, level by level."""
    if not isinstance(path, (str, os.PathLike)):
        raise CaseError(f"{shown(path)}: is not a path; give that of a case file or the name of a shipped case.")
    path = Path(os.fsdecode(path))
    if len(path.parts) <= 2 and not os.path.isfile(path) and (shipped := shipped_case(path)):
        path = shipped
    files = _files(path, [])
    overrides = [overrides] if isinstance(overrides, str) else list(overrides)
    sets = [_override(text) for text in overrides]
    defaults = files[0][1].pop("defaults", None)
    levels, sweep, sweep_where, sweep_folder = [], None, "", Path()
    for file, keys in reversed(files):  # the least specific first
        keys.pop("defaults", None)
        if "sweep" in keys:
            sweep, sweep_where, sweep_folder = keys.pop("sweep"), f"{printable_path(file)}: sweep", file.parent
        levels.append(_level(f"{printable_path(file)}: ", keys, file.parent))
    for one in sets:
        if "sweep" in one.keys:
            sweep, sweep_where, sweep_folder = one.keys.pop("sweep"), "--set sweep", Path()
    if any(one.keys for one in sets):
        levels.append(_Level("--set ", _together(sets, warn=True)))
    if changes:
        levels.append(_level("", changes))
    asked = overrides or changes or sweep
    return _Scene(printable_path(path), levels, sweep, sweep_where, sweep_folder, None if asked else defaults)


def _level(where, keys, folder=Path()):
    """The keys of one level in full, paths taken from ``folder``; raise CaseError that says where."""
    try:
        keys = in_full(keys, keep_null=True)
    except CaseError as error:
        raise CaseError(f"{where}{error}") from None
    if isinstance(keys.get("mesh"), dict) and isinstance(keys["mesh"].get("file"), str):
        keys["mesh"]["file"] = os.path.join(folder, keys["mesh"]["file"])
    return _Level(where, keys)


def _together(levels, warn=False):
    """The keys of ``levels`` that count as one level, the last one first; ``warn`` of what gives way."""
    keys = {}
    for level in levels:
        for key, value in level.keys.items():
            both = isinstance(value, dict) and isinstance(keys.get(key), dict)
            there, here = (keys[key], value) if both else ({None: keys.get(key, value)}, {None: value})
            for inner in there.keys() & here.keys() if warn else ():
                if there[inner] != here[inner]:
                    warnings.warn(
                        f"{level.where}{printable(key if inner is None else f'{key}.{inner}')}: {shown(there[inner])}"
                        f" gives way to {shown(here[inner])}, which is given after it.",
                        stacklevel=4,
                    )
            keys[key] = there | here if both else value
    return keys


def _is_set(level):
    return level.where in ("--set ", "")


def _case(levels, path):
    """The case of ``levels``; warns of what gave way."""

    holding = [(level.where, _holding(level.keys)) for level in reversed(levels)]

    def origin(key):
        where = next((where for where, holds in holding if holds(key)), f"{path}: ")
        return f"{where}{key}"

    keys, notes = merged([level.keys for level in levels])
    case = validated(keys, origin)
    for key, sentence in notes:
        warnings.warn(f"{origin(key)}: {sentence}", stacklevel=3)
    return case


def _with_stored_defaults(case, scene):
    """The stored ``case`` with the defaults it was stored with."""
    where = f"{scene.path}: defaults"
    if not isinstance(scene.defaults, dict):
        raise CaseError(f"{where}: not a mapping of keys to values; take it out.")
    level = _level(f"{where}: ", scene.defaults)
    given = _holding(case.given_keys())
    return case.with_defaults(level.keys, lambda key: f"{scene.path if given(key) else where}: {key}")


def _holding(keys):
    """A function: whether the nested dict ``keys`` has a dotted key, as sentences have it, or one above it that holds a value."""
    every, values = set(), set()

    def walk(nested, prefix):
        for name, inner in nested.items():
            dotted = prefix + name_shown(name)
            every.add(dotted)
            if isinstance(inner, dict):
                walk(inner, f"{dotted}.")
            else:
                values.add(dotted)

    def holds(key):
        key = str(key)
        listed = re.sub(r"(\[\d+\])+$", "", key)
        return key in every or listed in every or any(key[:i] in values for i, sign in enumerate(key) if sign == ".")

    walk(keys, "")
    return holds


def _at(keys, key):
    """What is at the dotted ``key`` of the nested dict ``keys``, or above it."""
    for part in key.split("."):
        keys = keys[part] if isinstance(keys, dict) else keys
    return keys


def _files(path, above):
    """(file, keys) of a case file and of its bases, the file itself first; ``above`` are those that led to it."""
    whence = f"{printable_path(above[-1])}: base: " if above else ""
    shown_path = printable_path(path)
    if any(os.path.realpath(path) == os.path.realpath(file) for file in above):
        raise CaseError(f"{whence}leads in a circle, back to {shown_path}; take one of these bases out.")
    if len(above) > MOST_BASES:
        raise CaseError(f"{whence}is more than {MOST_BASES} bases deep; write some of them as one.")
    raw = plain_yaml.read(_contents(path, whence), shown_path)
    if raw is None:
        raise CaseError(f"{shown_path}: the file is empty; `vesdyn template` prints one to start from.")
    if not isinstance(raw, dict):
        raise CaseError(f"{shown_path}: not a mapping of keys to values; `vesdyn template` prints one to start from.")
    for key in ("provenance", "name", "defaults") if above else ("provenance",):
        raw.pop(key, None)
    base = raw.pop("base", None)
    if base is not None and (not isinstance(base, str) or not base.strip() or "\0" in base):
        raise CaseError(f"{shown_path}: base: {shown(base)} is not a path; give one relative to this file.")
    return [(path, raw), *([] if base is None else _files(path.parent / base, [*above, path]))]


def _contents(path, whence):
    """The bytes of the file ``path``, which is a regular one and not large."""
    advice = "give the path of a case file"
    if not whence:
        advice += " or the name of a shipped case"
        names = sorted({file.stem for folder in SHIPPED for file in folder.glob("*.yaml")})
        if near := difflib.get_close_matches(path.name.removesuffix(".yaml")[:60], names, n=1):
            advice = f"did you mean the shipped case {near[0]}?"
    advice += "" if advice.endswith("?") else "."
    where = f"{whence}{printable_path(path)}"
    try:
        status = os.stat(path)
        if stat.S_ISDIR(status.st_mode):
            raise CaseError(f"{where}: Is a directory; {advice}")
        if not stat.S_ISREG(status.st_mode):
            raise CaseError(f"{where}: is not a regular file; {advice}")
        if status.st_size > LARGEST_FILE:
            raise CaseError(f"{where}: has {status.st_size:,} bytes, and a case at most {LARGEST_FILE:,}; {advice}")
        with open(path, "rb") as file:
            return file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, CaseError):
            raise
        reason = getattr(error, "strerror", None) or "is not a path"
        raise CaseError(f"{where}: {reason}; {advice}") from None


def _override(text):
    """The level of one ``key.sub=value``."""
    if not isinstance(text, str):
        raise CaseError(f"--set {shown(text)}: not of the form key.sub=value; write for instance --set time.end=0.5.")
    key, equals, value = text.partition("=")
    key = key.strip()
    if not equals or not all(key.split(".")):
        shown_text = printable(text)
        raise CaseError(f"--set {shown_text}: not of the form key.sub=value; write for instance --set time.end=0.5.")
    return _level("--set ", {key: plain_yaml.read(value, f"--set {printable(key)}")})


def _on_one_line(value):
    return plain_yaml.write(value, width=float("inf"), flow=True).strip()


# Template ------------------------------------------------------------------------------------------------


def template():
    """Return a commented case file with every key, its default, its meaning and its unit."""
    lines = [
        "# A vesdyn case. Units: length a0 (initial diameter), time a0^2/D, energy kT, density c_r0.",
        "# Keys stand here with their defaults; take away the # in front of those you change.",
        "",
        "# base: other.yaml                        # case file whose keys are the defaults of this one",
        "# sweep: {adhesion.cutoff: [0.06, 0.1]}   # many cases, one of each combination of values (vesdyn batch)",
        "",
    ]

    def add(key, field, default, indent="", mark="# "):
        lines.append(f"{f'{indent}{mark}{key}: {_on_one_line(default)}':<42}# {field.description}")

    for key, field in Case.model_fields.items():
        if SECTIONS[key]:
            lines.append(f"{key}:")
            for subkey, subfield in type(field.default).model_fields.items():
                default = subfield.default
                add(subkey, subfield, list(default) if isinstance(default, tuple) else default, "  ")
        elif field.is_required():
            add(key, field, "typical", mark="")
        else:
            add(key, field, field.default)
    return "\n".join(lines) + "\n"
