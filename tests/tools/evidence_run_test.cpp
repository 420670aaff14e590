#include "cli/evidence_run.h"

#include <fieldmark/imaging/image.h>

#include <sstream>

#include "support/random.h"
#include "tools/tiny_job.h"

using namespace fieldmark;
using namespace fieldmark::cli;

namespace {
struct Run {
  watermark::Owner owner = watermark::Owner::load(TinyJob::get().owner);
  watermark::CellCode code = owner.code();
  watermark::Message message = watermark::message_from_hex("5", 4);
  KeyTest test{owner, code, message};
  std::ostringstream out, err;
  Context context{CommonOptions{}, {"fieldmark", "verify"}, out, err};
  std::string folder = TinyJob::get().images();
  SuspectReader reader{owner, "blind"};
  std::vector<ImageEvidence> images = read_images(reader, {.paths = {folder}}, {}, context);
};
}  // namespace

TEST_CASE("evidence_run: images are scored one by one, under their names", "[evidence]") {
  Run run;
  const auto scores = score_images(run.test, run.images);
  REQUIRE(scores.size() == 2);
  CHECK(scores[0].name == "view_000.png");
  CHECK(scores[0].sha256 == run.images[0].sha256);
  CHECK(scores[0].sha256.size() == 64);
  CHECK(scores[0].width == 32);
  CHECK(scores[1].score.statistic == watermark::keyed_statistic(run.images[1].cells, run.code, run.message));
  print_views(run.out, run.images, scores);
  CHECK_THAT(run.out.str(), Contains("of 4, p ") && Contains("weakest bit p") && Contains("view_001.png"));
  const Json json = per_view_json(run.images, scores);
  REQUIRE(json.size() == 2);
  CHECK(json[0]["bit_p_values"].size() == 4);
  CHECK(json[0]["logits"].size() == 4);
  CHECK(json[0]["image"] == run.images[0].image);
}

TEST_CASE("evidence_run: three built-in controls, and one for each path that is given", "[evidence]") {
  Run run;
  const std::string clean = TinyJob::get().folder / "clean.png";
  write_png(clean, uniform<float>({20, 30, 3}, 0, 1, 3));
  const auto tested =
      test_controls(run.test, run.reader, run.images, {clean, run.folder + "/"}, {}, run.context);
  REQUIRE(tested.controls.size() == 5);
  CHECK(tested.thumbnails.size() == 5);
  std::string names;
  for (const auto& control : tested.controls) names += control.name + " ";
  CHECK(names == "blank unmarked shuffled clean.png views ");
  CHECK(tested.controls[0].images[0].sha256.empty());
  CHECK(tested.controls[3].images[0].sha256.size() == 64);
  // The folder of questioned images as its own control gives the same evidence.
  CHECK(tested.controls[4].together.statistic ==
        watermark::keyed_statistic(total_evidence(run.images), run.code, run.message));
  const Json json = controls_json(tested.controls, 1);
  CHECK(json[0]["found"] == true);
  CHECK(json[4]["views"] == 2);
  print_controls(run.out, tested.controls, 1);
  CHECK_THAT(run.out.str(), Contains("control clean.png: p ") && Contains("THE TEST RESPONDS TO A CONTROL"));
  std::ostringstream quiet;
  print_controls(quiet, tested.controls, 1e-300);
  CHECK_THAT(quiet.str(), !Contains("THE TEST"));
  CHECK_THROWS_AS(test_controls(run.test, run.reader, run.images, {"/no/such.png"}, {}, run.context),
                  IoError);
}

TEST_CASE("evidence_run: the verdict says how sure it is, and what a near miss lacks", "[evidence]") {
  CHECK(verdict_sentence(6.3e-30, 1e-6) ==
        "if the key had nothing to do with the images, evidence this strong would occur with a probability "
        "of at most 1 in 10^29");
  CHECK(verdict_sentence(1e-6, 1e-6).ends_with("of at most 1 in 1 000 000"));
  CHECK(verdict_sentence(0.4, 1).ends_with("of at most 40%"));
  CHECK(verdict_sentence(1e-4, 1e-6) ==
        "evidence this strong occurs by chance with a probability of up to 1 in 10 000: it points to a mark "
        "of this key, but at most 1 in 1 000 000 was required; more images of the field may decide");
  CHECK_THAT(verdict_sentence(2e-6, 1e-6), Contains("of up to 1 in 100 000: it points to a mark"));
  CHECK(verdict_sentence(0.54, 1e-6) ==
        "evidence this strong occurs by chance with a probability of up to 54%: nothing points to a mark of "
        "this key, though a damaged one may be left");
  CHECK_THAT(verdict_sentence(0.011, 1e-6), Contains("of up to 1 in 10: nothing points"));
  CHECK_THAT(verdict_sentence(1, 0.5), Contains("of up to 100%: nothing points"));
}
