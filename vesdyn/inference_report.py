"""What an inference comes to: tables in report.md, samples.csv, points.csv and claims.csv, and two pictures.

Every number of these files is written here from a `vesdyn.inference.Result`; none is typed in.
"""

import csv
import io
import os
import time
from importlib.util import find_spec
from pathlib import Path
from textwrap import wrap

import numpy as np

from vesdyn.ensemble import Ensemble
from vesdyn.errors import CaseError
from vesdyn.files import make_directory, replace_file
from vesdyn.pictures import store_figure
from vesdyn.inference import ENOUGH, INTERVAL, SETS, UNDETERMINED, Scan, infer, sample, sample_directly, sensitivity, trials

_PRIOR_WIDTH = INTERVAL[1] - INTERVAL[0]  # of the places of an unknown
_COLORS = "#12355b", "#b5382a", "#3f8f78", "#e0a030"  # told apart by lightness as well
_END = 0.05  # of a prior's range
_STORED = 2000  # samples in samples.csv
_STYLE = {
    "font.size": 8, "axes.titlesize": 8, "legend.fontsize": 7, "legend.frameon": False, "axes.linewidth": 0.7,
    "xtick.direction": "in", "ytick.direction": "in", "lines.linewidth": 1.1, "pdf.fonttype": 42,
}  # fmt: skip


def carry_out(inference, directory, jobs=None, scheduler=None, held=None, n_direct=0, n_trials=0, with_claims=True,
              tell=lambda line: None):  # fmt: skip
    """Carry out ``inference`` and write its files to ``directory``, where its runs are kept; the `Result`.

    ``held`` maps unknowns to values at which the others are told too; ``n_direct`` points of a direct sampler,
    ``n_trials`` synthetic experiments; ``tell`` gets a line a stage. Raises CaseError and RunError.
    """
    missing = [name for name in ("corner", "nautilus", "sklearn") if find_spec(name) is None]
    if missing:
        raise CaseError(f"{', '.join(missing)}: not installed; give `pip install 'vesdyn[infer]'`, then the same command.")
    began, spent = time.monotonic(), sum(os.times()[:4])

    def timed(line):
        tell(f"[{time.monotonic() - began:.0f} s] {line}")

    ensemble, notes = Ensemble(inference, directory, jobs, scheduler, show=False), []
    result = infer(inference, ensemble, timed, claims=with_claims)
    if held:
        notes.append(("With unknowns held", held_table(result, held)))
    if n_direct:
        timed(f"without the emulator: {n_direct} points")
        notes.append(("Without the emulator", direct(result, sample_directly(result, ensemble, n_direct))))
    if n_trials:
        timed(f"trials: {n_trials} synthetic experiments")
        notes.append(("Trials", coverage(inference, *trials(result, ensemble, n_trials))))
    used = (
        f"{time.monotonic() - began:.0f} s on {jobs or 'all'} processes, {sum(os.times()[:4]) - spent:.0f} s of computing time;"
        f" {ensemble.runs} runs were computed, others kept."
    )
    write(result, directory, [*notes, ("Time", [used])])
    return result


def write(result, directory, notes=()):
    """Write the files of ``result`` to ``directory``; ``notes`` are further sections, pairs of a title and lines."""
    directory = Path(directory)
    make_directory(directory)
    sections = [
        ("Unknowns", unknowns(result)),
        *([("Readings", readings(result))] if result.inference.readings else []),
        ("Correlations", correlations(result)),
        *([("Other choices", other_choices(result))] if result.inference.variants else []),
        ("Data, and what is computed", predictive(result)),
        *([("Claims", claims(result))] if result.verdicts else []),
        ("Emulator", emulator_errors(result)),
        *notes,
    ]
    lines = [f"# Inference {result.inference.name}", "", _opening(result)]
    for title, body in sections:
        lines += ["", f"## {title}", "", *body]
    replace_file(directory, "report.md", ("\n".join(lines) + "\n").encode())
    write_samples(result, directory / "samples.csv")
    write_points(result, directory / "points.csv")
    if result.verdicts:
        write_claims(result, directory / "claims.csv")
    draw_corner(result, directory)
    draw_predictive(result, directory)


def _opening(result):
    numbers = {stage: len(places) for stage, (places, _) in result.stages.items()}
    parts = ", ".join(f"{number} {stage}" for stage, number in numbers.items() if number)
    return (
        f"From {result.inference.path.name}. Points of {len(result.inference.scenes)} cases each: {parts}. Values are"
        f" medians with intervals of {_PRIOR_WIDTH:.0%}; units a0, a0²/D, kT, c_r0."
    )


def table(header, rows):
    """Lines of a Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return ["| " + " | ".join(str(cell).replace("|", "/") for cell in line) + " |" for line in lines]


def interval(samples, values):
    """Median and interval of ``values`` (n,) in words."""
    low, middle, high = (f"{q:.3g}" for q in samples.quantiles(values, [INTERVAL[0], 0.5, INTERVAL[1]]))
    return f"{middle} ({low} to {high})"


def groups(result):
    """The posteriors that are told: a name and the samples each, all readings together first."""
    named = {f"{kind}: {reading}": samples for (kind, reading), samples in result.under.items()}
    return {"all data": result.posterior, **named}


def unknowns(result):
    """Table of the unknowns under each reading, and what was not identified."""
    names, every = list(result.inference.unknowns), groups(result)
    rows = []
    for k, name in enumerate(names):
        prior = result.inference.unknowns[name]
        cells = [interval(s, result.inference.values(s.places)[:, k]) for s in every.values()]
        share = result.posterior.widths()[k] / _PRIOR_WIDTH
        place = result.posterior.places[:, k]
        ends = (result.posterior.mean(part) / _END for part in (place < _END, place > 1.0 - _END))
        rows.append([name, f"{prior.low:g} to {prior.high:g}", *cells, f"{share:.2f}", ", ".join(f"{end:.2f}" for end in ends)])
    lines = table(["unknown", "prior", *every, "width / prior", "at the prior's ends"], rows)
    lost = [name for name, row in zip(names, rows) if float(row[-2]) > UNDETERMINED]
    verdict = ", ".join(lost) or "none"
    return lines + [
        "",
        f"Not identified (more than {UNDETERMINED:g} of the prior's width left): {verdict}. At the prior's ends: the density of the"
        f" posterior in the lowest and in the highest {_END:.0%} of the prior, over that of the prior; 1 where nothing was learnt.",
    ]


def held_table(result, held):
    """Table of the other unknowns where some are ``held``, under each reading."""
    every = {"all data": None, **{f"{kind}: {reading}": (kind, reading) for kind, reading in result.under}}
    scan = Scan(result.inference, result.emulator.numbers, held=held)
    found = {name: scan.posterior(result.likelihood, given=given) for name, given in every.items()}
    if min(samples.effective for samples in found.values()) < ENOUGH:
        found = {name: sample(result.likelihood, result.emulator.numbers, given=given, held=held) for name, given in every.items()}
    rows = []
    for k, unknown in enumerate(result.inference.unknowns):
        if unknown not in held:
            rows.append([unknown, *(interval(s, result.inference.values(s.places)[:, k]) for s in found.values())])
    where = ", ".join(f"{key} = {value:g}" for key, value in held.items())
    return [f"Held: {where}.", "", *table(["unknown", *found], rows)]


def readings(result):
    """Table of the readings: probability, and evidence against the first of its kind, found in two ways."""
    rows = []
    for kind, names in result.inference.readings.items():
        first = result.under[kind, names[0]].log_evidence
        p_first = result.posterior.probability(result.inference, kind, names[0])
        for name in names:
            p = result.posterior.probability(result.inference, kind, name)
            ratio = np.exp(result.under[kind, name].log_evidence - first)
            rows.append([kind, name, f"{p:.3g}", f"{ratio:.3g}", f"{p / p_first:.3g}" if p_first > 0 else "-"])
    header = ["", "reading", "probability", "evidence / that of the first", "the same from one sampling of all"]
    return table(header, rows)


def correlations(result):
    """Table of the correlations of the unknowns (of logarithms where the prior is even in them)."""
    names = list(result.inference.unknowns)
    C = result.posterior.covariance()
    R = C / np.sqrt(np.outer(np.diag(C), np.diag(C)))
    return table(["", *names], [[name, *(f"{r:+.2f}" for r in row)] for name, row in zip(names, R)])


def other_choices(result):
    """Table of the posterior under the variants of the file: unknowns, and probabilities of the readings."""
    inference, tried = result.inference, sensitivity(result)
    kinds = [(kind, reading) for kind, names in inference.readings.items() for reading in names]
    rows = []
    for name, samples in tried.items():
        values = inference.values(samples.places)
        shares = [f"{samples.probability(inference, *key):.2g}" for key in kinds]
        rows.append([name, *(interval(samples, column) for column in values.T), *shares, f"{samples.effective:.0f}"])
    header = ["choice", *inference.unknowns, *(f"{kind}: {reading}" for kind, reading in kinds), "samples"]
    return table(header, rows) + [
        "",
        f"All by one emulator at {len(tried['as stated'].places)} points of the prior, weighed anew for each choice; samples: how many"
        " independent ones these are worth.",
    ]


def known(term):
    """What is known of a term, in words."""
    if term.printed is None:
        limits, word = (term.above, "above") if term.above is not None else (term.below, "below")
        return f"{word} {limits[0]:g}" + (f" to {limits[1]:g}" if limits[1] > limits[0] else "")
    rounded = f", to {term.to:g}" if term.to else f", levels {term.legend:g} apart" if term.legend else ""
    return f"{term.printed:g} ± {term.error:.2g}{rounded}"


def shown_terms(inference):
    """Terms to tell of, with each formula once: triples of term, formula and what is known of it."""
    seen = {}
    for term in inference.terms:
        for formula in term.formulas:
            key = term.claim, formula.text
            if key in seen:
                seen[key][2].append(known(term))
            else:
                seen[key] = (term, formula, [known(term)])
    return [(term, formula, "; or ".join(words)) for term, formula, words in seen.values()]


def predictive(result):
    """Table of every formula of the data: what is known of it and its posterior predictive under each reading."""
    every = groups(result)
    numbers = {name: result.emulator.numbers(s.places) for name, s in every.items()}
    rows = []
    for term, formula, words in shown_terms(result.inference):
        several = len(term.formulas) > 1 or formula.text.startswith("at(") and term.printed is not None
        name = f"{term.claim}: {formula.text}" if several else term.claim
        cells = [interval(s, formula.value(numbers[g])) for g, s in every.items()]
        rows.append([name, term.says, words, *cells])
    return table(["datum", "the words", "known", *every], rows)


def changes(verdict):
    """What would change a verdict, in words: readings, the threshold, an unknown."""
    words = [
        f"{kind}: " + ", ".join(f"{reading} {p:.2f}" for (k, reading), p in verdict.by_reading.items() if k == kind)
        for kind in dict.fromkeys(kind for kind, _ in verdict.by_reading)
    ]
    if verdict.by_threshold:
        (low, high), (p_low, p_high) = verdict.by_threshold
        words.append(f"threshold {low:g}: {p_low:.2f}, {high:g}: {p_high:.2f}")
    if verdict.by_measure:
        every = [p[()] for p in verdict.by_measure.values()]
        words.append(f"by measure {min(every):.2f} to {max(every):.2f}")
    words.append(f"without its figure {verdict.without_figure:.2f}")
    unknown, (below, above) = max(verdict.by_unknown.items(), key=lambda item: abs(item[1][1] - item[1][0]))
    words.append(f"{unknown} below its median {below:.2f}, above {above:.2f}")
    return "; ".join(words)


def called(verdict):
    """The word for a verdict, with the unknowns that the claim has set."""
    return verdict.word + (f" (sets {', '.join(verdict.sets)})" if verdict.sets else "")


def claims(result):
    """Table of the verdicts, and what the words mean."""
    rows = [[v.claim, v.says, f"{v.probability:.2f}", called(v), changes(v)] for v in result.verdicts]
    return table(["claim", "the words", "probability", "verdict", "what would change it"], rows) + [
        "",
        "Each probability is that of the claim in what all other data leave. Calibrated: without the claim the interval of"
        f" an unknown is {SETS:g} times as wide, or the volume of the posterior as much larger: the claim has set a parameter"
        " and is no prediction, whatever its probability. It is left out of all data, and it is left out where nothing else of"
        " its figure counts, for statements that say the same hide each other.",
        *(line for verdict in result.verdicts if verdict.by_measure for line in measures(result, verdict)),
    ]


def measures(result, verdict):
    """Table of the probability of a claim by each of the ways to measure it, under each reading."""
    kinds = [(kind, reading) for kind, names in result.inference.readings.items() for reading in names]
    kinds = [key for key in kinds if any(key in found for found in verdict.by_measure.values())]
    rows = [[text, *(f"{found[key]:.2f}" if key in found else "-" for key in ((), *kinds))]
            for text, found in verdict.by_measure.items()]  # fmt: skip
    header = [verdict.claim, "all data", *(f"{kind}: {reading}" for kind, reading in kinds)]
    return ["", *table(header, rows)]


def emulator_errors(result):
    """Table of the emulator's errors and those of the runs, by formula."""
    inference, emulator = result.inference, result.emulator
    late = slice(len(result.stages["design"][0]) if len(result.stages.get("refined", ((),))[0]) else 0, None)
    off = emulator.off(emulator.left_out, emulator.table)
    everywhere, near = (np.sqrt(np.nanmean(part**2, axis=0)) for part in (off, off[late]))
    rows = []
    for k, q in enumerate(inference.quantities):
        rows.append([str(q), "ln" if q.by_ratio else "", f"{everywhere[k]:.4f}", f"{near[k]:.4f}", f"{emulator.shift[k]:+.4f}"])
    header = ["quantity", "", "left out, rms, everywhere", "in the posterior", "finer runs, mean difference"]
    return table(header, rows)


def direct(result, found):
    """Table of the direct sampler's unknowns beside the emulator's, and the emulator's error on its runs."""
    n = found.samples.effective
    rows = []
    for k, name in enumerate(result.inference.unknowns):
        with_emulator, without = (s.mean(s.places[:, k]) for s in (result.posterior, found.samples))
        spread = np.sqrt(found.samples.covariance()[k, k])
        value = [f"{result.inference.unknowns[name].value(p):.4g}" for p in (with_emulator, without)]
        rows.append([name, *value, f"{(without - with_emulator) / (spread / np.sqrt(n)):+.1f}"])
    for kind, names in result.inference.readings.items():
        for name in names:
            p, q = (s.probability(result.inference, kind, name) for s in (result.posterior, found.samples))
            if p * n > 1.0:  # of a reading that few points stand for they can tell nothing
                rows.append([f"{kind}: {name}", f"{p:.3g}", f"{q:.3g}", ""])
    off = result.emulator.off(found.told, found.table)
    rms = np.sqrt(np.nanmean(off**2, axis=0))
    worst = int(np.argmax(rms))
    return table(["mean", "with emulator", "runs alone", "difference / standard error"], rows) + [
        "",
        f"{len(found.table)} points, all run at a wish of {result.inference.design.checked_at:g}, worth {n:.0f} independent samples ({result.posterior.effective:.0f} with the"
        f" emulator). On these runs, none of which it knew, the emulator is off by {np.median(rms):.4f} (rms, median over the"
        f" quantities; {rms[worst]:.4f} at most, {result.inference.quantities[worst]}).",
    ]


def coverage(inference, levels, ranks):
    """Table of how often synthetic unknowns lie in regions and intervals of a nominal probability."""
    rows = []
    for nominal in (0.5, 0.68, 0.9, 0.95):
        inside = np.abs(ranks - 0.5) <= 0.5 * nominal
        counts = [f"{int(column.sum())} of {len(ranks)}" for column in inside.T]
        rows.append([f"{nominal:.0%}", f"{int((levels <= nominal).sum())} of {len(levels)}", *counts])
    return table(["", "all unknowns together", *inference.unknowns], rows)


# Files ---------------------------------------------------------------------------------------------------


def write_samples(result, path):
    """Equally weighted samples of the posterior: unknowns, and the probability of each combination of readings."""
    rng = np.random.default_rng(0)
    chosen = rng.choice(len(result.posterior.weights), _STORED, p=result.posterior.weights)
    values = result.inference.values(result.posterior.places[chosen])
    names = [", ".join(f"{kind}: {reading}" for kind, reading in c.items()) for c in result.inference.combinations]
    header = [*result.inference.unknowns, *(names if result.inference.readings else [])]
    shares = result.posterior.readings[:, chosen].T if result.inference.readings else np.empty((_STORED, 0))
    _write_csv(path, header, [[f"{x:.6g}" for x in (*v, *s)] for v, s in zip(values, shares)])


def write_points(result, path):
    """Every point that was run: its stage, the unknowns, the quantities."""
    rows = []
    for stage, (places, numbers) in result.stages.items():
        for values, row in zip(result.inference.values(places), numbers):
            rows.append([stage, *(f"{x:.6g}" for x in (*values, *row))])
    _write_csv(path, ["stage", *result.inference.unknowns, *map(str, result.inference.quantities)], rows)


def write_claims(result, path):
    rows = [[v.claim, v.says, f"{v.probability:.4f}", v.word, "; ".join(v.sets), changes(v)] for v in result.verdicts]
    _write_csv(path, ["claim", "says", "probability", "verdict", "sets", "changes"], rows)


def _write_csv(path, header, rows):
    text = io.StringIO()
    csv.writer(text).writerows([header, *rows])
    replace_file(path.parent, path.name, text.getvalue().encode())


def _store(figure, directory, name, **options):
    """Store ``figure`` as ``name``.png and .pdf."""
    for suffix in ("png", "pdf"):
        store_figure(figure, Path(directory), f"{name}.{suffix}", dpi=200, **options)


# Pictures ------------------------------------------------------------------------------------------------


def _shown_groups(result):
    """The readings of the first kind, or the whole posterior where there are none."""
    if not result.inference.readings:
        return {"all data": result.posterior}
    kind = next(iter(result.inference.readings))
    return {f"{kind}: {reading}": s for (k, reading), s in result.under.items() if k == kind}


def draw_corner(result, directory):
    """Store corner.png and .pdf: the posterior of the unknowns in pairs, a colour for each reading."""
    import matplotlib.style
    from corner import corner
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    names = list(result.inference.unknowns)
    logarithmic = np.array([u.prior == "log-uniform" for u in result.inference.unknowns.values()])
    limits = [(np.log10(u.low), np.log10(u.high)) if u.prior == "log-uniform" else (u.low, u.high)
              for u in result.inference.unknowns.values()]  # fmt: skip
    labels = [f"log$_{{10}}$ {n.split('.')[-1]}" if is_log else n.split(".")[-1] for n, is_log in zip(names, logarithmic)]
    with matplotlib.style.context(["default", _STYLE]):
        figure = Figure(figsize=(1.7 * len(names) + 1.0, 1.7 * len(names) + 1.0))
        some = _shown_groups(result)
        for color, samples in zip(_COLORS, some.values()):
            values = result.inference.values(samples.places)
            values[:, logarithmic] = np.log10(values[:, logarithmic])
            corner(values, weights=samples.weights, fig=figure, color=color, labels=labels, range=limits, bins=30, smooth=1.0,
                   levels=(0.5, 0.9), plot_datapoints=False, plot_density=False, no_fill_contours=True, labelpad=0.05,
                   hist_kwargs={"density": True})  # fmt: skip
        for ax in np.reshape(figure.axes, (len(names), -1)).diagonal():  # corner takes the last histogram's height
            ax.set_ylim(0.0, 1.05 * max(patch.get_xy()[:, 1].max() for patch in ax.patches))
        handles = [Line2D([], [], color=color, label=name) for color, name in zip(_COLORS, some)]
        figure.legend(handles=handles, loc="upper right", title="contours: 50 and 90 %", title_fontsize=7)
        _store(figure, directory, "corner", bbox_inches="tight")


def draw_predictive(result, directory):
    """Store predictive.png and .pdf: what is computed for each datum beside what is known, a colour for each reading."""
    import matplotlib.style
    from matplotlib.figure import Figure

    some = _shown_groups(result)
    numbers = {name: result.emulator.numbers(s.places) for name, s in some.items()}
    shown = shown_terms(result.inference)[:_MOST_PANELS]
    columns = 4
    rows = -(-len(shown) // columns)
    with matplotlib.style.context(["default", _STYLE]):
        figure = Figure(figsize=(7.2, 1.35 * rows + 0.5), layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False).ravel()
        for ax, (term, formula, _) in zip(axes, shown):
            every = {name: formula.value(numbers[name]) for name in some}
            ends = np.array([s.quantiles(every[name], [0.002, 0.998]) for name, s in some.items()])
            spans = [term.printed - 2 * term.error, term.printed + 2 * term.error] if term.printed is not None else [
                *(term.above or term.below)]  # fmt: skip
            low, high = min(ends.min(), *spans), max(ends.max(), *spans)
            pad = 0.08 * (high - low or 1.0)
            edges = np.linspace(low - pad, high + pad, 60)
            if term.printed is not None:
                ax.axvspan(*spans, color="0.8", linewidth=0)
            else:
                start, stop = (term.above[0], edges[-1]) if term.above else (edges[0], term.below[1])
                ax.axvspan(start, stop, color="0.93", linewidth=0)
                ax.axvspan(*(term.above or term.below), color="0.82", linewidth=0)
            for color, (name, s) in zip(_COLORS, some.items()):
                ax.hist(every[name], edges, weights=s.weights, histtype="step", color=color, density=True)
            ax.set_title(term.claim, loc="left", fontsize=6)
            if len(term.formulas) > 1:
                measure = "\n".join(wrap(formula.text, 44))
                ax.text(0.0, 1.0, measure, transform=ax.transAxes, fontsize=4, va="bottom")
                ax.set_title(term.claim, loc="left", fontsize=6, pad=6 + 5 * measure.count("\n") + 5)
            ax.set(yticks=[], xlim=edges[[0, -1]])
        for ax in axes[len(shown) :]:
            ax.set_axis_off()
        handles = [axes[0].plot([], [], color=color, label=name)[0] for color, name in zip(_COLORS, some)]
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
        _store(figure, directory, "predictive")


_MOST_PANELS = 40
