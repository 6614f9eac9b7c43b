# Everything happens in .venv; nothing else on the machine is touched.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

.PHONY: run test lint bench clean

run: $(STAMP)            ## the paper's problem on TALOS' two arms
	$(BIN)/excite optimize configs/talos_arms.yaml -o results/talos_arms.h5 --overwrite

test: $(STAMP) lint      ## lint, types, import directions, all tests
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist worksteal -q

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(STAMP)          ## cost and gradient, growth, whole motions
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.gradient
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.growth
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.clearance
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.motions

$(STAMP): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade "pip>=24"
	$(BIN)/python -m pip install --quiet -e ".[dev]"
	touch $(STAMP)

clean:
	rm -rf $(VENV) build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
