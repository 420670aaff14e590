#pragma once
#include <fieldmark/core/error.h>
#include <fieldmark/engine/shape.h>

#include <string_view>

namespace fieldmark {

/// Checks one extent. Message form: "[op] arg: axis 0 must be N (why), got shape [..]".
void check_extent(std::string_view op, std::string_view arg, const Shape& got, int axis, Index want,
                  std::string_view why);
/// Overload whose reason is the shape of another argument: "(why, whose shape is [..])".
void check_extent(std::string_view op, std::string_view arg, const Shape& got, int axis, Index want,
                  std::string_view why, const Shape& of);
/// Checks the rank. Message form: "[op] arg must have rank 2 [rows, cols], got shape [..]".
void check_rank(std::string_view op, std::string_view arg, const Shape& got, int rank,
                std::string_view layout);
/// Checks that two arguments have one shape. Message form: "[op] b must have the shape of a, [..], got shape
/// [..]".
void check_same(std::string_view op, std::string_view arg_a, const Shape& a, std::string_view arg_b,
                const Shape& b);
/// Checks an axis; negative ones count from the last. Message form: "[op] arg must be in [-2, 1], an axis of
/// shape [2, 3], got 4". @return the axis counted from the first
int check_axis(std::string_view op, std::string_view arg, int axis, const Shape& of);

}  // namespace fieldmark
