// Compiled to PTX by clang, with or without a GPU: an error says which host function the query headers call from device code.
#include "device/kernels.h"
