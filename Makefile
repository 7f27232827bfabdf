# make demo | test | lint | docs | forget-kernels | clean: each works from a bare checkout with python3, make and the package index.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

.PHONY: demo test lint format docs forget-kernels clean

$(STAMP): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check --editable '.[dev]'
	touch $(STAMP)

demo: $(STAMP)
	$(BIN)/tauhat demo

test: $(STAMP)
	$(BIN)/pytest -n auto --dist loadfile

lint: $(STAMP)
	$(BIN)/ruff format --check src tests benchmarks examples docs/site
	$(BIN)/ruff check src tests benchmarks examples docs/site
	$(BIN)/mypy

# into build/site, from which it can be opened or copied
docs: $(STAMP)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "build/site/index.html"

format: $(STAMP)
	$(BIN)/ruff format src tests benchmarks examples docs/site
	$(BIN)/ruff check --fix src tests benchmarks examples docs/site

# compiled functions that may hold older versions of those they call: docs/code.md
forget-kernels:
	find src -name '*.nb[ci]' -delete

clean: forget-kernels
	rm -rf $(VENV) build dist *.egg-info src/*.egg-info .mypy_cache .ruff_cache .pytest_cache
