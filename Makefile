PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.installed
CORE := .venv/.core
PEERS := .venv/.peers
EXTRAS := .venv/.extras

# a machine may be set to keep no bytecode: then each of the hundreds of processes that tests start compiles everything
export PYTHONDONTWRITEBYTECODE :=

.PHONY: run test test-all check bench bench-full mutate docs clean zig
.DEFAULT_GOAL := help

help:
	@echo "make run       fly two emulated mock-ups (Ctrl-C ends it)"
	@echo "make test      the default tests"
	@echo "make test-all  the slow tests too"
	@echo "make check     format, lint, types, import contracts"
	@echo "make docs      build the documentation as a site: build/site/index.html"
	@echo "make bench     measure what docs/benchmarks.md reports"
	@echo "make bench-full   every fault over 20 seeds, 10 h of healthy flight, 1000 hostile sequences, formation flight over"
	@echo "                  100 seeds; goes on where it was ended"
	@echo "make mutate    change the safety path 200 times; a test must notice each change"

$(STAMP): pyproject.toml tools/requirements.lock
	@echo "Creating .venv (once) ..."
	@$(PYTHON) -m venv .venv
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r tools/requirements.lock
	@command -v $(firstword $(CC)) > /dev/null || $(MAKE) --no-print-directory zig
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $(STAMP)

zig: # the C compiler of a machine that has none
	@echo "There is no C compiler: installing ziglang (once) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r tools/requirements-zig.lock

$(CORE): $(STAMP) groundstation/core/build.py groundstation/core/sources.py $(wildcard groundstation/core/*.[ch])
	@$(BIN)/python tools/build_core.py
	@touch $(CORE)

run: $(CORE)
	@$(BIN)/groundstation run examples/rigs/two_mock_ups.toml

$(EXTRAS): tools/requirements-tests.lock | $(STAMP)
	@echo "Installing what tests and documentation need (once) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r tools/requirements-tests.lock
	@touch $(EXTRAS)

test: $(CORE) $(EXTRAS)
	@$(BIN)/python -m pytest -q -n 2

test-all: $(CORE) $(EXTRAS)
	@$(BIN)/python -m pytest -q -n 2 -m "not hardware" --ignore tests/closed_loop/live --ignore tests/browser
	@$(BIN)/python -m pytest -q -m "not hardware" tests/closed_loop/live tests/browser

check: $(CORE) $(EXTRAS)
	@$(BIN)/ruff format --check .
	@$(BIN)/ruff check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports

docs: $(CORE) $(EXTRAS)
	@NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet --strict --clean -f docs/site/mkdocs.yml
	@echo "build/site/index.html; with its search: $(BIN)/python -m http.server --bind 127.0.0.1 --directory build/site"

$(PEERS): tools/requirements-bench.lock | $(STAMP)
	@echo "Installing what the benches stand beside (once) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes \
	  -r tools/requirements-bench.lock && touch $(PEERS) \
	  || echo "They could not be installed: their rows will say so."

bench: $(CORE) $(PEERS)
	@$(BIN)/python tools/bench.py

bench-full: $(CORE)
	@mkdir -p build
	@$(BIN)/python tools/fault_campaign.py --seeds 20 --out build/fault_campaign.jsonl
	@$(BIN)/python tools/fault_campaign.py --only healthy --seeds 60 --after 600 --out build/healthy_flights.jsonl
	@$(BIN)/python tools/hostile_commands.py --seeds 1000 --out build/hostile_commands.jsonl
	@$(BIN)/python tools/formation_flights.py --seeds 100 --out build/formation_flights.jsonl

mutate: $(CORE)
	@$(BIN)/python tools/mutate.py --sample 200 --seed 1 --write docs/benchmarks.md

clean:
	@rm -rf .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache build dist
