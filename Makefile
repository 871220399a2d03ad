# make demo · make test · make help. Needs make and Python 3.11-3.13 with venv; the rest is fetched into .venv.
# Another interpreter: make PYTHON=python3.12 test

SHELL := /bin/sh
PYTHON ?= python3
BIN := .venv/bin
SEED ?= $(shell date +%s)
EXAMPLES ?= 20
WORKERS ?= $(shell expr $$(nproc) \* 3 / 2) # tests of processes wait; but each worker imports all tests

# A sourced ROS workspace or another virtual environment would win over .venv: none of it reaches the commands below.
unexport PYTHONPATH PYTHONHOME PYTHONSTARTUP VIRTUAL_ENV LD_LIBRARY_PATH LD_PRELOAD
unexport AMENT_PREFIX_PATH COLCON_PREFIX_PATH CMAKE_PREFIX_PATH ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION
unexport ROS_DOMAIN_ID ROS_LOCALHOST_ONLY ROS_AUTOMATIC_DISCOVERY_RANGE ROS_STATIC_PEERS ROS_DISCOVERY_SERVER
unexport ROS_SECURITY_ENABLE ROS_SECURITY_STRATEGY ROS_SECURITY_KEYSTORE ROS_SUPER_CLIENT
unexport RMW_IMPLEMENTATION RMW_FASTRTPS_USE_QOS_FROM_XML RMW_FASTRTPS_PUBLICATION_MODE CYCLONEDDS_URI
unexport FASTRTPS_DEFAULT_PROFILES_FILE FASTDDS_DEFAULT_PROFILES_FILE FASTDDS_BUILTIN_TRANSPORTS FASTDDS_ENVIRONMENT_FILE
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE
# With this every process would compile all sources anew: half a second for each start.
unexport PYTHONDONTWRITEBYTECODE
export AMENT_PREFIX_PATH := $(CURDIR)/.venv

.PHONY: help demo workbench test docs figures lint types bench soak interop fresh setup clean run-environment test-environment bench-environment interop-environment
.DEFAULT_GOAL := help

help:   ## list the targets
	@sed -n 's/^\([a-z]*\):.*## /make \1\t/p' $(firstword $(MAKEFILE_LIST)) | expand -t 16

demo: run-environment   ## set up (minutes, once), then run the demonstration (half a minute)
	@$(BIN)/python -m bouncing_disk_ros demo

workbench: run-environment   ## set up, start a simulator and serve the workbench, a page in the browser
	@$(BIN)/python -m bouncing_disk_ros workbench

# pytest rewrites the tests' sources and keeps them: the first time on a core that mypy leaves idle, not in each worker.
test: lint   ## set up, then run every check and the whole test suite, on all cores
	@test -d test/__pycache__ || $(BIN)/pytest --collect-only -qq > /dev/null 2>&1 & $(BIN)/mypy; types=$$?; wait; exit $$types
	$(BIN)/pytest -n $(WORKERS) --dist worksteal

lint: test-environment   ## check style and layout of the code (ruff)
	$(BIN)/ruff check
	$(BIN)/ruff format --check

types: test-environment   ## check types (mypy --strict)
	$(BIN)/mypy

bench: bench-environment   ## measure speed and lateness, beside other programs (minutes)
	$(BIN)/pytest -m bench -s test/bench

docs: test-environment   ## build guides and API reference as web pages: output/docs/html/index.html
	@$(BIN)/python tools/make_docs.py

figures: run-environment   ## compute every figure of the paper and docs/figures.md (minutes)
	@$(BIN)/python tools/make_figures.py

soak: test-environment   ## run for long: memory, lateness, lost rows, hostile commands; bags cut, damaged, killed and of gigabytes
	$(BIN)/pytest -m soak -s --timeout=7200 test/soak test/integration test/unit/cases test/unit/measured
	@echo "random examples with seed $(SEED); the same again: make soak SEED=$(SEED)"
	EXAMPLES=$(EXAMPLES) SEED=$(SEED) $(BIN)/pytest --hypothesis-seed=$(SEED) --timeout=43200 test/unit/core \
		test/reference test/unit/bag test/unit/report test/unit/measured test/unit/nodes/simulator/test_storms.py \
		test/unit/test_public_names.py test/unit/study/test_store.py test/unit/orbit_studies/test_fatal_changes.py test/unit/orbit_studies/test_manifolds.py \
		test/integration/test_hostile_bags.py test/integration/test_requests.py \
		test/integration/test_juggle.py test/integration/test_simulator_process.py

interop: interop-environment   ## check against foreign tools (another DDS, Foxglove, rerun, ros2) and Ubuntu 24.04's versions
	$(BIN)/pytest -m interop test/interop test/integration

fresh: test-environment   ## try make demo and make test on a fresh Debian 12 (root, debootstrap, some ten minutes)
	tools/fresh_machine.sh

setup: test-environment   ## only set up .venv and install the package

clean:   ## delete what make, colcon, pip and the tools have made
	rm -rf .venv .venv-ubuntu-24.04 build install log ./*.egg-info .hypothesis .mypy_cache .pytest_cache .ruff_cache output
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

run-environment test-environment bench-environment interop-environment: %-environment:
	@command -v $(PYTHON) >/dev/null || { \
	  echo "make: no $(PYTHON) here. On Debian and Ubuntu: sudo apt install git make python3 python3-venv" >&2; exit 2; }
	@$(PYTHON) tools/set_up.py $*
