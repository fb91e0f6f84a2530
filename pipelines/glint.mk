# Make rules from images to assets. In a Makefile of yours:
#
#   GLINT_MAPS := textures
#   GLINT_OUT := assets
#   GLINT_INGEST_FLAGS_dunes := --kind height --height-scale 12
#   include path/to/glint/pipelines/glint.mk
#
#   all: $(GLINT_OUT)/flakes.cp.glint $(GLINT_OUT)/dunes.pca.glint
#
#   image (png, exr, tif, jpg, ...)  ->  NAME.glint  ->  NAME.pyramid.glint  ->  NAME.cp.glint | NAME.tucker.glint | NAME.pca.glint
#                                                    ->  NAME.binmap.glint | NAME.sat.glint
#   image of heights                     ->  NAME.heights.glint  ->  NAME.displaced.glint
#
# Assets are made again when an image, an asset they come from, or a file in GLINT_SETTINGS changes. Every tool writes
# its inputs to a depfile beside the asset. Works with `make -j`; GLINT_THREADS limits what one tool takes.

GLINT_MAPS ?= .
GLINT_OUT ?= .
GLINT_BIN ?=
GLINT_THREADS ?=
GLINT_IMAGES ?= exr png tif tiff tga jpg jpeg hdr
# Files that hold flags. Empty: assets stay when flags change.
GLINT_SETTINGS ?= $(firstword $(MAKEFILE_LIST))

# Of one map: the same name with _NAME behind it, for example GLINT_PYRAMID_FLAGS_flakes.
GLINT_INGEST_FLAGS ?=
GLINT_PYRAMID_FLAGS ?=
GLINT_CP_FLAGS ?= --rank 16
GLINT_TUCKER_FLAGS ?= --rank 25
GLINT_PCA_FLAGS ?= --rank 16
GLINT_BINMAP_FLAGS ?= --alpha 0.02
GLINT_SAT_FLAGS ?=
GLINT_HEIGHTS_FLAGS ?=
GLINT_DISPLACE_FLAGS ?= --factor 16

glint_tool = $(if $(GLINT_BIN),$(GLINT_BIN)/)$(1) $(if $(GLINT_THREADS),--threads $(GLINT_THREADS)) --quiet
glint_flags = $($(1)) $($(1)_$*)

define glint_ingest_rule
$(GLINT_OUT)/%.glint: $(GLINT_MAPS)/%.$(1) $(GLINT_SETTINGS) | $(GLINT_OUT)
	$$(call glint_tool,glint-ingest) $$< -o $$@ --depfile $$@.d $$(call glint_flags,GLINT_INGEST_FLAGS)
endef

define glint_heights_rule
$(GLINT_OUT)/%.heights.glint: $(GLINT_MAPS)/%.$(1) $(GLINT_SETTINGS) | $(GLINT_OUT)
	$$(call glint_tool,glint-ingest) $$< -o $$@ --depfile $$@.d --kind height --to heights $$(call glint_flags,GLINT_HEIGHTS_FLAGS)
endef

define glint_normals_rule
$(GLINT_OUT)/%.$(1).glint: $(GLINT_OUT)/%.glint $(GLINT_SETTINGS)
	$$(call glint_tool,glint-$(1)) $$< -o $$@ --depfile $$@.d $$(call glint_flags,$(2))
endef

define glint_compress_rule
$(GLINT_OUT)/%.$(1).glint: $(GLINT_OUT)/%.pyramid.glint $(GLINT_SETTINGS)
	$$(call glint_tool,glint-compress) $$< -o $$@ --depfile $$@.d --method $(1) $$(call glint_flags,$(2))
endef

$(eval $(call glint_normals_rule,pyramid,GLINT_PYRAMID_FLAGS))
$(eval $(call glint_normals_rule,binmap,GLINT_BINMAP_FLAGS))
$(eval $(call glint_normals_rule,sat,GLINT_SAT_FLAGS))
$(eval $(call glint_compress_rule,cp,GLINT_CP_FLAGS))
$(eval $(call glint_compress_rule,tucker,GLINT_TUCKER_FLAGS))
$(eval $(call glint_compress_rule,pca,GLINT_PCA_FLAGS))
$(foreach image,$(GLINT_IMAGES),$(eval $(call glint_ingest_rule,$(image)))$(eval $(call glint_heights_rule,$(image))))

$(GLINT_OUT)/%.displaced.glint: $(GLINT_OUT)/%.heights.glint $(GLINT_SETTINGS)
	$(call glint_tool,glint-displace) $< -o $@ --depfile $@.d $(call glint_flags,GLINT_DISPLACE_FLAGS)

$(GLINT_OUT):
	mkdir -p $@

# Make would delete the steps between an image and what was asked for.
.PRECIOUS: $(GLINT_OUT)/%.glint $(GLINT_OUT)/%.heights.glint $(GLINT_OUT)/%.pyramid.glint
# The tools replace their output in one step, or not at all; this covers what is not theirs.
.DELETE_ON_ERROR:

-include $(wildcard $(GLINT_OUT)/*.glint.d)
