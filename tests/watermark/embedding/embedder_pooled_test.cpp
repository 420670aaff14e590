#include <fieldmark/engine/parallel.h>
#include <fieldmark/watermark/embedding/embedder.h>

#include <cmath>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "watermark/embedding/few_steps.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("embedder: preset paper learns the colours of the field, then its content loss is small") {
  Owner owner = tiny_paper_owner({.message_weight = 0});  // at 5, the message would be most of the loss
  Embedder embedder(owner, tiny_views(), few_steps(150));
  embedder.step(0);
  const double first = embedder.figures().loss;
  while (!embedder.done()) {
    embedder.step(0);
    REQUIRE(std::isfinite(embedder.figures().loss));
  }
  CAPTURE(first, embedder.figures().loss);
  CHECK(embedder.figures().loss < 0.3 * first);
  CHECK_THAT(embedder.status(), Contains("right: bits") && Contains("loss"));
  embedder.calibrate();
  CHECK(owner.gain == 0);
}

TEST_CASE("embedder: preset paper's message loss begins at that of guessing, five times") {
  Owner owner = tiny_paper_owner({.content_weight = 0});
  Embedder embedder(owner, tiny_views(), few_steps(10));
  embedder.step(0);
  CHECK(embedder.figures().loss == Approx(5 * std::log(2.0)).epsilon(0.25));
}

TEST_CASE(
    "embedder: preset paper's content weight falls with the square of the mark's power below its limit") {
  const auto first_loss = [](const PooledTrainingOptions& training) {
    Owner owner = tiny_paper_owner(training);
    Embedder embedder(owner, tiny_views(), few_steps(10));
    embedder.step(0);
    return embedder.figures().loss;
  };
  const double weight = 100, message = first_loss({.content_weight = 0}),
               content = first_loss({.content_weight = weight}) - message,
               psnr = -10 * std::log10(content / weight), half = 10 * std::log10(2.0);
  REQUIRE(content > 0.1);
  const auto with_limit = [&](double limit) {
    return first_loss({.content_weight = weight, .content_psnr = limit}) - message;
  };
  CHECK(with_limit(psnr - half) == Approx(content / 4).epsilon(1e-4));
  CHECK(with_limit(psnr - 2 * half) == Approx(content / 16).epsilon(1e-4));
  CHECK(with_limit(psnr + half) == Approx(content).epsilon(1e-4));

  // The weight is a constant in the gradient: a step moves the networks as it does at the weight itself.
  const auto moved = [](const PooledTrainingOptions& training) {
    Owner owner = tiny_paper_owner(training);
    Embedder(owner, tiny_views(), few_steps(10)).step(0);
    return std::vector<float>(owner.params.values().begin(), owner.params.values().end());
  };
  const auto limited = moved({.content_weight = weight, .content_psnr = psnr - half}),
             same = moved({.content_weight = weight / 4}),
             tripled = moved({.content_weight = 3 * weight / 4});
  const auto apart = [](const std::vector<float>& x, const std::vector<float>& y) {
    double sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += std::abs(static_cast<double>(x[i]) - y[i]);
    return sum;
  };
  REQUIRE(apart(same, tripled) > 0);
  CHECK(apart(limited, same) < 0.02 * apart(same, tripled));
}

namespace {
// Weights of VGG-16's first convolution that pass each normalised colour on, far from the ReLU's kink.
SafetensorsFile passing_weights() {
  Tensor<float> weight(Shape{64, 3, 3, 3}), bias(Shape{64});
  for (Index c = 0; c < 3; ++c) weight[(c * 3 + c) * 9 + 4] = 1, bias[c] = 10;
  SafetensorsFile file;
  file.add("features.0.weight", weight.shape, std::span<const float>(weight.data));
  file.add("features.0.bias", bias.shape, std::span<const float>(bias.data));
  return file;
}
PerceptualTerm passing_term(double weight) {
  return {.weight = weight,
          .features = std::make_shared<const Vgg16Features<float>>(passing_weights()),
          .sha256 = std::string(64, 'a')};
}
}  // namespace

TEST_CASE("embedder: the perceptual term is lambda times the squared distance of features per value") {
  const auto first_loss = [](const PooledTrainingOptions& training) {
    Owner owner = tiny_paper_owner(training);
    Embedder embedder(owner, tiny_views(), few_steps(10));
    embedder.step(0);
    return embedder.figures().loss;
  };
  const double message = first_loss({.content_weight = 0}),
               content = first_loss({.content_weight = 100}) - message;
  REQUIRE(content > 0.1);
  CHECK(first_loss({.content_weight = 0, .perceptual = passing_term(1)}) == message);
  // Features that are colours over ImageNet's deviations, 0.224 to 0.229.
  for (const double lambda : {0.01, 0.5}) {
    const double term =
        first_loss({.content_weight = 100, .perceptual = passing_term(lambda)}) - message - content;
    CAPTURE(lambda, term, content);
    CHECK(term > 0.999 * lambda * content / (0.229 * 0.229));
    CHECK(term < 1.001 * lambda * content / (0.224 * 0.224));
  }
  // Both terms have the weight of the content, which falls for faint marks.
  const double half = 10 * std::log10(2.0), psnr = -10 * std::log10(content / 100);
  const auto limited = [&](const PerceptualTerm& term) {
    return first_loss({.content_weight = 100, .content_psnr = psnr - half, .perceptual = term}) - message;
  };
  const double faint = limited(passing_term(0.5)) - limited({});
  CHECK(faint > 0.999 * 0.25 * 0.5 * content / (0.229 * 0.229));
  CHECK(faint < 1.001 * 0.25 * 0.5 * content / (0.224 * 0.224));

  CHECK_THROWS_WITH(first_loss({.perceptual = {.weight = 1}}),
                    "[PooledTraining] perceptual: a weight above 0 needs features and their SHA-256");
  PerceptualTerm wrong = passing_term(1);
  wrong.sha256.clear();
  CHECK_THROWS_WITH(first_loss({.perceptual = wrong}), Contains("needs features and their SHA-256"));
  for (const double weight : {-1.0, std::nan("")}) {
    wrong.weight = weight;
    CHECK_THROWS_WITH(first_loss({.perceptual = wrong}),
                      Contains("[PooledTraining] perceptual: weight must be at least 0, got"));
  }
}

TEST_CASE("embedder: the perceptual term moves the networks as more content does") {
  const auto moved = [](const PooledTrainingOptions& training) {
    Owner owner = tiny_paper_owner(training);
    Embedder(owner, tiny_views(), few_steps(10)).step(0);
    return std::vector<float>(owner.params.values().begin(), owner.params.values().end());
  };
  const auto apart = [](const std::vector<float>& x, const std::vector<float>& y) {
    double sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += std::abs(static_cast<double>(x[i]) - y[i]);
    return sum;
  };
  // Features that are colours over ImageNet's deviations, 0.224 to 0.229, count as content of that weight.
  const double lambda = 0.5, deviation = 0.2265, weight = 20;
  const auto plain = moved({.content_weight = weight}),
             perceived = moved({.content_weight = weight, .perceptual = passing_term(lambda)}),
             more = moved({.content_weight = weight * (1 + lambda / (deviation * deviation))});
  REQUIRE(apart(plain, more) > 0);
  CAPTURE(apart(plain, more), apart(perceived, more));
  CHECK(apart(perceived, more) < 0.1 * apart(plain, more));
}

TEST_CASE("embedder: a run with a perceptual term resumes with that term only") {
  const TemporaryFolder folder;
  const auto resumed_with = [&](const PerceptualTerm& term, bool save) {
    Owner owner = tiny_paper_owner({.perceptual = term});
    Embedder embedder(owner, tiny_views(), few_steps(3));
    if (save) {
      embedder.step(0);
      embedder.save(folder / "checkpoint");
    } else {
      embedder.restore(folder / "checkpoint");
    }
  };
  resumed_with(passing_term(0.5), true);
  resumed_with(passing_term(0.5), false);
  CHECK_THROWS_WITH(resumed_with(passing_term(0.25), false), Contains("option 'perceptual_weight'"));
  CHECK_THROWS_WITH(resumed_with({}, false), Contains("perceptual_weight"));
  PerceptualTerm other = passing_term(0.5);
  other.sha256.assign(64, 'b');
  CHECK_THROWS_WITH(resumed_with(other, false), Contains("perceptual_weights"));
}

TEST_CASE("embedder: preset code learns the colours of the field from raw numbers") {
  Owner owner = tiny_paper_owner({.message_weight = 0}, true);
  Embedder embedder(owner, tiny_views(), few_steps(60));
  embedder.step(0);
  const double first = embedder.figures().loss;
  while (!embedder.done()) embedder.step(0);
  CHECK(embedder.figures().loss < 0.6 * first);
}

TEST_CASE("embedder: a warm start paints and reads carriers, is resumed bit by bit, and leaves no helpers") {
  const PooledTrainingOptions training{
      .content_weight = 60, .content_psnr = 25.5, .matrix_rate = 2, .warm_steps = 6};
  const auto owner_of = [&] {
    return Owner(tiny_field(), {.bits = 4, .reader_size = 48}, test_key(5), message_slots(4),
                 fusion_mark({.width = 16, .channels = 8, .running_norm = true, .training = training}));
  };
  const TemporaryFolder folder;
  Owner whole = owner_of(), resumed = owner_of(), two_threads = owner_of();
  Embedder embedder(whole, tiny_views(), few_steps(9));
  embedder.step(0);
  const double first = embedder.figures().loss;
  while (!embedder.done()) embedder.step(0);
  CHECK(std::isfinite(first));
  CHECK(embedder.warm_steps() == 6);
  {
    Embedder begun(resumed, tiny_views(), few_steps(9));
    for (int k = 0; k < 4; ++k) begun.step(0);
    begun.save(folder / "checkpoint");
    const SafetensorsFile file = SafetensorsFile::read(folder / "checkpoint");
    CHECK(file.has("extractor/0/conv/weight.velocity"));
    CHECK_FALSE(file.has("extractor/0/conv/weight.mean"));
    CHECK(file.has("extractor/0/conv/bias.mean"));
  }
  resumed = owner_of();
  Embedder rest(resumed, tiny_views(), few_steps(9));
  rest.restore(folder / "checkpoint");
  while (!rest.done()) rest.step(0);
  CHECK(outcome(whole, embedder) == outcome(resumed, rest));
  const ScopedThreads scope(2);
  Embedder on_two(two_threads, tiny_views(), few_steps(9));
  while (!on_two.done()) on_two.step(0);
  CHECK(outcome(whole, embedder) == outcome(two_threads, on_two));
  for (const auto& e : whole.params.entries())
    CHECK((e.name.starts_with("mark/") || e.name.starts_with("extractor/")));
  whole.save(folder / "owner");
  const Owner again = Owner::load(folder / "owner");
  const Tensor<float>& image = tiny_views().front().base;
  CHECK(again.mark().evidence(again, image, nullptr) == whole.mark().evidence(whole, image, nullptr));
}

TEST_CASE("embedder: a warm start takes more steps for more than 16 bits, in proportion") {
  const auto steps = [](Index bits) {
    Owner owner(tiny_field(), {.bits = bits, .reader_size = 48}, test_key(5), message_slots(bits),
                fusion_mark({.width = 8, .channels = 8, .training = {.warm_steps = 30}}));
    return Embedder(owner, tiny_views(), few_steps(1)).warm_steps();
  };
  CHECK(steps(1) == 30);
  CHECK(steps(16) == 30);
  CHECK(steps(32) == 60);
  CHECK(steps(40) == 75);

  // With 32 bits, the second step is of the warm start, which knows no content loss, and the third is not.
  const auto trained = [](Index count, double content_weight) {
    Owner owner(
        tiny_field(), {.bits = 32, .reader_size = 48}, test_key(5), message_slots(32),
        fusion_mark(
            {.width = 8, .channels = 8, .training = {.content_weight = content_weight, .warm_steps = 1}}));
    Embedder embedder(owner, tiny_views(), few_steps(count));
    while (!embedder.done()) embedder.step(0);
    return std::vector<float>(owner.params.values().begin(), owner.params.values().end());
  };
  CHECK(trained(2, 1) == trained(2, 50));
  CHECK(trained(3, 1) != trained(3, 50));
}

TEST_CASE("embedder: in 150 steps of a warm start the extractor begins to read the carriers") {
  Owner owner(
      tiny_field(), {.bits = 4, .reader_size = 48}, test_key(5), message_slots(4),
      fusion_mark({.width = 16, .channels = 8, .running_norm = true, .training = {.warm_steps = 200}}));
  Embedder embedder(owner, tiny_views(),
                    {.schedule = {.steps = 150, .lr = 4e-3},
                     .batch = 4,
                     .distortions = {.noise = 0, .rotation = 0, .zoom_out = 1, .zoom_in = 1, .blur = 0},
                     .seed = 4});
  embedder.step(0);
  const double first = embedder.figures().loss;
  while (!embedder.done()) embedder.step(0);
  CAPTURE(first, embedder.figures().loss, embedder.figures().bits);
  CHECK(embedder.figures().loss < 0.8 * first);
  CHECK(embedder.figures().bits > 0.57);
}
