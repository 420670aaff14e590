#pragma once
#include <stdexcept>

namespace fieldmark {

/// Base class of every exception that this library throws on purpose.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// An argument's shape does not fit the operation.
struct ShapeError : Error {
  using Error::Error;
};
/// An argument's value is outside the operation's domain.
struct ValueError : Error {
  using Error::Error;
};
/// A file or folder is missing, unreadable, malformed or not writable. The message names the path, the
/// position in the file, what was expected and what was found.
struct IoError : Error {
  using Error::Error;
};

}  // namespace fieldmark
