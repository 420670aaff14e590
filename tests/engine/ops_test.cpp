#include <fieldmark/engine/ops.h>

#include "support/catch.h"
#include "support/folder_headers.h"
#include "support/random.h"

using namespace fieldmark;

TEST_CASE("ops.h has every header of its folder") { expect_headers_of_folder("ops"); }

namespace {

// Calls every op with weights, targets or statistics as `Values`, without naming the scalar type.
template <template <class> class Values, class T>
std::vector<T> results_with(const Values<T>& of_elements, const Values<T>& of_columns) {
  const auto a = uniform<T>({3, 2}, -1, 1, 1), b = uniform<T>({3, 2}, -1, 1, 2);
  const Tensor<T> column({2}, T(1));
  Tape<T> tape;
  const Var<T> x = tape.constant(a), y = tape.constant(b), c = tape.constant(column);
  const std::vector<std::int32_t> labels{1, 0};
  const Var<T> logits = slice(x, 0, 0, 2), image = reshape(x, {1, 1, 3, 2}), other = reshape(y, {1, 1, 3, 2});
  std::vector<T> all;
  for (const Var<T> v :
       {weighted_mean(x, of_elements), mse_loss(x, y, of_elements), l1_loss(x, y, of_elements),
        huber_loss(x, y, 0.5, of_elements), bce_with_logits(x, of_elements),
        bce_with_logits(x, of_elements, of_elements), feature_distance(image, other, of_columns),
        softmax_cross_entropy(logits, labels, of_columns),
        batch_norm_fixed(image, c, c, of_columns, of_columns)})
    all.insert(all.end(), v.value(), v.value() + v.shape().size());
  return all;
}
template <class T>
using Vector = std::vector<T>;
template <class T>
using Span = std::span<const T>;

template <class T>
void expect_vectors_like_spans() {
  const Vector<T> elements{T(0.5), 1, T(0.2), T(0.7), 0, T(0.9)}, columns{T(0.5), 2};
  const auto of_vectors = results_with<Vector, T>(elements, columns);
  CHECK(of_vectors == results_with<Span, T>(elements, columns));
  CHECK(of_vectors.size() == 8 + 6);
}

}  // namespace

TEST_CASE("ops: weights, targets and statistics may be vectors, the scalar type is that of the Vars") {
  expect_vectors_like_spans<float>();
  expect_vectors_like_spans<double>();
}
