#include "optional_term.h"

#include <fieldmark/engine/ops/loss.h>

#include <vector>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("optional_term: a weighted term as it is, or 0 with a gradient of 0 where no weight counts") {
  const std::vector<float> targets{0, 1}, zeros{0, 0}, weights{0, 2};
  const Tensor<float> logits({2}, {0.5f, -0.5f});
  Tensor<float> gradient({2}), alone({2});
  Tape<float> tape;
  const auto x = tape.leaf(logits, gradient);
  const auto term = [&](const std::vector<float>& w) {
    return watermark::term_or_zero(x, w, [&] { return bce_with_logits<float>(x, targets, w); });
  };
  const auto nothing = term(zeros), none = watermark::term_or_zero(x, {}, [&] { return term(weights); });
  CHECK((nothing.value()[0] == 0 && none.value()[0] == 0));
  tape.backward(nothing);
  CHECK(gradient.data == std::vector<float>{0, 0});
  const auto y = term(weights), want = bce_with_logits<float>(tape.leaf(logits, alone), targets, weights);
  CHECK(y.value()[0] == want.value()[0]);
  tape.backward(y);
  tape.backward(want);
  CHECK(gradient.data == alone.data);
}
