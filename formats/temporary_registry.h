#pragma once

// Private to formats/.

#include <filesystem>

namespace glint::formats {

/// Makes removeTemporaryFiles() remove a file. The file need not exist yet.
/// @return its slot; -1 if all slots are taken or the path is too long: the file is then left to the next writer
int registerTemporary(const std::filesystem::path& path);

/// Takes it off again. Ignores -1.
void forgetTemporary(int slot);

}  // namespace glint::formats
