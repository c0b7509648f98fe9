# tightwire: one non-recursive Makefile. `make help` lists what it does.
#   config=release|check|debug|sanitize|thread   how to compile; the default is release, and check (the same with
#                                          asserts) for what `make test` builds
#   V=1                                    show every command
#   DATA=DIR INSTANCES=DIR CASES=DIR       real suits, Steiner instances and small bad inputs for demo, test and bench, where
#                                          they are there

test_config := $(or $(config),check)
config ?= release
DATA ?= ../shared/data
INSTANCES ?= ../shared/instances
CASES ?= ../shared/cases
prefix ?= /usr/local
V ?= 0
Q := $(if $(filter 1,$(V)),,@)

out := build/$(config)
packages := openmesh libmicrohttpd jansson sqlite3 libmodbus libzstd libsodium clp
test_packages := cmocka geos

# --- what is compiled ------------------------------------------------------------------------------------------------
rooms := solver storage api service
sources = $(if $(wildcard $(1)),$(sort $(shell find $(wildcard $(1)) -name '*.c' -o -name '*.cc')))
objects = $(patsubst %,$(out)/%.o,$(1))
unit_tests := $(patsubst tests/unit/%.c,$(out)/tests/unit/%,$(call sources,tests/unit))
benches := $(patsubst tests/bench/%.c,$(out)/tests/bench/%,$(call sources,tests/bench))
helpers := $(patsubst tests/tools/%.c,$(out)/tests/tools/%,$(wildcard tests/tools/*.c))
fuzzers := $(patsubst tests/fuzz/%.c,$(out)/tests/fuzz/%,$(wildcard tests/fuzz/*.c))
libraries := $(patsubst %,$(out)/lib%.a,$(rooms))

# --- how ---------------------------------------------------------------------------------------------------------------
CC := gcc
CXX := g++
warnings := -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror
c_warnings := -Wstrict-prototypes -Wmissing-prototypes -Wvla
# The same bytes on every machine: no contraction into fused multiply-adds, no reassociation.
floating := -ffp-contract=off -fno-fast-math
hardening := -D_FORTIFY_SOURCE=2 -fstack-protector-strong
flags.release := -O2 -g -DNDEBUG $(hardening)
flags.check := -O2 -g $(hardening)
flags.debug := -O0 -g3
flags.sanitize := -O1 -g -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer
flags.thread := -O1 -g -fsanitize=thread
ifeq ($(flags.$(config)),)
$(error config=$(config) is not one of release, check, debug, sanitize, thread)
endif
package_cflags = $(shell pkg-config --cflags $(packages) 2>/dev/null | sed 's/-I\([^ ]*\)/-isystem \1/g')
package_libs = $(shell pkg-config --libs $(packages) 2>/dev/null) -lamd -lsuitesparseconfig
test_cflags = $(shell pkg-config --cflags $(test_packages) 2>/dev/null)
test_libs = $(shell pkg-config --libs $(test_packages) 2>/dev/null)
common := -I. $(floating) $(flags.$(config)) -pthread -MMD -MP -D_GNU_SOURCE
CFLAGS_ALL = -std=gnu17 $(common) $(warnings) $(c_warnings) $(package_cflags) $(CFLAGS)
CXXFLAGS_ALL = -std=gnu++17 $(common) $(warnings) $(package_cflags) $(CXXFLAGS)
# What one file needs beyond the rest stands here, by name.
# Vectorised loops: neither flag changes a value, they only promise that nobody reads errno or the exception flags.
flags.solver/field/strain.c := -O3 -fno-math-errno -fno-trapping-math
flags.solver/field/strain_mean.c := $(flags.solver/field/strain.c)
flags.solver/field/strip.c := $(flags.solver/field/strain.c)
# Kernels once for each instruction set; which of them runs is decided at run time (solver/linear/isa.h). -O3 unrolls their
# short loops.
ifeq ($(shell uname -m),x86_64)
isa.avx2 := -mavx2
isa.avx512 := -mavx512f -mavx512vl -mavx512dq -mavx512bw
endif
$(foreach isa,base avx2 avx512,$(foreach file,linear/kernels steiner/flow/sweep,$(eval flags.solver/$(file)_$(isa).c := -O3 $(isa.$(isa)))))
-include tests/flags.mk

.DEFAULT_GOAL := all
.SECONDARY:
.DELETE_ON_ERROR:
.PHONY: all help deps deps-lint deps-test demo test test-unit test-http soak bench bench-stream bench-steiner lint format format-check fuzz pictures install clean

all: $(out)/tightwire ## build the one binary (default)

help: ## this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' Makefile | expand -t 24

# --- packages ----------------------------------------------------------------------------------------------------------
deps: ## install what the build needs (Debian), where it is missing
	$(Q)sh deploy/deps.sh build

deps-lint: ## install what `make lint` needs (Debian), where it is missing
	$(Q)sh deploy/deps.sh lint

deps-test: ## install what the tests need (Debian and npm), where it is missing
	$(Q)sh deploy/deps.sh test

# --- build -------------------------------------------------------------------------------------------------------------
define room_library
$(out)/lib$(1).a: $(call objects,$(call sources,$(1)))
	@mkdir -p $$(@D)
	$$(Q)rm -f $$@ && ar rcsD $$@ $$^
endef
$(foreach room,$(rooms),$(eval $(call room_library,$(room))))

$(out)/%.c.o: %.c
	@mkdir -p $(@D)
	@$(if $(Q),echo "  CC  $<",:)
	$(Q)$(CC) $(CFLAGS_ALL) $(flags.$<) $(if $(filter tests/%,$<),$(test_cflags)) -c $< -o $@

$(out)/%.cc.o: %.cc
	@mkdir -p $(@D)
	@$(if $(Q),echo "  CXX $<",:)
	$(Q)$(CXX) $(CXXFLAGS_ALL) $(flags.$<) -c $< -o $@

# The contract travels inside the binary, so that /openapi.yaml is always the one of this build.
$(out)/openapi.o: openapi.yaml
	@mkdir -p $(@D)
	$(Q)ld -r -b binary -z noexecstack -o $@ $<

link = $(CXX) $(flags.$(config)) -pthread -o $@ $(1) -Wl,--start-group $(2) -Wl,--end-group $(package_libs) -lm

$(out)/tightwire: $(libraries) $(out)/openapi.o
	@$(if $(Q),echo "  LD  $@",:)
	$(Q)$(call link,-Wl$(comma)--whole-archive $(out)/libservice.a -Wl$(comma)--no-whole-archive,$(out)/libapi.a $(out)/libstorage.a $(out)/libsolver.a $(out)/openapi.o)
comma := ,

# Tests and benches may use every room but service's main.
test_archives = $(filter-out $(out)/libservice.a,$(libraries)) $(out)/openapi.o
$(out)/libservice_test.a: $(filter-out $(out)/service/main.c.o,$(call objects,$(call sources,service)))
	$(Q)rm -f $@ && ar rcsD $@ $^
define test_program
$(out)/tests/$(1)/%: $(out)/tests/$(1)/%.c.o $$(libraries) $(out)/libservice_test.a $(out)/openapi.o
	@$$(if $$(Q),echo "  LD  $$@",:)
	$$(Q)$$(call link,$$<,$(out)/libservice_test.a $$(test_archives)) $$(test_libs)
endef
$(foreach kind,unit bench tools,$(eval $(call test_program,$(kind))))

# --- run ---------------------------------------------------------------------------------------------------------------
# A make within make, on all cores where the caller did not say how many; the tests' one builds with its own config. Recipes
# begin with + for it, because make does not see $(MAKE) within a variable, and would keep its jobserver to itself.
make_all = $(MAKE) --no-print-directory $(if $(findstring jobserver,$(MAKEFLAGS)),,-j$(shell nproc))
run_tests = DATA="$(DATA)" INSTANCES="$(INSTANCES)" CASES="$(CASES)" TIGHTWIRE="$(CURDIR)/build/$(test_config)/tightwire" \
	BUILD="build/$(test_config)" sh tests/run.sh

demo: deps ## install, build, start the service, lay out a suit, show the result
	+$(Q)$(make_all) all
	$(Q)DATA="$(DATA)" sh deploy/demo.sh $(out)/tightwire

test: deps-test ## install, build and run every test; the last line counts them
	+$(Q)$(make_all) config=$(test_config) all unit-programs
	$(Q)$(run_tests)

.PHONY: unit-programs bench-programs helper-programs
unit-programs: $(unit_tests) $(helpers)
bench-programs: $(benches)
helper-programs: $(helpers)

test-unit: ## only the C tests
	+$(Q)$(make_all) config=$(test_config) all unit-programs
	$(Q)$(run_tests) unit

test-http: ## only the HTTP, contract and process tests
	+$(Q)$(make_all) config=$(test_config) all helper-programs
	$(Q)$(run_tests) http

# Ten thousand searches from warm states, compared with those from scratch, take a quarter of an hour.
soak: deps-test ## kills, a full disk, tricklers, aborts, load and days with and without them, each for seconds=60, or attacks="kills disk" of them; then moves=10000 of terminals
	+$(Q)$(make_all) all $(out)/tests/unit/steiner/warm
	$(Q)TIGHTWIRE="$(CURDIR)/$(out)/tightwire" BUILD="$(out)" node tests/soak/soak.mjs $(if $(filter file,$(origin seconds)),60,$(seconds)) $(attacks)
	$(Q)$(if $(attacks),,MOVES=$(or $(moves),10000) $(out)/tests/unit/steiner/warm)

bench: deps-test ## speed and memory on the sample suit, each figure beside its goal
	$(Q)$(MAKE) --no-print-directory all bench-programs
	$(Q)DATA="$(DATA)" TIGHTWIRE="$(CURDIR)/$(out)/tightwire" BUILD="$(out)" sh tests/bench/run.sh

bench-stream: deps-test ## a motion set of 11 GB through the service: time, memory of every process (sequences=248)
	$(Q)$(MAKE) --no-print-directory all
	$(Q)$(if $(sequences),SEQUENCES=$(sequences)) TIGHTWIRE="$(CURDIR)/$(out)/tightwire" node tests/bench/stream.mjs

bench-steiner: all $(out)/tests/tools/suit_instance $(out)/tests/tools/moved_terminal ## suits, and every Steiner instance of INSTANCES: seconds, work, gap, memory
	$(Q)INSTANCES="$(INSTANCES)" TIGHTWIRE="$(CURDIR)/$(out)/tightwire" BUILD="$(out)" sh tests/bench/steiner.sh

# --- fuzz --------------------------------------------------------------------------------------------------------------
fuzz_flags := -O2 -g -fsanitize=address,undefined,fuzzer-no-link -fno-sanitize-recover=undefined
fuzz_sources := $(call sources,solver storage api service/daemon/http)
fuzz_objects := $(patsubst %,build/fuzz/%.o,$(fuzz_sources))
seconds ?= 20
build/fuzz/%.c.o: %.c
	@mkdir -p $(@D)
	$(Q)clang -std=gnu17 -I. $(floating) $(fuzz_flags) -pthread -MMD -MP -D_GNU_SOURCE $(package_cflags) -c $< -o $@
build/fuzz/%.cc.o: %.cc
	@mkdir -p $(@D)
	$(Q)clang++ -std=gnu++17 -I. $(floating) $(fuzz_flags) -pthread -MMD -MP -D_GNU_SOURCE $(package_cflags) -c $< -o $@
build/fuzz/liball.a: $(fuzz_objects) $(out)/openapi.o
	$(Q)rm -f $@ && ar rcsD $@ $^
build/fuzz/tests/%: build/fuzz/tests/fuzz/%.c.o build/fuzz/liball.a
	@mkdir -p $(@D)
	$(Q)clang++ $(fuzz_flags) -fsanitize=fuzzer -o $@ $^ $(package_libs) -lm
.PHONY: fuzz-programs
fuzz-programs: $(patsubst tests/fuzz/%.c,build/fuzz/tests/%,$(wildcard tests/fuzz/*.c))
fuzz: deps-test ## run fuzz targets=all from their corpus, for seconds=20 each, or runs=N executions
	$(Q)$(MAKE) --no-print-directory fuzz-programs
	$(Q)sh tests/fuzz/run.sh $(if $(runs),$(runs)x,$(seconds)) $(targets)

# --- care --------------------------------------------------------------------------------------------------------------
tidy_stamps := $(patsubst %,build/lint/%.tidy,$(filter %.c,$(call sources,$(rooms))))
build/lint/%.tidy: %
	@mkdir -p $(@D)
	@$(if $(Q),echo "  TIDY $<",:)
	$(Q)clang-tidy --quiet $< -- -std=gnu17 -I. -D_GNU_SOURCE $(package_cflags) 2>&1 | grep -v 'warnings generated' ; test $${PIPESTATUS[0]} -eq 0
	@touch $@
build/lint/%.tidy: SHELL := /bin/bash

lint: deps-lint format-check ## layering, formatting, clang-tidy, cppcheck
	$(Q)sh tests/layering.sh
	+$(Q)$(make_all) -k $(tidy_stamps)
	$(Q)cppcheck --quiet --std=c11 --language=c --enable=warning,performance,portability --inline-suppr --error-exitcode=1 \
		--suppress=missingIncludeSystem -I. -D_GNU_SOURCE -DTW_NODISCARD= $(filter %.c,$(call sources,$(rooms)))
	@echo "lint: clean"

formatted = tightwire.h $(sort $(shell find $(rooms) tests -name node_modules -prune -o -name '*.[ch]' -print -o -name '*.cc' -print))
format: ## clang-format in place
	$(Q)clang-format -i $(formatted)

format-check:
	$(Q)clang-format --dry-run -Werror $(formatted)

pictures: all $(out)/tests/tools/solve_pictures ## the pictures of README and solver/steiner/README.md anew
	$(Q)sh deploy/pictures.sh $(out)/tightwire
	$(Q)mkdir -p solver/steiner/pictures && $(out)/tests/tools/solve_pictures solver/steiner/pictures

install: all ## into $(DESTDIR)$(prefix), with the systemd unit and a sample configuration
	$(Q)install -D -m 0755 $(out)/tightwire $(DESTDIR)$(prefix)/bin/tightwire
	$(Q)install -D -m 0644 deploy/tightwire.service $(DESTDIR)$(prefix)/lib/systemd/system/tightwire.service
	$(Q)install -D -m 0644 deploy/tightwire.conf $(DESTDIR)$(prefix)/share/doc/tightwire/tightwire.conf
	$(Q)install -D -m 0644 openapi.yaml $(DESTDIR)$(prefix)/share/doc/tightwire/openapi.yaml

clean: ## remove what was built
	$(Q)rm -rf build

-include $(shell find build -name '*.d' 2>/dev/null)
