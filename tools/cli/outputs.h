#pragma once
#include <string>

namespace fieldmark::cli {

/// Tries an output before the work begins: it can be written, is no folder, and replaces no secret, a file
/// that holds a key or an owner's networks. Leaves an existing file untouched.
/// @throws IoError naming the file and what to do
void check_writable(const std::string& path);

/// As check_writable(), for text and images: they replace no field or checkpoint either.
void check_writable_page(const std::string& path);

/// Makes a folder for outputs, and tries whether files can be written to it.
/// @throws IoError naming the folder and what to do
void prepare_folder(const std::string& path);

}  // namespace fieldmark::cli
