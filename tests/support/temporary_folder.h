#pragma once
#include <fieldmark/core/private_folder.h>

#include <iterator>

/// A fresh folder for a test's files, removed at the end of the scope.
struct TemporaryFolder : fieldmark::PrivateFolder {
  TemporaryFolder() : PrivateFolder("test") {}
  /// Returns the number of files and folders in it, which reveals temporary files left behind.
  long entries() const {
    return std::distance(std::filesystem::directory_iterator(path), std::filesystem::directory_iterator());
  }
};
