# Two commands do all the set-up: `make dataset` and `make test`. Both make .venv themselves when it is absent.

PYTHON  ?= python3
VENV    := .venv
BIN     := $(VENV)/bin
DATASET ?= plans/demo
RELEASE ?= data_manifests/free40k.toml
RUNS    ?= experiments/runs
SEEDS   ?= 0 1 2
TRAIN   ?=
EXPERIMENTS := avoidance exploration exploration-view-10m exploration-view-10m-cnn exploration-view-10m-masks \
  exploration-frontiers
PLANS   ?= 500
FEW     ?= 100
PUBLISHED ?=
FURNISHED ?=
SEEKERS := seek seek-likely seek-likely-1 seek-likely-2 shortest random
EXPLORERS := chooser chooser-1 chooser-2 finisher look-around straight swift frontier random-frontier information tour oracle random forward wall
RESULTS ?= $(EXPLORERS:%=budget:%) $(EXPLORERS:%=quality:%) $(patsubst %,avoidance:%,spin random forward wall) \
  $(foreach track,navigation pointgoal,$(patsubst %,$(track):%,a-star greedy random forward)) \
  $(patsubst %,roomgoal:%,$(SEEKERS)) $(if $(FURNISHED),$(patsubst %,objectgoal:%,$(SEEKERS))) \
  $(foreach track,social social-orca,$(patsubst %,$(track):%,shortest wait keep-away give-way give-way-1 give-way-2)) \
  $(foreach track,large noisy people,$(patsubst %,$(track):%,chooser frontier random-frontier information wall forward random)) \
  $(patsubst %,slam:%,chooser frontier information)
TRACKS  ?= $(sort $(foreach run,$(RESULTS),$(firstword $(subst :, ,$(run)))))
LEARNED ?= $(foreach seed,$(SEEDS),avoidance:experiments/paper/avoidance-$(seed)/policy.pt \
  $(foreach run,view-10m view-10m-cnn frontiers,$(patsubst %,%:experiments/beyond/exploration-$(run)-$(seed)/policy.pt,budget quality)))
ABOUT   ?=
PYTEST  ?=
PIP     := $(BIN)/python -m pip --disable-pip-version-check --quiet install -c constraints.txt

.DEFAULT_GOAL := help
.PHONY: help setup cluster learn clients puffer gmapping ros readers experiments dataset release docs pictures screenshots results leaderboard test test-all check bench claims clean

help: ## show this list
	@printf '\n  \033[1mHouseExpo\033[0m: turns 3D house models into 2D floor plans, in bulk\n\n'
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  \033[36mmake %-11s\033[0m %s\n", $$1, $$2}' Makefile
	@echo

setup: $(VENV)/installed ## make .venv with the pinned versions, for the tests and checks too

$(VENV)/base: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "houseexpo needs Python 3.11 or newer, found $$($(PYTHON) --version 2>&1). Try: make setup PYTHON=python3.12"; exit 1; }
	@echo "-- making $(VENV) with $$($(PYTHON) --version)"
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV) || \
	  { echo "python3 has no venv; on Debian and Ubuntu: apt-get install python3-venv"; exit 1; }
	@echo "-- installing the pinned versions (1 GB; a few minutes the first time)"
	@$(PIP) setuptools
	@$(subst --quiet,,$(PIP)) --no-build-isolation --config-settings editable_mode=compat -e '.[serve]'
	@echo "-- installed; the command is $(BIN)/houseexpo"
	@touch $@

$(VENV)/installed: $(VENV)/base
	@echo "-- installing what the tests and checks need (another 1 GB)"
	@$(subst --quiet,,$(PIP)) --no-build-isolation --config-settings editable_mode=compat -e '.[ifc,scans,dev]'
	@touch $@

cluster: setup ## install what the tests on clusters need: Ray, an S3 client and server
	@$(PIP) --no-build-isolation -e '.[cluster-tests]'

learn: setup ## install what people learn with: PyTorch, Stable-Baselines3, sb3-contrib, TensorBoard, ONNX Runtime
	@$(PIP) --no-build-isolation --config-settings editable_mode=compat -e '.[learn,onnx]'

clients: learn ## install other libraries for learning, with which the tests train: TorchRL and RLlib
	@$(PIP) --no-build-isolation --config-settings editable_mode=compat -e '.[clients]'

puffer: learn ## put PufferLib 3 and its trainer, without its own games, into .venv/puffer: it asks for another NumPy than the rest does
	@ls $(VENV)/puffer/pufferlib/_C*.so >/dev/null 2>&1 || NO_OCEAN=1 PYTHONPATH=$(CURDIR)/tests/builders/pufferlib_setup \
	  $(PIP) --no-deps --no-build-isolation --no-cache-dir --upgrade --target $(VENV)/puffer pufferlib==3.0.0 gym==0.26.2 gym-notices==0.1.0 \
	  heavyball==1.7.2 opt-einsum pyro-api pyro-ppl rich-argparse

gmapping: setup ## build GMapping, the SLAM of the paper, for the comparison of maps; needs git and g++
	@tests/builders/gmapping/build $(VENV)/gmapping

ros: setup ## install CycloneDDS for `houseexpo ros`, and ROS 2's Python with Fast DDS, which judges it in the tests
	@$(PIP) --no-build-isolation --config-settings editable_mode=compat -e '.[ros-tests]'

readers: setup ## install what the tests read releases with: geopandas, DuckDB, pandas, datasets, mlcroissant
	@$(PIP) --no-build-isolation --config-settings editable_mode=compat -e '.[release-tests]'

experiments: learn ## learn the paper's two experiments, and those that go beyond them, three seeds each: hours; goes on where it was stopped
	@for name in $(EXPERIMENTS); do for seed in $(SEEDS); do \
	  $(BIN)/houseexpo train $${name%%-*} --config experiments/$$name.toml --seed $$seed --resume \
	    --out $(RUNS)/$$name-$$seed $(TRAIN) || exit; done; done

dataset: $(VENV)/base ## build the demo data set: 300 houses made by the project, into plans/demo
	@$(BIN)/houseexpo build --config data_manifests/demo.toml --out $(DATASET)
	@$(BIN)/houseexpo stats $(DATASET) --out $(DATASET)/.build/statistics.html

release: $(VENV)/base ## build a manifest (RELEASE=...) and release it, into releases/<its name>
	@$(BIN)/houseexpo build --config $(RELEASE) --out plans/$(basename $(notdir $(RELEASE)))
	@$(BIN)/houseexpo release plans/$(basename $(notdir $(RELEASE))) \
	  --out releases/$(basename $(notdir $(RELEASE))) $(ABOUT)

docs: setup ## build the pages of docs/ as a site, into docs/_build; warnings are errors
	@$(BIN)/python -c 'import furo, sphinx_copybutton, sphinx_design' 2>/dev/null || $(PIP) --no-build-isolation --config-settings editable_mode=compat -e '.[docs]'
	@$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet docs docs/_build
	@echo "-- open docs/_build/index.html"

pictures: setup ## draw the pictures of docs/algorithm.md anew
	@PYTHONPATH=. $(BIN)/python docs/scripts/pictures.py

screenshots: dataset ## take the pictures of the service's pages anew; needs Chromium
	@$(BIN)/python docs/scripts/screenshots.py $(DATASET)

results: learn ## run all policies of the leaderboard, on PLANS=500 plans, or FEW=100 on large, noisy, people, roomgoal, social, social-orca, slam; on objectgoal if FURNISHED=DATASET; TRACKS="large noisy" runs only these: hours; then `make leaderboard`
	@for run in $(RESULTS) $(LEARNED); do \
	  track=$${run%%:*}; case " $(TRACKS) " in *" $$track "*) ;; *) continue;; esac; policy=$${run#*:}; name=$$policy; folder=$$(basename $$(dirname $$policy)); \
	  case $$policy in *.pt) name=learned-$${folder#*-};; esac; \
	  case $$track in avoidance) plans=100;; objectgoal) plans=;; large|noisy|people|roomgoal|social|social-orca|slam) plans=$(FEW);; *) plans=$(PLANS);; esac; \
	  case $$track in objectgoal) data='--dataset $(FURNISHED)';; *) data='$(PUBLISHED)';; esac; \
	  id=$$($(BIN)/python -c "from houseexpo.pseudoslam.benchmark.tracks import find_track; print(find_track('$$track').id)"); \
	  $(BIN)/houseexpo benchmark run --track $$track --policy $$policy $${plans:+--plans $$plans} $$data \
	    --out docs/leaderboard/$$id-$$name.json || exit; done

leaderboard: setup ## make docs/leaderboard.md from the results in docs/leaderboard
	@$(BIN)/houseexpo benchmark compare docs/leaderboard --curves --title Leaderboard --out docs/leaderboard.md --replace

test: setup ## run the quick tests (3 to 5 minutes on two cores, kernels compiled)
	@OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 $(BIN)/python -m pytest -q -m 'not slow' -n auto --maxprocesses 8 --dist loadfile $(PYTEST)

test-all: setup ## run the slow tests too
	@$(BIN)/python -m pytest -q -n auto --maxprocesses 8 --dist loadfile $(PYTEST)

check: setup ## lint, formatting, types and the arrows between packages
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports --no-logo

bench: setup ## measure speed and quality; prints the tables of docs/benchmarks.md
	@$(BIN)/python -m pytest -q -s tests/benchmarks --benchmarks

claims: setup ## try what README and docs claim, an hour at most; says what is true, false, older than its code, or needs what is not here
	@$(BIN)/python -m tests.claims --run minutes

clean: ## remove what was built; data sets stay
	rm -rf $(VENV) build dist docs/_build *.egg-info .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis
