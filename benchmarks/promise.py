"""The promise `accuracy: 1%` tried on random scenes: docs/promise.md and its picture are written by this script.

Each scene is drawn log-uniformly over what real vesicles and cells span (RANGES), run at the wishes of 4 % and 1 % as
`auto` plans it, and compared with a meridian of Newton's method on a finer mesh with finer steps. The reference has two
levels; their difference is its own error. Where the finer one would take too long the coarser one is the reference, and
all of its distance from the run at 1 % counts as its own error. Errors of the binding area count at all times after it has passed
`vesdyn.budget.WISHED_FROM` of its final value; a scene ends when a scout has reached ENDS_AT of its final area.

    python benchmarks/promise.py [--limit N] [--jobs N] [--seconds S] [--draw]

One row for each scene and level is appended to runs/promise/rows.csv, its curve stands beside: what is there, and was
computed by these very sources, is not computed again.
"""

import argparse
import csv
import multiprocessing
import os
import re
import resource
import signal
import time
import warnings
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # the systems are banded and small

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from vesdyn.budget import WISHED_FROM
from vesdyn.case import Case
from vesdyn.diagnostics import Moment
from vesdyn.errors import CaseError, RunError
from vesdyn.meshing import reduced_volume, spheroid_area
from vesdyn.planning import plan, survey
from vesdyn.provenance import provenance, sources_hash
from vesdyn.spreading import Spreading
from vesdyn.stepping import march

ROOT = Path(__file__).parents[1]
RUNS, PAGE = ROOT / "runs" / "promise", ROOT / "docs" / "promise.md"
SCENES, SEED = 100, 2026
RANGES = {  # log-uniform; issue of the wish kept everywhere, item 3
    "softness": (1e-3, 10.0),  # T_max d_c / (2 K)
    "cutoff": (1e-3, 0.2),  # d_c [a0]
    "slowness": (1e-3, 1e4),  # drag D / (T_max d_c)
    "binding": (1.0, 20.0),  # drift number T_max d_c / 2 [kT]
    "ligand_ratio": (0.5, 30.0),  # q
    "shear_modulus": (0.1, 1e5),  # K [kT/a0^2]: a scale, which must not matter
    "thickness": (2e-3, 0.06),  # h [a0]; none in a quarter of the scenes
}
PRESTRETCH, REDUCED_VOLUME = (1.0, 1.2), (0.6, 1.0)  # uniform, each in a part of the scenes:
KINDS = {"sphere": 0.35, "swollen": 0.25, "oblate": 0.25, "prolate": 0.15}
THINNEST_LAYER = 2e-4  # [a0]: a receptor of 5 nm on a vesicle of 25 um, the largest there are
TAUT = 1.05  # prestretch from which a membrane is in tension everywhere (tests/verification/test_static_adhesion)
WISHES = (0.04, 0.01)
REFERENCES = {"coarser": (1.4, 0.5), "finer": (2.0, 0.25)}  # edge of the 1 % mesh over its own; accuracy over 1 %
ENDS_AT = 0.95  # of the final area, by a scout
BEFORE_FOLD = 0.8  # of the time at which a scout folds: the end of a scene that does
LATEST = 300.0  # [a0^2/D] per 1 + slowness: the scout's own end
SECONDS, REFERENCE_TIME = 30.0, 1.5  # of CPU for a wish; as many times that for a level of the reference
QUANTITIES = ("binding_area", "contact_radius", "pressure", "density_max", "density_min")
UNITS = {"seconds": 1.0, "minutes": 60.0, "hours": 3600.0, "days": 86400.0}  # [s]
FORK = multiprocessing.get_context("fork")  # kernels that are loaded need not be loaded again
BELIEVED = "area_error"  # column of the error that a run believes to have
FIELDS = "scene level sources status cause seconds told steps nodes edge stated warned end".split()
FINER_COSTS = 3.0  # times as much as the coarser reference


# Scenes --------------------------------------------------------------------------------------------------


def scenes(count=SCENES, seed=SEED):
    """The first ``count`` scenes as dicts of numbers that belong together, and how many of each rule were refused."""
    rng, accepted, refused = np.random.default_rng(seed), [], {rule: 0 for rule, _ in RULES}
    while len(accepted) < count:
        scene = {key: float(f"{np.exp(rng.uniform(*np.log(ends))):.3g}") for key, ends in RANGES.items()}
        kind, bare = rng.choice(list(KINDS), p=list(KINDS.values())), rng.random() < 0.25
        scene["thickness"] *= not bare
        swollen, flat = rng.uniform(*PRESTRETCH), rng.uniform(*REDUCED_VOLUME)
        scene["kind"] = str(kind)
        scene["prestretch"] = round(swollen, 3) if kind == "swollen" else 1.0
        scene["reduced_volume"] = round(flat, 3) if kind in ("oblate", "prolate") else 1.0
        broken = [rule for rule, holds in RULES if not holds(scene)]
        for rule in broken:
            refused[rule] += 1
        if not broken:
            accepted.append({"scene": f"S{len(accepted):03d}", **scene})
    return accepted, refused


RULES = (
    (
        f"the layer of receptors at the front, d_c / (2 binding energy), is at least {THINNEST_LAYER:g} a0 wide: a receptor"
        " of 5 nm on a vesicle of 25 um",
        lambda s: s["cutoff"] / (2.0 * s["binding"]) >= THINNEST_LAYER,
    ),
    (
        f"a membrane without bending is taut, swollen by {TAUT:g} at least: compressed it has no shape but that of its mesh",
        lambda s: s["thickness"] > 0.0 or s["prestretch"] >= TAUT,
    ),
)


def case_of(scene, end, accuracy):
    """The `Case` of a scene as a user would write it: everything of the numerics is `auto`."""
    traction = 2.0 * scene["softness"] * scene["shear_modulus"] / scene["cutoff"]
    strength = traction * scene["cutoff"]
    return Case(
        name=scene["scene"],
        model="auto",
        accuracy=accuracy,
        membrane={key: scene[key] for key in ("shear_modulus", "thickness", "prestretch")},
        adhesion={"traction": traction, "cutoff": scene["cutoff"], "ligand_ratio": scene["ligand_ratio"]},
        receptors={"drift_number": 2.0 * scene["binding"] / strength},
        drag=scene["slowness"] * strength,
        mesh={"front_edge": "auto", "far_edge": "auto", "axes": axes(scene)},
        time={"end": float(f"{end:.6g}"), "step": "auto"},
        output={"frames": ()},
    )


def axes(scene):
    """Equatorial and polar axis of the start shape."""
    if scene["reduced_volume"] == 1.0:
        return 1.0, 1.0
    flat = scene["kind"] == "oblate"

    def excess(ratio):
        return reduced_volume(spheroid_area((ratio, 1.0) if flat else (1.0, ratio))) - scene["reduced_volume"]

    ratio = float(f"{brentq(excess, 1.0001, 9.9):.4g}")
    return (ratio, 1.0) if flat else (1.0, ratio)


# Runs ----------------------------------------------------------------------------------------------------


def level_of(wish):
    return f"{100 * wish:g} %"


def compute(scene, seconds, known):
    """Compute the levels of a scene that are not in ``known``, and append a row for each; return its name."""
    if "scout" not in known:
        known["scout"] = run(scene, "scout", lambda: scouted(scene), seconds)
    end = float(known["scout"]["end"])
    for wish in WISHES:
        if level_of(wish) not in known:
            before = known.get(level_of(WISHES[0])) or known["scout"]
            if before["status"] == "failed":  # what failed for the scouts or at 4 % is no easier
                known[level_of(wish)] = before | {"level": level_of(wish), "seconds": "0"}
                append(known[level_of(wish)])
                continue
            known[level_of(wish)] = run(scene, level_of(wish), lambda: wished(scene, end, wish), seconds)
    planned = known[level_of(WISHES[-1])]
    for level, (finer, sharper) in REFERENCES.items():
        if level in known:
            continue
        if planned["status"] != "finished" or (level == "finer" and not is_affordable(known["coarser"], seconds)):
            break
        edge, accuracy = float(planned["edge"]) / finer, WISHES[-1] * sharper
        known[level] = run(scene, level, lambda: referred(scene, end, edge, accuracy), REFERENCE_TIME * seconds)
    return scene["scene"]


def is_affordable(coarser, seconds):
    """Whether the finer reference may be expected to be done in its time."""
    return coarser["status"] == "finished" and FINER_COSTS * float(coarser["seconds"]) <= REFERENCE_TIME * seconds


def run(scene, level, work, seconds):
    """Do ``work`` in a process of its own within so many ``seconds`` of CPU; append and return its row."""
    row = dict.fromkeys(FIELDS, "") | {"scene": scene["scene"], "level": level, "sources": sources_hash()[:12]}
    here, there = FORK.Pipe(duplex=False)
    worker = FORK.Process(target=send, args=(there, work, seconds))
    began = children_time()
    worker.start()
    there.close()
    curve = None
    try:
        while True:  # what is known so far, and at last the curve
            part = here.recv()
            curve = part.pop("curve", curve)
            row |= part
    except EOFError:
        worker.join()
    row["seconds"] = f"{children_time() - began:.2f}"
    if curve is not None:
        np.savez_compressed(RUNS / "curves" / f"{scene['scene']}-{level.replace(' %', '')}.npz", **curve)
    if not row["status"]:
        spent = worker.exitcode in (-signal.SIGXCPU, -signal.SIGKILL)
        why = f"{level} not done after {seconds:g} s of CPU" if spent else f"ended by signal {-(worker.exitcode or 0)}"
        row |= {"status": "failed", "cause": why}
    append(row)
    return row


def send(pipe, work, seconds):
    """Do ``work`` and send its parts through ``pipe``; the system ends the process after so many ``seconds`` of CPU."""
    limit = int(np.ceil(time.process_time() + seconds))
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what is doubtful stands in the row
            for part in work():
                pipe.send(part)
        pipe.send({"status": "finished"})
    except (CaseError, RunError) as failure:
        pipe.send({"status": "failed", "cause": " ".join(str(failure).split())})


def children_time():
    """CPU time [s] of the processes that this one has waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def append(row):
    with (RUNS / "rows.csv").open("a", newline="") as file:
        csv.DictWriter(file, FIELDS).writerow(row)


def scouted(scene):
    """Find the end of a scene: when a scout has reached ENDS_AT of its final area."""
    latest = min(1e6, LATEST * (1.0 + scene["slowness"]))
    yield {"end": f"{1e-3 * latest:.6g}"}  # unless a scout knows better
    seen = survey(case_of(scene, latest, 0.04))
    if seen is None:
        raise RunError("no scout found a balance")
    t, area = seen[1].curve.T
    end = t[np.argmax(area >= ENDS_AT * area[-1])]
    if seen[1].folded:  # beyond, the model holds no more
        end = min(end, BEFORE_FOLD * t[-1])
    yield {"end": f"{end:.6g}", "edge": f"{seen[1].front_edge:.4g}", "cause": seen[1].folded or ""}


def wished(scene, end, wish):
    """Run the scene as `auto` plans it."""
    began = time.process_time()
    planned = plan(case_of(scene, end, wish))
    size = next(told for told in planned.decisions if told.startswith("size"))
    planning = time.process_time() - began
    yield {"edge": planned.case.mesh.front_edge, "end": f"{end:.6g}", "told": f"{planning:.2f} s for the plan; {size}"}
    yield from marched(planned.case)


def referred(scene, end, edge, accuracy):
    """Run the scene on a meridian of a given ``edge``, bending included, with steps of a given ``accuracy``."""
    yield {"edge": f"{edge:.4g}", "end": f"{end:.6g}"}
    case = case_of(scene, end, WISHES[-1])
    fine = plan(case).case.mesh.fine_angle
    mesh = case.mesh.model_copy(
        update={"front_edge": edge, "far_edge": max(edge, min(0.02, 6.0 * edge)), "fine_angle": fine}
    )
    time_ = case.time.model_copy(update={"stop_when_steady": False})
    yield from marched(case.changed(model="axisymmetric", mesh=mesh, time=time_, accuracy=max(1e-4, accuracy)))


def marched(case):
    """Run ``case``; yield what it took and at last the curve of each of QUANTITIES."""
    sim = Spreading(case)
    yield {"nodes": len(sim.x_start), "warned": "; ".join(case.warnings())}
    rows = []
    for state in march(sim):
        moment = Moment(sim, state)
        rows.append([moment[key] for key in ("time", *QUANTITIES, BELIEVED)])
    curve = dict(zip(("time", *QUANTITIES, BELIEVED), np.array(rows).T))
    late = curve["binding_area"] >= WISHED_FROM * curve["binding_area"][-1]
    yield {"steps": len(rows), "stated": f"{curve[BELIEVED][late].max():.4g}", "curve": curve}


# Judgement -----------------------------------------------------------------------------------------------


def curve_of(scene, level):
    """The curve of a scene at a level as a dict of arrays, or None."""
    file = RUNS / "curves" / f"{scene}-{level.replace(' %', '')}.npz"
    if not file.exists():
        return None
    with np.load(file) as stored:
        return {key: stored[key] for key in stored.files}


def at(curve, key, times):
    """A curve's quantity at ``times``: smooth and monotone between the steps, over ln t; at rest after its last."""
    t = np.minimum(times, curve["time"][-1])
    value, is_area = curve[key], key == "binding_area"
    smooth = PchipInterpolator(np.log(curve["time"]), np.log(value) if is_area else value)
    return np.exp(smooth(np.log(t))) if is_area else smooth(np.log(t))


def errors(curve, reference, end, since=WISHED_FROM):
    """Largest error of each of QUANTITIES after the area has passed ``since`` of its final value, and of the range.

    Relative; that of the pressure to its largest magnitude, that of the density's range to the largest range.
    """
    times = np.append(curve["time"][curve["time"] < end], end)
    area = at(reference, "binding_area", times)
    late = area >= since * at(reference, "binding_area", np.array([end]))[0]
    times = times[late & (times >= reference["time"][0])]
    found = {key: (at(curve, key, times), at(reference, key, times)) for key in QUANTITIES}
    here, there = (found["density_max"][i] - found["density_min"][i] for i in (0, 1))
    return {
        "binding_area": np.max(np.abs(np.divide(*found["binding_area"]) - 1.0)),
        "contact_radius": np.max(np.abs(np.divide(*found["contact_radius"]) - 1.0)),
        "pressure": np.max(np.abs(np.subtract(*found["pressure"]))) / np.max(np.abs(found["pressure"][1])),
        "density_range": np.max(np.abs(here - there)) / np.max(np.abs(there)),
    }


def judge(rows):
    """For each scene and wish a dict: the row, the errors at a tenth and a hundredth, those of the reference."""
    judged = []
    for name in sorted({scene for scene, _ in rows}):
        levels = ("finer", "coarser", level_of(WISHES[-1]))  # the best two that are there
        done = [level for level in levels if rows.get((name, level), {}).get("status") == "finished"][:2]
        reference = own = None
        if len(done) == 2:
            reference, other = (curve_of(name, level) for level in done)
            own = errors(other, reference, reference["time"][-1])
        for wish in WISHES:
            row = rows.get((name, level_of(wish)))
            if row is None:
                continue
            found = {"scene": name, "wish": wish, "row": row, "own": own, "error": None, "early": None, "finer": "finer" in done}
            if row["status"] == "finished" and reference:
                curve, end = curve_of(name, level_of(wish)), reference["time"][-1]
                found["error"] = errors(curve, reference, end)
                found["early"] = errors(curve, reference, end, 0.01)["binding_area"]
            judged.append(found)
    return judged


def is_converged(found):
    """Whether the reference's own error is below a half of the wish."""
    return found["own"] is not None and found["own"]["binding_area"] <= 0.5 * found["wish"]


# Page ----------------------------------------------------------------------------------------------------


def stored_rows():
    """The last row of each scene and level, as (scene, level) to dict."""
    file = RUNS / "rows.csv"
    if not file.exists():
        return {}
    with file.open(newline="") as text:
        return {(row["scene"], row["level"]): row for row in csv.DictReader(text)}


def of_page(drawn, refused, judged, seconds):
    """The lines of docs/promise.md."""
    yield from (
        "# The promise",
        "",
        "Written by `make promise` (`benchmarks/promise.py`): change it there.",
        "",
        f"The first {len(done_scenes(judged))} of {len(drawn)} random scenes (seed {SEED}), each run as `auto` plans it at the"
        " wishes of 4 % and 1 %, against a meridian of Newton's method with edges 2 times finer than the run at 1 % has and"
        " an accuracy of 0.25 %; the same with edges 1.4 times finer and 0.5 % tells the error of that reference. Where the"
        " finer one would take too long the other is the reference, and all of its distance from the run at 1 % counts as"
        f" its own error (\"coarser\" in the last column). A wish may take {SECONDS:g} s of CPU, a reference"
        f" {REFERENCE_TIME * SECONDS:g} s. Computed by commit {commit()}. An error counts at all times after the binding area has"
        f" passed {WISHED_FROM:.0%} of its value at the end, and the end is when a scout has {ENDS_AT:.0%} of its final area.",
        "",
        "| quantity | from | to |",
        "|---|---|---|",
        *(f"| {NAMES[key]} | {low:g} | {high:g} |" for key, (low, high) in RANGES.items()),
        f"| prestretch (a {KINDS['swollen']:.0%} of the scenes) | {PRESTRETCH[0]:g} | {PRESTRETCH[1]:g} |",
        f"| reduced volume (oblate {KINDS['oblate']:.0%}, prolate {KINDS['prolate']:.0%}) | {REDUCED_VOLUME[0]:g} |"
        f" {REDUCED_VOLUME[1]:g} |",
        "",
        "Log-uniform; prestretch and reduced volume uniform and not both at once, since a swollen vesicle is round. Refused:",
        "",
        *(f"* {count} scenes by the rule: {rule}." for rule, count in refused.items()),
        "",
    )
    yield from of_wishes(judged)
    yield from ("", "![Stated against true error](promise.png)", "")
    yield from of_quantities(judged)
    yield from of_costs(judged)
    yield from of_trouble(judged)
    yield from of_scenes(drawn, judged)
    yield from ("", f"CPU time of all of it: {seconds / 60:.0f} minutes.")


NAMES = {
    "softness": "T_max d_c / (2 K)",
    "cutoff": "cutoff d_c [a0]",
    "slowness": "drag D / (T_max d_c)",
    "binding": "binding energy of a receptor, drift number T_max d_c / 2 [kT]",
    "ligand_ratio": "ligands for each receptor q",
    "shear_modulus": "shear modulus K [kT/a0^2]: a scale that must not matter",
    "thickness": "thickness h [a0]; 0 in a quarter of the scenes",
}


def done_scenes(judged):
    """Names of the scenes of which both wishes were tried."""
    tried = [found["scene"] for found in judged]
    return sorted({name for name in tried if tried.count(name) == len(WISHES)})


def commit():
    """Commit of the sources that computed what is in RUNS, as a computing call left it there."""
    file = RUNS / "commit.txt"
    return file.read_text(encoding="utf-8").strip()[:12] if file.exists() else "unknown"


def of_costs(judged):
    """What `explain` said a run would take against what it took."""
    ratios = []
    for found in judged:
        told = re.search(r"([0-9.]+) s for the plan; .*very roughly ([0-9.]+) (\w+)", found["row"].get("told") or "")
        if told and found["row"]["status"] == "finished":
            plan_time, amount, unit = told.groups()
            taken = float(found["row"]["seconds"]) - float(plan_time)
            ratios.append(float(amount) * UNITS[unit] / max(taken, 1e-2))
    if ratios:
        low, middle, high = np.quantile(ratios, (0.05, 0.5, 0.95))
        yield (
            f"What `explain` says that the steps of a run will take, over what they took ({len(ratios)} runs): median"
            f" {middle:.1f}, nine of ten between {low:.1f} and {high:.1f}."
        )
        yield ""


def of_wishes(judged):
    yield from (
        "| wish | scenes | kept | missed | failed with a named cause | no converged reference | warned |"
        " worst error / wish | the same from 1 % of the area | median stated / true | CPU, median [s] | CPU, longest [s] |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    )
    for wish in WISHES:
        here = [found for found in judged if found["wish"] == wish]
        measured = [f for f in here if f["error"] and is_converged(f)]
        ratios = [f["error"]["binding_area"] / wish for f in measured]
        stated = [float(f["row"]["stated"]) / f["error"]["binding_area"] for f in measured if f["row"]["stated"]]
        seconds = [float(f["row"]["seconds"]) for f in here if f["row"]["status"] == "finished"]
        failed = sum(f["row"]["status"] == "failed" for f in here)
        yield (
            f"| {level_of(wish)} | {len(here)} | {sum(r <= 1.0 for r in ratios)} | {sum(r > 1.0 for r in ratios)} | {failed} |"
            f" {len(here) - failed - len(measured)} | {sum(bool(f['row']['warned']) for f in here)} |"
            f" {max(ratios, default=0):.2f} | {max((f['early'] / wish for f in measured), default=0):.2f} |"
            f" {np.median(stated) if stated else 0:.2f} | {np.median(seconds) if seconds else 0:.1f} |"
            f" {max(seconds, default=0):.1f} |"
        )


def of_quantities(judged):
    """By how much other quantities are worse than the binding area."""
    yield from (
        "What else is measured of the same runs. Pressure against its largest magnitude, the range of the density (largest"
        " less smallest) against its largest; error over wish:",
        "",
        "| wish | quantity | median | 90 % of the scenes below | worst | median, error over that of the area |",
        "|---|---|---|---|---|---|",
    )
    for wish in WISHES:
        measured = [f["error"] for f in judged if f["wish"] == wish and f["error"] and is_converged(f)]
        for key in measured[0] if measured else ():
            ratios = np.array([error[key] / wish for error in measured])
            worse = np.median([error[key] / error["binding_area"] for error in measured])
            yield (
                f"| {level_of(wish)} | {key.replace('_', ' ')} | {np.median(ratios):.2f} | {np.quantile(ratios, 0.9):.2f} |"
                f" {ratios.max():.2f} | {worse:.1f} |"
            )
    yield ""


def of_trouble(judged):
    """Scenes that failed, missed the wish, or have no reference that is shown converged."""
    yield from ("## Missed, failed, or not shown", "")
    for found in judged:
        row, name = found["row"], f"{found['scene']} at {level_of(found['wish'])}"
        if row["status"] == "failed":
            yield f"* {name}: failed: {row['cause']}"
        elif not is_converged(found):
            own = f"{found['own']['binding_area']:.2%}" if found["own"] else "unknown"
            error = f"{found['error']['binding_area']:.2%}" if found["error"] else "unknown"
            yield f"* {name}: the reference is not shown converged (its own error {own}; the run's against it {error})"
        elif found["error"]["binding_area"] > found["wish"]:
            yield (
                f"* {name}: missed: {found['error']['binding_area']:.2%}, stated {float(row['stated'] or 0):.2%},"
                f" reference {found['own']['binding_area']:.2%}"
            )
    yield ""


def of_scenes(drawn, judged):
    """A line for each scene."""
    yield from (
        "## Scenes",
        "",
        "| scene | start | T d_c/2K | d_c | drag/T d_c | kT | q | h | end | error at 4 % | stated | s | error at 1 % | stated | s |"
        " nodes | steps | reference |",
        "|" + "---|" * 18,
    )
    found = {(f["scene"], f["wish"]): f for f in judged}
    for scene in drawn:
        start = {"swollen": f"swollen {scene['prestretch']:g}", "sphere": "sphere"}.get(
            scene["kind"], f"{scene['kind']} {scene['reduced_volume']:g}"
        )
        line = f"| {scene['scene']} | {start} | " + " | ".join(
            f"{scene[key]:g}" for key in ("softness", "cutoff", "slowness", "binding", "ligand_ratio", "thickness")
        )
        here = [found.get((scene["scene"], wish)) for wish in WISHES]
        if None in here:
            continue
        line += f" | {float(here[0]['row']['end'] or 0):.3g}"
        for f in here:
            error = f"{f['error']['binding_area']:.2%}" if f["error"] else f["row"]["status"]
            stated = f"{float(f['row']['stated']):.1%}" if f["row"]["stated"] else ""
            line += f" | {error} | {stated} | {float(f['row']['seconds']):.1f}"
        own = f"{here[1]['own']['binding_area']:.2%}" if here[1]["own"] else "none"
        own += " coarser" if here[1]["own"] and not here[1]["finer"] else ""
        yield f"{line} | {here[1]['row']['nodes']} | {here[1]['row']['steps']} | {own} |"


def draw(judged, out):
    """Stated against true error of the binding area."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context({"font.size": 8}):
        figure = Figure(figsize=(4.2, 3.8), layout="constrained")
        ax = figure.subplots()
        for wish, marker, color in zip(WISHES, "os", ("0.65", "black")):
            pairs = [
                (float(f["row"]["stated"]), f["error"]["binding_area"])
                for f in judged
                if f["wish"] == wish and f["error"] and f["row"]["stated"] and is_converged(f)
            ]
            if pairs:
                ax.loglog(*zip(*pairs), marker, color=color, markersize=3.5, label=f"wish {level_of(wish)}")
            ax.axhline(wish, color=color, linewidth=0.7, linestyle="--")
        ends = 2e-4, 0.3
        ax.loglog(ends, ends, color="tab:red", linewidth=0.8, label="stated = true")
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_formatter(lambda v, _: f"{100 * v:g} %")
        ax.set(xlabel="stated error", ylabel="true error of the binding area")
        ax.legend(loc="upper left")
        figure.savefig(out, dpi=160)


def write_page(page, count):
    drawn, refused = scenes(count)
    names = {scene["scene"] for scene in drawn}
    rows = {key: row for key, row in stored_rows().items() if key[0] in names}
    judged = judge(rows)
    page.parent.mkdir(exist_ok=True)
    page.write_text("\n".join(of_page(drawn, refused, judged, sum(float(r["seconds"]) for r in rows.values()))) + "\n")
    draw(judged, page.with_name("promise.png"))
    print("\n".join(of_wishes(judged)))
    print("\n".join(of_trouble(judged)))


def main():
    global RUNS
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--limit", type=int, default=SCENES, help="scenes, the first of them")
    parser.add_argument("--only", nargs="*", help="names of scenes")
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1)
    parser.add_argument("--seconds", type=float, default=SECONDS, help="CPU time that a wish may take")
    parser.add_argument("--draw", action="store_true", help="write the page from what is there")
    parser.add_argument("--runs", type=Path, default=RUNS, help="where rows and curves are kept")
    parser.add_argument("--page", type=Path, default=PAGE)
    given = parser.parse_args()
    RUNS = given.runs
    (RUNS / "curves").mkdir(parents=True, exist_ok=True)
    if not (RUNS / "rows.csv").exists():
        append(dict(zip(FIELDS, FIELDS)))
    if not given.draw:
        wanted = [s for s in scenes(given.limit)[0] if not given.only or s["scene"] in given.only]
        rows, sources = stored_rows(), sources_hash()[:12]
        (RUNS / "commit.txt").write_text(f"{provenance()['commit']}\n")
        with ProcessPoolExecutor(given.jobs) as pool:
            tasks = []
            for scene in wanted:
                known = {level: row for (name, level), row in rows.items() if name == scene["scene"]}
                known = {k: r for k, r in known.items() if r["sources"] == sources or (k in REFERENCES and r["status"] == "finished")}
                tasks.append(pool.submit(compute, scene, given.seconds, known))
            for number, task in enumerate(as_completed(tasks), 1):
                print(f"{number} of {len(tasks)}: {task.result()}", flush=True)
    write_page(given.page, given.limit)


if __name__ == "__main__":
    main()
