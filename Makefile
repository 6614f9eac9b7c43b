# Everything happens in .venv; nothing else on the machine is touched.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
USER_STAMP := $(VENV)/.installed-for-use

.PHONY: install run plan loop test lint docs bench battery robots clean

install: $(USER_STAMP)   ## the program alone, with figures, simulation and the view

run: plan loop           ## plan exciting motions, then close the loop

plan: $(STAMP)           ## the paper's problem on TALOS' two arms
	$(BIN)/excite optimize configs/talos_arms.yaml -o results/talos_arms.h5 --overwrite

loop: $(STAMP)           ## a UR10 with an effect its config does not know, found again
	$(BIN)/excite optimize configs/ur10.yaml --motions 4 -o results/motions.h5 --overwrite
	$(BIN)/excite simulate configs/ur10.yaml results/motions.h5 -o results/measured.h5 --overwrite \
	  --effect 'load_dependent_friction@elbow_joint=0.06'
	$(BIN)/excite diagnose configs/ur10.yaml results/measured.h5 -o results/diagnosis.h5 \
	  --apply results/ur10_found.yaml --overwrite
	$(BIN)/excite optimize configs/ur10.yaml --motions 1 --after results/diagnosis.h5 \
	  -o results/next.h5 --overwrite
	$(BIN)/excite report results/motions.h5 results/diagnosis.h5 results/next.h5 \
	  -o results/report.html --overwrite

test: $(STAMP) lint      ## lint, types, import directions, all tests
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist worksteal -q

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(STAMP)           ## the documentation, into site/; a warning is an error
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

robots: $(STAMP)         ## every robot of example-robot-data, into docs/robots.md (an hour or two)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.all_robots --workers 2 --resume

bench: $(STAMP)          ## cost and gradient, growth, whole motions
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.gradient
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.growth
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.clearance
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.motions

battery: $(STAMP)        ## the diagnosis on MuJoCo robots with undeclared effects (about 20 minutes)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.diagnosis_battery --cases 130 --seed 11001

$(STAMP): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade "pip>=24"
	$(BIN)/python -m pip install --quiet -e ".[dev]"
	touch $(STAMP) $(USER_STAMP)

$(USER_STAMP): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade "pip>=24"
	$(BIN)/python -m pip install --quiet -e ".[plot,sim,view]"
	touch $(USER_STAMP)

clean:
	rm -rf $(VENV) build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
