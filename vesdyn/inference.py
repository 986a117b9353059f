"""Which values of unknown parameters do curves, printed numbers and stated orders point to?

    design       the cases at points that fill the space of the unknowns (Sobol), as batches of runs
    emulator     each number that the data need as a Gaussian process of the unknowns
    refinement   more points where the posterior lies and the emulator knows least
    checks       some at a finer accuracy wish: mean difference (a correction) and its spread (an error)
    posterior    importance nested sampling (Lange 2023, `nautilus`) of prior times likelihood

The likelihood of one figure, with v the computed value of a term, s^2 = (emulator and run)^2 + (model error)^2 and
Phi the normal distribution function:

    a number p +- e     N(p; v, s^2 + e^2), or its integral over the numbers that are rounded to p
    top of a legend p   Phi((v - p)/s) l/v: any of the v/l levels within the range is as likely to be the top
    a stated order      slip/2 + (1 - slip) <Phi((v - threshold)/s)>, averaged over the prior of the threshold

multiplied over the terms of the figure and averaged over the prior of its model error, which is relative for numbers
and absolute for statements. Figures are independent given the unknowns. Readings are discrete alternatives, of each
kind exactly one is right; their priors are equal, so their evidence ratios are those of their posterior probabilities.

A claim's probability is that of its statement in what is left without it: the posterior of all other data, averaged over
thresholds and model error. A claim without which the interval of an unknown is SETS times as wide, or the volume
of the posterior SETS times as large, has set that unknown: it is called calibrated and is no prediction, whatever its probability.
This is tried twice: with the claim left out of all data, and with the claim added to what is left without its figure; two
statements that say the same would else hide each other.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp, ndtr
from scipy.stats import qmc

from vesdyn.emulator import Emulator
from vesdyn.errors import CaseError
from vesdyn.inference_file import Variant

SETS = 1.5  # times as wide without it: a claim that has set an unknown
PREDICTED, REFUTED = 0.9, 0.1  # probabilities from which, and up to which, a claim is called so
UNDETERMINED = 0.7  # of the prior's spread: an unknown that keeps more was not identified
INTERVAL = 0.05, 0.95  # quantiles between which an unknown or a number is told to lie
_NODES = 9  # of averages over thresholds and model errors
_ROUNDS = 2  # of refinement
_TINY = 1e-300  # what is added so that no logarithm or quotient fails
_LIVE = 300  # points of the nested sampling
_FEW = 1000  # effective samples of a posterior that is only looked at on the way
_SAMPLES = 3000  # of one that is told
_CANDIDATES = 1000  # samples among which points are chosen
_RARE = 1e-15  # the same of a scan, which is to find readings that are next to impossible
_NEGLIGIBLE = 1e-6  # weight of a sample / largest weight, below which it is dropped
_SCANNED = 2**15  # points of the prior that a scan weighs
ENOUGH = 200  # effective samples of a scan that are enough
_FEW_ENOUGH = 30  # for the probability of a claim under one reading
_WIDER = 1.3  # spread of the proposals of a direct sampler / spread of the posterior


# Likelihood ----------------------------------------------------------------------------------------------


def table_numbers(inference, table):
    """The numbers of ``table`` (n, n_quantities) by quantity."""
    return dict(zip(inference.quantities, table.T))


def values_of(term, numbers):
    """Values (n_formulas, m) of the formulas of a ``term``."""
    return np.array([np.broadcast_to(formula.value(numbers), _length(numbers)) for formula in term.formulas])


def _length(numbers):
    return np.shape(next(iter(numbers.values())))


def nodes(limits):
    """Equally likely values of a number whose logarithm is even between ``limits``."""
    low, high = limits
    if low == high:
        return np.array([low])
    return low * (high / low) ** ((np.arange(_NODES) + 0.5) / _NODES)


def probability(term, value, error, sigma):
    """What ``term`` gives to one of its formulas' ``value`` (m,), at model errors ``sigma`` (k,): (m, k).

    ``error`` is that of emulator and run. A density for a number that was not rounded. Statements have no slip here.
    """
    v = np.asarray(value)[:, None]
    if term.printed is None:
        s = np.sqrt(error**2 + sigma**2 + _TINY)
        limits, sign = (term.above, 1.0) if term.above is not None else (term.below, -1.0)
        return sum(ndtr(sign * (v - threshold) / s) for threshold in nodes(limits)) / len(nodes(limits))
    s = np.sqrt(error**2 + (sigma * v) ** 2 + term.error**2 + _TINY)
    off = np.abs(term.printed - v) / s
    if term.legend is not None:
        return ndtr((v - term.printed) / s) * term.legend / np.maximum(v, term.printed)
    if term.to is None:
        return np.exp(-0.5 * off**2) / s
    half = 0.5 * term.to / s
    return ndtr(half - off) - ndtr(-half - off)  # on the side where both are small, so that digits are kept


class Likelihood:
    """The likelihood of ``inference``; ``errors`` are those of emulator and run, by term and formula."""

    def __init__(self, inference, errors):
        self.inference, self.errors = inference, errors
        self.sigma = nodes(inference.model_error)

    def log_of_term(self, index, numbers):
        """Log probability (m, n_sigma) of term number ``index``, the mean over its formulas."""
        term = self.inference.terms[index]
        each = [probability(term, value, error, self.sigma)
                for value, error in zip(values_of(term, numbers), self.errors[index])]  # fmt: skip
        mean = np.mean(each, axis=0)
        if term.printed is None:
            mean = (1.0 - self.inference.slip) * mean + 0.5 * self.inference.slip
        return np.log(mean + _TINY)

    def log(self, numbers, without=(), known=None):
        """Log likelihood (n_combinations, m) under each combination of readings, the claims ``without`` left out.

        ``known`` holds the logs of all terms by their index where these were computed before (`log_of_term`).
        """
        terms = self.inference.terms
        logs = {i: self.log_of_term(i, numbers) if known is None else known[i]
                for i, term in enumerate(terms) if term.claim not in without}  # fmt: skip
        total = []
        for combination in self.inference.combinations:
            figures = {}
            for i, log in logs.items():
                if terms[i].when.items() <= combination.items():
                    figures[terms[i].figure] = figures.get(terms[i].figure, 0.0) + log
            parts = [logsumexp(log, axis=1) - np.log(len(self.sigma)) for log in figures.values()]
            total.append(np.sum(parts, axis=0) if parts else np.zeros(_length(numbers)))
        return np.array(total)

    def agreement(self, term, errors, numbers):
        """Probability (n_formulas, m) that the statement of ``term`` holds, or its number comes out as printed.

        As printed: within twice the error of reading, or as it is rounded; a legend's top: within the range.
        """
        found = []
        for value, error in zip(values_of(term, numbers), errors):
            if term.printed is None:
                found.append(probability(term, value, error, self.sigma).mean(axis=1))
                continue
            v = value[:, None]
            s = np.sqrt(error**2 + (self.sigma * v) ** 2 + _TINY)
            half = max(2.0 * term.error, 0.5 * (term.to or 0.0))
            inside = ndtr((term.printed + half - v) / s) - ndtr((term.printed - half - v) / s)
            found.append((inside if term.legend is None else ndtr((v - term.printed) / s)).mean(axis=1))
        return np.array(found)


    def below(self, term, errors, numbers):
        """Probability (n_formulas, m) that the number of ``term`` comes out below what is printed, all errors counted."""
        found = []
        for value, error in zip(values_of(term, numbers), errors):
            v = value[:, None]
            s = np.sqrt(error**2 + (self.sigma * v) ** 2 + term.error**2 + _TINY)
            found.append(ndtr((term.printed - v) / s).mean(axis=1))
        return np.array(found)


def errors_of(inference, told, true):
    """Root mean square differences of the terms' formulas between two tables (n, n_quantities): by term and formula."""
    told, true = table_numbers(inference, told), table_numbers(inference, true)
    errors = []
    for term in inference.terms:
        off = values_of(term, told) - values_of(term, true)
        errors.append(np.sqrt(np.nanmean(off**2, axis=1)) if off.size and np.isfinite(off).any() else np.zeros(len(off)))
    return errors


# Posterior -----------------------------------------------------------------------------------------------


class Samples(NamedTuple):
    """Weighted samples of a posterior: ``places`` (n, d), ``weights`` (n,) of sum 1, and the log of the evidence.

    ``readings`` (n_combinations, n) are the probabilities of the combinations of readings at each sample.
    """

    places: np.ndarray
    weights: np.ndarray
    log_evidence: float
    readings: np.ndarray

    @property
    def effective(self):
        """How many independent samples these are worth."""
        return 1.0 / np.sum(self.weights**2)

    def mean(self, values):
        return np.sum(self.weights * values, axis=-1)

    def quantiles(self, values, levels):
        """Weighted quantiles (len(levels),) of ``values`` (n,)."""
        order = np.argsort(values)
        cumulated = np.cumsum(self.weights[order]) - 0.5 * self.weights[order]
        return np.interp(levels, cumulated, values[order])

    def covariance(self):
        """Covariance (d, d) of the places."""
        off = self.places - self.weights @ self.places
        return (off * self.weights[:, None]).T @ off

    def volume(self):
        """Volume of the posterior, but for a factor, from the covariance."""
        return float(np.sqrt(max(np.linalg.det(self.covariance()), _TINY)))

    def drawn(self, n, seed):
        """``n`` places drawn with these weights."""
        return self.places[np.random.default_rng(seed).choice(len(self.weights), n, p=self.weights)]

    def thinned(self, n=_FEW):
        """About the same samples, ``n`` of equal weight; those that there are where they are fewer."""
        if len(self.weights) <= n:
            return self
        chosen = np.searchsorted(np.cumsum(self.weights) / self.weights.sum(), (np.arange(n) + 0.5) / n)
        return Samples(self.places[chosen], np.full(n, 1.0 / n), self.log_evidence, self.readings[:, chosen])

    def widths(self):
        """Widths (d,) of the 90 % intervals of the places."""
        return np.array([np.ptp(self.quantiles(place, INTERVAL)) for place in self.places.T])

    def probability(self, inference, kind, reading):
        """Posterior probability of one reading."""
        chosen = [combination[kind] == reading for combination in inference.combinations]
        return float(self.weights @ self.readings[chosen].sum(axis=0))


def sample(likelihood, numbers_at, without=(), given=None, held=None, effective=None, seed=0):
    """Samples of the posterior, the claims ``without`` left out.

    ``numbers_at(places)`` gives the quantities by name, arrays (m,), at ``places`` (m, n_unknowns). ``given``, a kind
    and a reading, takes that reading for granted; ``held`` maps unknowns to values at which they are held; ``effective``
    is how many independent samples they shall be worth.
    """
    from nautilus import Sampler  # here: slow to import
    from threadpoolctl import threadpool_limits

    inference = likelihood.inference
    chosen, fixed = _chosen(inference, given), _held_places(inference, held)
    free = np.isnan(fixed)

    def whole(some):
        places = np.tile(fixed, (len(some), 1))
        places[:, free] = some[:, : free.sum()]
        return places

    def each(places):
        return likelihood.log(numbers_at(places), without)[chosen]

    def log_likelihood(some):
        return logsumexp(each(whole(some)), axis=0) - np.log(chosen.sum())

    with threadpool_limits(1):  # the matrices are small
        n = max(2, int(free.sum()))  # the sampler needs two: the second of one alone changes nothing
        live = _LIVE if effective is None else _LIVE // 2
        sampler = Sampler(lambda u: u, log_likelihood, n, n_live=live, n_networks=0, n_batch=live,
                          vectorized=True, pass_dict=False, seed=seed)  # fmt: skip
        sampler.run(n_eff=effective or _SAMPLES, discard_exploration=False)
    some, log_weights, _ = sampler.posterior()
    weights = np.exp(log_weights - log_weights.max())
    keep = weights > _NEGLIGIBLE
    places, weights = whole(some[keep]), weights[keep] / weights[keep].sum()
    logs = each(places)
    readings = np.zeros((len(chosen), len(places)))
    readings[chosen] = np.exp(logs - logsumexp(logs, axis=0))
    return Samples(places, weights, float(sampler.log_z), readings)


def _chosen(inference, given):
    """Which combinations (n_combinations,) of readings have the one ``given``, a kind and a reading; all where none is."""
    return np.array([given is None or c[given[0]] == given[1] for c in inference.combinations])


def _held_places(inference, held):
    """Places (n_unknowns,) of the unknowns that are ``held``; NaN of the others."""
    return np.array([u.place((held or {}).get(key, np.nan)) for key, u in inference.unknowns.items()])


class Scan:
    """Points of the prior (Sobol, ``n``) and what the data say there: posteriors under other choices by weighing them anew.

    No better than the effective number of samples, which falls as data narrow the posterior down; but cheap, and an
    improbable reading is found where it lies.
    """

    def __init__(self, inference, numbers_at, n=_SCANNED, held=None):
        self.inference, fixed = inference, _held_places(inference, held)
        self.places = qmc.Sobol(len(inference.unknowns), seed=inference.design.seed).random(n)
        self.places[:, ~np.isnan(fixed)] = fixed[~np.isnan(fixed)]
        self.values, self.numbers, self._known = inference.values(self.places), numbers_at(self.places), None
        self._last = None  # the likelihood of which the logs are kept

    def posterior(self, likelihood, without=(), given=None, unknowns=None):
        """Samples of the posterior by ``likelihood``; ``without`` and ``given`` as for `sample`, ``unknowns`` as priors."""
        if self._last is not likelihood:
            terms = range(len(likelihood.inference.terms))
            self._known = {i: likelihood.log_of_term(i, self.numbers).astype(np.float32) for i in terms}
            self._last = likelihood
        logs = likelihood.log(self.numbers, without, self._known)
        chosen = _chosen(self.inference, given)
        total = logsumexp(logs[chosen], axis=0) - np.log(chosen.sum())
        for key, new in (unknowns or {}).items():
            k = list(self.inference.unknowns).index(key)
            old, values = self.inference.unknowns[key], self.values[:, k]
            total = total + np.log(new.density(values) / old.density(values) + _TINY)
        evidence = float(logsumexp(total) - np.log(len(total)))
        keep = total > total.max() + np.log(_RARE)
        weights = np.exp(total[keep] - logsumexp(total[keep]))
        readings = np.zeros((len(chosen), keep.sum()))
        readings[chosen] = np.exp(logs[chosen][:, keep] - logsumexp(logs[chosen][:, keep], axis=0))
        return Samples(self.places[keep], weights, evidence, readings)


def found(likelihood, numbers_at, scan, without=(), given=None, seed=0, enough=ENOUGH):
    """Samples of a posterior by the ``scan`` where it holds ``enough`` of them, else by nested sampling."""
    samples = scan.posterior(likelihood, without, given)
    if samples.effective >= enough:
        return samples
    return sample(likelihood, numbers_at, without=without, given=given, effective=_FEW, seed=seed)


def sensitivity(result, n=_SCANNED):
    """Posteriors under other choices, by name: those of the file as stated first, then each of its variants."""
    scan = Scan(result.inference, result.emulator.numbers, n)
    tried = {}
    for variant in (Variant(name="as stated"), *result.inference.variants):
        likelihood = Likelihood(result.inference.varied(variant), result.likelihood.errors)
        tried[variant.name] = scan.posterior(likelihood, variant.without, unknowns=variant.unknowns)
    return tried


# Claims --------------------------------------------------------------------------------------------------


class Verdict(NamedTuple):
    """What a claim comes to in what is left without it."""

    claim: str
    says: str
    probability: float
    by_reading: dict  # (kind, reading): probability
    by_threshold: tuple | None  # ends of its threshold's range and the probabilities there
    by_unknown: dict  # unknown: probabilities below and above its median
    by_measure: dict  # formula, of several: probability by reading, and by () where all are averaged
    without_figure: float  # probability in what is left without all claims of its figure
    wider: dict  # unknown: interval without it / interval with it, last of all or first of its figure, whichever is more
    larger: float  # volume of the posterior without it / with it, from the covariances, likewise
    tail: float  # of a number: probability of one at least as far off; of a statement: its probability

    @property
    def sets(self):
        """The unknowns that this claim has set, alone or together: then the one that it sets most."""
        alone = [unknown for unknown, times in self.wider.items() if times >= SETS]
        return alone or ([max(self.wider, key=self.wider.get)] if self.larger >= SETS else [])

    @property
    def word(self):
        """calibrated, predicted, open or refuted; a number that is told too vaguely to meet its print is not refuted."""
        if self.sets:
            return "calibrated"
        if self.probability >= PREDICTED:
            return "predicted"
        return "refuted" if max(self.probability, self.tail) <= REFUTED else "open"


def judge(likelihood, numbers_at, claim, posterior, scan, seed=0):
    """The `Verdict` on ``claim``; ``posterior`` is that of all data, found in the same way (`found`)."""
    inference = likelihood.inference
    whole = found(likelihood, numbers_at, scan, without=(claim,), seed=seed)
    kinds = [(kind, reading) for kind, names in inference.readings.items() for reading in names]
    rests = {(): whole.thinned()} | {
        key: found(likelihood, numbers_at, scan, (claim,), key, seed, enough=_FEW_ENOUGH).thinned() for key in kinds
    }
    parts = {key: (rest.readings * rest.weights, numbers_at(rest.places)) for key, rest in rests.items()}
    rest, (weights, numbers) = rests[()], parts[()]
    terms = [(i, term) for i, term in enumerate(inference.terms) if term.claim == claim]

    def probability(weights, numbers=numbers, change=lambda term: term, below=False):
        """Mean over terms, formulas and samples, of the readings under which each term counts.

        Of agreement, or with ``below`` of a computed number below the printed one.
        """
        total, judged = 0.0, likelihood.below if below else likelihood.agreement
        for k, combination in enumerate(inference.combinations):
            if not weights[k].any():
                continue
            each = [judged(change(term), likelihood.errors[i], numbers).mean(axis=0)
                    for i, term in terms if term.when.items() <= combination.items()]  # fmt: skip
            total += np.sum(weights[k] * np.mean(each, axis=0))
        return float(total / weights.sum())

    by_reading = {key: probability(*parts[key]) for key in kinds}
    by_unknown = {}
    for k, unknown in enumerate(inference.unknowns):
        below = rest.places[:, k] < rest.quantiles(rest.places[:, k], [0.5])[0]
        by_unknown[unknown] = probability(weights * below), probability(weights * ~below)
    first = terms[0][1]
    limits = first.above or first.below
    by_threshold = None
    if limits is not None and limits[0] < limits[1]:
        side = "above" if first.above else "below"
        ends = [probability(weights, change=lambda term: term._replace(**{side: (end, end)})) for end in limits]
        by_threshold = limits, tuple(ends)
    by_measure = {}
    for i, term in terms if len(first.formulas) > 1 else ():
        count = np.array([term.when.items() <= c.items() for c in inference.combinations])
        for key, (some, there) in parts.items():
            if not key or key[0] not in term.when:
                share = some[count].sum(axis=0)
                for formula, agreement in zip(term.formulas, likelihood.agreement(term, likelihood.errors[i], there)):
                    by_measure.setdefault(formula.text, {})[key] = float(share @ agreement / share.sum())
    agreed = probability(weights)
    numbers_count = np.array([any(t.printed is not None and t.legend is None and t.when.items() <= c.items() for _, t in terms)
                              for c in inference.combinations])  # fmt: skip
    tail = 0.0
    for is_number in (True, False):
        share = weights * (numbers_count == is_number)[:, None]
        if share.sum() > 0.0:
            part = probability(share, below=is_number)
            tail += share.sum() * (2.0 * min(part, 1.0 - part) if is_number else part)
    mates = _mates(inference, claim)
    bare = found(likelihood, numbers_at, scan, mates, seed=seed)
    first_in = found(likelihood, numbers_at, scan, tuple(other for other in mates if other != claim), seed=seed)
    less = bare.thinned()
    pairs = [(whole, posterior), (bare, first_in)]
    wider = dict(zip(inference.unknowns, np.max([without.widths() / with_it.widths() for without, with_it in pairs], axis=0)))
    larger = max(without.volume() / with_it.volume() for without, with_it in pairs)
    return Verdict(claim, first.says, agreed, by_reading, by_threshold, by_unknown, by_measure,
                   probability(less.readings * less.weights, numbers_at(less.places)), wider, larger, tail)  # fmt: skip


def _mates(inference, claim):
    """The claims of the figures of ``claim``, itself included: they may say the same in other words."""
    figures = {term.figure for term in inference.terms if term.claim == claim} - {""}
    return tuple(dict.fromkeys(term.claim for term in inference.terms if term.claim == claim or term.figure in figures))


# The whole -----------------------------------------------------------------------------------------------


class Result(NamedTuple):
    """What an inference comes to."""

    inference: object
    emulator: Emulator
    likelihood: Likelihood
    stages: dict  # stage: places and table of its runs
    posterior: Samples
    under: dict  # (kind, reading): posterior given it
    verdicts: list


def infer(inference, ensemble, tell=print, claims=True):
    """Carry out ``inference``, its runs from ``ensemble`` (`vesdyn.ensemble.Ensemble`); ``tell`` gets a line a stage.

    Without ``claims`` no verdicts. Raises vesdyn.errors.RunError where too many runs fail.
    """
    design, d = inference.design, len(inference.unknowns)
    places = qmc.Sobol(d, seed=design.seed).random(2 ** int(np.ceil(np.log2(design.points))))[: design.points]
    tell(f"design: {len(places)} points, {len(inference.scenes)} cases each")
    table = ensemble.quantities(places, design.accuracy)
    stages = {"design": (places, table)}
    emulator = Emulator(inference, places, table)
    likelihood = Likelihood(inference, errors_of(inference, emulator.left_out, table))
    added = ensemble.remembered("refined")[: design.refined]
    for r in range(_ROUNDS if design.refined else 0):
        n = design.refined * (r + 1) // _ROUNDS - len(added)
        if n > 0:
            some = sample(likelihood, emulator.numbers, effective=_FEW, seed=design.seed + r)
            new = _refinement(some, emulator, n, design.seed + r)
            ensemble.remember("refined", new)
            added = np.concatenate([added, new])
        elif r < _ROUNDS - 1 and len(added) == design.refined:
            continue
        every = np.concatenate([places, added])
        tell(f"refinement: {len(added)} points in the posterior")
        table = ensemble.quantities(every, design.accuracy)
        emulator = Emulator(inference, every, table)
        late = slice(len(places), None)  # the errors that count are those in the posterior
        likelihood = Likelihood(inference, errors_of(inference, emulator.left_out[late], table[late]))
    stages["refined"] = added, table[len(places) :]
    if design.checks:
        checks = ensemble.remembered("checked")[: design.checks]
        if len(checks) < design.checks:
            some = sample(likelihood, emulator.numbers, effective=_FEW, seed=design.seed)
            new = _spread_out(some.drawn(_CANDIDATES, design.seed), checks, design.checks - len(checks))
            ensemble.remember("checked", new)
            checks = np.concatenate([checks, new])
        tell(f"checks: {len(checks)} points at a wish of {design.checked_at:g}")
        coarse, fine = (ensemble.quantities(checks, wish) for wish in (design.accuracy, design.checked_at))
        stages |= {"checked": (checks, coarse), "finer": (checks, fine)}
        emulator.correct(coarse, fine)
        by_runs = errors_of(inference, emulator.corrected(coarse), fine)
        by_emulator = likelihood.errors
        likelihood = Likelihood(inference, [np.hypot(a, b) for a, b in zip(by_emulator, by_runs)])
    tell("posterior")
    posterior = sample(likelihood, emulator.numbers, seed=design.seed)
    scan = Scan(inference, emulator.numbers)
    under = {(kind, reading): found(likelihood, emulator.numbers, scan, given=(kind, reading), seed=design.seed)
             for kind, readings in inference.readings.items() for reading in readings}  # fmt: skip
    verdicts = []
    if claims:
        tell("claims")
        every = found(likelihood, emulator.numbers, scan, seed=design.seed)
        verdicts = [judge(likelihood, emulator.numbers, claim, every, scan, design.seed) for claim in inference.claims]
    return Result(inference, emulator, likelihood, stages, posterior, under, verdicts)


def _refinement(found, emulator, n, seed):
    """``n`` places (n, d) drawn from the samples ``found`` where the emulator knows less than elsewhere, spread out."""
    candidates = found.drawn(_CANDIDATES, seed)
    unknown = emulator.uncertainty(candidates)
    return _spread_out(candidates[unknown >= np.median(unknown)], emulator.places, n)


def _spread_out(candidates, taken, n):
    """``n`` of the ``candidates``, each as far as can be from those before it and from the ones ``taken``."""
    chosen = []
    distance = np.full(len(candidates), np.inf)
    for place in taken:
        distance = np.minimum(distance, np.linalg.norm(candidates - place, axis=1))
    for _ in range(n):
        best = int(np.argmax(distance)) if np.isfinite(distance).all() else 0
        chosen.append(candidates[best])
        distance = np.minimum(distance, np.linalg.norm(candidates - candidates[best], axis=1))
    return np.array(chosen).reshape(n, -1)


# Without the emulator ------------------------------------------------------------------------------------


class Direct(NamedTuple):
    """A posterior from runs alone: samples, the runs' table, and what the emulator had told of them."""

    samples: Samples
    table: np.ndarray
    told: np.ndarray


def sample_directly(result, ensemble, n, seed=1):
    """A `Direct` posterior by importance sampling with ``n`` points, all of them run at the wish of the checks.

    They are drawn from the samples of ``result``, each moved by a normal distribution (_WIDER: broader than the
    posterior, so that it may turn out wrong), and weighted by prior times the likelihood of their runs over the density
    they were drawn from. The emulator has no part in the weights.
    """
    inference, rng = result.inference, np.random.default_rng(seed)
    centres = result.posterior.drawn(_CANDIDATES, seed)
    spread = np.linalg.cholesky((_WIDER**2 - 1.0) * result.posterior.covariance() + 1e-12 * np.eye(centres.shape[1]))
    places = np.empty((0, centres.shape[1]))
    while len(places) < n:  # those outside the prior have no weight
        moved = centres[rng.integers(len(centres), size=n)] + rng.normal(size=(n, centres.shape[1])) @ spread.T
        places = np.concatenate([places, moved[np.all((moved > 0) & (moved < 1), axis=1)]])[:n]
    off = np.linalg.solve(spread, (places[:, None, :] - centres).reshape(-1, centres.shape[1]).T).T
    proposal = logsumexp(-0.5 * (off**2).sum(axis=1).reshape(n, -1), axis=1)
    table = ensemble.quantities(places, inference.design.checked_at)
    good = np.all(np.isfinite(table), axis=1)
    places, table, proposal = places[good], table[good], proposal[good]
    errors = [0.0 * e for e in result.likelihood.errors]
    logs = Likelihood(inference, errors).log(table_numbers(inference, table))
    log_weights = logsumexp(logs, axis=0) - np.log(len(logs)) - proposal
    weights = np.exp(log_weights - logsumexp(log_weights))
    samples = Samples(places, weights, np.nan, np.exp(logs - logsumexp(logs, axis=0)))
    told = np.array(list(result.emulator.numbers(places).values())).T
    return Direct(samples, table, told)


# Trials --------------------------------------------------------------------------------------------------


def trials(result, ensemble, n, seed=2):
    """Levels (n,) of the smallest regions of highest posterior density that hold the true unknowns, and their places
    within the intervals (n, n_unknowns), in ``n`` synthetic experiments.

    In each the unknowns are drawn from the prior, the cases run there, and the data made from the runs, with model error
    and noise as the file states them. Of a correct inference both are even in [0, 1]. Raises CaseError where a datum is
    no number.
    """
    inference, rng = result.inference, np.random.default_rng(seed)
    if any(term.printed is None or term.legend or term.to or len(term.formulas) > 1 for term in inference.terms):
        raise CaseError(f"{inference.path}: data: trials need numbers or curves; leave statements and legends out.")
    true = qmc.Sobol(len(inference.unknowns), seed=seed).random(2 ** int(np.ceil(np.log2(n))))[:n]
    table = result.emulator.corrected(ensemble.quantities(true, inference.design.accuracy))
    levels, ranks = [], []
    for place, row in zip(true, table):
        if not np.all(np.isfinite(row)):
            continue
        made = synthetic(inference, table_numbers(inference, row[None]), rng)
        likelihood = Likelihood(made, result.likelihood.errors)
        found = sample(likelihood, result.emulator.numbers, effective=_FEW, seed=seed)
        every = logsumexp(likelihood.log(result.emulator.numbers(np.vstack([place, found.places]))), axis=0)
        levels.append(found.weights[every[1:] > every[0]].sum())
        ranks.append([found.weights[found.places[:, k] < place[k]].sum() for k in range(len(place))])
    return np.array(levels), np.array(ranks)


def synthetic(inference, numbers, rng):
    """``inference`` with data made from ``numbers`` (arrays of one), with its model error and its noise."""
    sigma = {term.figure: rng.choice(nodes(inference.model_error)) for term in inference.terms}
    terms = []
    for term in inference.terms:
        value = float(values_of(term, numbers)[0, 0])
        noise = np.hypot(term.error, sigma[term.figure] * value)
        terms.append(term._replace(printed=value + noise * rng.normal()))
    return inference.with_terms(terms)
