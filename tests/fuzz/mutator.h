#pragma once

#include <random>

#include "support/hdf5_bytes.h"

namespace glint::test {

/// Changes an asset where a reader believes what it reads: attributes, links, layouts, types, sizes, index arrays; or anywhere.
/// Checksums are renewed most of the time, and hashes of datasets half of the time, so that what lies behind them is reached.
Bytes mutate(Bytes bytes, std::mt19937& random);

}  // namespace glint::test
