PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
READY := $(VENV)/ready

SCRIPTS := $(filter-out looks,$(sort $(patsubst plots/%.py,%,$(wildcard plots/*.py))))
FIGURES := $(filter figure%,$(SCRIPTS))

.PHONY: run test verify faults mutate figures promise $(SCRIPTS) clean
.NOTPARALLEL:

run: $(READY)
	$(VENV)/bin/python -m vesdyn run configs/typical.yaml
	@echo "Figures: runs/typical/summary.png; in ParaView: runs/typical/frames.xdmf"

test: $(READY)
	$(VENV)/bin/python -m pytest -m "not verify" -n 2

# Errors of the disk, damage, interrupts, neighbours and inputs, all of them; says how many were tried.
faults: $(READY)
	$(VENV)/bin/python -m pytest -q tests/faults -p no:xdist --tried tests/faults/tried.csv
	$(VENV)/bin/python benchmarks/storage.py quick --csv tests/faults/cost.csv
	$(VENV)/bin/python tests/faults/table.py docs/faults.md

# The sources broken in one place at a time, in a copy: does a fast test see it? docs/mutations.md.
mutate: $(READY)
	$(VENV)/bin/python tests/mutate.py docs/mutations.md --jobs $(or $(JOBS),2) $(if $(NAME),-k "$(NAME)")

# Those of tests/faults belong to make faults.
verify: $(READY)
	$(VENV)/bin/python -m pytest -m verify -n 2 --ignore=tests/faults

# Random scenes against references: docs/promise.md. What is in runs/promise by the same sources is not computed again.
promise: $(READY)
	$(VENV)/bin/python benchmarks/promise.py $(if $(JOBS),--jobs $(JOBS)) $(if $(LIMIT),--limit $(LIMIT))

# All figures of the paper, or one script of plots/: make figure3, make accuracy. JOBS=N limits the runs side by side.
figures: $(FIGURES)

$(SCRIPTS): $(READY)
	$(VENV)/bin/python plots/$@.py $(if $(JOBS),--jobs $(JOBS))

# Built afresh whenever the requirements change, so that a forgotten requirement is noticed.
$(READY): setup.cfg pyproject.toml
	$(PYTHON) -m venv --clear $(VENV)
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --editable ".[test]"
	touch $@

# Results in runs/ stay.
clean:
	rm -rf $(VENV) vesdyn.egg-info .pytest_cache
	find vesdyn tests -name __pycache__ -prune -exec rm -rf {} +
