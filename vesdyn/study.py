"""Studies: runs named by a case and what is changed in it, computed once and kept; curves with errors.

A curve is a case run at its accuracy wish and once more at a quarter of it. Errors fall with the wish, so the
difference of the two runs is three quarters of the error of the first. What is given as the error is the largest
relative one of all t >= START: mesh, step and tolerance together.

Times in a0^2/D, areas in a0^2.
"""

import hashlib
import re
import time
import warnings
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from vesdyn.batch import run_batch
from vesdyn.body import set_shares_below
from vesdyn.case import Case
from vesdyn.case_file import load_case, shipped_case
from vesdyn.diagnostics import BINDING_GAP
from vesdyn.errors import CaseError, RunError
from vesdyn.front import faces_on_plane, front_radius, front_shape, modulation, rim_radius
from vesdyn.kinds import topology_of
from vesdyn.planning import needs_planning, plan
from vesdyn.provenance import sources_hash
from vesdyn.run import run_case
from vesdyn.spreading import Spreading
from vesdyn.stepping import march
from vesdyn.storage import DamagedRunError, RunDirectory

FINER = 0.25  # accuracy wish of the second run of a curve / wish of the first
START = 0.01  # errors are those after this time [a0^2/D]
ON_MERIDIAN = {"model": "axisymmetric", "mesh.front_edge": "auto", "mesh.far_edge": "auto", "time.step": "auto"}
UNCHANGED = MappingProxyType({})
_APART = 1.1  # factor between the times whose areas give a local exponent
_LONGEST_NAME = 90
_WARM_UP = {
    "mesh.front_edge": 0.05, "mesh.far_edge": 0.1, "time.end": 0.008, "time.step": 0.001, "output.frames": (),
}  # fmt: skip


# Runs ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Study:
    """Where the runs of a study are kept, and how they are made.

    A run is named by a case and ``changes``, a dict of dotted keys and values. The case is ``configs``/<name>.yaml,
    or the shipped one of that name where no ``configs`` are given. A run is kept in ``directory`` under a name that
    tells both and ends with the hash of the case, so that a case that was edited is another run. A stored run is used
    again whatever the version that computed it, which is warned of where the sources were others: remove the directory
    to measure anew. One that is not as it was written is computed anew. ``jobs`` runs are computed side
    by side (by default one a core), ``every`` holds changes made to each run. ``show`` keeps a table of the runs on
    stderr while they are computed. ``draws`` are changes at each of which every curve is run as well, parameters drawn
    from what the prints leave open (`Curve.band`).
    """

    directory: Path
    configs: Path | None = None
    jobs: int | None = None
    every: dict = field(default_factory=dict)
    show: bool = False
    draws: tuple = ()

    def case(self, name, changes=UNCHANGED):
        """The case ``name`` with ``changes`` as asked for, before anything that is `auto` is chosen.

        A run made shorter keeps the frames that it reaches. Raises vesdyn.errors.CaseError.
        """
        file = shipped_case(name) if self.configs is None else self.configs / f"{name}.yaml"
        if file is None:
            raise CaseError(f"{name}: is not a shipped case; give the folder of its file as configs.")
        with _without_doubts():
            case = load_case(file, **changes).changed(**self.every)
            return case.changed(name=_run_name(name, changes, case.hash))

    def planned(self, name, changes=UNCHANGED):
        """The case as it is run, what it leaves open chosen, and the decisions (`vesdyn.planning.plan`)."""
        case = self.case(name, changes)
        return plan(case)[:2] if needs_planning(case) else (case, ())

    def path(self, name, changes=UNCHANGED):
        """Directory of a run, whether it is there or not."""
        return self.directory / self.case(name, changes).name

    def file(self, what, changes, suffix):
        """File for numbers that are not the history of a run: named by ``what`` and ``changes``."""
        self.directory.mkdir(parents=True, exist_ok=True)
        digest = hashlib.sha256(repr(sorted({**changes, **self.every}.items())).encode()).hexdigest()
        return self.directory / f"{_run_name(what, changes, digest)}.{suffix}"

    def prepare(self, runs):
        """Compute those of ``runs``, pairs of a case's name and changes, that are not finished, side by side.

        Raises RunError with a sentence for each that does not come to its end.
        """
        cases = {self.path(*run): self.case(*run) for run in runs}
        missing = [case for path, case in cases.items() if not _is_finished(path)]
        if len(missing) > 1 and self.jobs != 1:
            with _without_doubts():
                outcomes = run_batch(
                    missing, self.directory, jobs=self.jobs and min(self.jobs, len(missing)), show=self.show
                )
            _check(outcomes)

    def run(self, name, changes=UNCHANGED):
        """The finished run, a `vesdyn.storage.RunDirectory`; computed here and now if need be.

        Raises RunError.
        """
        path = self.path(name, changes)
        if not _is_finished(path):
            case, decisions = self.planned(name, changes)
            with _without_doubts():
                try:
                    outcome = run_case(case, path, progress=self.show, decisions=decisions)
                except DamagedRunError:  # told by `_is_finished`
                    outcome = run_case(case, path, progress=self.show, decisions=decisions, restart=True)
            _check([(case, outcome)])
        return RunDirectory(path)

    def history(self, name, changes=UNCHANGED):
        """Columns of the history of a run, name to array (n_steps,); computed if need be."""
        return self.run(name, changes).history()

    def frames(self, name, changes=UNCHANGED):
        """Stored shapes of a run in order of time; computed if need be.

        Dicts of ``time``, ``elements`` (n_elements, k) and the stored arrays by name.
        """
        return [
            {"time": frame.time, "elements": frame.connectivity, **frame.nodes, **frame.cells}
            for frame in self.run(name, changes).frames()
        ]

    def resolution(self, name, changes=UNCHANGED):
        """Front edge [a0] and number of nodes of a run."""
        case = load_case(self.run(name, changes).case_file)
        return case.mesh.front_edge, len(self.frames(name, changes)[0]["position"])

    def cpu_time(self, name, changes=UNCHANGED):
        """CPU time [s] of the coupling steps of a run, kernels compiled; measured once, then kept beside it."""
        note = self.run(name, changes).path / "cpu_time.txt"
        if not note.exists():
            case = load_case(note.with_name("case.yaml"))
            self.compile_kernels(case.model)
            note.write_text(repr(_time_steps(case)))
        return float(note.read_text())

    def compile_kernels(self, model):
        """Take a few steps of a coarse body, so that a measurement after it holds no compilation."""
        _time_steps(self.planned("quick", {"model": model, **_WARM_UP})[0])

    # Curves

    def curves(self, names, changes=None):
        """A `Curve` of each case of ``names``, with the same ``changes`` or a list of its own for each."""
        changes = changes if isinstance(changes, (list, tuple)) else [changes or UNCHANGED] * len(names)
        pairs = [self._both_runs(name, change) for name, change in zip(names, changes)]
        drawn = [self._drawn_runs(name, change) for name, change in zip(names, changes)]
        self.prepare([run for runs in (*pairs, *drawn) for run in runs])
        return [
            Curve(name, change, self.case(name, change), self.history(*own), self.history(*finer),
                  spread=tuple(self.history(*run) for run in runs))
            for name, change, (own, finer), runs in zip(names, changes, pairs, drawn)
        ]  # fmt: skip

    def varied(self, curves, changes):
        """The ``curves`` with further ``changes``, to be compared with them: run once, with the same errors."""
        runs = [(curve.name, {**curve.changes, **changes}) for curve in curves]
        self.prepare(runs)
        return [
            Curve(*run, self.case(*run), history := self.history(*run), history, errors_of=curve)
            for run, curve in zip(runs, curves)
        ]

    def _drawn_runs(self, name, changes):
        """The runs of a curve at each of ``draws``; none where something else is held than these vary."""
        if "receptors" in changes or "receptors.drift_number" in changes:
            return []
        return [(name, {**changes, **draw}) for draw in self.draws]

    def _both_runs(self, name, changes):
        """The two runs of a curve, at its wish and at a quarter of it."""
        return (name, changes), (name, {**changes, "accuracy": self.case(name, changes).accuracy * FINER})


def _run_name(name, changes, digest):
    """Name of a run: the case's, what is changed in it, and a hash of all that it computes."""
    words = [f"{key.split('.')[-1]}={_in_short(value)}" for key, value in changes.items()]
    words = re.sub(r"[^A-Za-z0-9.=_-]+", "", "_".join([name, *words]))
    return f"{words[:_LONGEST_NAME]}-{digest[:8]}"


def _in_short(value):
    return f"{value[0]}..{value[-1]}" if isinstance(value, (list, tuple)) and len(value) > 2 else value


def _is_finished(path):
    """Whether a run in ``path`` came to its end and is as it was written; each is looked through once a process."""
    directory = RunDirectory(path)
    if directory.status().get("state") != "finished":
        return False
    key = str(path), directory.status_file.stat().st_mtime_ns
    if key not in _WHOLE:
        _WHOLE[key] = not directory.faults()
        if not _WHOLE[key]:
            warnings.warn(f"{' '.join(directory.faults())} This is done now.", stacklevel=3)
        elif directory.sources() != sources_hash():
            warnings.warn(f"{path}: was computed by other sources; remove it to compute it by these.", stacklevel=3)
    return _WHOLE[key]


_WHOLE = {}  # of each finished run that was looked through, by its path and the time of its end


def _check(outcomes):
    """Raise RunError unless all ``outcomes``, pairs of a case and its outcome, are finished."""
    faults = [
        f"{case.name}: {outcome.state}, {outcome.reason}" for case, outcome in outcomes if outcome.state != "finished"
    ]
    if faults:
        raise RunError("\n".join(faults))


@contextmanager
def _without_doubts():
    """Context in which nothing is said of a case that is coarse on purpose; the run stores the sentences."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _time_steps(case):
    """CPU time [s] of the coupling steps of ``case``."""
    sim = Spreading(case)
    began = time.process_time()
    for _ in march(sim):
        pass
    return time.process_time() - began


# Histories -----------------------------------------------------------------------------------------------


def value_at(history, column, times):
    """A column of a history at ``times``; once the run has ended, its last value.

    Between the steps it is interpolated by a cubic spline in sqrt(t), in which it is smooth at the start.
    """
    return CubicSpline(np.sqrt(history["time"]), history[column])(np.sqrt(np.minimum(times, history["time"][-1])))


def area_at(history, times):
    """Binding area [a0^2] at ``times``, see `value_at`."""
    return value_at(history, "binding_area", times)


def area_error(history, finest, start=START, end=np.inf):
    """Largest relative error of the binding area over all steps with ``start`` <= t <= ``end``."""
    t = history["time"]
    use = (t >= start) & (t <= min(end, finest["time"][-1]))
    return np.max(np.abs(history["binding_area"][use] / area_at(finest, t[use]) - 1.0))


def time_of(history, part):
    """Time at which ``part`` of the final binding area is reached first."""
    area = np.maximum.accumulate(history["binding_area"])
    return float(np.interp(part * history["binding_area"][-1], area, history["time"]))


def fitted_order(lengths, errors):
    """Slope of log error against log length, and the standard error of the fit (nan where it is not known)."""
    x, y = np.log(lengths), np.log(np.abs(errors))
    slope, offset = np.polyfit(x, y, 1)
    if len(x) < 3:
        return float(slope), np.nan
    scatter = np.sum((y - slope * x - offset) ** 2) / (len(x) - 2)
    return float(slope), float(np.sqrt(scatter / np.sum((x - x.mean()) ** 2)))


# Curves --------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Curve:
    """A case with ``changes`` run at its accuracy wish and at a quarter of it: two histories, and so an error.

    One that is only to be compared with another in the wish's own accuracy takes its relative errors from that
    curve, ``errors_of``. Made by `Study.curves` and `Study.varied`.
    """

    name: str
    changes: dict
    case: Case  # as asked for
    history: dict
    finer: dict
    errors_of: "Curve | None" = None
    spread: tuple = ()  # histories at parameters drawn from what the prints leave open

    def value(self, key):
        """What the case says of ``key``, a dotted key."""
        found = self.case
        for part in key.split("."):
            found = getattr(found, part)
        return found

    @property
    def end(self):
        """Time at which the run ended."""
        return float(self.history["time"][-1])

    @property
    def final(self):
        """Binding area [a0^2] at the end."""
        return float(self.history["binding_area"][-1])

    def at(self, times, column="binding_area"):
        """A column of the history at ``times``, its last value once the run has ended."""
        return value_at(self.history, column, times)

    def band(self, times):
        """Lowest and highest binding area (n,), (n,) at ``times`` over the drawn parameters; None where there are none."""
        if not self.spread:
            return None
        areas = [area_at(history, np.maximum(times, history["time"][0])) for history in self.spread]
        return np.min(areas, axis=0), np.max(areas, axis=0)

    def error(self, column="binding_area"):
        """Estimated relative error of a column of the history."""
        if self.errors_of:
            return self.errors_of.error(column)
        use = self.history["time"] >= min(START, self.end)
        exact = value_at(self.finer, column, self.history["time"][use])
        return float(np.max(np.abs(self.history[column][use] / exact - 1.0)) / (1.0 - FINER))

    def time_of(self, part):
        """Time at which ``part`` of the final binding area is reached."""
        return time_of(self.history, part)

    def time_error(self, part):
        """Estimated error of `time_of`."""
        if self.errors_of:
            return self.errors_of.time_error(part)
        return abs(time_of(self.history, part) - time_of(self.finer, part)) / (1.0 - FINER)

    def exponent(self, times):
        """Local exponent d ln A / d ln t at ``times``, the slope from t/1.1 to 1.1 t of the finer run."""
        return _local_exponent(self.finer, times)

    def exponent_error(self, times):
        """Estimated error of `exponent`: its difference between the two runs.

        Scatter from the passage of the front over the mesh does not fall with the wish, so that the whole difference
        counts.
        """
        if self.errors_of:
            return self.errors_of.exponent_error(times)
        return np.abs(_local_exponent(self.history, times) - _local_exponent(self.finer, times))


def _local_exponent(history, times):
    ahead, behind = (np.log(area_at(history, np.multiply(times, factor))) for factor in (_APART, 1.0 / _APART))
    return (ahead - behind) / (2.0 * np.log(_APART))


def common_times(curves, n=200):
    """Times (n,) at equal ratios, from the first at which errors count to the end of the longest run."""
    last = max(curve.end for curve in curves)
    return np.geomspace(min(START, 0.5 * last), last, n)


def separation(lower, upper, times):
    """Relative difference of two curves at ``times``, and what their errors together allow."""
    return upper.at(times) / lower.at(times) - 1.0, lower.error() + upper.error()


def holds_from(lower, upper):
    """Time from which ``upper`` stays above ``lower`` by more than their errors; inf if never to stay."""
    times = common_times([lower, upper])
    apart, allowed = separation(lower, upper, times)
    late = np.flatnonzero(apart <= allowed)
    if not len(late):
        return float(times[0])
    return float(times[late[-1] + 1]) if late[-1] + 1 < len(times) else np.inf


def goes_one_way(times, values, error, sign):
    """True where ``values`` only rise (``sign`` +1) or only fall (-1) from START on, but for their ``error``."""
    late = sign * values[times >= START]
    return bool(np.all(late >= np.maximum.accumulate(late) - error) and late[-1] - late[0] > error)


# The paper's figures -------------------------------------------------------------------------------------


class Family(NamedTuple):
    """Curves of one figure: ``cases`` by name, which differ in ``key``."""

    cases: tuple
    key: str


FAMILIES = {
    "figure2": Family(("typical-auto",), "membrane.shear_modulus"),
    "figure3": Family(("typical-auto",), "membrane.shear_modulus"),
    "figure4": Family(("fig4-K0.603", "fig4-K1.206", "fig4-K1.81", "fig4-K3.018"), "membrane.shear_modulus"),
    "figure5": Family(("fig5-T0.302", "fig5-T0.604", "fig4-K1.81", "typical-auto"), "adhesion.traction"),
    "figure6": Family(("fig6-dc0.06", "fig4-K1.81", "fig6-dc0.18"), "adhesion.cutoff"),
    "figure7": Family(("fig7-q1.5", "fig7-q2", "fig7-q3", "typical-auto"), "adhesion.ligand_ratio"),
}
SNAPSHOTS = (0.008, 0.044, 0.128, 0.56)  # of Fig. 2


def at_one_product(study):
    """Curves of Fig. 6 with the traction changed so that T_max d_c is that of the middle one."""
    names = FAMILIES["figure6"].cases
    laws = [study.case(name).adhesion for name in names]
    product = laws[1].traction * laws[1].cutoff
    changes = [{"adhesion.traction": float(f"{product / law.cutoff:.6g}")} for law in laws]
    return study.curves(names, [changes[0], {}, changes[2]])


def with_drift_number_held(study):
    """Curves of Fig. 7 with the drift number of the largest ratio, in the place of its mobility."""
    names = FAMILIES["figure7"].cases
    change = {"receptors.drift_number": study.case(names[-1]).drift_number}
    return study.curves(names, [change] * (len(names) - 1) + [{}])


def density_range(curve, times=SNAPSHOTS):
    """Smallest and largest density [c_r0] at ``times``, each with its error."""
    low, high = float(curve.at(times, "density_min").min()), float(curve.at(times, "density_max").max())
    return (low, low * curve.error("density_min")), (high, high * curve.error("density_max"))


# Fronts --------------------------------------------------------------------------------------------------


class FrontShapes(NamedTuple):
    """The membrane where it leaves the plane, against time, as read from meridians."""

    times: np.ndarray  # (n,)
    shapes: np.ndarray  # (n, 4) as `vesdyn.front.FrontShape`
    errors: np.ndarray  # (n, 4) difference from a run at a quarter of the accuracy wish
    meridians: list  # n of (n_nodes, 2) [a0]
    case: Case


def front_shapes(study, name, times, accuracy=0.01, changes=UNCHANGED):
    """`FrontShapes` of a case, run as a meridian, at those of ``times`` that it reaches."""
    wish = {"model": "axisymmetric", "output.frames": list(times), **changes}
    runs = [(name, {**wish, "accuracy": accuracy * part}) for part in (1.0, FINER)]
    study.prepare(runs)
    case = study.case(*runs[0])
    coarse, fine = ({frame["time"]: frame["position"] for frame in study.frames(*run)[1:]} for run in runs)
    t = [time for time in coarse if time in case.output.frames and time in fine]  # the ends of both runs may differ
    shapes, finer = (np.array([front_shape(x[time], case.adhesion.cutoff) for time in t]) for x in (coarse, fine))
    return FrontShapes(np.array(t), shapes, abs(finer - shapes), [coarse[time] for time in t], case)


LEVELS = {"contact": BINDING_GAP, "above": 0.3}  # gap / d_c at which a front is read
NODES = "touching nodes"  # the other way to read one


def contour_radius(frame, level, n_angles=360):
    """Radius (n_angles,) [a0] of the contour of a stored surface at height ``level`` [a0], about its own centre."""
    x = frame["position"]
    topology = topology_of(frame["elements"])
    share = np.zeros(len(topology.edges))
    set_shares_below(topology, x, level, share)
    return front_radius(x, topology.edges, share, n_angles)


def displaced_fronts(study, name, times, changes=UNCHANGED):
    """Fronts of the run ``name`` and of its control, ``name``-control, in which nothing is displaced.

    By way of reading (LEVELS, NODES) and time: a pair of radii (360,) [a0]. Second value: the control's shapes.
    """
    runs = [(name, changes), (f"{name}-control", changes)]
    study.prepare(runs)
    cutoff = study.case(*runs[0]).adhesion.cutoff
    frames = [study.frames(*run) for run in runs]
    near = [[min(some, key=lambda f: abs(f["time"] - t)) for t in times] for some in frames]
    ways = {way: lambda frame, level=part * cutoff: contour_radius(frame, level) for way, part in LEVELS.items()}
    ways[NODES] = lambda frame: rim_radius(frame["position"], faces_on_plane(frame["elements"], frame["gap"]))
    fronts = {way: {t: tuple(map(read, pair)) for t, *pair in zip(times, *near)} for way, read in ways.items()}
    return fronts, near[1]


def left_of_displacement(moved, still):
    """What a displacement leaves of itself in a front ``moved`` (n,), of the mean of its control ``still`` (n,)."""
    return modulation(moved - still, still)
