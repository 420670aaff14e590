#include <fieldmark/engine/shape_checks.h>

#include <string>

namespace fieldmark {
namespace {
std::string head(std::string_view op, std::string_view arg) {
  std::string text = "[";  // not one expression: GCC 12 would warn of an impossible overlap
  text.append(op).append("] ").append(arg);
  return text;
}
}  // namespace

void check_extent(std::string_view op, std::string_view arg, const Shape& got, int axis, Index want,
                  std::string_view why) {
  if (got[axis] == want) return;
  throw ShapeError(head(op, arg) + ": axis " + std::to_string(axis) + " must be " + std::to_string(want) +
                   " (" + std::string(why) + "), got shape " + got.str());
}

void check_extent(std::string_view op, std::string_view arg, const Shape& got, int axis, Index want,
                  std::string_view why, const Shape& of) {
  if (got[axis] != want)
    check_extent(op, arg, got, axis, want, std::string(why) + ", whose shape is " + of.str());
}

void check_rank(std::string_view op, std::string_view arg, const Shape& got, int rank,
                std::string_view layout) {
  if (got.rank() == rank) return;
  throw ShapeError(head(op, arg) + " must have rank " + std::to_string(rank) + " " + std::string(layout) +
                   ", got shape " + got.str());
}

void check_same(std::string_view op, std::string_view arg_a, const Shape& a, std::string_view arg_b,
                const Shape& b) {
  if (a == b) return;
  throw ShapeError(head(op, arg_b) + " must have the shape of " + std::string(arg_a) + ", " + a.str() +
                   ", got shape " + b.str());
}

int check_axis(std::string_view op, std::string_view arg, int axis, const Shape& of) {
  const int rank = of.rank();
  if (axis >= -rank && axis < rank) return axis < 0 ? axis + rank : axis;
  if (rank == 0)
    throw ShapeError(head(op, arg) + " must be an axis, but shape [] has none, got " + std::to_string(axis));
  throw ShapeError(head(op, arg) + " must be in [" + std::to_string(-rank) + ", " + std::to_string(rank - 1) +
                   "], an axis of shape " + of.str() + ", got " + std::to_string(axis));
}

}  // namespace fieldmark
