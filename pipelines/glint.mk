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
#                                                    ->  NAME.binmap.glint | NAME.sat.glint | NAME.moments.glint | NAME.tiny.glint | NAME.wang.glint
#   image of heights                     ->  NAME.heights.glint  ->  NAME.displaced.glint | NAME.wave.glint  ->  NAME.wavecp.glint
#   environment (exr, hdr) or lights (json)  ->  NAME.light.glint
#   no file, but GLINT_LOBES_FLAGS_NAME := --sigma-r 0.01  ->  NAME.lobes.glint
#
# Pyramids of large maps can be made in parts: with GLINT_SHARDS := 8, eight runs make NAME.pyramid.1of8.glint and so on, which `make -j`
# runs at once, and glint-merge joins them. The pyramid is the same file. Make deletes the parts in the end.
#
# Assets are made again when an image, an asset they come from, or a file in GLINT_SETTINGS changes. Every tool writes
# its inputs to a depfile beside the asset. Works with `make -j`; GLINT_THREADS limits what one tool takes.
#
# An image may be replaced by one of another type. Two images of one name are an error, because they would be one asset. Names may hold
# blanks and signs; in a Makefile write them as Make wants them: assets/a\ b.glint, $$ for $, \# and \: for # and :. Of all images
# together, $(call glint_all,pyramid) names the assets of a kind, written so. Names with ; | or = cannot be targets of Make, nor can
# GLINT_MAPS and GLINT_OUT hold blanks or signs but . _ / + @ ~ and -.

GLINT_MAPS ?= .
GLINT_OUT ?= .
GLINT_BIN ?=
GLINT_THREADS ?=
# Types of files. Of two images of one name, a shorter list says which is meant.
GLINT_IMAGES ?= exr png tif tiff tga jpg jpeg hdr EXR PNG TIF TIFF TGA JPG JPEG HDR
GLINT_LIGHTS ?= exr hdr json EXR HDR
# Files that hold flags. Empty: assets stay when flags change.
GLINT_SETTINGS ?= $(firstword $(MAKEFILE_LIST))

# Of one map: the same name with _NAME behind it, for example GLINT_PYRAMID_FLAGS_flakes.
GLINT_INGEST_FLAGS ?=
GLINT_PYRAMID_FLAGS ?=
# Parts in which each pyramid is made. Empty: one run.
GLINT_SHARDS ?=
GLINT_CP_FLAGS ?= --rank 16
GLINT_TUCKER_FLAGS ?= --rank 25
GLINT_PCA_FLAGS ?= --rank 16
GLINT_BINMAP_FLAGS ?=
GLINT_SAT_FLAGS ?=
GLINT_MOMENTS_FLAGS ?=
GLINT_TINY_FLAGS ?= --cut 32
GLINT_WANG_FLAGS ?=
GLINT_HEIGHTS_FLAGS ?=
GLINT_DISPLACE_FLAGS ?= --factor 16
GLINT_WAVE_FLAGS ?=
GLINT_WAVECP_FLAGS ?= --tolerance 0.1
GLINT_LIGHT_FLAGS ?=
GLINT_LOBES_FLAGS ?=

$(foreach folder,GLINT_MAPS GLINT_OUT,$(if $(word 2,$($(folder))),$(error $(folder) is "$($(folder))", and lists of Make cannot hold \
  a folder with a blank in its name; make a symbolic link to it, and name the link)))

# Rules, patterns and commands each give signs a meaning of their own.
$(foreach folder,GLINT_MAPS GLINT_OUT,$(if $(shell printf %s '$(subst ','\'',$($(folder)))' | LC_ALL=C tr -d 'A-Za-z0-9._/+@~\200-\377-'),\
  $(error $(folder) is "$($(folder))", and rules of Make can hold folders of letters, digits and . _ / + @ ~ - alone; make a symbolic link \
  to it, and name the link)))

# A text as one word of the shell.
glint_quote = '$(subst ','\'',$(1))'
glint_tool = $(if $(GLINT_BIN),$(call glint_quote,$(GLINT_BIN)/$(1)),$(1)) $(if $(GLINT_THREADS),--threads $(GLINT_THREADS)) --quiet
glint_flags = $($(1)) $($(1)_$*)
# Output and depfile of a rule.
glint_out = -o $(call glint_quote,$@) --depfile $(call glint_quote,$@.d)

# Types, of $(2), in which a file named $(1) exists now. The shell looks: Make remembers what a folder held before, and takes for existing
# what a depfile of an earlier run names.
glint_types = $(shell for type in $(2); do if [ -e $(call glint_quote,$(GLINT_MAPS)/$(1).)$$type ]; then echo $$type; fi; done)
# Refuses two files of the name $(1), whose types are $(3), of those in the variable $(2).
glint_one = $(if $(word 2,$(3)),$(error $(GLINT_MAPS)/$(1).$(firstword $(3)) and $(GLINT_MAPS)/$(1).$(word 2,$(3)) would be one asset \
  of the name $(1); rename one of them, or say which type is meant, as $(2) := $(firstword $(3))))
# Refuses two images $(1) and $(1).$(2): the asset $(1).$(2).glint would be of either.
glint_apart = $(if $(and $(call glint_types,$(1),$(GLINT_IMAGES)),$(call glint_types,$(1).$(2),$(GLINT_IMAGES))),$(error images \
  $(GLINT_MAPS)/$(1) and $(GLINT_MAPS)/$(1).$(2) would both make $(GLINT_OUT)/$(1).$(2).glint; rename one of them))
# The same for an image $(1) whose name ends as those of assets do: its stem and its ending, taken apart by the shell.
glint_endings := pyramid cp tucker pca binmap sat moments tiny wang heights displaced wave wavecp light lobes
glint_bar := |
glint_empty :=
glint_any_ending := $(subst $(glint_empty) $(glint_empty),\$(glint_bar),$(glint_endings))
glint_apart_of = $(if $(findstring .,$(1)),$(call glint_apart_at,$(shell printf '%s' $(call glint_quote,$(1)) | sed -n 's,\.\($(glint_any_ending)\)$$,,p'),$(1)))
glint_apart_at = $(if $(1),$(call glint_apart,$(1),$(lastword $(subst ., ,$(2)))))
# The file of a rule's name: the one that exists, or what Make thought of where a dry run has not made it.
glint_source = $(call glint_source_of,$(1),$(call glint_types,$*,$($(1))))
glint_source_of = $(call glint_one,$*,$(1),$(2))$(call glint_quote,$(if $(2),$(GLINT_MAPS)/$*.$(2),$<))

define glint_ingest_rule
$(GLINT_OUT)/%.glint: $(GLINT_MAPS)/%.$(1) $(GLINT_SETTINGS) | $(GLINT_OUT)
	$$(call glint_apart_of,$$*)$$(call glint_tool,glint-ingest) $$(call glint_source,GLINT_IMAGES) $$(glint_out) $$(call glint_flags,GLINT_INGEST_FLAGS)
endef

define glint_heights_rule
$(GLINT_OUT)/%.heights.glint: $(GLINT_MAPS)/%.$(1) $(GLINT_SETTINGS) | $(GLINT_OUT)
	$$(call glint_apart,$$*,heights)$$(call glint_tool,glint-ingest) $$(call glint_source,GLINT_IMAGES) $$(glint_out) --kind height --to heights \
	  $$(call glint_flags,GLINT_HEIGHTS_FLAGS)
endef

define glint_light_rule
$(GLINT_OUT)/%.light.glint: $(GLINT_MAPS)/%.$(1) $(GLINT_SETTINGS) | $(GLINT_OUT)
	$$(call glint_apart,$$*,light)$$(call glint_tool,glint-shlobes) --light $$(call glint_source,GLINT_LIGHTS) $$(glint_out) $$(call glint_flags,GLINT_LIGHT_FLAGS)
endef

define glint_normals_rule
$(GLINT_OUT)/%.$(1).glint: $(GLINT_OUT)/%.glint $(GLINT_SETTINGS)
	$$(call glint_apart,$$*,$(1))$$(call glint_tool,glint-$(1)) $$(call glint_quote,$$<) $$(glint_out) $$(call glint_flags,$(2))
endef

define glint_compress_rule
$(GLINT_OUT)/%.$(1).glint: $(GLINT_OUT)/%.pyramid.glint $(GLINT_SETTINGS)
	$$(call glint_apart,$$*,$(1))$$(call glint_tool,glint-compress) $$(call glint_quote,$$<) $$(glint_out) --method $(1) $$(call glint_flags,$(2))
endef

# Parts have no depfile: Make deletes a file only if nothing else names it.
glint_part = $(GLINT_OUT)/$(1).pyramid.$(2)of$(GLINT_SHARDS).glint
define glint_part_rule
$(call glint_part,%,$(1)): $(GLINT_OUT)/%.glint $(GLINT_SETTINGS)
	$$(call glint_apart,$$*,pyramid)$$(call glint_tool,glint-pyramid) $$(call glint_quote,$$<) -o $$(call glint_quote,$$@) --region $(1)/$(GLINT_SHARDS) \
	  $$(call glint_flags,GLINT_PYRAMID_FLAGS)
endef
ifneq ($(GLINT_SHARDS),)
glint_regions := $(shell seq $(GLINT_SHARDS))
$(foreach region,$(glint_regions),$(eval $(call glint_part_rule,$(region))))
$(GLINT_OUT)/%.pyramid.glint: $(foreach region,$(glint_regions),$(call glint_part,%,$(region))) $(GLINT_SETTINGS)
	$(call glint_tool,glint-merge) $(foreach region,$(glint_regions),$(call glint_quote,$(call glint_part,$*,$(region)))) -o $(call glint_quote,$@)
else
$(eval $(call glint_normals_rule,pyramid,GLINT_PYRAMID_FLAGS))
endif
$(eval $(call glint_normals_rule,binmap,GLINT_BINMAP_FLAGS))
$(eval $(call glint_normals_rule,sat,GLINT_SAT_FLAGS))
$(eval $(call glint_normals_rule,moments,GLINT_MOMENTS_FLAGS))
$(eval $(call glint_normals_rule,tiny,GLINT_TINY_FLAGS))
$(eval $(call glint_normals_rule,wang,GLINT_WANG_FLAGS))
$(eval $(call glint_compress_rule,cp,GLINT_CP_FLAGS))
$(eval $(call glint_compress_rule,tucker,GLINT_TUCKER_FLAGS))
$(eval $(call glint_compress_rule,pca,GLINT_PCA_FLAGS))
$(foreach type,$(GLINT_IMAGES),$(eval $(call glint_ingest_rule,$(type)))$(eval $(call glint_heights_rule,$(type))))
$(foreach type,$(GLINT_LIGHTS),$(eval $(call glint_light_rule,$(type))))

$(GLINT_OUT)/%.wave.glint: $(GLINT_OUT)/%.heights.glint $(GLINT_SETTINGS)
	$(call glint_apart,$*,wave)$(call glint_tool,glint-pyramid) $(call glint_quote,$<) $(glint_out) --optics wave $(call glint_flags,GLINT_WAVE_FLAGS)

$(GLINT_OUT)/%.wavecp.glint: $(GLINT_OUT)/%.wave.glint $(GLINT_SETTINGS)
	$(call glint_apart,$*,wavecp)$(call glint_tool,glint-compress) $(call glint_quote,$<) $(glint_out) $(call glint_flags,GLINT_WAVECP_FLAGS)

$(GLINT_OUT)/%.displaced.glint: $(GLINT_OUT)/%.heights.glint $(GLINT_SETTINGS)
	$(call glint_apart,$*,displaced)$(call glint_tool,glint-displace) $(call glint_quote,$<) $(glint_out) $(call glint_flags,GLINT_DISPLACE_FLAGS)

# Lobes come from a number alone, so they need no file of their name.
$(GLINT_OUT)/%.lobes.glint: $(GLINT_SETTINGS) | $(GLINT_OUT)
	$(if $(call glint_types,$*.lobes,$(GLINT_IMAGES)),$(error the image $(GLINT_MAPS)/$*.lobes would make $@ as well; rename it))\
	$(call glint_tool,glint-shlobes) $(glint_out) $(call glint_flags,GLINT_LOBES_FLAGS)

$(GLINT_OUT):
	mkdir -p $(call glint_quote,$@)

# Make would delete the steps between an image and what was asked for.
.PRECIOUS: $(GLINT_OUT)/%.glint $(GLINT_OUT)/%.heights.glint $(GLINT_OUT)/%.pyramid.glint $(GLINT_OUT)/%.wave.glint
# The tools replace their output in one step, or not at all; this covers what is not theirs.
.DELETE_ON_ERROR:

# Names of all images, a line each, without folder and type. Lists of Make would take a name with blanks apart.
glint_names = ls -d $(foreach type,$(GLINT_IMAGES),$(call glint_quote,$(GLINT_MAPS))/*.$(type)) 2>/dev/null | sed -e 's,.*/,,' -e 's,\.[^.]*$$,,'
# The assets of a kind of all images, with blanks and colons as Make reads them: $(call glint_all,pyramid); of normals, $(call glint_all).
glint_all = $(call glint_nameable,$(shell $(glint_names) | grep '[;|=]' | head -n 1))$(shell $(glint_names) | LC_ALL=C sort -u | \
  sed -e 's,[ :],\\&,g' -e 's,.*,$(GLINT_OUT)/&$(if $(1),.$(1)).glint,')
glint_nameable = $(if $(1),$(error $(GLINT_MAPS)/$(1): targets of Make cannot have names with ; | or =; rename the image))

# A second image beside the one that an asset was made of: nothing would tell that the asset is now of one of two.
glint_twice := $(shell $(glint_names) | LC_ALL=C sort | uniq -d | while IFS= read -r name; do \
  if [ -e $(call glint_quote,$(GLINT_OUT))/"$$name".glint ] || [ -e $(call glint_quote,$(GLINT_OUT))/"$$name".heights.glint ]; then \
  printf '%s\n' "$$name"; break; fi; done)
$(if $(glint_twice),$(call glint_one,$(glint_twice),GLINT_IMAGES,$(call glint_types,$(glint_twice),$(GLINT_IMAGES))))

-include $(shell ls -d $(call glint_quote,$(GLINT_OUT))/*.glint.d 2>/dev/null | sed 's,[ *?[],\\&,g')
