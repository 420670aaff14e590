#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace fieldmark::cli {

/// True if two paths, which may not exist yet, name one file.
bool same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// Checks before the work begins that a file can be written: it is no folder, and its folder exists.
/// @throws IoError naming the file and what to do
void check_place(const std::string& path);

/// Checks the place of a model before the work begins: it is writable, is not a folder, has no name of an
/// image, and replaces neither a secret, that is, a file with a key or an owner's networks, nor a checkpoint.
/// Leaves an existing file untouched.
/// @throws IoError naming the file and what to do
void check_writable(const std::string& path);

/// Checks the checkpoint that a new run will write: there is none of an interrupted run, which would be lost.
/// @throws IoError naming the file and what to do
void check_new_checkpoint(const std::string& path);

/// As check_writable(), for text and images, which must not replace a field either.
void check_writable_page(const std::string& path);

/// Returns the images that a folder for outputs holds already. Among new ones they would be mistaken for the
/// same run, above all by verify.
/// @param replaced  the names that --overwrite replaces, for the message
/// @throws IoError if there are any, unless they may be overwritten
std::vector<std::filesystem::path> images_of_other_runs(const std::string& folder, bool overwrite,
                                                        const std::string& replaced);

/// Creates a folder for outputs, and checks that files can be written to it.
/// @throws IoError naming the folder and what to do
void prepare_folder(const std::string& path);

}  // namespace fieldmark::cli
