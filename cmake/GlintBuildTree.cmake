# The libraries of another build of this project, GLINT_BUILD_TREE, as they are.
include(GlintBakeLibraries)
include(${GLINT_BUILD_TREE}/glint-build-tree.cmake)
