# ringlet: `make render` gives frames of moving hair, `make test` checks everything. `make help` lists the rest.

ifeq ($(filter grouped-target,$(.FEATURES)),)
$(error GNU make 4.3 or newer is needed; this is $(MAKE_VERSION))
endif
MAKEFLAGS += --no-builtin-rules --no-builtin-variables
.SUFFIXES:
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

CONFIG ?= configs/default.toml
PYTHON ?= python3
VENV    = .venv
BIN     = $(VENV)/bin
RINGLET = $(BIN)/ringlet

# --- Environment: libraries by locked versions, then the kernels ---------------------------------

ENV     = $(VENV)/.complete
KERNELS = build/kernels/.built
KERNEL_SOURCES = $(wildcard pipeline/kernels/*.cpp pipeline/kernels/*.hpp) pipeline/kernels/CMakeLists.txt

.PHONY: env
env: $(ENV) $(KERNELS) ## prepare everything that the other targets need

$(ENV): requirements.lock pyproject.toml .ci/environment
	@PYTHON=$(PYTHON) .ci/environment $(VENV)
	@touch $@

$(KERNELS): $(KERNEL_SOURCES) $(ENV)
	@echo "building the kernels"
	@$(BIN)/cmake -S pipeline/kernels -B build/kernels -G Ninja -DCMAKE_BUILD_TYPE=Release \
	  -DPython_EXECUTABLE=$(abspath $(BIN)/python) -DCMAKE_MAKE_PROGRAM=$(abspath $(BIN)/ninja) >build.log 2>&1 \
	  || { cat build.log; rm -f build.log; exit 1; }
	@rm -f build.log
	@$(BIN)/cmake --build build/kernels
	@$(BIN)/cmake --install build/kernels --prefix build/kernels/installed >/dev/null
	@mv -f build/kernels/installed/pipeline/kernels/*.so pipeline/kernels/
	@touch $@

# --- Experiments: every configs/x.toml is a target, `make x` or `make outputs/x` ------------------

# Words "name|file"; a config's name is its file's stem unless it sets one.
CONFIGS := $(sort $(wildcard configs/*.toml configs/*/*.toml) $(CONFIG))
NAMED   := $(shell grep -sHm1 -E "^name *= *[\"']" $(CONFIGS) \
             | sed -E "s/^([^:]+):name *= *[\"']([^\"']+).*/\2|\1/")
UNNAMED := $(filter-out $(foreach n,$(NAMED),$(lastword $(subst |, ,$n))),$(CONFIGS))
ALL     := $(NAMED) $(foreach f,$(UNNAMED),$(basename $(notdir $f))|$f)
NAMES   := $(foreach n,$(ALL),$(firstword $(subst |, ,$n)))
NAME    := $(firstword $(subst |, ,$(filter %|$(CONFIG),$(ALL))))

# The experiments that this call of make is about; only their rules are read.
GOALS   := $(foreach g,$(MAKECMDGOALS),$(firstword $(subst /, ,$(g:outputs/%=%))))
WANTED  := $(sort $(filter $(NAMES),$(GOALS)) $(if $(filter render movie sheet sweep,$(GOALS)),$(NAME)))

ifneq ($(WANTED),)
# Which frames there are and which key each stage has, `ringlet keys` writes down: see pipeline/cli/stamps.py.
SOURCES := $(wildcard pipeline/*.py pipeline/*/*.py pipeline/*/*/*.py pipeline/*/*/*.json) $(KERNEL_SOURCES)

define rules
outputs/$1/targets.mk: $(lastword $(subst |, ,$(filter $1|%,$(ALL)))) $(SOURCES) $(KERNELS) | $(ENV)
	@$$(RINGLET) keys $$<
endef
$(foreach n,$(WANTED),$(eval $(call rules,$n)))

# What times alone do not tell: another file in the place of one (keys/sources holds times and sizes), and files from the
# future, made before the clock went back. Either asks for new keys.
ifeq ($(MAKE_RESTARTS),)
UNSETTLED := $(shell for folder in $(WANTED:%=outputs/%); do [ -f $$folder/keys/sources ] || continue; \
  cut -d' ' -f3- $$folder/keys/sources | tr '\n' '\0' | xargs -0 stat -c '%.9Y %s %n' 2>/dev/null \
    | cmp -s - $$folder/keys/sources && [ -z "$$(find $$folder/targets.mk $$folder/keys $$folder/*.h5 $$folder/frames \
    -type f -newermt '2 seconds' -print -quit 2>/dev/null)" ] || echo $$folder/targets.mk; done)
$(UNSETTLED): unsettled
.PHONY: unsettled
endif

include $(WANTED:%=outputs/%/targets.mk)

.PHONY: $(WANTED) $(WANTED:%=outputs/%)
$(filter-out render movie sheet sweep,$(WANTED)): %: outputs/%
endif

.PHONY: render movie sheet turntable sweep
render: $(if $(NAME),outputs/$(NAME)) ## frames of CONFIG, by WORKERS processes if set: make render CONFIG=configs/curly.toml

movie: render ## the frames of CONFIG as one movie
	@$(RINGLET) movie $(CONFIG)

sheet: render ## the frames of CONFIG on one page
	@$(RINGLET) sheet $(CONFIG)

turntable: $(ENV) $(KERNELS) ## once around the hair of CONFIG at rest, as a movie: outputs/<name>-turntable
	@$(RINGLET) turntable $(CONFIG)

sweep: $(if $(NAME),outputs/$(NAME)/sweep) ## all experiments of CONFIG's [sweep], by WORKERS processes if set

# --- Checks --------------------------------------------------------------------------------------

.PHONY: test lint validate interpolation performance gallery pathtracer docs site images approve bench sanitize schema fuzz coverage wheel
test: env ## all tests
	$(BIN)/pytest -n 2 --dist loadfile

lint: env ## style, types, and who may import whom
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

validate: env ## the physics against closed forms and rod equations; writes docs/validation.md
	$(RINGLET) validate --page docs/validation.md

interpolation: env ## strands that follow guides against their own simulation; writes docs/interpolation.md
	$(RINGLET) bench interpolation-error --page docs/interpolation.md

performance: env ## all benchmarks, on an idle machine: eight minutes; writes docs/performance.md
	$(RINGLET) bench page docs/performance.md

gallery: env ## every style, colour and operator, rendered; writes docs/gallery.md, docs/colours.md and docs/operators.md
	$(BIN)/python docs/gallery.py
	$(BIN)/python docs/front.py
	$(BIN)/python docs/colours.py
	$(BIN)/python docs/operators.py

pathtracer: env ## the same hair by a path tracer and by ringlet, minutes; needs Mitsuba; writes docs/pathtracer.md
	$(BIN)/python docs/pathtracer.py

docs: gallery site ## the site, with every style and operator rendered anew

site: env ## the site from the pages as they are: build/site/index.html; its examples run
	$(BIN)/python -m sphinx -q -W --keep-going -b html docs build/site
	@echo build/site/index.html

images: env ## golden images; differences go to an HTML page
	$(BIN)/pytest tests/images

approve: env ## take the new images as the golden ones: make approve WHY="the reason"
	$(RINGLET) approve "$(WHY)"

bench: env ## the figures of the README
	$(RINGLET) bench simulate
	$(RINGLET) bench interpolate
	$(RINGLET) bench render

schema: env ## configs/schema.json, after a change of pipeline/config/schema/
	$(RINGLET) config --schema >configs/schema.json

fuzz: env ## 100,000 damaged files for every reader and 2,000 calls of every kernel: hours; make fuzz FILES=1000
	$(BIN)/python -m tests.hostile.boundary
	$(BIN)/python -m tests.hostile.fuzz --files $(or $(FILES),100000) --totals outputs/fuzz.json --keep outputs/fuzz

coverage: env ## the tests once more, and which lines of Python they never ran; fails below 90 %
	rm -f .coverage .coverage.*
	$(BIN)/coverage run -m pytest -n 2 --dist loadfile; tests=$$?; \
	  $(BIN)/coverage combine -q && $(BIN)/coverage report && exit $$tests

wheel: env ## a wheel for this Python, installed and tried in an environment of its own
	.ci/wheel dist

sanitize: env ## kernels under the address and undefined-behaviour sanitizers
	tests/kernels/sanitize.sh

# --- The rest ------------------------------------------------------------------------------------

.PHONY: clean distclean help
clean: ## remove all outputs
	find outputs -mindepth 1 -maxdepth 1 ! -name README.md -exec rm -rf {} +

distclean: clean ## remove the environment and what was built, too
	rm -rf $(VENV) build pipeline/kernels/*.so

help: ## this list
	@sed -nE 's/^([a-z]+):.*## (.*)/  make \1|\2/p' Makefile | column -t -s '|'
	@echo; echo "Experiments, each a target:"; printf '  make %s\n' $(sort $(NAMES))
