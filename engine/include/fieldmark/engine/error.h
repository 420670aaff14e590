#pragma once
#include <fieldmark/engine/shape.h>

#include <stdexcept>
#include <string>
#include <string_view>

namespace fieldmark {

/// Root of every exception this library throws on purpose.
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
/// A file or folder is missing, unreadable, malformed or cannot be written. The text names the path, the
/// place in it, what was expected and what was found.
struct IoError : Error {
  using Error::Error;
};

/// Checks one extent. Message form: "[op] arg: axis 0 must be N (why), got shape [..]".
void check_extent(std::string_view op, std::string_view arg, const Shape& got, int axis, Index want,
                  std::string_view why);
/// As above, where the reason is the shape of another argument: "(why, whose shape is [..])". The text is
/// made only where the check fails.
void check_extent(std::string_view op, std::string_view arg, const Shape& got, int axis, Index want,
                  std::string_view why, const Shape& of);
/// Checks the rank. Message form: "[op] arg must have rank 2 [rows, cols], got shape [..]".
void check_rank(std::string_view op, std::string_view arg, const Shape& got, int rank,
                std::string_view layout);
/// Checks that two arguments have one shape. Message form: "[op] b must have the shape of a, [..], got shape
/// [..]".
void check_same(std::string_view op, std::string_view arg_a, const Shape& a, std::string_view arg_b,
                const Shape& b);

}  // namespace fieldmark
