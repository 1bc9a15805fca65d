# `make demo` and `make test` set up all they need; `make help` lists the rest.
PYTHON ?= python3
VENV   ?= .venv
BIN     = $(VENV)/bin
BUILT   = $(VENV)/.built
NODE    = node_modules/.package-lock.json
BUNDLE  = src/livebode/dashboard/_bundle/manifest.json
# Small products only make BLAS's threads wait for each other; the command line does the same for itself.
export OPENBLAS_NUM_THREADS ?= 1
# One more than there are processors: a test that waits, for a server or a child, leaves them to others.
WORKERS ?= $(shell $(PYTHON) -c "import os; print((os.cpu_count() or 1) + 1)")
# A file's tests share what they compute once; conftest.py has the files that take longest begin first.
BY_FILE = -n $(WORKERS) --dist loadfile --no-loadscope-reorder
WHEELS  = .venv-wheels
# A Python that has the wheel of the stable ABI: the newest of pyenv, else that of the system.
LATER_PYTHON ?= $(or $(lastword $(sort $(wildcard $(HOME)/.pyenv/versions/3.1[2-9].*/bin/python3))),python3.13)
PAGES   = $(shell find src wings -type f -path '*/static/*' -o -type f -path '*/_vendor/*')
NATIVE  = $(shell find kernel native simulation CMakeLists.txt src/livebode/kernel src/livebode/simulation -name '*.[ch]' -o -name '*.cpp' -o -name CMakeLists.txt -o -name '*.cmake')
C_SOURCES = $(shell find kernel native simulation src examples bench tests -name '*.[ch]' -o -name '*.cpp')

.PHONY: help bundle demo test test-changed durations mutations size pytest docs lint bench bench-compare release-check wheels test-abi3 bench-abi3 profiles lowest publishing outage peers studies repeating recognition uneven nonperiodic fit-bounds common-modes monitoring healthy temperature trends fuzz crash damage deletions archive-faults fleet-faults fleet-scale soak attacks screenshots system-packages catalogues lock clean

help:            ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 20

$(VENV)/.installed: requirements-dev.lock
	$(PYTHON) -m venv $(VENV)
	@$(BIN)/python tools/install.py requirements-dev.lock
	touch $@

$(BUILT): $(VENV)/.installed pyproject.toml $(NATIVE)
	@echo "Compiling livebode: about a minute"
	@PATH="$(abspath $(BIN)):$$PATH" $(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	touch $@

# Node.js is from PyPI; the lock file has the hashes of the packages.
$(NODE): $(VENV)/.installed package.json package-lock.json
	PATH="$(abspath $(BIN)):$$PATH" npm ci --ignore-scripts --no-audit --no-fund --loglevel=error \
		|| { echo "npm could not install TypeScript, Biome and esbuild: see Set up in CONTRIBUTING.md"; exit 1; }
	touch $@

bundle: $(BUILT) $(NODE)  ## join the scripts and styles of each page; without, or where they differ, pages load them one by one
	@$(BIN)/python -m tools.bundle

$(BUNDLE): $(BUILT) $(NODE) $(PAGES) tools/bundle.py src/livebode/dashboard/plugin_pages.py
	@$(MAKE) --no-print-directory bundle

demo: $(BUILT)   ## track a simulated machine, live
	$(BIN)/livebode demo

test: $(BUILT) $(BUNDLE)  ## lint, types, import contract and every test
	$(MAKE) --no-print-directory --jobs=2 lint pytest  # what checks the types has one thread

# Python compiles the tests once; else each of the processes below would.
$(VENV)/.compiled: $(BUILT)
	-@$(BIN)/python -m pytest --collect-only -q >/dev/null
	touch $@

pytest: $(BUILT) $(BUNDLE) $(VENV)/.compiled
	@$(BIN)/python -m pytest $(BY_FILE)

durations: $(BUILT) $(BUNDLE) $(VENV)/.compiled  ## every test, then the seconds of the longest in bench/history/test-seconds.csv
	@$(BIN)/python -m pytest $(BY_FILE) --junitxml=build/tests.xml -o junit_family=xunit1
	@$(BIN)/python -m tools.test_seconds build/tests.xml > bench/history/test-seconds.csv

BASE ?=
MUTATIONS ?= 20
test-changed: $(BUILT)  ## the tests that what changed since a commit can concern (BASE=COMMIT; default: the last one)
	@$(BIN)/python -m tools.changed_tests $(or $(BASE),HEAD) $(BY_FILE)

mutations: $(BUILT)  ## break 20 lines of the hull and of each wing at random: which does no test notice (hours; MUTATIONS=2: less)
	for package in livebode $(notdir $(wildcard wings/*/src/*)); do $(BIN)/python -m tools.mutations $$package $(MUTATIONS) 1 || exit; done

size: $(BUILT)   ## lines, files and imports of each package beside their limits (tests/meta/size_limits.toml)
	@$(BIN)/python -m tools.size

$(VENV)/.docs: $(BUILT) requirements-docs.lock
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements-docs.lock
	touch $@

docs: $(VENV)/.docs  ## the documentation as a site in build/docs, its tutorials executed; every warning is an error
	PATH="$(abspath $(BIN)):$$PATH" $(BIN)/python -m sphinx -W --keep-going -q -b html -c docs . build/docs

lint: $(BUILT) $(NODE)  ## style, types and the import contract
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache
	$(BIN)/clang-format --dry-run -Werror $(C_SOURCES)
	PATH="$(abspath $(BIN)):$$PATH" node_modules/.bin/biome check --error-on-warnings .
	PATH="$(abspath $(BIN)):$$PATH" node_modules/.bin/tsc

$(VENV)/.bench: $(BUILT) requirements-bench.lock
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements-bench.lock
	touch $@

bench: $(VENV)/.bench $(BUNDLE)  ## side by side with what a user would pick instead
	$(BIN)/python -m bench.felt
	$(BIN)/python -m bench.start
	$(BIN)/python -m bench
	$(BIN)/python -m bench.hop_rows
	$(BIN)/python -m bench.full_spectrum
	$(BIN)/python -m bench.tracking
	$(BIN)/python -m bench.fits
	$(BIN)/python -m bench.mimo
	$(BIN)/python -m bench.motion
	$(BIN)/python -m bench.bandwidth
	$(BIN)/python -m bench.repeating
	$(BIN)/python -m bench.nonperiodic
	$(BIN)/python -m bench.live
	$(BIN)/python -m bench.hall
	$(BIN)/python -m bench.live_blocks
	$(BIN)/python -m bench.overload
	$(BIN)/python -m bench.segments
	$(BIN)/python -m bench.dashboard
	$(BIN)/python -m bench.page
	$(BIN)/python -m bench.readers
	$(BIN)/python -m bench.runs
	$(BIN)/python -m bench.archive
	$(BIN)/python -m bench.growth

bench-compare: $(BUILT)  ## the speed of this version and of another commit, alternately (BASE=REV; default: newest tag or stored result)
	$(BIN)/python -m bench.versions --base "$(BASE)"

$(WHEELS)/.installed: requirements-wheels.lock
	$(PYTHON) -m venv $(WHEELS)
	$(WHEELS)/bin/python -m pip install --quiet --require-hashes -r requirements-wheels.lock
	touch $@

wheels: $(WHEELS)/.installed $(BUNDLE)  ## wheels for every Python of this computer in dist/, tried without a compiler or the network (10 min)
	$(WHEELS)/bin/python -m tools.wheels build
	$(WHEELS)/bin/python -m tools.wheels gather
	$(WHEELS)/bin/python -m tools.wheels try
	$(WHEELS)/bin/python -m tools.wheels runners

test-abi3:       ## every test on the stable ABI, in an environment of LATER_PYTHON
	@$(MAKE) --no-print-directory VENV=.venv-abi3 PYTHON=$(LATER_PYTHON) pytest

bench-abi3: $(BUILT)  ## the speed of the stable ABI and of the ABI of LATER_PYTHON itself
	@$(MAKE) --no-print-directory VENV=.venv-abi3 PYTHON=$(LATER_PYTHON) .venv-abi3/.built
	$(BIN)/python -m bench.stable_abi .venv-abi3/bin/python

release-check: $(VENV)/.docs $(WHEELS)/.installed $(BUNDLE)  ## what is missing for a release (CONTRIBUTING.md)
	$(BIN)/python -m tools.release check

profiles: $(BUNDLE) $(WHEELS)/.installed  ## install each profile of the wheel into a fresh environment: sizes, and whether the core works (10 min)
	PATH="$(abspath $(BIN)):$(abspath $(WHEELS)/bin):$$PATH" $(BIN)/python -m tools.profiles

lowest: $(BUILT) $(WHEELS)/.installed  ## tests with the lowest versions that pyproject.toml permits (20 min)
	PATH="$(abspath $(BIN)):$(abspath $(WHEELS)/bin):$$PATH" $(BIN)/python -m tools.lowest

outage: $(BUILT)  ## receivers of [[publish]] that are down for an hour: what arrives afterwards, and memory (1 h)
	$(BIN)/python -m studies.receivers_down

peers: $(VENV)/.bench  ## livebode and what others would take, on the same simulated recordings (docs/explanation/peers.md)
	$(BIN)/python -m studies.peers

studies: $(BUILT) ## the paper's experiments: figures, numbers, verdicts, docs/explanation/studies.md
	$(BIN)/python -m studies

repeating: $(BUILT) ## coverage of the bounds under friction, backlash, encoder steps, hum and noise of many kinds
	$(BIN)/python -m studies.repeating

recognition: $(BUILT) ## share of 1,000 generated excitations whose period and lines are found exactly
	$(BIN)/python -m studies.recognition

uneven: $(BUILT) ## coverage of the bounds where every channel has a jittering clock of its own (3 min)
	$(BIN)/python -m studies.uneven

nonperiodic: $(BUILT) ## chirps and noise: coverage of the bounds, and bias at a sharp resonance, of lpm and welch
	$(BIN)/python -m studies.nonperiodic

fit-bounds: $(BUILT) ## coverage and width of a fit's bounds where the model lacks something (docs/explanation/fits.md)
	$(BIN)/python -m studies.fit_bounds

common-modes: $(BUILT) ## order and coverage of the bounds of modes common to two outputs (docs/explanation/fits.md)
	$(BIN)/python -m studies.common_modes

trends: $(BUILT) ## trends over a year of runs: coverage, power, false discoveries of a fleet (wings/plant/docs/trends.md, 10 min)
	$(BIN)/python -m studies.archive_trends

monitoring: $(BUILT) ## a thousand healthy strokes and a thousand of each fault against the targets of docs/how-to/monitoring.md
	$(BIN)/python -m studies.monitoring

temperature: $(BUILT) ## a belt that softens with temperature: alarms and detection with and without a sensor (10 min)
	$(BIN)/python -m studies.temperature

HEALTHY_RUNS ?= 1000
healthy: $(BUILT) ## false alarms in 1,000 healthy runs with ripple, eccentricity, delay and others (2 h; HEALTHY_RUNS=20: 10 min)
	$(BIN)/python -m studies.healthy --runs $(HEALTHY_RUNS) --processes 2

fuzz: $(BUILT)   ## long campaigns against the readers, the parsers of live sources, the commands, the configuration and the dashboard
	LIVEBODE_FUZZ_ROUNDS=4000 $(BIN)/python -m pytest -n auto tests/sources/test_readers_damage_fault.py
	LIVEBODE_CONFIGURATION_FUZZ=1000000 $(BIN)/python -m pytest tests/configuration/test_axes_fault.py
	LIVEBODE_LIVE_FUZZ=1000000 $(BIN)/python -m pytest -n auto tests/sources/test_live_parsers_fault.py wings/drives/tests/test_live_variants_fault.py
	LIVEBODE_PLC_EXAMPLES=100 $(BIN)/python -m pytest -n auto wings/drives/tests/test_settings_property.py
	LIVEBODE_DASHBOARD_FUZZ=1000000 $(BIN)/python -m pytest tests/dashboard/test_requests_fault.py
	LIVEBODE_COMMANDS_FUZZ=1000 $(BIN)/python -m pytest -n auto tests/cli/test_unusual_recordings_fault.py

damage: $(BUILT) ## flip, cut and zero files of runs, baselines, lakes and edge buffers 1,000 times each, and open 1,000 hostile runs
	LIVEBODE_DAMAGE_FLIPS=1000 $(BIN)/python -m pytest -s tests/records/test_file_damage_fault.py
	LIVEBODE_DAMAGE_FLIPS=1000 $(BIN)/python -m pytest -s wings/plant/tests/lake/test_damage_fault.py
	LIVEBODE_DAMAGE_FLIPS=1000 $(BIN)/python -m pytest -s tests/monitoring/test_baseline_damage_fault.py
	LIVEBODE_HOSTILE_RUNS=1000 $(BIN)/python -m pytest -s tests/records/test_hostile_run_fault.py
	LIVEBODE_DAMAGE_BUFFER=1000 $(BIN)/python -m pytest -s wings/plant/tests/fleet/test_edge_buffer_damage_fault.py

deletions: $(BUILT) ## every command that removes or replaces files, in 1,000 hostile directories: what of others is touched (10 min)
	LIVEBODE_DELETIONS=1000 $(BIN)/python -m pytest -n 0 -q -s --show-capture=no tests/cli/test_deletions_fault.py

crash: $(BUILT)  ## kill processes that record at 1,000 random moments, as often with each of fourteen kinds of live source, and fail every call
	LIVEBODE_CRASH_CALLS=1 $(BIN)/python -m pytest tests/records/test_every_call_fault.py
	LIVEBODE_CRASH_KILLS=1000 $(BIN)/python -m pytest -s tests/records/test_kills_fault.py
	LIVEBODE_CRASH_KILLS_EACH=1000 $(BIN)/python -m pytest -n 10 -rP tests/records/test_live_kills_fault.py  # they mostly wait
	LIVEBODE_CRASH_KILLS_EACH=200 $(BIN)/python -m pytest -n 4 -rP tests/records/test_stored_backlog_fault.py

archive-faults: $(BUILT) ## an archive with bad recordings: kill workers and coordinators 100 times, compare with a loop (20 min)
	LIVEBODE_ARCHIVE_KILLS=100 $(BIN)/python -m pytest -q -s wings/plant/tests/archive/test_kills_fault.py

soak: $(BUILT)   ## a simulated day of four live axes with the page open: growth of memory, length of the stop, docs/images/soak.png
	$(BIN)/python -m studies.soak

FLEET_FAULTS ?= 1000
fleet-faults: $(BUILT) ## kill, freeze and disturb a fleet 1,000 times, and compare every response bit for bit (20 min; continues after an interruption)
	$(BIN)/python -m studies.fleet_faults $(FLEET_FAULTS)

fleet-scale: $(BUILT) ## costs of an axis of a fleet on this computer, and what 100,000 axes need (wings/plant/docs/fleet-scale.md; 5 min)
	$(BIN)/python -m bench.fleet_path
	$(BIN)/python -m bench.fleet_parts
	$(BIN)/python -m bench.fleet_load
	$(BIN)/python -m studies.fleet_scale

attacks: $(BUILT)  ## attack the dashboard, 45 s for each kind, and print what the owner and the record notice
	LIVEBODE_ATTACK_S=45 $(BIN)/python -m pytest -n 0 -q -s tests/dashboard/test_attacks_fault.py

publishing: $(BUILT) ## latency of live axes while receivers of [[publish]] answer, are down, slow, or refuse; nothing is lost (2 min)
	$(BIN)/python -m bench.publishing

screenshots: $(BUILT)  ## pictures of dashboard and report in every state (light, phone, alarm, lost server …) in build/screenshots (5 min)
	$(BIN)/python -m examples.screenshots

system-packages: ## Debian packages that some tests use (as root)
	apt-get update -qq
	apt-get install -y -qq --no-install-recommends chromium chromium-headless-shell clang fonts-wqy-microhei gcc-aarch64-linux-gnu gcc-arm-none-eabi influxdb libc6-dev-arm64-cross linuxcnc-uspace mosquitto nats-server nginx-light openssh-server openssl poppler-utils prometheus prometheus-alertmanager qemu-system-arm qemu-user rsyslog systemd

catalogues: $(BUILT)  ## after a change of a sentence of report or dashboard: update the catalogues, list what lacks a translation
	$(BIN)/python -m tools.catalogues

lock: $(VENV)/.uv ## renew the pinned dependencies from pyproject.toml
	$(BIN)/uv lock --upgrade
	$(BIN)/uv export --quiet --no-header --format requirements-txt --no-emit-project --all-extras --group dev -o requirements-dev.lock
	$(BIN)/uv export --quiet --no-header --format requirements-txt --no-emit-project --only-group bench -o requirements-bench.lock
	$(BIN)/uv export --quiet --no-header --format requirements-txt --no-emit-project --only-group docs -o requirements-docs.lock
	$(BIN)/uv export --quiet --no-header --format requirements-txt --no-emit-project --only-group wheels -o requirements-wheels.lock
	PATH="$(abspath $(BIN)):$$PATH" npm install --package-lock-only --save-dev --save-exact @biomejs/biome@latest axe-core@latest esbuild@latest typescript@latest

clean:           ## remove what was built
	rm -rf build dist node_modules $(dir $(BUNDLE)) $(VENV) $(WHEELS) .venv-abi3
