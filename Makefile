# Everything a person or a CI machine needs: python 3.11 or newer and make. `make help` lists the verbs.

SCENE ?= exploration-02
SEED ?= 0

# The first interpreter that is new enough and can make virtual environments.
PYTHON ?= $(shell for name in python3.11 python3.12 python3.13 python3; do \
	"$$name" -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 11))' 2>/dev/null \
	&& echo "$$name" && break; done)

VENV := .venv
BIN := $(VENV)/bin
# Stamps inside the environment: pip runs again only when pyproject.toml has changed.
SIM_INSTALLED := $(VENV)/.installed-sim
DEV_INSTALLED := $(VENV)/.installed-dev
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
SOURCES := data runtime sim_robot training export tests

.DEFAULT_GOAL := help
.PHONY: help run test check format proto clean

help:  ## list the verbs
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "make %-8s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

run: $(SIM_INSTALLED)  ## let the simulated robot find and grasp a hidden target (SCENE=name SEED=n)
	$(BIN)/gi-runtime --robot sim --scene $(SCENE) --seed $(SEED)

test: $(DEV_INSTALLED)  ## run every test
	$(BIN)/python -m pytest $(PYTEST_ARGS)

check: $(DEV_INSTALLED)  ## lint, format, types, import rules; changes nothing
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright
	$(BIN)/lint-imports --no-cache --no-logo

format: $(DEV_INSTALLED)  ## put the code into the project's format
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

proto: $(DEV_INSTALLED)  ## generate the message code again from data/proto/*.proto
	$(BIN)/python -m grpc_tools.protoc --proto_path=data/proto --python_out=data/proto --pyi_out=data/proto \
		data/proto/grasping_invisible.proto

clean:  ## remove the environment and everything built; logs under runs/ stay
	rm -rf $(VENV) build dist *.egg-info .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	find $(SOURCES) -name __pycache__ -prune -exec rm -rf {} +

$(SIM_INSTALLED): pyproject.toml | $(BIN)/python
	@echo "installing the runtime and the simulator into $(VENV) ..."
	@$(PIP) install --editable '.[sim]'
	@touch $@

$(DEV_INSTALLED): pyproject.toml | $(BIN)/python
	@echo "installing everything, with the tools for training and tests, into $(VENV) ..."
	@$(PIP) install --editable '.[dev]'
	@touch $(SIM_INSTALLED) $@

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "needs Python 3.11 or newer with its venv module; none is on the PATH" >&2; exit 1; }
	@echo "making $(VENV) with $(PYTHON) ..."
	@$(PYTHON) -m venv $(VENV)
