# A manifest of glint-farm in shards, by Make:
#
#   make -f path/to/glint/pipelines/farm/shards.mk MANIFEST=farm.json SHARDS=16 -j4
#
# For a program that runs makefiles on many machines (distributed or remote shells: set SHELL). On one machine
# `glint-farm run farm.json --jobs 4` does the same.
SHARDS ?= 4
GLINT_BIN ?=
GLINT_THREADS ?= 1

ifndef MANIFEST
$(error say which manifest: make MANIFEST=farm.json)
endif

shards := $(addprefix shard-,$(shell seq $(SHARDS)))
.PHONY: all $(shards)
all: $(shards)
$(shards): shard-%:
	$(if $(GLINT_BIN),'$(GLINT_BIN)/'glint-farm,glint-farm) run '$(MANIFEST)' --shard $*/$(SHARDS) --threads $(GLINT_THREADS)
