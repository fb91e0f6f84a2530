# The front door: `make demo` and `make test` need nothing but a Debian 12 machine, as root or with sudo.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
MAKEFLAGS += --no-print-directory

JOBS ?= $(shell nproc)
PYTHON := /usr/bin/python3
packages := $(shell sed 's/#.*//' packages.txt)

.PHONY: help
help:  ## list the targets
	@sed -nE 's/^([a-z-]+):.*## (.*)/  make \1\t\2/p' $(firstword $(MAKEFILE_LIST)) | expand -t 20

.PHONY: demo
demo: build python  ## run every tool on the sample maps, draw demo/*.png (DEMO_MAP=image.png adds yours), render three pictures
	@$(PYTHON) pipelines/demo/demo.py --bin build/bin --out demo $(if $(DEMO_MAP),--map '$(DEMO_MAP)')
	@$(venv)/bin/python pipelines/scenes/gallery.py --bin build/bin --out demo/gallery --quick

# The wheel links the libraries of the build; HDF5 statically. Its environment is made anew when the requirements change.
venv := build/venv
.PHONY: python
python: build $(venv)/requirements.txt  ## the Python package: a wheel in build/wheels, installed with Mitsuba 3 in build/venv
	@rm -rf build/python/wheels build/wheels
	$(venv)/bin/pip wheel . --quiet --no-deps --no-build-isolation --wheel-dir build/python/wheels --config-settings=build-dir=build/python \
	  --config-settings=cmake.define.GLINT_BUILD_TREE=$(CURDIR)/build --config-settings=cmake.define.GLINT_STATIC_HDF5=ON
	@PATH="$(CURDIR)/$(venv)/bin:$$PATH" auditwheel repair --wheel-dir build/wheels build/python/wheels/*.whl 2>build/python/auditwheel.log \
	  || { cat build/python/auditwheel.log >&2; exit 1; }
	@$(PYTHON) python/sbom.py build/wheels/*.whl --build build --build build/python -o build/wheels/glint_ndf.cdx.json
	@$(venv)/bin/pip install --quiet --force-reinstall --no-deps build/wheels/*.whl
	@echo "$$(ls build/wheels/*.whl), with a list of its libraries beside it; installed in $(venv)"

requirements := python/requirements.txt tests/python/integrations/requirements.txt
$(venv)/requirements.txt: $(requirements) packages.txt | packages
	@rm -rf $(venv)
	/usr/bin/python3 -m venv $(venv)
	$(venv)/bin/pip install --quiet --disable-pip-version-check --requirement $<
	@cp $< $@

.PHONY: test
test: build python  ## build and run the tests, except slow ones
	ctest --preset release --parallel $(JOBS) --label-exclude '^slow$$' --no-label-summary

.PHONY: test-all
test-all: benchmarks python  ## the same with the slow ones: fuzzing, large maps
	ctest --preset release --parallel $(JOBS) --no-label-summary

# A file that breaks something lands in build-fuzz/. Put it, made small by -minimize_crash=1, into tests/fuzz/corpus.
SECONDS := 60
.PHONY: fuzz
fuzz: | packages  ## fuzz the reader, the validator and all queries for SECONDS=60, guided by coverage
	cmake --preset fuzz
	cmake --build --preset fuzz --parallel $(JOBS) --target glint-fuzz
	@mkdir -p build-fuzz/corpus
	cd build-fuzz && bin/glint-fuzz -max_total_time=$(SECONDS) -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 corpus ../tests/fuzz/corpus ../tests/golden/v1.0

.PHONY: bench
bench: benchmarks  ## time whole commands and queries on 2K^2 maps; writes build/bench/results.json
	@$(PYTHON) tests/bench/bench.py --bin build/bin --out build/bench

.PHONY: bench-report
bench-report: bench  ## the same, and write docs/BENCHMARKS.md, its charts and docs/benchmarks.csv
	@$(PYTHON) tests/bench/report.py build/bench/results.json --docs docs

.PHONY: limits
limits: benchmarks  ## draw with every method, compare with brute force; writes docs/LIMITS.md and its pictures
	@$(PYTHON) tests/render/compare.py --bin build/bin --out build/limits --docs docs

.PHONY: gallery
gallery: build python  ## pictures rendered by Mitsuba 3, in gallery/ (GALLERY_FLAGS='--only kettle', '--quick', or '--docs docs' for docs/GALLERY.md)
	@$(venv)/bin/python pipelines/scenes/gallery.py --bin build/bin --out gallery $(GALLERY_FLAGS)

.PHONY: planned
planned: build python  ## plan, build, check and render three scenes, in planned/ (PLANNED_FLAGS='--only ring', '--no-pictures', or '--docs docs' for docs/PLANS.md)
	@$(venv)/bin/python pipelines/scenes/planned.py --bin build/bin --out planned $(PLANNED_FLAGS)

.PHONY: stability
stability: build  ## test every method where it fails; writes docs/stability.json, its chart and its section of docs/LIMITS.md
	@mkdir -p build/stability
	@build/bin/glint-bench --stability -o build/stability/results.json --force
	@$(PYTHON) tests/stability/write_docs.py build/stability/results.json --docs docs

papers := gamboa2018 wu2019 atanasov2021 deng2022 xing2024
.PHONY: papers
papers: build  ## repeat the tables and plots of the five papers; writes docs/PAPERS.md
	@mkdir -p build/papers
	@for paper in $(papers); do build/bin/glint-bench --preset $$paper -o build/papers/$$paper.json --force --quiet; done
	@$(PYTHON) tests/bench/papers_page.py $(papers:%=build/papers/%.json) --docs docs

# Asks for Doxygen and graphviz here only: nothing else needs them.
.PHONY: docs
docs:  ## the API reference, in build/docs/html; lists public names without a contract
	@for tool in doxygen:doxygen dot:graphviz; do \
	  command -v $${tool%:*} >/dev/null || { echo "make docs needs $${tool%:*}: install the package $${tool#*:}" >&2; exit 1; }; done
	@mkdir -p build/docs
	@private=$$(grep -rl --include='*.h' '^// Private to ' libglint formats | xargs); \
	  (cat docs/Doxyfile; echo "EXCLUDE += $$private") | doxygen - 2>&1 | sed 's,^$(CURDIR)/,,' | tee build/docs/warnings.txt
	@echo "build/docs/html/index.html; $$(wc -l <build/docs/warnings.txt) warnings, also in build/docs/warnings.txt"

# Asks for help2man here only, as make docs does for its tools.
.PHONY: man
man:  ## manual pages of the tools from their --help, in build/man
	@command -v help2man >/dev/null || { echo 'make man needs help2man: install the package help2man' >&2; exit 1; }
	@$(MAKE) build
	@mkdir -p build/man
	@for tool in $$(cd apps && echo glint-*) 'glint-query light' 'glint-query reflectance' 'glint-query plane' 'glint-farm plan' \
	  'glint-farm run' 'glint-farm status'; do \
	  summary=$$(build/bin/$$tool --help | sed -n '1s/\. .*\|\.$$//p'); \
	  help2man --no-info --manual glint --name "$$summary" --output "build/man/$${tool// /-}.1" "build/bin/$$tool"; done
	@echo "build/man; for example: man -l build/man/glint-query.1"

.PHONY: build
build: build/build.ninja  ## the optimised build, in build/
	cmake --build --preset release --parallel $(JOBS)

# They take minutes to compile, and make test needs none.
.PHONY: benchmarks
benchmarks: build  ## build the programs of make bench and make limits
	cmake --build --preset release --parallel $(JOBS) --target glint_benchmarks

.PHONY: debug
debug: build-debug/build.ninja  ## a debug build, in build-debug/
	cmake --build --preset debug --parallel $(JOBS)

build/build.ninja: CMakePresets.json packages.txt | packages
	cmake --preset release
	@touch $@

build-debug/build.ninja: CMakePresets.json packages.txt | packages
	cmake --preset debug
	@touch $@

# apt-get is not called at all when dpkg has everything.
.PHONY: packages
packages:  ## install what is missing of packages.txt
	@command -v dpkg-query >/dev/null || { echo 'This is not Debian: install the likes of packages.txt yourself.' >&2; exit 0; }; \
	have=$$(dpkg-query --show --showformat='$${db:Status-Status} $${Package}\n' $(packages) 2>/dev/null | sed -n 's/^installed //p' || true); \
	missing=$$(comm -23 <(printf '%s\n' $(packages) | sort -u) <(sort -u <<<"$$have") | xargs); \
	[[ -z $$missing ]] && exit 0; \
	echo "Installing $$missing"; \
	as_root=$$([[ $$(id -u) == 0 ]] || echo sudo); \
	$$as_root apt-get -q -o Acquire::Retries=3 update; \
	$$as_root env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o Acquire::Retries=3 install --no-install-recommends $$missing

.PHONY: clean
clean:  ## remove everything that was built
	rm -rf build build-* demo gallery planned
