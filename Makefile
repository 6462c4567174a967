# The verbs a person types. Two of them do everything on a fresh machine: `make fly` and `make test`.

PYTHON ?= python3
VENV := .venv/bin
SETUP := @$(PYTHON) tools/setup/setup.py
# The virtual environment without the compiled core, for what does not need it.
ENVIRONMENT := $(SETUP) environment

.PHONY: help setup fly test pio gains vectors bench footprint determinism fuzz m7 consistency accuracy handling campaign figures firmware format lint pins clean

help: ## List these verbs
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "make %-11s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: ## Make or update .venv and the compiled core
	$(SETUP)

fly: ## Fly 60 s in simulation and leave log, report and summary in out/ (ARGS="--heading 90")
	$(SETUP)
	@$(VENV)/strix fly --out out $(ARGS)

test: ## Run every test: the Unity suites, then the Python tests
	$(ENVIRONMENT)
	@$(VENV)/python tools/setup/run_tests.py

pio: ## Run PlatformIO, with its registry or without (ARGS="test -e native -f test_math")
	$(ENVIRONMENT)
	@$(VENV)/python tools/setup/pio.py $(ARGS)

gains: ## Compute the controller's gains into include/
	$(SETUP)
	@$(VENV)/strix gains $(ARGS)

vectors: ## Write sim_vectors/ anew with GNU Octave or MATLAB
	@$(PYTHON) tools/setup/vectors.py

bench: ## Count instructions per call on an emulated Cortex-M7, beside the budgets
	$(SETUP)
	@$(VENV)/python tools/m7/bench.py

footprint: ## Measure code, RAM and stack on a Cortex-M7, and what flight code calls
	$(SETUP)
	@$(VENV)/python tools/m7/footprint.py

determinism: ## Replay flights with every compiler here and on the emulated Cortex-M7, bit for bit
	$(SETUP)
	@$(VENV)/python tools/m7/determinism.py $(ARGS)

fuzz: ## Fuzz the parser of GPS sentences for five minutes (needs clang)
	$(ENVIRONMENT)
	@mkdir -p build/fuzz/nmea
	clang++ -std=gnu++17 -O1 -g -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all \
	  -ffp-contract=off -DEIGEN_DONT_VECTORIZE -I test/fakes -I lib/Sensors -I lib/Math \
	  -isystem $$($(VENV)/python -c "import sysconfig; print(sysconfig.get_path('purelib'))")/cmeel.prefix/include/eigen3 \
	  test/fuzz/fuzz_nmea.cpp -o build/fuzz/fuzz_nmea
	build/fuzz/fuzz_nmea -max_total_time=300 -max_len=1024 -dict=test/fuzz/nmea.dict \
	  -artifact_prefix=build/fuzz/ build/fuzz/nmea test/fuzz/seeds

m7: ## Build and run the Unity suites, whole flights and the benchmark on an emulated Cortex-M7
	$(SETUP)
	@$(VENV)/python tools/m7/suites.py
	@$(VENV)/python tools/m7/determinism.py --builds m7-O2
	@$(VENV)/python tools/m7/bench.py

consistency: ## Check in many simulated flights that the filter is as sure of itself as it may be
	$(SETUP)
	@$(VENV)/strix consistency --out out $(ARGS)

accuracy: ## Score the filter on the recordings in ../shared/data, beside VQF
	$(SETUP)
	@$(VENV)/strix accuracy --out out $(ARGS)

handling: ## Measure how both aircraft handle, and 200 flights of aircraft 20 % off (ARGS="--flights 50")
	$(SETUP)
	@$(VENV)/strix handling --out out $(ARGS)

campaign: ## Fly 500 times with one fault each, judged by the truth (ARGS="--n 30 --faults gps-jump")
	$(SETUP)
	@$(VENV)/strix campaign --out out/campaign $(ARGS)

figures: ## Draw what each option of the navigation buys, into docs/figures
	$(SETUP)
	@$(VENV)/strix options --out docs/figures
	@$(VENV)/strix gains --check --figures docs/figures
	@$(VENV)/strix gains --controller ugglan --check --figures docs/figures

firmware: ## Build the firmware for the Teensy 4.1 (needs PlatformIO's registry)
	$(ENVIRONMENT)
	@$(VENV)/python tools/setup/pio.py run -e teensy41

format: ## Lay out C++ and Python as .clang-format and ruff say
	$(ENVIRONMENT)
	@git ls-files --cached --others --exclude-standard '*.h' '*.c' '*.cpp' | xargs $(VENV)/clang-format -i
	@$(VENV)/ruff format tools
	@$(VENV)/ruff check --fix tools

lint: ## Check layout, Python types and, if clang-tidy is installed, the C++
	$(SETUP)
	@git ls-files --cached --others --exclude-standard '*.h' '*.c' '*.cpp' | xargs $(VENV)/clang-format --dry-run -Werror
	@$(VENV)/ruff format --check tools
	@$(VENV)/ruff check tools
	@cd tools && ../$(VENV)/mypy
	@if command -v clang-tidy > /dev/null; then clang-tidy -p build/core --quiet tools/strix/core/*.cpp; \
	else echo "clang-tidy is not installed: C++ not checked"; fi

pins: ## Write tools/requirements.txt anew from tools/pyproject.toml
	@$(PYTHON) tools/setup/pin.py

clean: ## Remove everything that these verbs made, except out/
	rm -rf .venv .pio build tools/strix/_core.*
