# `make demo` shows msgflow at work on a real recording, `make test` checks it. Both start on a bare
# machine: everything is installed into .venv, except what only the distribution has: python3-venv,
# and for the tests Babeltrace 2 to compare with, Chromium to look with, and LTTng and perf to record
# real ROS 2. apt installs these where that is allowed.

SHELL := /bin/sh
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
DEMO := .demo
HAS_BT2 := $(BIN)/python -c 'from msgflow.trace.bt2_library import load; load()' 2>/dev/null
HAS_LTTNG := { command -v lttng-sessiond && command -v gcc && gcc -E -include lttng/tracepoint.h -xc /dev/null; } >/dev/null 2>&1
HAS_CHROMIUM := PYTHONPATH=tests $(BIN)/python -c 'from support.browser import find_browser; exit(not find_browser())'

# Python compiles a module when it is first imported. To compile all that is installed, of which most
# is never imported, takes longer than the rest of an installation.
PIP := $(BIN)/python -m pip
INSTALL := install --quiet --no-compile

# Shell function: apt_install PACKAGE...; fails where apt is missing or not allowed.
APT := apt_install() { \
	command -v apt-get >/dev/null 2>&1 || return 1; \
	if [ "$$(id -u)" -eq 0 ]; then root=; else sudo -n true 2>/dev/null || return 1; root=sudo; fi; \
	$$root apt-get update -qq && \
	$$root env DEBIAN_FRONTEND=noninteractive \
		apt-get install -y -qq --no-install-recommends "$$@"; }

.PHONY: help demo quick test test-all bench truth real planted fuzz mutants docs babeltrace chromium ros clean

help:
	@echo 'make demo    read a real recording, print its end-to-end latency'
	@echo 'make quick   style, types, golden cases of schema, queries and pages: seconds'
	@echo 'make test    style, types, import contracts, tests: minutes'
	@echo 'make test-all the same with thorough tests: what others show on one input, on all of them'
	@echo 'make bench   speed and memory of reading and ingesting, beside Babeltrace 2'
	@echo 'make truth   precision and recall on systems with known truth: a sample of the day'
	@echo 'make real    the same on real ROS 2: nodes of rclpy, recorded with LTTng'
	@echo 'make planted whether msgflow why names the problems that were planted in a robot'
	@echo 'make ros     install what tests with real ROS 2 need: rclpy, LTTng, perf'
	@echo 'make fuzz    damaged traces, archives, databases and files through all of msgflow'
	@echo 'make mutants changes SQL rules one place at a time, and says what no test notices; hours'
	@echo 'make docs    the documentation as a site, in .site; fails at a dead link'
	@echo 'make clean   remove what these made'

demo: $(VENV)/.installed
	rm -rf $(DEMO)
	mkdir $(DEMO)
	$(BIN)/msgflow ingest examples/pipeline.tar.xz --db $(DEMO)/msgflow.duckdb
	$(BIN)/msgflow query e2e-latency --db $(DEMO)/msgflow.duckdb
	@echo
	@echo 'What to try next:'
	@echo '  export MSGFLOW_DB=$(CURDIR)/$(DEMO)/msgflow.duckdb; . $(BIN)/activate'
	@echo '  msgflow why /filtered                            why its messages are late'
	@echo '  msgflow query critical-path --to /filtered       what the slowest message waited for'
	@echo '  msgflow flow /scan --at 2.5s                     one message: its causes and effects'
	@echo '  msgflow query callbacks                          how long callbacks run, how often'
	@echo '  msgflow sql "FROM callback_run WHERE NOT is_internal LIMIT 10"         anything else'
	@echo 'see it: $(BIN)/msgflow ui --db $(DEMO)/msgflow.duckdb'
	@echo 'two hosts, simulated: $(BIN)/pip install -q -e simulator &&'
	@echo '  $(BIN)/msgflow simulate demo -o $(DEMO)/two_hosts'

quick: $(VENV)/.developed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/deno fmt --check --quiet
	$(BIN)/mypy --num-workers auto
	$(BIN)/pytest -n auto --dist worksteal --assert=plain $(wildcard tests/*/cases) \
		tests/style/test_generated.py tests/style/test_headers.py tests/style/test_sql_style.py \
		tests/style/test_weights.py

test: SELECTED := -m 'not thorough'
test test-all: $(VENV)/.developed babeltrace chromium ros
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/deno fmt --check --quiet
	$(BIN)/mypy --num-workers auto
	$(BIN)/lint-imports
	@# To show the values of a failed assert, each worker compiles all tests for ten seconds in a
	@# fresh clone: only what failed runs once more with them, and has failed all the same.
	$(BIN)/pytest -n auto --dist worksteal --assert=plain $(SELECTED) \
		|| { $(BIN)/pytest --last-failed --last-failed-no-failures none $(SELECTED); exit 1; }

bench: $(VENV)/.simulates babeltrace
	$(BIN)/python benchmarks/run.py

truth: $(VENV)/.simulates
	$(BIN)/python benchmarks/truth.py

real: $(VENV)/.installed ros
	$(BIN)/python benchmarks/real.py --python $(VENV)/ros/bin/python

planted: $(VENV)/.simulates ros
	$(BIN)/python benchmarks/planted.py --python $(VENV)/ros/bin/python

fuzz: $(VENV)/.simulates
	$(BIN)/python benchmarks/fuzz.py

mutants: $(VENV)/.developed
	$(BIN)/python benchmarks/mutants.py

docs: $(VENV)/.installed
	$(PIP) $(INSTALL) --group docs
	$(BIN)/zensical build --clean

$(VENV)/.made:
	@! command -v $(PYTHON) >/dev/null 2>&1 \
		|| $(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' \
		|| { echo 'msgflow needs Python 3.10 or newer; name one: make PYTHON=python3.12 ...' >&2; exit 1; }
	@$(APT); command -v $(PYTHON) >/dev/null 2>&1 || apt_install python3 python3-venv
	@$(APT); $(PYTHON) -m venv $(VENV) 2>/dev/null \
		|| { rm -rf $(VENV); apt_install python3-venv; $(PYTHON) -m venv $(VENV); }
	@# The group of development packages needs a pip of 2025.
	$(PIP) $(INSTALL) --upgrade 'pip>=25.1'
	@touch $@

$(VENV)/.installed: pyproject.toml $(VENV)/.made
	$(PIP) $(INSTALL) --editable .
	@touch $@

# The same, with the simulator.
$(VENV)/.simulates: simulator/pyproject.toml $(VENV)/.installed
	$(PIP) $(INSTALL) --editable simulator
	@touch $@

$(VENV)/.developed: pyproject.toml simulator/pyproject.toml $(VENV)/.made
	$(PIP) $(INSTALL) --editable . --editable simulator --group dev
	@touch $(VENV)/.installed $(VENV)/.simulates $@

babeltrace:
	@$(APT); { $(HAS_BT2) && command -v babeltrace2 >/dev/null; } \
		|| apt_install python3-bt2 babeltrace2 || true
	@$(HAS_BT2) || echo "note: no bt2: the tests that compare with Babeltrace 2 are skipped" >&2

chromium:
	@$(HAS_CHROMIUM) || { $(APT); \
		apt_install chromium-headless-shell || apt_install chromium || true; }
	@$(HAS_CHROMIUM) \
		|| echo "note: no chromium: the tests that look at pages are skipped" >&2

# Programs to record with, and an environment with the wheels of ROS 2.
ros: $(VENV)/.made
	@$(HAS_LTTNG) || { $(APT); apt_install lttng-tools liblttng-ust-dev gcc libc6-dev || true; }
	@command -v perf >/dev/null || { $(APT); apt_install linux-perf || true; }
	@test -x /usr/sbin/sshd || { $(APT); apt_install openssh-server openssh-client || true; }
	@test $(VENV)/ros/.installed -nt pyproject.toml || { \
		$(BIN)/python -m venv --clear --without-pip $(VENV)/ros \
		&& $(PIP) --python $(VENV)/ros/bin/python $(INSTALL) --group ros \
		&& touch $(VENV)/ros/.installed; } \
		|| echo "note: no rclpy: the tests with real ROS 2 are skipped" >&2

clean:
	rm -rf $(VENV) $(DEMO) .site .cache build/real
