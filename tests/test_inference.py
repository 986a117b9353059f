"""Inference: formulas, likelihood, posterior and verdicts on curves of closed form; files and the command on tiny runs."""

import csv
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from scipy.stats import norm

from quadrature import on_a_grid, use_a_grid
from vesdyn import ensemble as ensemble_module
from vesdyn import inference as inference_module
from vesdyn.cli import main
from vesdyn.emulator import Emulator
from vesdyn.ensemble import Ensemble
from vesdyn.errors import CaseError, RunError
from vesdyn.inference import (
    Likelihood, infer, nodes, probability, Scan, sample, sample_directly, sensitivity, trials,
)  # fmt: skip
from vesdyn.inference_file import Inference, read_held
from vesdyn.inference_report import called, write
from vesdyn.quantities import Formula, Quantity
from vesdyn.run import Outcome
from vesdyn.storage import RunDirectory

CONFIGS = Path(__file__).parents[1] / "configs"
TIMES = np.geomspace(1e-4, 3.0, 300)


@pytest.fixture
def quadrature(monkeypatch):
    """Let posteriors be found on a grid."""
    use_a_grid(monkeypatch)


class ClosedForm:
    """Takes the place of an ensemble of runs: A(t) = a (1 - exp(-t/tau)), a of the mobility, tau of the drag."""

    def __init__(self, inference):
        self.inference, self.asked, self.notes = inference, [], {}

    def remembered(self, stage):
        return self.notes.get(stage, np.empty((0, 2)))

    def remember(self, stage, places):
        self.notes[stage] = np.concatenate([self.remembered(stage), places])

    def quantities(self, places, accuracy):
        self.asked.append((len(places), accuracy))
        table = []
        for drag, mobility in self.inference.values(places):
            area = 0.3 * mobility**0.5 * (1.0 - np.exp(-TIMES / (0.2 * drag)))
            rows = {"time": TIMES, "binding_area": area, "contact_radius": np.sqrt(area), "density_max": 1 + area,
                    "density_min": 1 - 0.5 * area}  # fmt: skip
            table.append([q.of(rows) for q in self.inference.quantities])
        return np.array(table).reshape(-1, len(self.inference.quantities))


def inference_of(tmp_path, data, **keys):
    """An inference of drag and mobility from ``data``, stored in ``tmp_path``."""
    (tmp_path / "case.yaml").write_text("name: one\nmodel: axisymmetric\nmesh: auto\ntime: {end: 0.03, step: auto}\noutput: {frames: []}\n")
    text = {"name": "tiny", "unknowns": {"drag": {"low": 0.01, "high": 1.0}, "receptors.mobility": {"low": 0.5, "high": 8.0}},
            "cases": {"one": {"file": "case.yaml"}}, "data": data,
            "design": {"points": 24, "refined": 0, "checks": 0}, **keys}  # fmt: skip
    (tmp_path / "tiny.yaml").write_text(yaml.safe_dump(text))
    return Inference(tmp_path / "tiny.yaml")


def number(claim, value, printed, error, **more):
    return {"claim": claim, "value": value, "printed": printed, "error": error, **more}


FINAL = number("final", "final(one)", 0.6, 0.006)  # mobility 4
EARLY = number("early", "at(one, 0.02) / final(one)", 0.632, 0.006)  # drag 0.1


# Formulas ------------------------------------------------------------------------------------------------


def test_quantities_of_a_power_law():
    rows = {"time": TIMES, "binding_area": TIMES**0.5, "contact_radius": TIMES, "density_min": 1 / TIMES, "density_max": TIMES}
    assert Quantity("final", "one", ()).of(rows) == pytest.approx(3**0.5)
    assert Quantity("at", "one", (0.25,)).of(rows) == pytest.approx(0.5, rel=1e-6)
    assert Quantity("at", "one", (9.0,)).of(rows) == pytest.approx(3**0.5)  # after the end of the run
    assert Quantity("exponent", "one", (0.1,)).of(rows) == pytest.approx(0.5, abs=1e-6)
    assert Quantity("fitted_exponent", "one", (0.95,)).of(rows) == pytest.approx(0.5, abs=1e-6)
    assert Quantity("time_of", "one", (0.5,)).of(rows) == pytest.approx(0.75, rel=1e-3)
    assert Quantity("smallest", "one", ("density_min",)).of(rows) == pytest.approx(1 / 3)


def test_formula_is_arithmetic_of_quantities():
    formula = Formula("max(final(a), 2 * at(b, 0.1, density_min)) ** 2 - log(final(a)) / 4", ("a", "b"))
    a, b = formula.quantities
    assert (str(a), str(b)) == ("final(a)", "at(b, 0.1, density_min)")
    assert formula.value({a: np.array([1.0, 5.0]), b: np.array([3.0, 1.0])}) == pytest.approx([36.0, 25 - np.log(5.0) / 4])


@pytest.mark.parametrize("text", (
    "final(", "final(c)", "final(a, x)", "at(a)", "__import__('os')", "final(a).real", "open(a)", "final(a) if 1 else 2",
    "final(a, weight)", "lambda: 1", "time_of(a)",
))  # fmt: skip
def test_formula_refuses_what_it_does_not_know(text):
    with pytest.raises(CaseError, match=r"\."):
        Formula(text, ("a", "b"))


# The file ------------------------------------------------------------------------------------------------


def test_paper_uses_every_case_that_it_names():
    inference = Inference(CONFIGS / "inference" / "paper.yaml")
    assert {q.case for q in inference.quantities} == set(inference.scenes)
    assert len(inference.combinations) == 6
    assert {term.figure for term in inference.terms} == {"2", "3", "4", "5", "6", "7", "9"}


def test_drift_number_held_is_a_mobility_times_eight_over_the_ratio():
    inference = Inference(CONFIGS / "inference" / "paper.yaml")
    drift = [
        inference.case(name, inference.settings(name, (0.07, 2.0, 0.01, 1.0)), 0.02).drift_number
        for name in ("typical", "q15_drift")
    ]
    assert drift[0] == pytest.approx(drift[1], rel=1e-6)


@pytest.mark.parametrize("change, words", (
    ({"unknowns": {"drag": {"low": 1.0, "high": 0.1}}}, "no range"),
    ({"unknowns": {"drag": {"low": 0.0, "high": 0.1}}}, "no range"),
    ({"unknowns": {"draag": {"low": 0.01, "high": 0.1}}}, "draag"),
    ({"cases": {"one": {"file": "nowhere.yaml"}}}, "nowhere.yaml"),
    ({"data": [{"claim": "x", "value": "final(one)"}]}, "one of printed"),
    ({"data": [number("x", "final(two)", 1, 1)]}, "there is no case two"),
    ({"data": [number("x", "final(one)", 1, 1, when={"scale": "big"})]}, "no reading"),
    ({"data": [{"claim": "x", "file": "none.csv", "case": "one"}]}, "none.csv"),
    ({"data": [{"claim": "x", "value": "final(one)", "above": [2.0, 1.0]}]}, "increase"),
    ({"slip": 2.0}, "slip"),
    ({"variants": [{"name": "v", "without": ["none"]}]}, "no claim none"),
    ({"variants": [{"name": "v", "unknowns": {"drag": {"low": 0.001, "high": 0.1}}}]}, "within that of the prior"),
    ({"colour": "red"}, "colour"),
))  # fmt: skip
def test_a_fault_of_the_file_is_a_sentence(tmp_path, change, words):
    with pytest.raises(CaseError, match=words) as caught:
        inference_of(tmp_path, **{"data": [FINAL], **change})
    assert "tiny.yaml" in str(caught.value) or "none.csv" in str(caught.value)


@pytest.mark.parametrize("text", ("time,value\n1,2\n", "time,value,error\n1,2,0\n", "time,value,error\nx,2,1\n", "time,value,error\n"))
def test_a_measured_curve_that_is_none_is_refused(tmp_path, text):
    (tmp_path / "curve.csv").write_text(text)
    with pytest.raises(CaseError, match="curve.csv"):
        inference_of(tmp_path, [{"claim": "x", "file": "curve.csv", "case": "one"}])


def test_held_unknowns_are_checked(tmp_path):
    inference = inference_of(tmp_path, [FINAL])
    assert read_held(inference, ["drag=0.07"]) == {"drag": 0.07}
    for text in ("drag", "drag=x", "drog=1", "drag=7"):
        with pytest.raises(CaseError):
            read_held(inference, [text])


# Likelihood ----------------------------------------------------------------------------------------------


def term_of(tmp_path, **keys):
    [term] = inference_of(tmp_path, [{"claim": "x", "value": "final(one)", **keys}]).terms
    return term


def test_number_has_a_normal_density_and_its_rounding_an_integral(tmp_path):
    v, sigma = np.array([0.9, 1.0, 1.3]), np.array([0.0, 0.1])
    s = np.sqrt(0.05**2 + 0.02**2 + (sigma * v[:, None]) ** 2)
    density = probability(term_of(tmp_path, printed=1.0, error=0.05), v, 0.02, sigma)
    assert density == pytest.approx(norm.pdf(1.0, v[:, None], s) * np.sqrt(2 * np.pi), rel=1e-12)
    rounded = probability(term_of(tmp_path, printed=1.0, error=0.05, to=0.4), v, 0.02, sigma)
    assert rounded == pytest.approx(norm.cdf(1.2, v[:, None], s) - norm.cdf(0.8, v[:, None], s), rel=1e-9)


def test_rounded_prints_sum_to_one(tmp_path):
    """The readings of a scale can be compared only if each spreads the same probability over what may be printed."""
    v, sigma = np.array([4.3]), np.array([0.02])
    levels = [probability(term_of(tmp_path, printed=0.4 * k, error=0.1, to=0.4), v, 0.1, sigma) for k in range(1, 25)]
    assert np.sum(levels) == pytest.approx(1.0, abs=1e-6)
    legend = [probability(term_of(tmp_path, printed=0.4 * k, error=0.0, legend=0.4), np.array([8.0]), 1e-9, np.array([0.0]))
              for k in range(1, 25)]  # fmt: skip
    assert np.sum(legend) == pytest.approx(1.0, abs=0.05)  # the level at the very top counts half


def test_threshold_is_averaged_over_its_range(tmp_path):
    v = np.array([0.01, 0.1, 1.0])
    above = probability(term_of(tmp_path, above=[0.05, 0.2]), v, 1e-6, np.array([1e-6]))[:, 0]
    assert above == pytest.approx([0.0, 0.5, 1.0], abs=0.06)
    below = probability(term_of(tmp_path, below=[0.05, 0.2]), v, 1e-6, np.array([1e-6]))[:, 0]
    assert above + below == pytest.approx(1.0)
    assert np.diff(np.log(nodes((0.05, 0.2)))) == pytest.approx(np.log(4.0) / len(nodes((0.05, 0.2))))


def test_statement_that_fails_costs_half_the_slip_and_no_more(tmp_path):
    data = [{"claim": "x", "value": "final(one)", "above": 10.0}]
    inference = inference_of(tmp_path, data, slip=0.02)
    [log] = Likelihood(inference, [[1e-3]]).log({inference.quantities[0]: np.array([0.5])})
    assert np.exp(log) == pytest.approx(0.01)


def test_readings_count_only_where_they_are_meant(tmp_path):
    data = [number("x", "final(one)", 1.0, 0.1, when={"scale": "big"}), number("x", "final(one)", 0.5, 0.1, when={"scale": "small"})]
    inference = inference_of(tmp_path, data, readings={"scale": ["big", "small"]})
    big, small = Likelihood(inference, [[0.0], [0.0]]).log({inference.quantities[0]: np.array([1.0, 0.5])})
    assert big[0] > big[1] and small[0] < small[1]
    assert big[0] == pytest.approx(small[1])


# Emulator and posterior ----------------------------------------------------------------------------------


@pytest.fixture
def both(tmp_path):
    return inference_of(tmp_path, [FINAL, EARLY])


def test_emulator_tells_points_that_it_does_not_know(both):
    curves, rng = ClosedForm(both), np.random.default_rng(0)
    places, unseen = rng.random((40, 2)), rng.random((30, 2))
    emulator = Emulator(both, places, curves.quantities(places, 0.02))
    told = np.array(list(emulator.numbers(unseen).values())).T
    off = emulator.off(told, curves.quantities(unseen, 0.02))
    left_out = emulator.off(emulator.left_out, emulator.table)
    assert np.sqrt((off**2).mean()) < 0.01
    assert 0.1 < np.sqrt((off**2).mean() / (left_out**2).mean()) < 3.0  # what is left out tells the error


def test_emulator_leaves_failed_runs_out(both):
    curves, places = ClosedForm(both), np.random.default_rng(0).random((40, 2))
    table = curves.quantities(places, 0.02)
    table[3] = np.nan
    emulator = Emulator(both, places, table)
    assert np.all(np.isfinite(list(emulator.numbers(places).values())))
    assert np.isnan(emulator.left_out[3]).all()


def test_correction_is_the_mean_difference_of_finer_runs(both):
    curves, places = ClosedForm(both), np.random.default_rng(0).random((40, 2))
    table = curves.quantities(places, 0.02)
    emulator = Emulator(both, places, table)
    emulator.correct(table[:4], 0.9 * table[:4])
    assert emulator.shift == pytest.approx(np.log(0.9))
    assert emulator.corrected(table) == pytest.approx(0.9 * table)


def test_posterior_of_two_numbers_that_set_two_unknowns(both, quadrature):
    result = infer(both, ClosedForm(both), lambda line: None, claims=False)
    values = both.values(result.posterior.places)
    for k, true in enumerate((0.1, 4.0)):
        low, middle, high = result.posterior.quantiles(values[:, k], [0.05, 0.5, 0.95])
        assert low < true < high
        assert middle == pytest.approx(true, rel=0.05)
    low, high = result.posterior.quantiles(values[:, 1], [0.05, 0.95])
    assert (high - low) / 4.0 == pytest.approx(2 * 1.645 * 0.02, rel=0.25)  # 1 % of the area is 2 % of the mobility


def test_points_once_chosen_are_used_again_with_other_data(tmp_path, quadrature):
    design = {"points": 24, "refined": 8, "checks": 2}
    first = inference_of(tmp_path, [FINAL], design=design)
    curves = ClosedForm(first)
    chosen = infer(first, curves, lambda line: None, claims=False).stages
    other = inference_of(tmp_path, [FINAL, EARLY], design=design)
    curves.inference = other
    again = infer(other, curves, lambda line: None, claims=False).stages
    for stage in ("design", "refined", "checked"):
        assert np.array_equal(again[stage][0], chosen[stage][0])
    assert len(chosen["refined"][0]) == 8 and len(curves.notes["refined"]) == 8


def test_notes_of_points_outlive_the_process_and_keep_to_the_priors(tmp_path):
    inference = inference_of(tmp_path, [FINAL])
    places = np.array([[0.25, 0.5], [0.75, 0.9]])
    Ensemble(inference, tmp_path / "runs").remember("refined", places)
    Ensemble(inference, tmp_path / "runs").remember("checked", places[:1])
    assert Ensemble(inference, tmp_path / "runs").remembered("refined") == pytest.approx(places, abs=1e-12)
    narrow = {"drag": {"low": 0.01, "high": 0.2}, "receptors.mobility": {"low": 0.5, "high": 8.0}}
    narrower = inference_of(tmp_path, [FINAL], unknowns=narrow)
    assert len(Ensemble(narrower, tmp_path / "runs").remembered("refined")) == 1  # drag 0.0316 of 0.0316 and 0.316


def test_nested_sampling_agrees_with_quadrature(tmp_path, monkeypatch):
    """Means to four standard errors, evidence and the probability of a reading to what such a sampling gives."""
    for name, value in {"_LIVE": 150, "_SAMPLES": 500}.items():
        monkeypatch.setattr(inference_module, name, value)
    data = [number("x", "final(one)", 0.6, 0.03, when={"scale": "one"}), number("x", "2 * final(one)", 0.6, 0.03, when={"scale": "two"}),
            number("y", "final(one)", 0.5, 0.1), EARLY]  # fmt: skip
    inference = inference_of(tmp_path, data, readings={"scale": ["one", "two"]})
    places = np.random.default_rng(0).random((30, 2))
    emulator = Emulator(inference, places, ClosedForm(inference).quantities(places, 0.02))
    likelihood = Likelihood(inference, [[0.002]] * 4)
    exact, found = (f(likelihood, emulator.numbers) for f in (on_a_grid, sample))
    assert found.log_evidence == pytest.approx(exact.log_evidence, abs=0.2)
    p, q = (s.probability(inference, "scale", "one") for s in (exact, found))
    assert 0.6 < p < 0.999 and q == pytest.approx(p, abs=0.05)
    for k in range(2):
        error = np.sqrt(exact.covariance()[k, k] / found.effective)
        assert abs(found.mean(found.places[:, k]) - exact.mean(exact.places[:, k])) < 4 * error
    held = sample(likelihood, emulator.numbers, held={"drag": 0.1}, given=("scale", "one"))
    assert inference.values(held.places)[:, 0] == pytest.approx(0.1)
    assert held.probability(inference, "scale", "one") == pytest.approx(1.0)


def test_direct_sampler_agrees_with_the_emulator(both, quadrature):
    curves = ClosedForm(both)
    result = infer(both, curves, lambda line: None, claims=False)
    found = sample_directly(result, curves, 400)
    assert found.samples.effective > 80
    for k in range(2):
        error = np.sqrt(found.samples.covariance()[k, k] / found.samples.effective)
        assert abs(found.samples.mean(found.samples.places[:, k]) - result.posterior.mean(result.posterior.places[:, k])) < 4 * error


def test_direct_sampler_finds_what_a_wrong_emulator_hides(both, quadrature):
    curves = ClosedForm(both)
    result = infer(both, curves, lambda line: None, claims=False)
    processes = [process._replace(middle=process.middle + np.log(1.03)) for process in result.emulator._processes]
    result.emulator._processes = processes  # 3 % off in all that it tells
    wrong = result._replace(posterior=on_a_grid(result.likelihood, result.emulator.numbers))
    found = sample_directly(wrong, curves, 400)
    right, direct, off = (s.mean(s.places[:, 1]) for s in (result.posterior, found.samples, wrong.posterior))
    assert abs(off - right) > 0.01
    assert abs(direct - right) < 0.3 * abs(off - right)


def test_unknowns_of_synthetic_experiments_are_recovered(tmp_path, quadrature):
    """Of thirty regions of 95 %, 26 or more hold the true unknowns; of a correct inference fewer do in 2 % of trials."""
    rows = "".join(f"{t:g},1,0.02\n" for t in np.geomspace(0.002, 1.0, 12))
    (tmp_path / "curve.csv").write_text("time,value,error\n" + rows)
    inference = inference_of(tmp_path, [{"claim": "x", "file": "curve.csv", "case": "one"}])
    curves = ClosedForm(inference)
    result = infer(inference, curves, lambda line: None, claims=False)
    levels, ranks = trials(result, curves, 30)
    assert (levels <= 0.95).sum() >= 26
    assert 7 <= (levels <= 0.5).sum() <= 23  # and not because they are too large
    assert ranks.shape == (30, 2)


def test_trials_need_numbers(tmp_path, quadrature):
    inference = inference_of(tmp_path, [FINAL, {"claim": "large", "value": "final(one)", "above": 0.6}])
    result = infer(inference, ClosedForm(inference), lambda line: None, claims=False)
    with pytest.raises(CaseError, match="trials need numbers"):
        trials(result, ClosedForm(inference), 2)


# Other choices -------------------------------------------------------------------------------------------


VARIANTS = [
    {"name": "narrow", "unknowns": {"receptors.mobility": {"low": 0.5, "high": 3.5}}},
    {"name": "even", "unknowns": {"receptors.mobility": {"low": 0.5, "high": 8.0, "prior": "uniform"}}},
    {"name": "vague", "model_error": 0.2},
    {"name": "strict", "thresholds": "high"},
    {"name": "blind", "without": ["large", "final"]},
]


def test_other_choices_are_those_of_an_inference_that_states_them(tmp_path, quadrature):
    """The scan of the prior under each variant against an inference whose file has the variant's choice, on a grid."""
    large = {"claim": "large", "value": "final(one)", "above": [0.3, 0.62]}
    data = [number("final", "final(one)", 0.6, 0.06), number("early", EARLY["value"], 0.632, 0.06), large]
    inference = inference_of(tmp_path, data, slip=0.01, variants=VARIANTS)
    result = infer(inference, ClosedForm(inference), lambda line: None, claims=False)
    tried = sensitivity(result, 2**14)
    assert [*tried] == ["as stated", *(variant["name"] for variant in VARIANTS)]
    unknowns = {"drag": {"low": 0.01, "high": 1.0}}
    stated = {
        "as stated": (data, {}),
        "narrow": (data, {"unknowns": {**unknowns, **VARIANTS[0]["unknowns"]}}),
        "even": (data, {"unknowns": {**unknowns, **VARIANTS[1]["unknowns"]}}),
        "vague": (data, {"model_error": 0.2}),
        "strict": ([*data[:2], {**large, "above": 0.62}], {}),
        "blind": (data[1:2], {}),
    }
    for name, (other_data, keys) in stated.items():
        other = inference_of(tmp_path, other_data, slip=0.01, **keys)
        exact = on_a_grid(Likelihood(other, _errors(result, other)),
                          lambda places, other=other: result.emulator.numbers(inference.places(other.values(places))))  # fmt: skip
        found = inference.values(tried[name].places)
        for k in range(2):
            there = exact.quantiles(other.values(exact.places)[:, k], [0.1, 0.5, 0.9])
            assert tried[name].quantiles(found[:, k], [0.1, 0.5, 0.9]) == pytest.approx(there, rel=0.06), (name, k)
        assert tried[name].log_evidence == pytest.approx(exact.log_evidence, abs=0.1), name


def _errors(result, other):
    """Errors of the terms of ``result`` for those of ``other`` that have the same claims."""
    known = {term.claim: error for term, error in zip(result.inference.terms, result.likelihood.errors)}
    return [known[term.claim] for term in other.terms]


def test_a_scan_finds_the_probability_of_a_reading_that_is_next_to_impossible(tmp_path):
    data = [number("x", "final(one)", 0.6, 0.01, when={"scale": "one"}), number("x", "final(one)", 0.3, 0.01, when={"scale": "two"}),
            number("y", "final(one)", 0.6, 0.05)]  # fmt: skip
    inference = inference_of(tmp_path, data, readings={"scale": ["one", "two"]})
    places = np.random.default_rng(0).random((30, 2))
    emulator = Emulator(inference, places, ClosedForm(inference).quantities(places, 0.02))
    likelihood = Likelihood(inference, [[0.002]] * 3)
    exact = on_a_grid(likelihood, emulator.numbers).probability(inference, "scale", "two")
    found = Scan(inference, emulator.numbers).posterior(likelihood).probability(inference, "scale", "two")
    assert exact < 1e-6 and found == pytest.approx(exact, rel=0.2)


# Verdicts ------------------------------------------------------------------------------------------------


def verdicts_of(tmp_path, data, **keys):
    inference = inference_of(tmp_path, data, **keys)
    result = infer(inference, ClosedForm(inference), lambda line: None)
    return result, {v.claim: v for v in result.verdicts}


def test_a_number_that_sets_a_parameter_is_calibrated_and_no_prediction(tmp_path, quadrature):
    result, verdicts = verdicts_of(tmp_path, [FINAL, EARLY])
    assert verdicts["final"].sets == ["receptors.mobility"]
    assert verdicts["early"].sets == ["drag"]
    for verdict in verdicts.values():
        assert verdict.word == "calibrated"
        assert "predicted" not in called(verdict)
    # ... and even where it would come out as printed
    sure = verdicts["final"]._replace(probability=1.0)
    assert sure.word == "calibrated"
    write(result, tmp_path / "out")
    for line in (tmp_path / "out" / "report.md").read_text().splitlines():
        if line.startswith(("| final |", "| early |")) and "calibrated" in line:
            assert "predicted" not in line
    with open(tmp_path / "out" / "claims.csv", newline="") as file:
        assert {row["verdict"] for row in csv.DictReader(file)} == {"calibrated"}


def test_a_number_told_too_vaguely_is_not_refuted(tmp_path, quadrature):
    data = [FINAL, number("vague", "at(one, 0.02) / final(one)", 0.632, 0.001)]
    _, verdicts = verdicts_of(tmp_path, data)
    assert verdicts["vague"].probability < 0.1 and verdicts["vague"].sets == ["drag"]
    vague = verdicts["vague"]._replace(wider={"drag": 1.0}, larger=1.0)
    assert vague.tail > 0.2 and vague.word == "open"
    assert vague._replace(tail=0.01).word == "refuted"
    assert vague._replace(larger=2.0).word == "calibrated"


def test_a_claim_that_is_a_number_under_one_reading_and_an_order_under_another(tmp_path, quadrature):
    data = [FINAL, EARLY, number("both", "final(one)", 0.6, 0.02, when={"way": "a"}),
            {"claim": "both", "value": "final(one)", "below": 0.7, "when": {"way": "b"}}]  # fmt: skip
    _, verdicts = verdicts_of(tmp_path, data, readings={"way": ["a", "b"]})
    assert verdicts["both"].by_reading["way", "b"] > 0.99
    assert 0.9 < verdicts["both"].tail <= 1.0


def test_a_second_print_of_the_same_is_predicted_by_the_first(tmp_path, quadrature):
    same = [number(name, "final(one)", 0.6, 0.006) for name in ("first", "second", "third")]
    _, verdicts = verdicts_of(tmp_path, [*same, EARLY, {"claim": "false", "value": "final(one)", "above": [0.7, 0.8]}], slip=0.5)
    assert verdicts["first"].word == verdicts["second"].word == "predicted"
    assert verdicts["false"].word == "refuted"
    assert not verdicts["false"].sets


def test_statements_that_say_the_same_do_not_hide_each_other(tmp_path, quadrature):
    """Each alone is predicted by its twin; as claims of one figure both have set the mobility."""
    twins = [number(name, "final(one)", 0.6, 0.006, figure=5) for name in ("first", "second", "third")]
    _, apart = verdicts_of(tmp_path, [{**twin, "figure": k} for k, twin in enumerate(twins)] + [EARLY])
    _, together = verdicts_of(tmp_path, [*twins, EARLY])
    assert not any(apart[name].sets for name in ("first", "second", "third"))
    for name in ("first", "second", "third"):
        assert together[name].sets == ["receptors.mobility"] and together[name].word == "calibrated"
        assert together[name].without_figure < 0.3 < 0.9 < apart[name].probability


def test_probability_leaves_the_claim_out(tmp_path, quadrature):
    """A statement that only itself supports is as likely as the prior makes it, not as its own data do."""
    data = [EARLY, {"claim": "large", "value": "final(one)", "above": 0.6}]
    _, verdicts = verdicts_of(tmp_path, data)
    assert verdicts["large"].probability == pytest.approx(0.25, abs=0.04)  # mobility above 4 of 0.5 to 8, log-uniform


def test_threshold_ends_measures_and_readings_are_told(tmp_path, quadrature):
    data = [FINAL, EARLY, {"claim": "some", "value": ["final(one)", "2 * final(one)"], "above": [0.5, 1.0], "when": {"way": "a"}},
            {"claim": "some", "value": "final(one) / 2", "above": [0.5, 1.0], "when": {"way": "b"}}]  # fmt: skip
    _, verdicts = verdicts_of(tmp_path, data, readings={"way": ["a", "b"]}, slip=0.3)
    found = verdicts["some"]
    limits, (low, high) = found.by_threshold
    assert limits == (0.5, 1.0) and low > found.probability > high
    one, two, half = found.by_measure.values()
    assert two[()] > one[()] > half[()]  # 2 final, final, final / 2 against the same threshold
    assert {*found.by_measure} == {"final(one)", "2 * final(one)", "final(one) / 2"}
    assert found.by_reading["way", "a"] > found.by_reading["way", "b"]


# Runs ----------------------------------------------------------------------------------------------------


def test_runs_are_kept_and_used_again(tmp_path):
    inference = inference_of(tmp_path, [FINAL])
    places = np.array([[0.5, 0.3], [0.6, 0.7]])
    first = Ensemble(inference, tmp_path / "runs", jobs=1, show=False)
    table = first.quantities(places, 0.2)
    assert first.runs == 2 and np.isfinite(table).all() and table[0, 0] != table[1, 0]
    again = Ensemble(inference, tmp_path / "runs", jobs=1, show=False)
    assert np.array_equal(again.quantities(places, 0.2), table)
    assert again.runs == 0
    assert not any((tmp_path / "runs" / "runs").iterdir())


def test_a_curve_that_is_damaged_or_anothers_is_run_again(tmp_path):
    inference = inference_of(tmp_path, [FINAL])
    places = np.array([[0.5, 0.3], [0.6, 0.7]])
    first = Ensemble(inference, tmp_path / "runs", jobs=1, show=False)
    table = first.quantities(places, 0.2)
    one, other = sorted(first.curves.glob("*.npz"))
    whole = one.read_bytes()
    flipped = bytearray(whole)
    flipped[len(whole) // 2] ^= 4
    harms = [whole[: len(whole) // 2], b"", bytes(len(whole)), b"text", bytes(flipped), other.read_bytes()]
    for harm in harms:
        one.write_bytes(harm)
        assert ensemble_module._read(one) is None
    again = Ensemble(inference, tmp_path / "runs", jobs=1, show=False)
    assert np.array_equal(again.quantities(places, 0.2), table)
    assert again.runs == 1 and one.read_bytes() != harms[-1]


def test_a_full_disk_is_no_gap(tmp_path, monkeypatch):
    """A failure in which the scene has no part is not remembered."""
    inference = inference_of(tmp_path, [FINAL])
    ensemble = Ensemble(inference, tmp_path / "runs", jobs=1, show=False)
    full = Outcome("failed", "runs/a: the disk is full (status.yaml); make room.", disturbed=True)
    monkeypatch.setattr(ensemble_module, "run_batch", lambda cases, *_, **__: [(case, full) for case in cases])
    with pytest.raises(RunError, match="the disk is full"):
        ensemble.quantities(np.array([[0.2, 0.5]]), 0.2)
    assert not list(ensemble.curves.glob("*.npz"))


def test_places_that_were_noted_in_part_are_passed_over(tmp_path):
    ensemble = Ensemble(inference_of(tmp_path, [FINAL]), tmp_path / "runs", jobs=1, show=False)
    places = np.array([[0.5, 0.3], [0.6, 0.7]])
    ensemble.remember("refined", places)
    whole = ensemble._notes.read_bytes()
    for tail in (b"refined,0.1", b"refined,0.1,x\r\n", b"\x00", b"refined", b"\xff\xfe"):
        ensemble._notes.write_bytes(whole + tail)
        assert len(ensemble.remembered("refined")) == (0 if tail == b"\xff\xfe" else 2)
    ensemble._notes.write_bytes(whole + b"refined,0.1")
    ensemble.remember("checked", places[:1])
    assert len(ensemble.remembered("refined")) == 2 and len(ensemble.remembered("checked")) == 1


def test_a_run_that_fails_leaves_a_gap(tmp_path, monkeypatch):
    inference = inference_of(tmp_path, [FINAL])
    ensemble = Ensemble(inference, tmp_path / "runs", jobs=1, show=False)
    run = ensemble_module.run_batch

    def one_fails(cases, *arguments, **options):
        outcomes = run(cases, *arguments, **options)
        return [(case, replace(outcome, state="failed", reason="no balance.") if case.drag > 0.1 else outcome)
                for case, outcome in outcomes]  # fmt: skip

    monkeypatch.setattr(ensemble_module, "run_batch", one_fails)
    with pytest.warns(UserWarning, match="left out"):
        table = ensemble.quantities(np.array([[0.2, 0.5], [0.9, 0.5]]), 0.2)
    assert np.isfinite(table[0, 0]) and np.isnan(table[1, 0])


def test_a_run_that_was_never_begun_is_no_gap(tmp_path):
    """A process that died is no fault of the point: the next call runs it."""
    ensemble = Ensemble(inference_of(tmp_path, [FINAL]), tmp_path / "runs", jobs=1, show=False)
    outcome, file = SimpleNamespace(state="failed", reason="its process died 3 times."), tmp_path / "curve.npz"
    with pytest.raises(RunError, match="its process died"):
        ensemble._keep(RunDirectory(tmp_path / "none"), outcome, file)
    assert not file.exists()


@pytest.mark.verify
def test_the_command_on_tiny_runs_twice(tmp_path, monkeypatch, capsys, quadrature):
    monkeypatch.chdir(tmp_path)
    inference_of(tmp_path, [number("front", "at(one, 0.02, contact_radius)", 0.25, 0.005)],
                 design={"points": 12, "refined": 2, "checks": 1, "accuracy": 0.2, "checked_at": 0.1})  # fmt: skip
    for expected in ("runs were computed", " 0 runs were computed"):
        assert main(["infer", "tiny.yaml", "--jobs", "1", "--hold", "receptors.mobility=2"]) == 0
        report = (tmp_path / "runs" / "tiny" / "report.md").read_text()
        assert expected in report
    for section in ("Unknowns", "Correlations", "Claims", "Emulator", "With unknowns held"):
        assert f"## {section}" in report
    assert {f.name for f in (tmp_path / "runs" / "tiny").iterdir()} >= {
        "report.md", "samples.csv", "points.csv", "claims.csv", "corner.png", "predictive.png"
    }  # fmt: skip
    assert main(["infer", "nowhere.yaml"]) == 2
    assert "nowhere.yaml" in capsys.readouterr().err
