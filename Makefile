VENV := .venv
BIN := $(VENV)/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
LOCK := build/lock
UV_VERSION := 0.13.9

# One stamp for the locked packages, which depend on the ROS 2 that is sourced, if any, one for this project, and one for the
# packages of the tests.
PACKAGES := $(VENV)/.packages$(addprefix -,$(or $(ROS),$(ROS_DISTRO)))
PROJECT := $(VENV)/.project
TESTERS := $(VENV)/.testers
READER := tests/bag/javascript/node_modules
INSTALLED := setup.py package.xml pyproject.toml $(wildcard */nodes.py launch/*/* config/*/* papers/*/__init__.py)

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help setup develop viewers docs demo compile test portable bench lock clean choose

help: ## this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / {printf "make %-8s %s\n", $$1, $$2}' $(MAKEFILE_LIST)
	@echo
	@echo "PYTHON=/path/to/python3.12 chooses the interpreter (3.11 or 3.12); ROS=none leaves ROS 2 out;"
	@echo "PINOCCHIO=none leaves out the reference of some tests of the space robot (380 MB): they are skipped then;"
	@echo "RERUN=none likewise the viewer Rerun (500 MB)."

setup: $(PROJECT) ## .venv with pinned, hash-checked packages and this project, editable

develop: setup $(TESTERS) ## the packages of the tests as well

viewers: setup ## Rerun and the stream to Foxglove, for flight view and flight serve (500 MB)
	requirements/install.sh --viewers

docs: setup ## the handbook as a site, in build/site (250 MB of packages)
	requirements/install.sh --docs
	@$(BIN)/python docs/build.py --execute

demo: setup ## a first flight (runs: flight demo)
	$(BIN)/flight demo

compile: setup ## machine code of all components, ahead of the first run
	$(BIN)/flight compile --all

test: develop $(if $(shell command -v npm),$(READER)) ## all tests; a broken build fails in the first seconds
	$(BIN)/python -m pytest -x -q tests/smoke
	$(BIN)/python -m pytest -q -n 2 --dist loadgroup --max-worker-restart 0 tests --ignore=tests/smoke

portable: develop ## the same bits on other processors, emulated Arm too (docs/portable.md; ARM_ROOT=/path/to/its/root)
	$(BIN)/python -m tests.portable.machines $(if $(ARM_ROOT),--root "$(ARM_ROOT)")

bench: develop ## the numbers of the README (runs: benchmarks/*.py)
	@for script in benchmarks/*.py; do echo "$$script"; $(BIN)/python "$$script" || exit 1; done

lock: ## write requirements/*.txt anew (UPGRADE=1 takes the newest versions)
	test -x $(LOCK)/bin/uv || (python3 -m venv $(LOCK) && $(LOCK)/bin/pip install --quiet uv==$(UV_VERSION))
	$(call compile,build,requirements/build.in,3.11 --universal)
	$(call compile_all,3.11)
	$(call compile_all,3.12)

$(READER): tests/bag/javascript/package.json tests/bag/javascript/package-lock.json
	-npm ci --silent --no-audit --no-fund --fetch-retries 1 --fetch-timeout 20000 --prefix $(@D) && touch $@

clean: ## removes what make made, .venv too (recordings in runs/ stay)
	rm -rf $(VENV) $(READER) build install log dist *.egg-info .pytest_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# The locks of one Python: for users, the same with ROS, for tests, for their largest reference, for viewers, for the
# handbook. All have the same versions.
define compile_all
$(call compile,python$(1),setup.py,$(1) --universal)
	$(call compile,python$(1)-ros,setup.py --extra ros,$(1) --python-platform x86_64-manylinux_2_28,python$(1))
	$(call compile,python$(1)-test,setup.py --extra test,$(1) --universal,python$(1))
	$(call compile,python$(1)-pinocchio,setup.py --extra pinocchio,$(1) --universal,python$(1)-test)
	$(call compile,python$(1)-view,setup.py --extra view --extra foxglove,$(1) --universal,python$(1)-test)
	$(call compile,python$(1)-docs,setup.py --extra docs --extra notebooks,$(1) --universal,python$(1)-test)
endef

# $(call compile,name of the lock,sources,python version and platform,lock to agree with). No address goes into a lock.
define compile
$(LOCK)/bin/uv pip compile --quiet --no-config --generate-hashes --no-emit-index-url --no-emit-find-links \
	--no-annotate --custom-compile-command "make lock" $(if $(UPGRADE),--upgrade) --constraint requirements/build.in \
	$(if $(4),--constraint requirements/$(4).txt) --python-version $(3) --output-file requirements/$(1).txt $(2)
endef

$(PACKAGES): requirements/install.sh $(wildcard requirements/*.txt) $(if $(PYTHON),choose)
	requirements/install.sh $(PYTHON)
	@rm -f $(VENV)/.packages* $(TESTERS) && touch $@

$(TESTERS): $(PACKAGES)
	requirements/install.sh --tests
	@touch $@

$(PROJECT): $(PACKAGES) $(INSTALLED)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-index --no-build-isolation -e .
	@touch $@
