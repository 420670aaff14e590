#include <fieldmark/baselines/departures.h>
#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/embedding/recipe.h>

#include <cstdio>
#include <functional>

namespace fieldmark::baselines {
namespace {

using watermark::EmbedRecipe;
using watermark::FusionMarkOptions;

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

const FusionMarkOptions& fusion_of(const EmbedRecipe& recipe) {
  return std::get<FusionMarkOptions>(recipe.mark);
}

std::string window_of(const EmbedRecipe& r) {
  const std::string side = std::to_string(r.owner.reader_size);
  return side + " x " + side + " pixels, the object's window";
}

std::string distortion_of(double value, double none, const std::string& text) {
  return value == none ? "none" : text;
}

// The options of a preset, in words.
struct Option {
  const char *part, *paper, *code;
  std::function<std::string(const EmbedRecipe&)> value;
};

std::vector<Option> options_of_networks() {
  return {
      {"N_m", "256", "128",
       [](const EmbedRecipe& r) { return std::to_string(fusion_of(r).message_features); }},
      {"N_c, and units of E and G", "-", "256",
       [](const EmbedRecipe& r) { return std::to_string(fusion_of(r).width); }},
      {"inputs of G", "f_c, f_M, c", "bits and raw colours again before each layer, d in G",
       [](const EmbedRecipe& r) {
         return std::string(fusion_of(r).authors_code ? "as the code" : "as the paper");
       }},
      {"colour c_m", "free", "raw number", [](const EmbedRecipe&) { return std::string("sigmoid of G"); }},
      {"channels of H", "-", "64",
       [](const EmbedRecipe& r) { return std::to_string(fusion_of(r).channels); }},
      {"batch norm of H at test", "-", "statistics of the image",
       [](const EmbedRecipe& r) {
         return std::string(fusion_of(r).running_norm ? "running statistics" : "statistics of the image");
       }},
      {"values of a bit", "0, 1", "-", [](const EmbedRecipe&) { return std::string("-1, 1"); }},
  };
}

std::vector<Option> options_of_training() {
  return {
      {"rays of an image", "150 x 150, of a random window", "150 x 150, contiguous", window_of},
      {"images a step", "-", "1", [](const EmbedRecipe& r) { return std::to_string(r.embed.batch); }},
      {"samples of a ray in training", "64", "-",
       [](const EmbedRecipe&) { return std::to_string(watermark::samples_for(nerf::SpaceKind::cube)); }},
      {"warm start, steps", "none", "-",
       [](const EmbedRecipe& r) {
         return std::to_string(fusion_of(r).training.warm_steps) +
                " for up to 16 bits; for more, in proportion";
       }},
      {"gamma_1, of the content loss", "1, of the squared norm", "-",
       [](const EmbedRecipe& r) {
         const auto& training = fusion_of(r).training;
         return text_of(training.content_weight) + ", of the mean square; less for marks fainter than " +
                text_of(training.content_psnr) + " dB";
       }},
      {"gamma_2, of the message loss", "5", "-",
       [](const EmbedRecipe& r) { return text_of(fusion_of(r).training.message_weight); }},
      {"lambda, of VGG-16 features", "0.01", "-",
       [](const EmbedRecipe& r) { return text_of(fusion_of(r).training.perceptual.weight); }},
      {"optimiser of H's convolutions", "Adam", "Adam",
       [](const EmbedRecipe& r) {
         const double rate = fusion_of(r).training.matrix_rate;
         return rate > 0 ? "Muon, " + text_of(rate) + " times Adam's step size" : "Adam";
       }},
      {"beta_2 of Adam", "0.999", "-", [](const EmbedRecipe&) { return text_of(watermark::kEmbedBeta2); }},
      {"step size", "0.0005", "0.0005, of H 0.001",
       [](const EmbedRecipe& r) {
         const std::string lr = text_of(r.embed.schedule.lr);
         return r.embed.extractor_lr == 1
                    ? lr
                    : lr + ", of H " + text_of(r.embed.extractor_lr * r.embed.schedule.lr);
       }},
  };
}

std::vector<Option> options_of_distortions() {
  return {
      {"noise, standard deviation", "0.1", "0.0001",
       [](const EmbedRecipe& r) {
         const double noise = r.embed.distortions.noise;
         return distortion_of(noise, 0, "up to " + text_of(noise));
       }},
      {"rotation", "up to 30 degrees", "none, or up to 30 degrees",
       [](const EmbedRecipe& r) {
         const double angle = r.embed.distortions.rotation;
         return distortion_of(angle, 0, "up to " + text_of(angle) + " degrees");
       }},
      {"scale", "0.75 to 1", "none, or 0.75 to 1",
       [](const EmbedRecipe& r) {
         const auto& d = r.embed.distortions;
         return distortion_of(d.zoom_out, 1, text_of(d.zoom_out) + " to " + text_of(d.zoom_in));
       }},
      {"blur, sigma", "0.1", "none, or 0.1 pixel",
       [](const EmbedRecipe& r) {
         const double blur = r.embed.distortions.blur;
         return distortion_of(blur, 0, "up to " + text_of(blur) + " pixel");
       }},
      {"shift of samples, cube sides", "normal, beta not given", "0.2 of their spacing",
       [](const EmbedRecipe& r) { return "normal, beta " + text_of(r.embed.distortions.sample_shift); }},
  };
}

}  // namespace

std::vector<Departure> departures() {
  const EmbedRecipe paper = watermark::embed_recipe("paper"), code = watermark::embed_recipe("code");
  std::vector<Departure> rows;
  for (const auto& options : {options_of_networks(), options_of_training(), options_of_distortions()})
    for (const Option& o : options) rows.push_back({o.part, o.paper, o.code, o.value(paper), o.value(code)});
  return rows;
}

}  // namespace fieldmark::baselines
