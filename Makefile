# Everything runs in .venv, made from the locked requirements. `make help` says what there is.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin

PACKAGES := analysis $(patsubst %/setup.py,%,$(wildcard ros_ws/src/*/setup.py))
METADATA := $(wildcard $(foreach package,$(PACKAGES),$(addprefix $(package)/,*.py *.cfg *.toml *.xml launch/* config/*.yaml layouts/*)))
UPLOT    := analysis/rhythmid/report/vendor/uplot
UPLOT_VERSION := 1.6.32

# whatever the shell says, modules are compiled once and not by every process: the tests start hundreds
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help install test test-long lint format demo demo-leg docs picture benchmark naming docker dist vendor lock clean

help: ## Show this list
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 12

install: $(VENV)/.warm ## Create .venv with the locked requirements and all packages (PYTHON=python3.12 to choose)

$(VENV)/.requirements: requirements.lock
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info[:2] not in ((3, 11), (3, 12)))' 2>/dev/null || \
		{ echo "error: rhythmid needs Python 3.11 or 3.12, and $(PYTHON) is not one; try: make $(or $(MAKECMDGOALS),install) PYTHON=python3.12" >&2; exit 2; }
	$(PYTHON) -m venv --clear $(VENV)
	@# a module is compiled when it is first imported: most never are
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --requirement requirements.lock
	@touch $@

$(VENV)/.packages: $(VENV)/.requirements $(METADATA)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation \
		$(foreach package,$(PACKAGES),--editable ./$(package))
	@# an editable install leaves out what ROS looks for in share/
	@for package in $(PACKAGES); do \
		(cd $$package && $(CURDIR)/$(BIN)/python -W ignore setup.py --quiet install_data --install-dir $(CURDIR)/$(VENV)) || exit 1; \
	done
	@touch $@

$(VENV)/.warm: $(VENV)/.packages
	@# a convenience: what cannot be compiled ahead is compiled when it is needed
	@$(BIN)/python -m rhythmid.warm_up || true
	@touch $@

test: lint ## Run the linters and all tests but the long ones
	@# in the order of tests/conftest.py, the longest files first; a test that fails twice fails, one that passes the second time is
	@# listed as RERUN
	$(BIN)/python -m pytest --numprocesses 2 --dist loadfile --no-loadscope-reorder --reruns 1 -r fEsxXR -m "not long" \
		tests/proof tests/browser tests/faults tests/unit
	@# what runs in real time has the machine to itself; much of it waits, so that two go side by side
	$(BIN)/python -m pytest --numprocesses 2 --dist loadfile --no-loadscope-reorder --reruns 1 -r fEsxXR -m "not long" tests/ros

test-long: install ## Run the tests that `make test` leaves out because they take long
	$(BIN)/python -m pytest --numprocesses 2 -m long tests

lint: $(VENV)/.packages ## Run ruff and pyright
	$(BIN)/ruff check .
	$(BIN)/ruff format --check --quiet .
	$(BIN)/pyright --threads 2 --pythonpath $(BIN)/python

format: install ## Format the code
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

demo: install ## Run the real graph, identify it from its bag; then conceal an effect, and find it
	$(BIN)/python docs/demo.py
	$(BIN)/python docs/demo_concealed.py

demo-leg: install ## Conceal an effect at a joint of a leg, and find joint and effect from its records
	$(BIN)/python docs/demo_leg.py

benchmark: install ## Compare the simulator with scipy and MuJoCo
	$(BIN)/python benchmarks/simulator.py

naming: install ## Compare the naming of missing physics with PySINDy and a Gaussian process
	$(BIN)/python -m pip install --quiet --constraint requirements.lock pysindy scikit-learn
	$(BIN)/python benchmarks/naming.py

docs: install ## Build the documentation site into site/, without warnings
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

picture: install ## Draw the pictures of README and docs (needs Chromium)
	$(BIN)/python docs/signal_path.py
	$(BIN)/python docs/delay_noise.py
	$(BIN)/python docs/report_picture.py

docker: install ## Build the image and run the graph in containers, with buildah and without any engine
	$(BIN)/python docker/without_engine.py

dist: install ## Build the package's wheel and sdist into dist/, check them, and run the wheel in an empty environment
	rm -rf dist
	$(BIN)/python -m pip install --quiet build twine
	$(BIN)/python -m build --outdir dist analysis
	$(BIN)/python -m twine check --strict dist/*
	$(PYTHON) -m venv --clear build/empty
	build/empty/bin/python -m pip install --quiet --disable-pip-version-check dist/*.whl
	cd build && empty/bin/rhythmid simulate $(CURDIR)/analysis/rhythmid/models/paper_hopper.yaml \
		--experiment $(CURDIR)/ros_ws/src/rhythmid_bringup/config/lockstep.yaml --out empty/bag
	cd build && empty/bin/rhythmid check empty/bag

vendor: ## Fetch the library that draws the figures of reports (needs npm)
	cd $(UPLOT) && npm pack --silent uplot@$(UPLOT_VERSION) && \
		tar --extract --gzip --file uplot-$(UPLOT_VERSION).tgz --no-same-owner --strip-components 1 package/LICENSE && \
		tar --extract --gzip --file uplot-$(UPLOT_VERSION).tgz --no-same-owner --strip-components 2 \
			package/dist/uPlot.iife.min.js package/dist/uPlot.min.css && \
		rm uplot-$(UPLOT_VERSION).tgz

lock: install ## Resolve the requirements anew into requirements.lock
	$(BIN)/python -m pip install --quiet uv
	$(BIN)/uv pip compile --quiet --universal --upgrade --python-version 3.11 \
		--custom-compile-command "make lock" --output-file requirements.lock \
		analysis/pyproject.toml --extra ros --group pyproject.toml:test --group pyproject.toml:docs

clean: ## Remove what was built, not what was recorded
	rm -rf $(VENV) build install log site .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -o -name '*.egg-info' | xargs rm -rf
